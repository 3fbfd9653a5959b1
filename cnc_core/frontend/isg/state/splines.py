"""Splines in force: their kind, their ends, and whether one is active."""

from __future__ import annotations

import numpy as np

from cnc_core.blocks import SPLINE
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row

from .offsets import Offsets

KINDS = {"AKIMA": 1, "BSPLINE": 2}
ENDS = {"AUTO": 0, "TANGENTIAL": 1, "USER": 2}


class Splines:
    """Modal state of one channel."""

    def __init__(self, modal: Modal, offsets: Offsets) -> None:
        self._modal, self._offsets = modal, offsets
        self.kind = "AKIMA"
        self.ends = ["AUTO", "AUTO"]
        self.vectors: list[dict[int, float]] = [
            {},
            {},
        ]  # start, end: programmed direction by channel axis
        self.active = False

    def switch(self, on: bool, n: int) -> list[Row]:
        """G151, G150."""
        if on == self.active:
            return []
        self.active = on
        row = self._modal.row(SPLINE, n, code=KINDS[self.kind] if on else 0)
        row["plane"] = ENDS[self.ends[0]]
        row["degree"] = ENDS[self.ends[1]]
        row["end"] = np.nan
        for axis, value in self.vectors[0 if on else 1].items():
            row["end"][0][axis] = self._offsets.from_zero(axis, value)
        return [row]


def refused_with_compensation(offset: int) -> Exception:
    """A spline and tool radius compensation at the same time."""
    return fail(911003, ERRORS[911003], offset)
