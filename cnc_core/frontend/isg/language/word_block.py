"""The words of one block: compiled, and as the block says them now."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.frontend.base.scanner import MotionWords

from ..state.call import Call


@dataclass(frozen=True)
class Function:
    """One M or H function; ``offset`` of its letter."""

    number: int
    value: float | None
    offset: int


@dataclass
class Words:
    """Everything one block says.

    ``offsets``: where a word stands, by its letter or ``G`` group.
    """

    motion: MotionWords = field(default_factory=MotionWords)
    functions: dict[str, list[Function]] = field(
        default_factory=lambda: {"M": [], "H": []}
    )
    spindle: float | None = None
    position: float | None = None  # S.POS
    tool: int | None = None
    data: int | None = None
    is_dwell: bool = False
    dwell: float | None = None
    values: dict[int, float] = field(default_factory=dict)  # G..=value
    call: Call | None = None
    arguments: list[float | None] = field(default_factory=list)  # G80 [a, b]
    offsets: dict[str, int] = field(default_factory=dict)
    codes: dict[str, int] = field(default_factory=dict)


Step = Callable[[Words], None]


@dataclass
class WordBlock:
    """The compiled words of one block.

    ``simple``: nothing but a motion in the words that the scanner knows too.
    """

    steps: list[Step] = field(default_factory=list)
    template: MotionWords = field(default_factory=MotionWords)
    offsets: dict[str, int] = field(default_factory=dict)
    codes: dict[str, int] = field(default_factory=dict)
    is_dwell: bool = False
    simple: bool = True
    words: bool = False  # there is a word that is no assignment

    def evaluate(self) -> Words:
        """The words with their present values."""
        template = self.template
        motion = MotionWords(
            offset=template.offset,
            motion=template.motion,
            plane=template.plane,
            absolute=template.absolute,
            inch=template.inch,
            centre_absolute=template.centre_absolute,
            exact_stop=template.exact_stop,
            block_stop=template.block_stop,
        )
        words = Words(
            motion,
            offsets=self.offsets,
            codes=self.codes,
            is_dwell=self.is_dwell,
        )
        for step in self.steps:
            step(words)
        return words
