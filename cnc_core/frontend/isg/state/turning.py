"""Motions tied to the spindle: threads (G33), tapping (G63, G331, G332),
constant cutting speed (G96, G97, G196).

The angle of the spindle is not followed: a thread or a tapping is a line whose
feed is speed times pitch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi

import numpy as np

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, MotionWords, Row
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import SECONDS_PER_MINUTE

THREAD, RIGID, TAP, RETRACT = 33, 63, 331, 332
CODES = (THREAD, RIGID, TAP, RETRACT)
ROTATING = frozenset({3, 4})
SPINDLE_FUNCTIONS = frozenset({3, 4, 5, 19})
TINY_MM = 1e-6


class Turning:
    """Modal state of one channel.

    ``mode``: the function of CODES that is in force, 0 for none.  ``rev_min``:
    speed as programmed, or as computed from the cutting speed.
    """

    def __init__(self, machine: ProgramMachine, modal: Modal) -> None:
        self._machine, self._modal = machine, modal
        self.mode = 0
        self.rev_min = 0.0
        self.constant = False  # G96
        self.limit_rev_min = 0.0  # G196, 0: none
        self.cutting_m_min = 0.0
        self.rotating = False
        self._pitch: dict[str, float] = {}  # mm by I, J, K
        # mm, of the tool's present place
        self.diameter: Callable[[], float] = lambda: 0.0

    @property
    def plain(self) -> bool:
        """The scanner may read motions."""
        return self.mode == 0 and not self.constant

    @property
    def thread(self) -> tuple[int, dict[str, float]]:
        """The function in force and its pitches, mm by I, J, K."""
        return self.mode, dict(self._pitch)

    @thread.setter
    def thread(self, thread: tuple[int, dict[str, float]]) -> None:
        self.mode, self._pitch = thread[0], dict(thread[1])

    # words

    def take(
        self,
        codes: dict[str, int],
        motion: MotionWords,
        functions: set[int],
        mode: int,
        speed: float | None,
    ) -> MotionWords:
        """The motion words without the pitch.

        ``mode``: of the feed.  ``functions``, ``speed``: M functions and S word
        of the block.
        """
        code = next((c for c in CODES if f"G{c}" in codes), None)
        if code is not None:
            self.mode = code
        elif motion.motion is not None:
            self.mode = 0
        for function in functions & SPINDLE_FUNCTIONS:
            self.rotating = function in ROTATING
        if code == RIGID:
            self._check_rigid(
                codes["G63"],
                functions,
                mode,
                self.rev_min if speed is None else speed,
            )
        if self.mode in (0, RIGID):
            return motion
        for letter, value in motion.centre.items():
            self._pitch[letter] = abs(value) * self._modal.unit_mm
        return replace(motion, centre={})

    def _check_rigid(
        self, offset: int, functions: set[int], mode: int, speed: float
    ) -> None:
        if functions & SPINDLE_FUNCTIONS:
            raise fail(
                907070,
                f"{ERRORS[907070]}: M{min(functions & SPINDLE_FUNCTIONS)}",
                offset,
            )
        if mode == 95:
            raise fail(20635, ERRORS[20635], offset)
        if self.constant:
            raise fail(20636, ERRORS[20636], offset)
        if self.rotating:
            raise fail(907071, ERRORS[907071], offset)
        if speed <= 0:
            raise fail(20007, ERRORS[20007], offset)

    def speed(
        self, codes: dict[str, int], word: float | None, offset: int
    ) -> float | None:
        """Take an S word and G96, G97, G196; rev/min if the speed has changed."""
        before = self.rev_min
        if "G196" in codes:
            if word is None:
                raise fail(900004, "G196 without S", codes["G196"])
            self.limit_rev_min = word
            return None
        if "G97" in codes:
            self.constant = False
        if "G96" in codes:
            self.constant = True
        if word is not None and self.constant:
            self.cutting_m_min = word
            self.follow()
            return self.rev_min or None
        if word is not None:
            self.rev_min = word
            return word
        return self.rev_min if self.rev_min != before else None

    def follow(self) -> bool:
        """Take the speed of the cutting speed at the present diameter.

        Returns whether it has changed.
        """
        if not self.constant or self.cutting_m_min <= 0:
            return False
        diameter, before = self.diameter(), self.rev_min
        if diameter > TINY_MM:
            self.rev_min = self.cutting_m_min * 1000.0 / (pi * diameter)
        elif self.limit_rev_min:
            self.rev_min = self.limit_rev_min
        if self.limit_rev_min:
            self.rev_min = min(self.rev_min, self.limit_rev_min)
        return abs(self.rev_min - before) > 1e-3 * before

    # feed

    def apply(self, row: Row, start: np.ndarray, offset: int) -> None:
        """The feed of a thread or a tapping; that of G63 is F."""
        if self.mode in (0, RIGID):
            return
        if self.rev_min <= 0:
            raise fail(
                900019, f"G{self.mode}: no spindle speed is programmed", offset
            )
        way = row["end"][0][: len(start)] - start
        found = [
            (abs(float(way[axis])), pitch)
            for letter, pitch in self._pitch.items()
            if (axis := self._machine.main["IJK".index(letter)]) >= 0
            and pitch > 0
        ]
        along, pitch = max(found, default=(0.0, 0.0))
        if along <= TINY_MM:
            raise fail(
                900004, f"G{self.mode}: no pitch for the axes that move", offset
            )
        row["feed"] = (
            self.rev_min
            / SECONDS_PER_MINUTE
            * pitch
            * float(row["length"][0])
            / along
        )
        row["flags"] = 0
