"""What the control lines of one file say: where branches, loops, labels and the
blocks stand that jumps name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from cnc_core.errors import CncError
from cnc_core.frontend.base.block_text import BlockText, read_line
from cnc_core.frontend.base.flow import Mark, ProgramFile
from cnc_core.frontend.base.lexer import digits, fail
from cnc_core.frontend.base.reader import ERRORS_MAX

from ..base.text import LABEL_SIGNS, head_word, label_of, strip_remark

CONTROL = re.compile(
    rb"^[ \t]*(?:N[ \t]*\d+[ \t]*)?"
    rb"(?:@|IF|ELSE|END_IF|LOOP|END_LOOP|GOTO|GOSUB)",
    re.I | re.M,
)
JUMP = re.compile(
    r"\s*(?:N\s*[0-9]+\s*)?(?:GOTO|GOSUB)(?![A-Z_])\s*@?\s*(\S.*?)\s*$", re.I
)
NUMBER = re.compile(r"[ \t]*N[ \t]*([0-9]+)", re.I)
RESTART = "1"


@dataclass
class Index:
    """Control lines of one file.

    Marks stand behind the lines they name, of ``numbers`` in front of them; keys
    are places of the lines.

    ``branches``: of IF the mark to go to when the condition is false, of ELSE
    the one behind END_IF.  ``loops``: place of END_LOOP and the mark behind it.
    ``labels``, ``numbers``: by name, by block number if a jump names it.
    ``begins``: place of LOOP by place of END_LOOP.
    """

    labels: dict[str, Mark] = field(default_factory=dict)
    numbers: dict[int, Mark] = field(default_factory=dict)
    branches: dict[int, Mark] = field(default_factory=dict)
    loops: dict[int, tuple[int, Mark]] = field(default_factory=dict)
    begins: dict[int, int] = field(default_factory=dict)
    errors: list[tuple[CncError, BlockText]] = field(default_factory=list)

    def around(self, position: int) -> set[int]:
        """Places of the loops in whose body a place lies."""
        return {
            begin
            for begin, (end, _) in self.loops.items()
            if begin < position <= end
        }


class Indexer:
    """Builds the index of one file in one pass over its control lines."""

    def __init__(self, file: ProgramFile) -> None:
        self._source, self._index = file.source, Index()
        # IF, ELSE, LOOP; the blocks of those whose error would be told
        self._open: list[tuple[str, int, BlockText | None]] = []
        # what jumps name: the block that does first, and where in it
        self._named: dict[str, tuple[BlockText, int]] = {}

    def build(self) -> Index:
        source, line = self._source, 0
        before = source.position
        source.seek(0)
        while True:
            line += source.hop(CONTROL)
            position = source.position
            block = read_line(source, line)
            if block is None:
                break
            line += 1
            try:
                self._take(
                    strip_remark(block.text),
                    position,
                    Mark(source.position, line),
                    block,
                )
            except CncError as error:
                self._wrong(error, block)
        for word, _, block in self._open[: ERRORS_MAX + 1]:
            if block is not None:
                self._wrong(fail(907021, f"{word} is not closed", 0), block)
        self._find_targets()
        source.seek(before)
        return self._index

    def _wrong(self, error: CncError, block: BlockText) -> None:
        """One more than a check collects: so it says that there are more."""
        if len(self._index.errors) <= ERRORS_MAX:
            # its traceback holds the frames of the block
            self._index.errors.append((error.with_traceback(None), block))

    def _take(
        self, text: str, position: int, behind: Mark, block: BlockText
    ) -> None:
        jump = JUMP.match(text)
        if jump is not None:
            self._named.setdefault(jump[1].upper(), (block, jump.start(1)))
            return
        name = label_of(text)
        if name is not None:
            self._label(name, behind)
            return
        word = head_word(text)
        if word in ("IF", "LOOP"):
            self._begin(word, position, block)
        elif word == "ELSE":
            begin = self._close("ELSE", ("IF",))
            self._index.branches[begin] = behind
            self._begin(word, position, block)
        elif word == "END_IF":
            self._index.branches[self._close(word, ("IF", "ELSE"))] = behind
        elif word == "END_LOOP":
            begin = self._close(word, ("LOOP",))
            self._index.loops[begin] = (position, behind)
            self._index.begins[position] = begin

    def _begin(self, word: str, position: int, block: BlockText) -> None:
        told = len(self._open) <= ERRORS_MAX
        self._open.append((word, position, block if told else None))

    def _close(self, word: str, openers: tuple[str, ...]) -> int:
        if not self._open or self._open[-1][0] not in openers:
            raise fail(907020, f"{word} without {openers[0]}", 0)
        return self._open.pop()[1]

    def _label(self, name: str, behind: Mark) -> None:
        if not name or LABEL_SIGNS & set(name):
            raise fail(
                909112,
                f"@{name}: a label has a name without blanks and operators",
                0,
            )
        if name in self._index.labels:
            raise fail(907025, f"label {name} exists more than once", 0)
        self._index.labels[name] = behind

    def _find_targets(self) -> None:
        """Each target of a jump is there, and there once."""
        named = {
            name: at
            for name, at in self._named.items()
            if name not in self._index.labels and name != RESTART
        }
        lines = self._find_numbers({int(n) for n in named if digits(n)})
        for name, (block, offset) in named.items():
            found = lines.get(int(name), []) if digits(name) else []
            if len(found) > 1:
                text = (
                    f"block number {int(name)} exists more than once, in lines "
                    f"{found[0]} and {found[1]}"
                )
                self._wrong(fail(907025, text, offset), block)
            elif not found:
                text = f"the file has no label or block number {name}"
                self._wrong(fail(907023, text, offset), block)

    def _find_numbers(self, numbers: set[int]) -> dict[int, list[int]]:
        """The lines of each of these block numbers."""
        if not numbers:
            return {}
        source, line = self._source, 0
        source.seek(0)
        pattern = re.compile(
            rb"^[ \t]*N[ \t]*0*(?:%s)(?![\d.])"
            % b"|".join(b"%d" % number for number in sorted(numbers)),
            re.I | re.M,
        )
        lines: dict[int, list[int]] = {}
        while True:
            line += source.hop(pattern)
            mark = Mark(source.position, line)
            found = NUMBER.match(source.line() or "")
            if found is None:
                return lines
            number = int(found[1])
            self._index.numbers.setdefault(number, mark)
            line += 1
            lines.setdefault(number, []).append(line)
