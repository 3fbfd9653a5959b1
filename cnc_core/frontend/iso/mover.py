"""Motions of one block through the shared geometry.

Errors get the place of the block's motion words.
"""

from __future__ import annotations

from cnc_core.blocks import CIRCULAR, DWELL, RAPID
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, MotionWords, Row
from cnc_core.units import SECONDS_PER_MINUTE


class Mover:
    """Makes the rows of one block.

    ``minutes``: G93, duration of each motion that is not rapid.
    """

    def __init__(
        self, modal: Modal, n: int, offset: int, minutes: float | None = None
    ) -> None:
        self.modal, self.n, self._offset, self._minutes = (
            modal,
            n,
            offset,
            minutes,
        )

    def apply(self, words: MotionWords) -> list[Row]:
        """No row or one."""
        words.n = self.n
        error, row = self.modal.apply(words)
        if error:
            raise fail(error, ERRORS[error], self._offset)
        return [] if row is None else [row]

    def motion(self, words: MotionWords) -> list[Row]:
        """A motion that G93 may time."""
        rows = self.apply(words)
        for row in rows:
            if self._minutes is not None and not row["flags"][0] & RAPID:
                row["feed"] = row["length"] / (
                    self._minutes * SECONDS_PER_MINUTE
                )
        return rows

    def line(self, motion: int, target: dict[int, float]) -> list[Row]:
        """G0 or G1."""
        return (
            self.apply(MotionWords(axis=target, motion=motion))
            if target
            else []
        )

    def dwell(self, seconds: float) -> Row:
        return self.modal.row(DWELL, self.n, value=seconds)


def add_turns(row: Row, turns: int, rise: float) -> None:
    """Full turns more for an arc (P word); ``rise`` along the third axis, mm."""
    if row["type"][0] != CIRCULAR:
        return
    angle = float(row["angle"][0])
    angle += turns * (6.283185307179586 if angle > 0 else -6.283185307179586)
    row["angle"] = angle
    row["length"] = row["length_min"] = (
        (float(row["radius"][0]) * angle) ** 2 + rise**2
    ) ** 0.5
