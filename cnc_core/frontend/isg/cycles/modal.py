"""Modal cycles: ``L CYCLE [.. MODAL_MOVE]`` is executed again behind later blocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cnc_core.frontend.base.flow import Level

    from ..language.calls import Call

MODAL_MOVE, MODAL_BLOCK = "MODAL_MOVE", "MODAL_BLOCK"


@dataclass
class ModalCycle:
    """The active modal cycle.

    It repeats behind blocks of the program level that it was called in.
    """

    call: Call | None = None
    level: Level | None = None

    def select(self, call: Call, level: Level) -> None:
        self.call, self.level = call, level

    def deselect(self) -> None:
        self.call = self.level = None

    def behind(self, level: Level, *, motion: bool) -> Call | None:
        """The call that a block of ``level`` repeats."""
        if (
            self.call is None
            or self.level is not level
            or not (motion or self.call.modal == MODAL_BLOCK)
        ):
            return None
        return self.call
