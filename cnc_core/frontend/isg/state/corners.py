"""The size of chamfers and roundings in force, and the rows that ask for them."""

from __future__ import annotations

from cnc_core.blocks import CHAMFER, CORNER, ROUND
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.units import SECONDS_PER_MINUTE

from .offsets import Offsets

CODES = {301: CHAMFER, 302: ROUND}


class CornerWords:
    """Modal state: the size of G301 and G302."""

    def __init__(self, modal: Modal, offsets: Offsets) -> None:
        self._modal, self._offsets = modal, offsets
        self._size_mm = 0.0
        self._last: Row | None = None
        self._feed: tuple[int, float] = (-1, 0.0)  # block count, mm/s

    def g(
        self, code: int, size: float | None, n: int, offset: int
    ) -> list[Row]:
        """G301 I5, G302 I5; I is modal."""
        if size is not None:
            self._size_mm = size * self._modal.unit_mm
        return [self.row(CODES[code], self._size_mm, n, f"G{code} I", offset)]

    def row(
        self, kind: int, size_mm: float, n: int, name: str, offset: int
    ) -> Row:
        """``size_mm`` as programmed: #SCALE acts on it as on the words of the plane."""
        if not 0 < size_mm <= 1e9:
            raise fail(900012, f"{name}: the size must be positive", offset)
        plane = self._modal.plane
        factor = self._offsets.plane_factor(plane)
        if factor is None:
            raise fail(910113, f"{name}: {ERRORS[910113]}", offset)
        row = self._modal.row(CORNER, n, code=kind, value=size_mm * factor)
        row["plane"] = plane
        if self._feed[0] == self._modal.count:
            row["feed"] = self._feed[1]
        self._last = row
        return row

    def set_feed(self, feed: float, offset: int) -> None:
        """#FRC: of the new element of this block, per minute."""
        if not feed > 0:
            raise fail(900012, "#FRC: the feed must be positive", offset)
        mm_s = feed * self._modal.unit_mm / SECONDS_PER_MINUTE
        self._feed = (self._modal.count, mm_s)
        if (
            self._last is not None
            and self._last["count"][0] == self._modal.count
        ):
            self._last["feed"] = mm_s
