"""Pausing with macros: rows that were pushed and not driven are cut where the
path stands and pushed again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from cnc_core.blocks.pool import coefficients, joined

from ..blocks import CIRCULAR, NC_BLOCK, PIECE, POLYNOMIAL, BlockBatch
from ..frontend.front_end import Restartable
from ..geometry.shapes.polynomial import shifted
from ..program.restart import SAME_MM, Uncovered, way_to
from ..units import AnyArray, FloatArray

if TYPE_CHECKING:
    from ..engine import Engine
    from ..engine.left_out import LeftOut
    from ..program import Program


class _Numbered:
    """Rows with the numbers under which they were pushed."""

    def __init__(self) -> None:
        self._numbers: list[npt.NDArray[np.int64]] = []
        self._rows: list[AnyArray] = []

    def add(self, numbers: npt.NDArray[np.int64], rows: AnyArray) -> None:
        self._numbers.append(numbers)
        self._rows.append(rows)

    def rows(self) -> AnyArray:
        """All of them, as they were pushed; forgotten then."""
        numbers = np.concatenate([*self._numbers, np.empty(0, np.int64)])
        rows = np.concatenate([*self._rows, np.empty(0, NC_BLOCK)])
        self._numbers, self._rows = [], []
        return np.asarray(rows[np.argsort(numbers, kind="stable")])


class PushedRows:
    """Batches as they were pushed, with the number of their first row, as long
    as they may not be driven.
    """

    def __init__(self) -> None:
        self._batches: deque[tuple[int, BlockBatch]] = deque()
        self._uncovered = Uncovered()  # by what has been dropped

    def add(self, first: int, batch: BlockBatch, done: int) -> None:
        """``first``: number of its first row.

        ``done``: rows below it have been executed.
        """
        while (
            self._batches
            and self._batches[0][0] + len(self._batches[0][1]) <= done
        ):
            before, gone = self._batches.popleft()
            moves = gone.rows["type"] <= POLYNOMIAL
            numbers = before + np.arange(len(gone))
            self._uncovered.take(gone.rows[moves], numbers[moves])
        self._batches.append((first, batch))

    def rest(self, left: LeftOut, place: FloatArray) -> BlockBatch:
        """What has been left out; the path stands at ``place`` (axes,)."""
        parts, ahead = [], _Numbered()
        for first, batch in self._batches:
            numbers = first + np.arange(len(batch))
            moves = batch.rows["type"] <= POLYNOMIAL
            waits = np.where(
                moves,
                numbers >= left.path,
                (numbers >= left.row) & ~np.isin(numbers, list(left.done)),
            )
            gone = moves & ~waits
            self._uncovered.take(batch.rows[gone], numbers[gone])
            rest = BlockBatch(batch.rows[waits].copy(), batch.pool)
            at = np.flatnonzero(numbers[waits] == left.path)
            if len(at):
                ahead.add(numbers[waits][: at[0]], rest.rows[: at[0]])
                rest = BlockBatch(rest.rows[at[0] :], rest.pool)
                parts.append(self._cut(rest, ahead, left, place))
            elif (moves & waits).any() or parts:
                parts += [BlockBatch(ahead.rows(), rest.pool), rest]
            else:
                ahead.add(numbers[waits], rest.rows)
        self._batches.clear()
        parts.append(BlockBatch(ahead.rows(), np.empty(0)))
        return joined([part for part in parts if len(part)])

    def _cut(
        self,
        batch: BlockBatch,
        ahead: _Numbered,
        left: LeftOut,
        place: FloatArray,
    ) -> BlockBatch:
        """The rest of the first row, behind the elements that it and what comes
        still have to cover, and behind what is ``ahead`` of it and comes again, in
        the order of the program.
        """
        row = batch.rows[:1]
        if left.driven > SAME_MM:
            share = max(0.0, 1.0 - left.driven / left.whole)
            if row["flags"][0] & PIECE:
                self._uncovered.drive(float(row["value"][0]) * (1.0 - share))
                row["value"] *= share
            if row["type"][0] == POLYNOMIAL:
                batch = _polynomial_rest(batch, 0, 1.0 - share, place)
            elif row["type"][0] == CIRCULAR:
                row["angle"] *= share
            for name in ("length", "length_min"):
                batch.rows[name][0] *= share
        ahead.add(*self._uncovered.numbered())
        return BlockBatch(
            np.concatenate([ahead.rows(), batch.rows]), batch.pool
        )


def _polynomial_rest(
    batch: BlockBatch, at: int, share: float, place: FloatArray
) -> BlockBatch:
    """Row ``at``, a polynomial, from near ``share`` of its length on; it begins at
    ``place`` (axes,).
    """
    row, axes = batch.rows[at : at + 1], len(place)
    coef = coefficients(row, batch.pool, axes)[0]
    whole = float(row["angle"][0])
    begin = _parameter_at(coef, whole, share, place)
    rest = shifted(coef, begin)
    rest[:, 0] = place
    rows = batch.rows.copy()
    rows["pool"][at], rows["degree"][at], rows["angle"][at] = (
        len(batch.pool),
        coef.shape[1] - 1,
        whole - begin,
    )
    return BlockBatch(rows, np.concatenate([batch.pool, rest.ravel()]))


def _parameter_at(
    coef: FloatArray, whole: float, share: float, place: FloatArray
) -> float:
    """Parameter of the point next to ``place``, near ``share`` of the length."""
    u = np.linspace(0.0, whole, 129)
    points = np.einsum(
        "ak,ku->ua", coef, u ** np.arange(coef.shape[1])[:, None]
    )
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(chords)])
    at = float(np.interp(share * length[-1], length, u))
    first = coef[:, 1:] * np.arange(1, coef.shape[1])
    for _ in range(8):
        miss = coef @ at ** np.arange(coef.shape[1]) - place
        slope = first @ at ** np.arange(first.shape[1])
        at = min(
            max(
                at - float(miss @ slope) / max(float(slope @ slope), 1e-300),
                0.0,
            ),
            whole * (1.0 - 1e-9),
        )
    return at


class Host(Protocol):
    """What pausing needs of the preparation."""

    engine: Engine
    program: Program | None
    waiting: bool
    done: bool

    def take_rows(self) -> tuple[BlockBatch, int]:
        """Rows that are not pushed yet, and from which on; there are none then."""
        ...

    def give_rows(self, batch: BlockBatch) -> None:
        """What is pushed next."""
        ...

    def macro(self, path: Path, place: npt.NDArray[np.float64]) -> None:
        """Read this macro in place of the program."""
        ...

    def position(self) -> npt.NDArray[np.float64]: ...


class Pause:
    """Pausing with macros: halt, M_PAUSE, stand; M_GOPAUSE, the way back at
    VRIPOSO, then what was left of the path.

    ``held``: the path stands paused.  ``stands``, ``goes_on``: called when it
    does so, and when the program goes on.
    """

    def __init__(
        self,
        host: Host,
        stands: Callable[[], None],
        goes_on: Callable[[], None],
    ) -> None:
        self._host, self._stands, self._goes_on = host, stands, goes_on
        self.rows = PushedRows()
        self.held = False
        self._soon = False  # ACTIVE has come already
        self._in_block = False  # what is left begins within a block
        # what comes when everything pushed has been driven
        self._step: Callable[[], None] | None = None
        self._behind_macro: Callable[[], None] | None = (
            None  # while a macro is read
        )
        self._saved: tuple[Program | None, bool, bool] = (None, False, False)
        self._rest, self._place = BlockBatch.empty(), np.zeros(0)

    @property
    def active(self) -> bool:
        """The program of the host is not the one that was started, or the path
        is being halted.
        """
        return (
            self._step is not None
            or self._behind_macro is not None
            or self.held
        )

    @property
    def due(self) -> bool:
        """The path stands paused, and ACTIVE has come."""
        return self.held and self._soon

    def begin(self, reader: Restartable) -> bool:
        """HOLD: True if macros take part, False if the path only stands."""
        macros = [
            reader.pause_macro("M_PAUSE"),
            reader.pause_macro("M_GOPAUSE"),
        ]
        first = macros[0] if reader.pause_mode in (0, 1) else None
        last = macros[1] if reader.pause_mode in (0, 2) else None
        host = self._host
        if not (first or last) or self.active:
            return False
        self._reader, self._last, self._soon = reader, last, False
        self._saved = host.program, host.waiting, host.done
        self._unpushed, self._from = host.take_rows()
        host.waiting, host.done = True, False
        self._step = lambda: self._halted(first)
        host.engine.macro_runs(True)
        host.engine.halt()
        return True

    def drained(self) -> bool:
        """Everything pushed has been driven: True if that was awaited here."""
        step, self._step = self._step, None
        if step is None:
            return False
        step()
        return True

    def ended(self) -> None:
        """The macro has been read to its end."""
        self._step, self._behind_macro = self._behind_macro, None
        self._host.waiting = True
        self._host.engine.expect_drain()

    def _halted(self, macro: Path | None) -> None:
        host = self._host
        left = host.engine.left_out()
        self._in_block = left.driven > SAME_MM
        host.engine.resync()
        self._place = host.position()
        pushed = self.rows.rest(left, self._place)
        unpushed = BlockBatch(
            self._unpushed.rows[self._from :], self._unpushed.pool
        )
        self._rest = joined([part for part in (pushed, unpushed) if len(part)])
        self._run(macro, self._hold)

    def _run(self, macro: Path | None, behind: Callable[[], None]) -> None:
        """A macro, then what comes behind it; at once if there is none."""
        if macro is None:
            behind()
            return
        self._behind_macro = behind
        self._host.macro(macro, self._place)
        self._host.waiting = self._host.done = False

    def _hold(self) -> None:
        if self._soon:
            self.resume()
            return
        self.held = self._host.waiting = True
        self._host.engine.macro_runs(False)
        self._stands()

    def forget_rows(self) -> None:
        """What has been pushed does not come again: the program has left it out."""
        self.rows = PushedRows()

    def resume_soon(self) -> None:
        """ACTIVE: the program goes on behind M_PAUSE, and not from a way back."""
        self._soon = True

    def leave(self) -> None:
        """STOP: neither the rest of a macro nor that of the path comes."""
        if not self.active:
            return
        self._step = self._behind_macro = None
        self.held, self.behind = False, ""
        self._host.program = self._saved[0]
        self._host.engine.macro_runs(False)

    def resume(self) -> None:
        """ACTIVE from HOLD."""
        self.held = self._soon = False
        self._host.engine.resync()
        self._host.engine.macro_runs(True)
        self._run(self._last, self._go_on)

    def _go_on(self) -> None:
        host = self._host
        host.engine.resync(in_block=self._in_block)
        host.engine.await_functions()
        program, waiting, done = self._saved
        rows = self._rest.rows
        like = (rows if len(rows) else np.zeros(1, NC_BLOCK))[0]
        back = way_to(
            self._place, host.position(), self._reader.return_speed(), like
        )
        host.program, host.waiting, host.done = program, False, False
        host.give_rows(
            joined([part for part in (back, self._rest) if len(part)])
        )
        self.behind = "drain" if waiting else "end" if done else ""
        host.engine.macro_runs(False)
        self._goes_on()

    behind = ""  # what the program was waiting for when it was paused

    def pushed_all(self) -> bool:
        """The rows given back are pushed: True if the program then waits or
        ends, as it did.
        """
        behind, self.behind = self.behind, ""
        if behind == "drain":
            self._host.waiting = True
            self._host.engine.expect_drain()
        elif behind == "end":
            self._host.done = True
            self._host.engine.finish()
        return bool(behind)
