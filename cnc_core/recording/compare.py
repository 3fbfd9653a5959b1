"""Two recordings side by side: the first difference, and how many there are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.units import AnyArray

from ..errors import CncError
from .reading import Recording, Table
from .schema import is_wall

Floats = npt.NDArray[np.float64]
PLACES = {"time": "t", "distance": "s", "line": "line"}
# along the path: what differs where the speed or the start differs, and the
# tables that do not; ``start`` of the elements tells the resets that ``epoch``
# counts since the start of the CNC
NOT_ALONG_THE_PATH = (
    "cycle",
    "t",
    "fetched",
    "acknowledged",
    "epoch",
    "elements_ahead",
    "phases_ahead",
)
ALONG_THE_PATH = ("cycles", "functions", "elements")


@dataclass
class Difference:
    """The first difference: table, row, column, both values, line of the program.

    Column ``""``: the numbers of rows differ.
    """

    table: str
    row: int
    column: str
    a: Any
    b: Any
    line: int = 0

    def as_json(self) -> dict[str, Any]:
        """The members."""
        return dict(vars(self))


@dataclass
class Comparison:
    """What two recordings differ in: ``counts``: rows by column by table."""

    first: Difference | None = None
    counts: dict[str, dict[str, int]] = field(default_factory=dict)

    @property
    def equal(self) -> bool:
        """Whether nothing differs."""
        return not self.counts

    def as_json(self) -> dict[str, Any]:
        """The object that the command prints."""
        first = self.first.as_json() if self.first else None
        return {"equal": self.equal, "first": first, "counts": self.counts}

    def add(self, table: str, column: str, count: int) -> None:
        """Count rows that differ."""
        counts = self.counts.setdefault(table, {})
        counts[column] = counts.get(column, 0) + count

    def note(self, found: Difference) -> None:
        """Keep the difference if it comes before the first one: tables in their
        order, then rows, then columns.
        """
        first = self.first
        if first is None or (
            first.table == found.table and found.row < first.row
        ):
            self.first = found


def compare(
    a: Recording,
    b: Recording,
    by: str = "time",
    tolerance: Mapping[str, float] | None = None,
) -> Comparison:
    """Compare all tables; columns of the wall clock are left out.

    ``by``: ``time`` row by row; ``distance`` or ``line``: the cycles at the same
    place of the path, whatever their speed, and the order of functions and
    elements.  ``tolerance``: largest difference a
    column, ``column`` or ``table.column``.
    """
    if by not in PLACES:
        raise CncError(902001, f"--by {by}: {', '.join(PLACES)}")
    allowed = dict(tolerance or {})
    _check_columns(allowed, a)
    out = Comparison()
    for name in dict.fromkeys([*a.tables, *b.tables]):
        if by != "time" and name not in ALONG_THE_PATH:
            continue
        if name not in a.tables or name not in b.tables:
            present = a if name in a.tables else b
            if len(present.table(name)):
                _only_one(out, name, name in a.tables)
        elif name == "cycles" and by != "time":
            _along(out, a.cycles, b.cycles, PLACES[by], allowed)
        else:
            left_out = NOT_ALONG_THE_PATH if by != "time" else ()
            _rows(out, a.table(name), b.table(name), allowed, left_out)
    return out


def _check_columns(allowed: Mapping[str, float], a: Recording) -> None:
    known = {c for name in a.tables for c in a.table(name).columns}
    for key in allowed:
        if not {key, key.partition(".")[2]} & known:
            raise CncError(902001, f"--tolerance {key}: no such column")


def _only_one(out: Comparison, table: str, in_a: bool) -> None:
    out.add(table, "", 1)
    out.note(Difference(table, 0, "", in_a, not in_a))


def _allowed(table: str, column: str, allowed: Mapping[str, float]) -> float:
    return allowed.get(f"{table}.{column}", allowed.get(column, 0.0))


def _rows(
    out: Comparison,
    a: Table,
    b: Table,
    allowed: Mapping[str, float],
    left_out: Sequence[str],
) -> None:
    """Row by row, in memory for one chunk of each."""
    columns = [
        c
        for c in a.columns
        if c in b.columns and not is_wall(a.name, c) and c not in left_out
    ]
    only_one = [c for c in a.columns if c not in b.columns]
    only_one += [c for c in b.columns if c not in a.columns]
    for column in only_one:
        if not is_wall(a.name, column):
            out.add(a.name, column, max(len(a), len(b)))
            out.note(
                Difference(
                    a.name, 0, column, column in a.columns, column in b.columns
                )
            )
    first = 0
    for left, right in _side_by_side(a, b, columns):
        for column in columns:
            differs = unequal(
                left.column(column),
                right.column(column),
                _allowed(a.name, column, allowed),
            )
            if differs is not None and differs.any():
                _told(out, a.name, first, column, left, right, differs)
        first += len(left)
    if len(a) != len(b):
        out.add(a.name, "", abs(len(a) - len(b)))
        shorter = min(len(a), len(b))
        out.note(Difference(a.name, shorter, "", len(a), len(b)))


def _told(
    out: Comparison,
    table: str,
    first: int,
    column: str,
    left: Any,
    right: Any,
    differs: npt.NDArray[np.bool_],
) -> None:
    out.add(table, column, int(differs.sum()))
    i = int(np.argmax(differs))
    line = left.column("line")[i].as_py() if "line" in left.column_names else 0
    x, y = (side.column(column)[i].as_py() for side in (left, right))
    out.note(Difference(table, first + i, column, x, y, line or 0))


def _side_by_side(
    a: Table, b: Table, columns: Sequence[str]
) -> Iterator[tuple[Any, Any]]:
    """Chunks of the same rows of both."""
    import pyarrow as pa  # noqa: PLC0415

    streams = [iter(a.chunks(columns)), iter(b.chunks(columns))]
    held: list[Any] = [None, None]
    while True:
        for k, stream in enumerate(streams):
            if held[k] is None or not len(held[k]):
                held[k] = next(stream, None)
        if held[0] is None or held[1] is None:
            return
        count = min(len(held[0]), len(held[1]))
        yield tuple(pa.table(part).slice(0, count) for part in held)
        held = [part.slice(count) for part in held]


def unequal(
    left: Any, right: Any, tolerance: float = 0.0
) -> npt.NDArray[np.bool_] | None:
    """Where two columns differ; None: nowhere.  NaN equals NaN."""
    if left.equals(right):
        return None
    a, b = left.to_numpy(), right.to_numpy()
    if "O" in (a.dtype.kind, b.dtype.kind):
        return np.asarray(a != b)
    if a.dtype.kind in "ub":
        a, b = a.astype(np.int64), b.astype(np.int64)
    away = np.abs(a - b) > tolerance if tolerance > 0.0 else a != b
    if a.dtype.kind == "f":
        both = np.isnan(a) & np.isnan(b)
        one = np.isnan(a) ^ np.isnan(b)
        away = (away | one) & ~both
    return np.asarray(away)


# ------------------------------------------------------------ along the path
def _along(
    out: Comparison,
    a: Table,
    b: Table,
    place: str,
    allowed: Mapping[str, float],
) -> None:
    """The cycles of ``a`` where the path goes on, each against ``b`` at the same
    place: numbers between two cycles, states of one of both.
    """
    a.check(place)
    b.check(place)
    where, index = _places(a, place)
    there, other = _places(b, place)
    if not len(where) or not len(there):
        if len(where) != len(there):
            _only_one(out, a.name, bool(len(where)))
        return
    both = (where >= there[0]) & (where <= there[-1])
    lines = a["line"][index] if "line" in a.columns else None
    beside = _Beside(where, there)
    for column in a.columns:
        if (
            column not in b.columns
            or is_wall(a.name, column)
            or column in (*NOT_ALONG_THE_PATH, place)
        ):
            continue
        here, values = a[column][index], b[column][other]
        bound = _allowed(a.name, column, allowed)
        away = (
            beside.off_the_curve(here, values, bound)
            if here.dtype.kind == "f" and place == "s"
            else beside.no_such_state(here, values, bound)
        )
        away &= both
        if away.any():
            i = int(np.argmax(away))
            out.add(a.name, column, int(away.sum()))
            line = int(lines[i]) if lines is not None else 0
            pair = here[i].item(), values[beside.at[i]].item()
            out.note(Difference(a.name, int(index[i]), column, *pair, line))
    _ends(out, a, where, there)


class _Beside:
    """Places of one run among those of another one.

    ``at``: the cycle that comes to a place or beyond it; ``before``: the one
    before, or the same where a cycle ends at this very place.
    """

    def __init__(self, where: Floats, there: Floats) -> None:
        found = np.searchsorted(there, where)
        self.at = np.minimum(found, len(there) - 1)
        very = there[self.at] == where
        self.before = np.where(very, self.at, np.maximum(self.at - 1, 0))
        begin, end = there[self.before], there[self.at]
        self._way, self._left = where - begin, end - where
        self._length = np.where(self.at > self.before, end - begin, 1.0)
        self._step = np.diff(there)

    def off_the_curve(
        self, here: Floats, values: Floats, bound: float
    ) -> npt.NDArray[np.bool_]:
        """Where a number is not between its neighbours, but for ``bound`` and
        rounding.

        Between two cycles the slope may change as much as to the next ones: a
        bend of the path at any place between them, a step, an arc.
        """
        first, last = values[self.before], values[self.at]
        line = first + (last - first) * (self._way / self._length)
        bound = max(bound, 1e-9 * max(1.0, float(np.abs(here).max())))
        off = np.abs(here - line)
        away = np.asarray(off > bound)
        if away.any() and len(values) > 2:
            turn = np.abs(np.diff(np.diff(values) / self._step))
            turn = np.concatenate([[0.0], turn, [0.0]])
            bend = np.maximum(turn[self.before], turn[self.at])
            room = 2.0 * bend * self._way * self._left / self._length
            away &= off > bound + np.maximum(room, 0.0)
        return away

    def no_such_state(
        self, here: Any, values: Any, bound: float
    ) -> npt.NDArray[np.bool_]:
        """Where a state is none of those that the other run goes through."""
        first, last = values[self.before], values[self.at]
        if here.dtype.kind != "f":
            here, first, last = (
                side.astype(np.int64) for side in (here, first, last)
            )
        low, high = np.minimum(first, last), np.maximum(first, last)
        return np.asarray((here < low - bound) | (here > high + bound))


def _places(
    table: Table, place: str
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Increasing places of the path, and the rows where they are reached first."""
    values = table[place].astype(np.float64)
    if not len(values):
        return values, np.empty(0, np.int64)
    reached = np.maximum.accumulate(values)
    fresh = np.concatenate([[True], np.diff(reached) > 0.0])
    rows = np.flatnonzero(fresh).astype(np.int64)
    return reached[rows], rows


def _ends(out: Comparison, a: Table, where: AnyArray, there: AnyArray) -> None:
    """The paths are equally long."""
    end, other = float(where[-1]), float(there[-1])
    if abs(end - other) > 1e-6 * max(1.0, abs(end)):
        out.add(a.name, "", 1)
        out.note(Difference(a.name, len(a), "", end, other))
