"""The G functions in force, which the end of a cycle gives back to its caller.

G functions with values (G68 R30, G92, G159=7, G351) keep their effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cnc_core.frontend.base.compensation import Choice
from cnc_core.frontend.base.scanner import NO_CORRECTION

from ..state.offsets import MIRROR, ZERO_OFFSET
from ..state.state import ProgramState
from .gcodes import MIRRORS


@dataclass(frozen=True)
class GFunctions:
    """G functions, circle data and feed of one channel.

    ``modal``: what the scanner knows.  ``thread``: function and pitches.
    ``by_value``: how often zero offset and mirror were chosen with a value.
    """

    feed_mode: int
    modal: tuple[Any, ...]
    thread: tuple[int, dict[str, float]]
    contouring: bool
    compensation: Choice
    zero_offset: int
    mirror: int
    diameter: bool
    no_correction: bool
    constant_cutting_speed: bool
    spline: bool
    by_value: dict[str, int]

    @classmethod
    def of(cls, state: ProgramState) -> GFunctions:
        channel, offsets, modal = state.channel, state.offsets, state.modal
        return cls(
            channel.feeds.mode,
            modal.saved(),
            channel.turning.thread,
            channel.contouring.active,
            channel.compensation.choice,
            offsets.number,
            next(c for c, signs in MIRRORS.items() if signs == offsets.signs()),
            offsets.diameter,
            modal.has_rule(NO_CORRECTION),
            channel.turning.constant,
            channel.splines.active,
            dict(offsets.by_value),
        )

    def compensation_again(self, now: GFunctions) -> list[str]:
        """The functions of tool radius compensation that are to come back."""
        mine, other = self.compensation, now.compensation
        pairs = (
            (mine.side, other.side),
            (mine.corner, other.corner),
            (mine.mode, other.mode),
            (mine.feed, other.feed),
        )
        return [f"G{code}" for code, changed in pairs if code != changed]

    def others_again(self, now: GFunctions) -> list[str]:
        """All others, apart from those of the scanner and of the feed."""
        again = []

        def compare(mine: object, other: object, name: str) -> None:
            if mine != other:
                again.append(name)

        if self.by_value[ZERO_OFFSET] == now.by_value[ZERO_OFFSET]:
            name = (
                f"G{53 + self.zero_offset}" if self.zero_offset < 7 else "G159"
            )
            compare(self.zero_offset, now.zero_offset, name)
        if self.by_value[MIRROR] == now.by_value[MIRROR]:
            compare(self.mirror, now.mirror, f"G{self.mirror}")
        for mine, other, on, off in (
            (self.diameter, now.diameter, "G51", "G52"),
            (self.no_correction, now.no_correction, "G164", "G165"),
            (
                self.constant_cutting_speed,
                now.constant_cutting_speed,
                "G96",
                "G97",
            ),
            (self.spline, now.spline, "G151", "G150"),
        ):
            compare(mine, other, on if mine else off)
        return again
