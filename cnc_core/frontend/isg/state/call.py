"""A subprogram call, and the cycle call that is repeated behind later blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

from cnc_core.frontend.base.flow import Level
from cnc_core.frontend.base.variables import Value

MODAL_MOVE, MODAL_BLOCK = "MODAL_MOVE", "MODAL_BLOCK"


@dataclass(frozen=True)
class Call:
    """``local``: of the same file.

    ``arguments``: @P values of a cycle call, None for plain calls.

    ``offsets``: of each @P in the block.  ``pattern``, ``retract``: PATTERN_ID
    and PATTERN_RETRACT. ``modal``: MODAL_MOVE, MODAL_BLOCK or empty.
    """

    name: str
    local: bool
    offset: int
    arguments: dict[int, Value] | None = None
    offsets: dict[int, int] = field(default_factory=dict)
    pattern: int | None = None
    retract: float | None = None
    modal: str = ""


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
