"""Tool radius compensation in the program: functions in force, rows for the
stage.

The geometry is behind the waist
(``cnc_core.geometry.stages.radius_compensation``). The modal state is kept
here. A ``COMPENSATION`` row is made whenever the state changes for the stage.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from cnc_core.blocks import COMPENSATION, CONTOUR_FEED
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row

SIDES, CORNERS, MODES, FEEDS = (
    (40, 41, 42),
    (25, 26),
    (138, 139, 237, 239),
    (10, 11),
)
TANGENTIAL = 5
CODES = frozenset({*SIDES, *CORNERS, *MODES, *FEEDS, TANGENTIAL})


@dataclass(frozen=True)
class Choice:
    """The functions in force; the values are the G functions."""

    side: int = 40
    corner: int = 25
    mode: int = 139
    feed: int = 10
    radius_mm: float = 0.0

    @property
    def active(self) -> bool:
        return self.side != 40


class Compensation:
    """Modal state of one channel."""

    def __init__(self, modal: Modal) -> None:
        self._modal = modal
        self.choice = Choice()

    def take_back(self, before: Choice) -> None:
        """The block is refused, its rows are lost: a side that it chose is not in
        force.  A G40 counts, or the blocks behind it would be refused too.
        """
        if not before.active:
            self.choice = before
        self._modal.set_compensated(self.choice.active)

    def update(
        self, codes: dict[str, int], radius_mm: float, plane: int, n: int
    ) -> list[Row]:
        """Take over the G functions of a block and the tool radius.

        Returns the row for the stage, if the state changed for it. ``settle``
        has to follow when the block's motion is made. The block itself may
        change the plane, unless compensation is active both before and behind
        it.
        """
        before, self.choice = self.choice, self._chosen(codes, radius_mm)
        self._modal.set_compensated(before.active and self.choice.active)
        if f"G{TANGENTIAL}" in codes and before.active == self.choice.active:
            raise fail(906006, ERRORS[906006], codes[f"G{TANGENTIAL}"])
        if self.choice == before or not (before.active or self.choice.active):
            return []
        return [self._row(f"G{TANGENTIAL}" in codes, plane, n)]

    def settle(self) -> None:
        """The block's motion is made."""
        self._modal.set_compensated(self.choice.active)

    def _chosen(self, codes: dict[str, int], radius_mm: float) -> Choice:
        def last(group: tuple[int, ...], old: int) -> int:
            return next((code for code in group if f"G{code}" in codes), old)

        old = self.choice
        return replace(
            old,
            side=last(SIDES, old.side),
            corner=last(CORNERS, old.corner),
            mode=last(MODES, old.mode),
            feed=last(FEEDS, old.feed),
            radius_mm=radius_mm,
        )

    def _row(self, tangential: bool, plane: int, n: int) -> Row:
        choice = self.choice
        flags = CONTOUR_FEED if choice.feed == 11 else 0
        row = self._modal.row(
            COMPENSATION,
            n,
            code=choice.side,
            value=choice.radius_mm,
            flags=flags,
        )
        row["plane"], row["degree"] = plane, choice.corner
        row["pool"] = TANGENTIAL if tangential else choice.mode
        return row
