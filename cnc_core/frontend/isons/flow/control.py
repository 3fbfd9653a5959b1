"""IF, LOOP, GOTO, GOSUB: executed by the index of their file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cnc_core.errors import CncError
from cnc_core.frontend.base.block_text import BlockText
from cnc_core.frontend.base.flow import START, Flow, Mark
from cnc_core.frontend.base.lexer import digits, fail

from .index import RESTART, Index, Indexer


@dataclass
class Loop:
    """A loop that is being executed: place of its LOOP, passes left, where its
    body begins.
    """

    position: int
    left: int
    body: Mark


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
        # wrong LOOPs by file and place: a check executes their bodies once
        self._refused: set[tuple[int, int]] = set()

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
        here, visited = self._here(), self._flow.file.places
        key = ("visited", here.position)
        if self._visit is not None and key not in visited:
            visited[key] = target
            self._visit(here, target)
        self._flow.skip(target)

    def _here(self) -> Mark:
        """Behind the block that is being executed."""
        return Mark(self._flow.source.position, self._line())

    def begin_loop(
        self, position: int, count: Callable[[], float], offset: int
    ) -> None:
        try:
            passes = count()
            if not passes.is_integer():
                raise fail(909105, "LOOP: a whole number is expected", offset)
        except CncError:
            self.loop_refused(position)
            raise
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

    def loop_refused(self, position: int) -> None:
        """Of a LOOP that is wrong the END_LOOP is not wrong too."""
        self._refused.add((self._flow.file.number, position))

    def _is_refused(self, position: int) -> bool:
        return (self._flow.file.number, position) in self._refused

    def end_loop(self, position: int) -> None:
        nest: list[Loop] = self._flow.level.nest
        begin = self.index().begins.get(position)
        if begin is None and self._report is not None:
            return
        if begin is not None and self._is_refused(begin):
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
        mark = self.target(name)
        if mark is None:
            return
        inside = [
            position
            for position in self.index().around(mark.position)
            if not self._is_refused(position)
        ]
        nest: list[Loop] = self._flow.level.nest
        kept = [loop for loop in nest if loop.position in inside]
        if len(kept) < len(inside):
            raise fail(
                907024, f"GOTO {name} leads into a LOOP from outside", offset
            )
        nest[:] = kept
        if mark.line >= self._line() or self._jumped_back(offset, True):
            self._flow.jump(mark)

    def target(self, name: str) -> Mark | None:
        """Where a label, or the block of an N number, stands.

        None in a check: the index has told that there is none, or several.
        """
        index = self.index()
        if name in index.labels:
            return index.labels[name]
        if name == RESTART:
            return START
        return index.numbers.get(int(name)) if digits(name) else None
