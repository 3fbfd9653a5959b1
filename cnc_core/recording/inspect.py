"""What a recording holds: tables, statistics, the state at one place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.units import AnyArray

from ..errors import CncError
from .reading import Recording, Table

KEYS = {"time": "t", "cycle": "cycle", "line": "line", "distance": "s"}


def summary(recording: Recording) -> dict[str, Any]:
    """Rows, columns with units, and the account without texts."""
    tables = {
        name: {
            "rows": len(recording.table(name)),
            "columns": recording.table(name).units,
        }
        for name in recording.tables
    }
    hidden = ("columns", "types", "row_groups", "rows")
    meta = {k: v for k, v in recording.meta.items() if k not in hidden}
    return {"complete": recording.complete, "tables": tables, "meta": meta}


OPERATORS = {
    "<=": np.less_equal,
    ">=": np.greater_equal,
    "!=": np.not_equal,
    "=": np.equal,
    "<": np.less,
    ">": np.greater,
}


@dataclass(frozen=True)
class Filter:
    """Rows whose column compares so with a value."""

    column: str
    operator: str
    value: Any

    @classmethod
    def of(cls, text: str, table: Table) -> Filter:
        """``v>10``, ``line=9``, ``kind=M``; CncError 902001 otherwise."""
        for sign in OPERATORS:
            column, found, value = text.partition(sign)
            if not found:
                continue
            column = column.strip()
            if column not in table.columns:
                raise CncError(
                    902001,
                    f"--where {text}: {table.name} has no column {column!r}:"
                    f" {', '.join(table.columns)}",
                )
            return cls(column, sign, _value(text, value.strip(), table, column))
        raise CncError(
            902001,
            f"--where {text}: COLUMN, one of {' '.join(OPERATORS)}, value",
        )

    def holds(self, chunk: Any) -> npt.NDArray[np.bool_]:
        """Where the rows of a chunk fulfil it (n,)."""
        values = chunk.column(self.column).to_numpy()
        return np.asarray(OPERATORS[self.operator](values, self.value), bool)


def _value(text: str, value: str, table: Table, column: str) -> Any:
    kind = table.types[column]
    if kind == "string":
        return value
    if kind == "bool" and value.lower() in ("true", "false"):
        return value.lower() == "true"
    try:
        return float(value)
    except ValueError:
        raise CncError(
            902001, f"--where {text}: {value!r} is no number"
        ) from None


def chosen_rows(table: Table, filters: Sequence[Filter] = ()) -> Iterator[Any]:
    """The rows that fulfil all filters, in chunks."""
    for chunk in table.chunks():
        if not filters:
            yield chunk
            continue
        holds = np.logical_and.reduce([each.holds(chunk) for each in filters])
        if holds.any():
            yield chunk.take(np.flatnonzero(holds))


def statistics(
    table: Table, filters: Sequence[Filter] = ()
) -> tuple[int, dict[str, dict[str, Any]]]:
    """How many rows fulfil all filters; smallest, largest and mean value of each
    column of numbers in them.  Memory for a chunk.
    """
    rows = 0
    found: dict[str, dict[str, Any]] = {}
    for chunk in chosen_rows(table, filters):
        rows += len(chunk)
        for name in table.columns:
            if table.types[name] != "string":
                _add_values(found, name, chunk.column(name).to_numpy())
    for figures in found.values():
        total = figures.pop("sum")
        figures["mean"] = total / rows
    return rows, found


def _add_values(
    found: dict[str, dict[str, Any]], name: str, values: AnyArray
) -> None:
    low, high = values.min().item(), values.max().item()
    total = float(np.sum(values, dtype=np.float64))
    known = found.setdefault(name, {"min": low, "max": high, "sum": 0.0})
    known["min"], known["max"] = min(known["min"], low), max(known["max"], high)
    known["sum"] += total


def first_rows(
    table: Table, filters: Sequence[Filter], count: int
) -> list[dict[str, Any]]:
    """The first rows that fulfil all filters."""
    found: list[dict[str, Any]] = []
    for chunk in chosen_rows(table, filters):
        found += chunk.slice(0, count - len(found)).to_pylist()
        if len(found) >= count:
            break
    return found


def parse_at(text: str) -> tuple[str, float]:
    """``time=S``, ``cycle=N``, ``line=N`` or ``distance=MM``; CncError otherwise."""
    key, equals, value = text.partition("=")
    try:
        if equals and key in KEYS:
            return key, float(value)
    except ValueError:
        pass
    raise CncError(
        902001, f"--at {text}: time=S, cycle=N, line=N or distance=MM"
    )


def state_at(
    recording: Recording, key: str, value: float
) -> dict[str, dict[str, Any] | None]:
    """One row a table: the last that is not behind the place; None: none yet.

    The cycle of the place is found first; the other tables are looked up by it.
    """
    row = (
        _cycle_row(recording.cycles, key, value)
        if "cycles" in recording.tables
        else None
    )
    if row is None:
        raise CncError(
            902001, f"--at {key}={value:g}: nothing is recorded there"
        )
    cycle = recording.cycles.row(row)
    found: dict[str, dict[str, Any] | None] = {}
    for name in recording.tables:
        table = recording.table(name)
        if name == "cycles":
            found[name] = cycle
        elif "cycle" in table.columns and "cycle" in cycle:
            cycles = table["cycle"]
            before = int(np.searchsorted(cycles, cycle["cycle"], "right"))
            found[name] = table.row(before - 1) if before else None
        elif "element" in table.columns and "block" in cycle:
            same = np.flatnonzero(table["element"] == cycle["block"])
            found[name] = table.row(int(same[0])) if len(same) else None
    return found


def _is_within(values: Any, value: float) -> bool:
    """Whether a place is none behind all that was recorded."""
    last = float(np.fmax.reduce(values))
    return 0.0 <= value <= last + 1e-9 * max(1.0, abs(last))


def _cycle_row(cycles: Table, key: str, value: float) -> int | None:
    """Number of the first cycle of the line, or of the last one that is not
    behind the time, cycle or distance.
    """
    column = KEYS[key]
    if column not in cycles.columns:
        return None
    values = cycles[column]
    if not len(values) or not _is_within(values, value):
        return None
    if key == "line":
        same = np.flatnonzero(values == value)
        return int(same[0]) if len(same) else None
    if key == "distance":
        reached = np.flatnonzero(values >= value)
        return int(reached[0]) if len(reached) else None
    # times are products of the cycle time: half a row is not missed by rounding
    slack = 1e-9 * max(1.0, abs(value))
    before = int(np.searchsorted(values, value + slack, "right"))
    return before - 1 if before else None
