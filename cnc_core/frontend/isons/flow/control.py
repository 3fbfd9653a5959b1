"""IF, LOOP, GOTO, GOSUB over one file: where control lines stand, and which
loops a place lies in.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.errors import CncError
from cnc_core.frontend.base.block_text import BlockText, read_line
from cnc_core.frontend.base.flow import START, Flow, Mark, ProgramFile
from cnc_core.frontend.base.lexer import digits, fail
from cnc_core.frontend.base.reader import ERRORS_MAX

from ..base.text import LABEL_SIGNS, head_word, label_of, strip_remark

CONTROL = re.compile(
    rb"^[ \t]*(?:N[ \t]*\d+[ \t]*)?(?:@|IF|ELSE|END_IF|LOOP|END_LOOP)",
    re.I | re.M,
)
RESTART = "1"


@dataclass
class Loop:
    """A loop that is being executed: place of its LOOP, passes left, where its
    body begins.
    """

    position: int
    left: int
    body: Mark


@dataclass
class Index:
    """Control lines of one file.

    Marks stand behind the lines they name; keys are places of the lines.

    ``branches``: of IF the mark to go to when the condition is false, of ELSE
    the one behind END_IF.  ``loops``: place of END_LOOP and the mark behind it.
    ``labels``: the mark behind.  ``begins``: place of LOOP by place of
    END_LOOP.
    """

    labels: dict[str, Mark] = field(default_factory=dict)
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


class Control:
    """Executes control words.

    ``report`` gets the structural errors of a file, without it the first one is
    raised.

    ``visit`` gets the lines that are skipped.  ``jumped_back``: the program
    repeats lines (offset, whether by GOTO); False: it does not.
    """

    def __init__(
        self,
        flow: Flow,
        line: Callable[[], int],
        report: Callable[[CncError, BlockText], None] | None,
        visit: Callable[[Mark, Mark], None] | None,
        jumped_back: Callable[[int, bool], bool] = lambda *_: True,
    ) -> None:
        self._jumped_back = jumped_back
        self._flow = flow
        self._line = line
        self._report = report
        self._visit = visit

    def index(self) -> Index:
        """Of the file that is being executed."""
        file = self._flow.file
        known: Index | None = file.places.get("index")
        if known is None:
            known = file.places["index"] = Indexer(file).build()
            for error, block in known.errors:
                error.at(block.place(error.place.column))
                if self._report is not None:
                    self._report(error, block)
        if known.errors and self._report is None:
            raise known.errors[0][0]
        return known

    def skip_branch(self, position: int) -> None:
        """IF whose condition is false, or ELSE behind the true branch."""
        self._skip(self.index().branches.get(position))

    def _skip(self, target: Mark | None) -> None:
        if target is None and self._report is not None:
            return  # the index has told it
        if target is None:
            raise fail(
                907021, "the control structure of the program is not closed", 0
            )
        if self._visit is not None:
            self._visit(self._here(), target)
        self._flow.skip(target)

    def _here(self) -> Mark:
        """Behind the block that is being executed."""
        return Mark(self._flow.source.position, self._line())

    def begin_loop(self, position: int, passes: float, offset: int) -> None:
        if not passes.is_integer():
            if self._report is not None:  # its END_LOOP is not wrong too
                self._flow.level.nest.append(Loop(position, 1, self._here()))
            raise fail(909105, "LOOP: a whole number is expected", offset)
        found = self.index().loops.get(position)
        if found is None and self._report is not None:
            return
        if found is None:
            raise fail(907021, "LOOP without END_LOOP", offset)
        if passes < 1:
            self._skip(found[1])
            return
        self._flow.level.repeats = True
        self._flow.level.nest.append(
            Loop(
                position,
                int(passes),
                self._here(),
            )
        )

    def end_loop(self, position: int) -> None:
        nest: list[Loop] = self._flow.level.nest
        begin = self.index().begins.get(position)
        if begin is None and self._report is not None:
            return
        if not nest or nest[-1].position != begin:
            raise fail(907020, "END_LOOP: its LOOP is not being executed", 0)
        nest[-1].left -= 1
        if nest[-1].left > 0:
            self._jumped_back(0, False)
            self._flow.jump(nest[-1].body)
        else:
            nest.pop()

    def jump(self, name: str, offset: int) -> None:
        """GOTO."""
        mark = self.target(name, offset)
        inside = self.index().around(mark.position)
        nest: list[Loop] = self._flow.level.nest
        kept = [loop for loop in nest if loop.position in inside]
        if len(kept) < len(inside):
            raise fail(
                907024, f"GOTO {name} leads into a LOOP from outside", offset
            )
        nest[:] = kept
        if mark.line >= self._line() or self._jumped_back(offset, True):
            self._flow.jump(mark)

    def target(self, name: str, offset: int) -> Mark:
        """Where a label, or the block of an N number, stands."""
        found = self.index().labels.get(name)
        if found is None and name == RESTART:
            return START
        if found is None and digits(name):
            found = self._numbered(int(name))
        if found is None:
            raise fail(
                907023, f"the file has no label or block number {name}", offset
            )
        return found

    def _numbered(self, number: int) -> Mark | None:
        file = self._flow.file
        key = ("N", number)
        if key not in file.places:
            file.keep_place(key, self._search(file, number))
        mark: Mark | None = file.places[key]
        return mark

    def _search(self, file: ProgramFile, number: int) -> Mark | None:
        """The mark in front of the block."""
        source = file.source
        before = source.position
        source.seek(0)
        block = re.compile(
            rb"^[ \t]*N[ \t]*0*%d(?![\d.])" % number, re.I | re.M
        )
        line = source.hop(block)
        mark = None if source.exhausted else Mark(source.position, line)
        twice = False
        if mark is not None:
            source.line()
            line += 1 + source.hop(block)
            twice = not source.exhausted
        source.seek(before)
        if twice:
            raise fail(
                907025,
                f"block number {number} exists more than once, "
                f"again in line {line + 1}",
                0,
            )
        return mark
