"""The call patterns of a program: the places of each #PATTERN."""

from __future__ import annotations

from dataclasses import dataclass, field

from cnc_core.errors import CncError, Place
from cnc_core.frontend.base.lexer import fail

UNKNOWN_ID, SYNTAX, ROTATION = 907104, 907105, 907106
ID_MAX = 2**31 - 1


@dataclass(frozen=True)
class At:
    """One place: position, mm, and rotation about Z, degrees."""

    x: float
    y: float
    z: float
    c: float = 0.0


@dataclass
class Patterns:
    """The patterns of one program.

    ``opened``: where the #PATTERN BEGIN stands that has no END yet.
    """

    by_id: dict[int, list[At]] = field(default_factory=dict)
    opened: Place | None = None
    _id: int = 0
    _places: list[At] = field(default_factory=list)

    def begin(self, identity: int, place: Place, offset: int) -> None:
        """#PATTERN BEGIN."""
        self.not_open(offset, "#PATTERN BEGIN")
        self.opened, self._id, self._places = place, identity, []

    def at(self, values: list[float], unit_mm: float, offset: int) -> None:
        """#AT [x, y, z, a, b, c]; lengths in programmed units."""
        if self.opened is None:
            raise fail(
                SYNTAX, "PAT_SYNTAX: #AT outside #PATTERN BEGIN and END", offset
            )
        if not 3 <= len(values) <= 6:
            raise fail(
                SYNTAX,
                f"PAT_SYNTAX: #AT with {len(values)} values: 3 to 6 are expected",
                offset,
            )
        missing = [0.0] * (6 - len(values))
        x, y, z, a, b, c = *values, *missing
        if a or b:
            text = f"PAT_ROTATION: #AT turned by {a:g} about X and {b:g} about Y: only Z is allowed"
            raise fail(ROTATION, text, offset)
        self._places.append(At(x * unit_mm, y * unit_mm, z * unit_mm, c))

    def end(self, offset: int) -> None:
        """#PATTERN END: the pattern is known from here on."""
        if self.opened is None:
            raise fail(
                SYNTAX,
                "PAT_SYNTAX: #PATTERN END without #PATTERN BEGIN",
                offset,
            )
        self.by_id[self._id] = self._places
        self.opened = None

    def delete(self, identity: int | None, offset: int) -> None:
        """#PATTERN DELETE; None: all."""
        self.not_open(offset, "#PATTERN DELETE")
        if identity is None:
            self.by_id.clear()
        elif self.by_id.pop(identity, None) is None:
            raise fail(
                UNKNOWN_ID,
                f"PAT_UNKNOWN_ID: there is no pattern {identity}",
                offset,
            )

    def not_open(self, offset: int, what: str) -> None:
        if self.opened is not None:
            line = self.opened.line
            text = (
                f"PAT_SYNTAX: {what} inside the pattern of line {line}: "
                "only #AT stands there"
            )
            raise fail(SYNTAX, text, offset)

    def at_end(self) -> CncError | None:
        """The error of a program that ends inside a pattern."""
        opened, self.opened = self.opened, None
        return (
            None
            if opened is None
            else CncError(
                SYNTAX, "PAT_SYNTAX: #PATTERN BEGIN without END", opened
            )
        )

    def places(self, identity: int, offset: int) -> list[At]:
        """The places of a pattern for a call."""
        found = self.by_id.get(identity)
        if found is None:
            raise fail(
                UNKNOWN_ID,
                f"PAT_UNKNOWN_ID: there is no pattern {identity}",
                offset,
            )
        if not found:
            raise fail(
                SYNTAX, f"PAT_SYNTAX: pattern {identity} has no places", offset
            )
        return found
