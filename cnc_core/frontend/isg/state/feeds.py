"""Feed modes G93, G94, G95, G194: each keeps its own F."""

from __future__ import annotations

import numpy as np

from cnc_core.blocks import CIRCULAR, RAPID, motion_planes
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import SECONDS_PER_MINUTE, FloatArray

TIME, PER_MINUTE, PER_TURN, SHARE = 93, 94, 95, 194
ROUNDING = 1e-12  # of a direction


class Feeds:
    """F words, and the feed of motions.

    G94 is the scanner's own mode. In the other modes the rows get their feed
    here.
    """

    def __init__(self, machine: ProgramMachine, modal: Modal) -> None:
        self._machine, self._modal = machine, modal
        self.mode = PER_MINUTE
        self._words: dict[int, float] = {}
        self._units: dict[int, float] = {}
        self._per_minute = 0.0  # the scanner's F while another mode is on
        self.factor = 1.0
        self.limit_mm_s = 0.0  # 0: none
        # axes that F refers to; None: the main axes
        self.group: frozenset[int] | None = None
        self.tangential_radius_mm = 0.0  # #TANGFEED: smaller arcs are slower

    @property
    def per_minute(self) -> bool:
        """G94: the scanner's own mode."""
        return self.mode == PER_MINUTE

    @property
    def plain(self) -> bool:
        """The scanner knows everything about the feed."""
        return (
            self.per_minute
            and self.group is None
            and self.tangential_radius_mm <= 0.0
        )

    @property
    def programmed(self) -> float:
        """F of the mode that is on."""
        return (
            self._modal.feed
            if self.per_minute
            else self._words.get(self.mode, 0.0)
        )

    @property
    def per_minute_mm(self) -> float:
        """F of G94, mm/min; 0: none yet."""
        return (
            self._modal.feed if self.per_minute else self._per_minute
        ) * self._modal.feed_unit

    def choose(self, mode: int) -> None:
        if mode == self.mode:
            return
        if self.per_minute:
            self._per_minute = self._modal.feed
        self.mode = mode
        self._modal.feed = self._per_minute if mode == PER_MINUTE else 1.0

    def word(self, value: float, offset: int) -> None:
        """An F word in a mode that is not G94."""
        if not 0 < value <= 1e9 or (self.mode == SHARE and value > 100):
            raise fail(
                900012, f"F{value:g} out of range in G{self.mode}", offset
            )
        self._words[self.mode] = value
        self._units[self.mode] = self._modal.unit_mm

    def set_factor(self, factor: float) -> None:
        """#OVERRIDE FEED_FACT, 1 for 100 %."""
        self.factor = factor
        self._modal.set_feed_factor(factor)

    def set_limit(self, limit_mm_s: float) -> None:
        """#VECTOR LIMIT VEL, mm/s; 0: none."""
        self.limit_mm_s = limit_mm_s
        self._modal.set_feed_limit(limit_mm_s)

    def apply(
        self,
        row: Row,
        start: np.ndarray,
        turns_min: float,
        turned: FloatArray,
        offset: int,
    ) -> None:
        """The feed of a motion that the scanner does not know.

        ``start``: (axes,) where it begins.  ``turned``: (3, 3), from programmed
        directions to those of the main axes.
        """
        if row["flags"][0] & RAPID:
            return
        if not self.per_minute:
            word = self._words.get(self.mode, 0.0)
            if word <= 0:
                raise fail(900006, ERRORS[900006], offset)
            if self.mode == SHARE:
                feed = word / 100.0 * self._largest(row, start, turned)
            else:
                feed = self._in_mode(word, row, turns_min, offset)
            row["feed"] = min(feed * self.factor, self.limit_mm_s or np.inf)
        self._of_group(row, start, offset)
        radius = float(row["programmed_radius"][0])
        if row["type"][0] == CIRCULAR and radius < self.tangential_radius_mm:
            row["feed"] *= radius / self.tangential_radius_mm

    def _of_group(self, row: Row, start: np.ndarray, offset: int) -> None:
        """#FGROUP: F is the speed of these axes, the path is faster or slower."""
        if self.group is None or self.mode == TIME:
            return
        main = {axis for axis in self._machine.main if axis >= 0}
        if row["type"][0] == CIRCULAR:
            if self.group & main not in (main, set()):
                raise fail(21209, ERRORS[21209], offset)
            return
        way = row["end"][0][: len(start)] - start
        grouped = float(np.linalg.norm(way[sorted(self.group)]))
        if grouped > 0.0:
            feed = float(row["feed"][0]) * float(row["length"][0]) / grouped
            row["feed"] = min(feed, self.limit_mm_s or np.inf)

    def _in_mode(
        self, word: float, row: Row, turns_min: float, offset: int
    ) -> float:
        """The feed of G93 and G95, mm/s."""
        if self.mode == TIME:
            return float(row["length"][0]) / word
        if turns_min <= 0:
            raise fail(900019, "G95: no spindle speed is programmed", offset)
        return word * self._units[PER_TURN] * turns_min / SECONDS_PER_MINUTE

    def _largest(
        self, row: Row, start: np.ndarray, turned: FloatArray
    ) -> float:
        """Largest path velocity within the axis limits.

        On circles every direction of the plane has to keep them.
        """
        velocity = self._machine.velocity
        if velocity is None:
            raise fail(
                907061, "G194: the machine's axis velocities are not known", 0
            )
        way = row["end"][0][: len(start)] - start
        way /= float(row["length"][0])
        places = [k for k in range(3) if self._machine.main[k] >= 0]
        axes = [self._machine.main[k] for k in places]
        ahead, around = np.zeros(3), np.zeros(3)
        ahead[places] = way[axes]
        if row["type"][0] == CIRCULAR:
            plane = list(motion_planes(int(row["plane"][0]))[:2])
            ahead[plane] = 0.0
            around = np.linalg.norm(turned[:, plane], axis=1)
        way[axes] = (np.abs(turned @ ahead) + around)[places]
        need = np.abs(way)
        moving = need > ROUNDING
        return float((velocity[moving] / need[moving]).min())
