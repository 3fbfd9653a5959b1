"""Drilling and boring cycles G73, G81, G82, G83, G85, G86, G89 as single
motions, in machine coordinates (mm).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from cnc_core.blocks import M, motion_planes
from cnc_core.errors import CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.iso import codes
from cnc_core.frontend.iso.frame import machine_coordinates
from cnc_core.frontend.iso.mover import Mover
from cnc_core.frontend.iso.words import Words
from cnc_core.frontend.machine import ProgramMachine

# clearance above the last depth (G83), retraction to break the chip (G73)
CHIP_MM = 0.254
SAME_MM = 1e-9
ROWS_MAX = 1_000_000  # of one block
STICKY = "RPQ"
DWELL_MAX_S = 1e6


@dataclass(frozen=True)
class Hole:
    """Levels along the drilling axis, machine coordinates."""

    top: float
    bottom: float
    clear: float
    peck: float
    dwell: float


@dataclass
class Drilling:
    """Modal state of the cycles.

    ``code``: the cycle in force, None if there is none.
    ``initial``: G98's level.
    """

    machine: ProgramMachine
    modal: Modal
    code: int | None = None
    initial: float = 0.0
    words: dict[str, float] = field(default_factory=dict)
    _absolute: bool = True

    def end(self) -> None:
        self.code = None
        self.words = {}

    def run(
        self,
        code: int,
        words: Words,
        mover: Mover,
        spindle: int,
        *,
        to_top: bool,
    ) -> list[Row]:
        """Rows of one block; ``to_top``: G99.  ``spindle``: M3 or M4, 0 when it
        stands (G86).
        """
        plane = [self.machine.main[i] for i in motion_planes(self.modal.plane)]
        offset = words.first("XYZRLKPQ") or words.g.get(code, 0)
        self._check(code, words, plane, offset)
        if code == 860 and not spindle:
            raise fail(908004, "G86: the spindle does not turn", offset)
        self._take(code, words, plane, offset)
        repeats = self._repeats(words, offset)
        moves = self._moves(words, plane)
        hole = self._hole(plane[2], to_top, offset)
        self._check_size(repeats, hole, offset)
        self._absolute = self.modal.absolute
        with machine_coordinates(self.modal, mm=True):
            return self._drill(
                code, hole, moves, repeats, plane, mover, spindle
            )

    # checks

    def _check(
        self, code: int, words: Words, plane: list[int], offset: int
    ) -> None:
        names = [self.machine.axes[i].upper() if i >= 0 else "" for i in plane]
        if not all(names):
            raise fail(
                900016,
                f"{codes.name(code)}: the machine lacks an axis of the plane",
                offset,
            )
        other = next(
            (letter for letter in words.axes if letter not in names), None
        )
        if other is not None:
            raise self._wrong(
                code,
                f"{other} is no axis of the plane and its cycles",
                words.offsets[other],
            )
        if not words.axes:
            raise self._wrong(code, "an axis word is missing", offset)

    def _wrong(self, code: int, text: str, offset: int) -> CncError:
        return fail(908004, f"{codes.name(code)}: {text}", offset)

    def _take(
        self, code: int, words: Words, plane: list[int], offset: int
    ) -> None:
        """Words that stay in force from block to block."""
        depth = self.machine.axes[plane[2]].upper()
        if self.code is None:
            self.initial = float(self.modal.position[plane[2]])
        if self.code != code:
            self.words = {}
        self.code = code
        self.words |= {
            letter: words.values[letter]
            for letter in STICKY
            if letter in words.values
        }
        if depth in words.values:
            self.words["depth"] = words.values[depth]
        needed = {"depth": depth, "R": "R"}
        needed |= {"Q": "Q"} if code in codes.PECKING else {}
        needed |= {"P": "P"} if code in codes.DWELLING else {}
        for key, letter in needed.items():
            if key not in self.words:
                raise self._wrong(code, f"{letter} is missing", offset)
        if code in codes.PECKING and not self.words["Q"] > 0:
            raise self._wrong(code, "Q is not positive", offset)
        if self.words.get("P", 0.0) > DWELL_MAX_S:
            raise fail(
                900012,
                f"{codes.name(code)}: P out of range 0..{DWELL_MAX_S:g} s",
                offset,
            )

    def _repeats(self, words: Words, offset: int) -> int:
        given = [
            words.values[letter] for letter in "LK" if letter in words.values
        ]
        if len(given) > 1:
            raise fail(908004, "L and K both give the number of holes", offset)
        count = given[0] if given else 1.0
        if count != int(count) or not 1 <= count <= ROWS_MAX:
            raise fail(
                908004,
                f"number of holes {count:g}: a whole number from 1 on is expected",
                offset,
            )
        return int(count)

    def _check_size(self, repeats: int, hole: Hole, offset: int) -> None:
        pecks = (hole.top - hole.bottom) / hole.peck if hole.peck else 1.0
        if not repeats * (3.0 * pecks + 5.0) <= ROWS_MAX:
            raise fail(
                900012, f"more than {ROWS_MAX} motions in one block", offset
            )

    # geometry

    def _moves(self, words: Words, plane: list[int]) -> dict[int, float]:
        """Coordinate or distance by axis of the plane, mm."""
        out = {}
        for axis in plane[:2]:
            value = words.values.get(self.machine.axes[axis].upper())
            if value is not None:
                out[axis] = value * self.modal.unit_mm + (
                    self.modal.offset[axis] if self.modal.absolute else 0.0
                )
        return out

    def _hole(self, axis: int, to_top: bool, offset: int) -> Hole:
        unit, now = self.modal.unit_mm, float(self.modal.position[axis])
        base = float(self.modal.offset[axis]) if self.modal.absolute else now
        top = base + self.words["R"] * unit
        bottom = self.words["depth"] * unit + (
            base if self.modal.absolute else top
        )
        if top < bottom:
            raise fail(908004, "R lies below the bottom of the hole", offset)
        clear = top if to_top else max(self.initial, top)
        peck = self.words["Q"] * unit if self.code in codes.PECKING else 0.0
        return Hole(top, bottom, clear, peck, self.words.get("P", 0.0))

    def _drill(
        self,
        code: int,
        hole: Hole,
        moves: dict[int, float],
        repeats: int,
        plane: list[int],
        mover: Mover,
        spindle: int,
    ) -> list[Row]:
        axis, rows = plane[2], []
        if self.modal.position[axis] < hole.top:
            rows += mover.line(0, {axis: hole.top})
        for _ in range(repeats):
            rows += mover.line(0, self._target(moves))
            rows += mover.line(0, {axis: hole.top})
            rows += self._down(code, hole, axis, mover)
            rows += self._bottom(code, hole, mover)
            if code == 860:
                rows.append(self.modal.row(M, mover.n, code=5))
            rows += mover.line(
                1 if code in codes.FEEDING_OUT else 0, {axis: hole.clear}
            )
            if code == 860:
                rows.append(self.modal.row(M, mover.n, code=spindle))
        return rows

    def _target(self, moves: dict[int, float]) -> dict[int, float]:
        position = self.modal.position
        return {
            axis: value + (0.0 if self._absolute else position[axis])
            for axis, value in moves.items()
        }

    def _down(
        self, code: int, hole: Hole, axis: int, mover: Mover
    ) -> list[Row]:
        rows = []
        step = 1
        while (
            code in codes.PECKING
            and (depth := hole.top - step * hole.peck) > hole.bottom + SAME_MM
        ):
            rows += mover.line(1, {axis: depth})
            if code == 830:
                rows += mover.line(0, {axis: hole.top})
            rows += mover.line(0, {axis: min(depth + CHIP_MM, hole.top)})
            step += 1
        return rows + mover.line(1, {axis: hole.bottom})

    def _bottom(self, code: int, hole: Hole, mover: Mover) -> list[Row]:
        return [mover.dwell(hole.dwell)] if code in codes.DWELLING else []
