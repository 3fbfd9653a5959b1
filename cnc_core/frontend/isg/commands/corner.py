"""Commands of chamfers and roundings: #CHF, #CHR, #RND, #FRC.

The geometry is ``cnc_core.geometry.stages.corner``. A ``CORNER`` row stands
behind the block that the corner ends.
"""

from __future__ import annotations

from cnc_core.blocks import CHAMFER, EDGE, ROUND
from cnc_core.frontend.base.lexer import fail

from .base import CommandBase, Items, Run

KEYWORDS = {"CHR": CHAMFER, "CHF": EDGE, "RND": ROUND}


class CornerCommands(CommandBase):
    """``#RND=3`` behind or in front of the words of its block."""

    def _corner(self, name: str) -> Run:
        self._last = True
        self._stream.accept("=")
        if not self._formulas.starts_here():
            raise fail(900004, f"#{name} without a value", self._start)
        value = self._formulas.number(f"#{name}", self._start)

        def run() -> Items:
            words, modal = self._state.channel.corner_words, self._modal
            if name == "FRC":
                words.set_feed(value(), self._start)
                return []
            return [
                words.row(
                    KEYWORDS[name],
                    value() * modal.unit_mm,
                    modal.n,
                    f"#{name}",
                    self._start,
                )
            ]

        return run
