"""Contouring and smoothing in the program: G61, G261, #CONTOUR MODE, #HSC,
#FILTER.

The geometry is behind the waist (``cnc_core.geometry.stages.contouring``,
``cnc_core.geometry.stages.smoothing``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import radians

import numpy as np

from cnc_core._engine import lib
from cnc_core.blocks import CONTOUR, SMOOTHING
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row

from .offsets import Offsets

NOT_GIVEN = -1.0
ACTIONS = {"PRE_ACTION": 0, "INTER_ACTION": 1, "POST_ACTION": 2}
FILTER_TOLERANCE_MM = 0.01  # #FILTER ON without AX_DEV (R)


@dataclass(frozen=True)
class ContourMode:
    """A contour mode.

    ``name``: DEV, DIST .. Lengths are in mm, other axes in degrees, shares
    0..1. A negative distance is not given.
    ``interim``: programmed coordinates of the interim point by channel axis.
    """

    name: str = "DEV"
    path_dev: float = 1.0
    pre: float = NOT_GIVEN
    post: float = NOT_GIVEN
    track_dev: float = 0.0
    relevant_path: float = 0.0
    relevant_track: float = 0.0
    remain: float = 0.0
    max_angle: float = 0.0
    share: float = 1.0
    const_vel: bool = False
    action: int = 1
    interim: dict[int, float] = field(default_factory=dict)


# what a command sets that names the mode and nothing else
DEFAULTS = {
    "DEV": ContourMode("DEV"),
    "DIST": ContourMode("DIST", path_dev=0.0, pre=1.0, post=1.0),
    "DIST_SOFT": ContourMode(
        "DIST_SOFT", path_dev=0.0, pre=1.0, post=1.0, share=0.5
    ),
    "DIST_MASTER": ContourMode(
        "DIST_MASTER", path_dev=0.0, pre=1.0, post=1.0, share=0.5
    ),
    "POS": ContourMode("POS", path_dev=0.0, pre=1.0, post=1.0),
    "PTP": ContourMode("PTP"),
    "AUTO_DEV": ContourMode("AUTO_DEV"),
    "AUTO_VEL": ContourMode("AUTO_VEL", path_dev=0.0),
}
CODES = {
    "DEV": lib.NC_CONTOUR_DEV,
    "DIST": lib.NC_CONTOUR_DIST,
    "DIST_SOFT": lib.NC_CONTOUR_SOFT,
    "DIST_MASTER": lib.NC_CONTOUR_SOFT,
    "POS": lib.NC_CONTOUR_POS,
    "PTP": lib.NC_CONTOUR_PTP,
    "AUTO_DEV": lib.NC_CONTOUR_AUTO_DEV,
    "AUTO_VEL": lib.NC_CONTOUR_AUTO_VEL,
}
SOFT = ("DIST_SOFT", "DIST_MASTER")


class Contouring:
    """Modal state of G61, G261, G260 and #CONTOUR MODE."""

    def __init__(self, modal: Modal, offsets: Offsets) -> None:
        self._modal, self._offsets = modal, offsets
        self.mode = ContourMode()
        self.active = False
        self.last_once: np.ndarray | None = (
            None  # where the last G61 block ended
        )

    def switch(self, on: bool, n: int) -> list[Row]:
        """G261, G260."""
        if on == self.active:
            return []
        self.active = on
        return [self._row(on, n)]

    def set_mode(self, mode: ContourMode, n: int, offset: int) -> list[Row]:
        """#CONTOUR MODE: from the next corner on."""
        if (
            self.active
            and mode.name != self.mode.name
            and (mode.name in SOFT or self.mode.name in SOFT)
        ):
            raise fail(
                120698,
                f"{ERRORS[120698]}: {self.mode.name} to {mode.name}",
                offset,
            )
        self.mode = mode
        return [self._row(self.active, n)] if self.active else []

    def once(self, n: int) -> tuple[list[Row], list[Row]]:
        """G61: rows ahead of its motion and behind it."""
        if self.active:
            return [], []
        return [self._row(True, n)], [self._row(False, n)]

    def at_end(self) -> str:
        """Why a corner at the program's end is not rounded; empty if none should be."""
        if self.active:
            return "G261 is active at the program's end"
        if self.last_once is not None and np.array_equal(
            self.last_once, self._modal.position
        ):
            return "no block follows the last one with G61"
        return ""

    def _row(self, on: bool, n: int) -> Row:
        mode, row = (
            self.mode,
            self._modal.row(
                CONTOUR, n, code=CODES[self.mode.name], value=self.mode.path_dev
            ),
        )
        row["plane"], row["degree"] = on, mode.action
        row["flags"] = lib.NC_CONTOUR_CONST_VEL if mode.const_vel else 0
        row["center"] = mode.pre, mode.post
        row["radius"], row["programmed_radius"], row["length_min"] = (
            mode.track_dev,
            mode.relevant_path,
            mode.relevant_track,
        )
        row["feed"], row["angle"], row["length"] = (
            mode.remain,
            radians(mode.max_angle),
            mode.share,
        )
        row["end"] = np.nan
        for axis, value in mode.interim.items():
            row["end"][0][axis] = self._offsets.machine(axis, value)
        return row


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of #HSC or #FILTER, mm, degrees.  0: as configured.

    ``max_angle``: degrees.  ``max_length``: mm.  0: no limit.
    """

    path: float = 0.2
    track: float = 5.0
    max_angle: float = 0.0
    max_length: float = 0.0


class Smooth:
    """#HSC and #FILTER: chains of blocks become smooth curves within a
    tolerance.

    #HSC goes before #FILTER.
    """

    def __init__(self, modal: Modal) -> None:
        self._modal = modal
        self.hsc: Tolerances | None = None
        self.hsc_settings = Tolerances()
        self.filter: Tolerances | None = None
        self._told: Tolerances | None = None

    def switch_hsc(self, on: bool, n: int) -> list[Row]:
        self.hsc = self.hsc_settings if on else None
        return self._rows(n)

    def switch_filter(self, deviation_mm: float | None, n: int) -> list[Row]:
        """``deviation_mm``: AX_DEV, 0 if it is not given.  None switches off."""
        self.filter = None
        if deviation_mm is not None:
            tolerance = deviation_mm or FILTER_TOLERANCE_MM
            self.filter = Tolerances(tolerance, tolerance)
        return self._rows(n)

    def _rows(self, n: int) -> list[Row]:
        now = self.hsc or self.filter
        if now == self._told:
            return []
        self._told = now
        row = self._modal.row(SMOOTHING, n, code=int(now is not None))
        if now is not None:
            row["value"], row["radius"] = now.path, now.track
            row["angle"], row["length"] = radians(now.max_angle), now.max_length
        return [row]
