"""Words of one block: what is programmed, and its values when it is executed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

Number = Callable[[], float]


@dataclass
class WordBlock:
    """``g``: (number, offset, index in brackets).

    ``values``: by word.  ``named``: axis letters without a value.

    ``signs``: 1 or -1 by axis letter (``Z+``).  ``m``: (number, offset, an axis
    word stands before).  ``hm``: macro number, offset and its arguments.
    """

    n: int = 0
    g: list[tuple[int, int, Number | None]] = field(default_factory=list)
    values: dict[str, Number] = field(default_factory=dict)
    named: dict[str, int] = field(default_factory=dict)
    signs: dict[str, float] = field(default_factory=dict)
    offsets: dict[str, int] = field(default_factory=dict)
    m: list[tuple[int, int, bool]] = field(default_factory=list)
    hm: tuple[int, int, list[Number]] | None = None
    assignments: list[tuple[Callable[[float], None], Number]] = field(
        default_factory=list
    )
    indexed: dict[str, tuple[Number, Number, int]] = field(default_factory=dict)
    ending: bool = False

    @property
    def empty(self) -> bool:
        return not (
            self.g
            or self.values
            or self.named
            or self.signs
            or self.m
            or self.hm
            or self.indexed
        )


@dataclass
class Words:
    """A block's words with their values.  ``used``: words that a function has taken."""

    block: WordBlock
    values: dict[str, float]
    indices: dict[int, float]
    used: set[str] = field(default_factory=set)

    @property
    def codes(self) -> dict[int, int]:
        """Offset by G function."""
        return {code: offset for code, offset, _ in self.block.g}

    def offset(self, name: str) -> int:
        return self.block.offsets.get(name, 0)

    def take(self, name: str) -> float | None:
        self.used.add(name)
        return self.values.get(name)
