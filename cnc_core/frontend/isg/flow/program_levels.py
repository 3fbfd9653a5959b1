"""Program levels of the dialect: % lines, calls and returns, program ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.frontend.base.block_text import (
    BlockText,
    PhysicalLine,
    read_block,
)
from cnc_core.frontend.base.flow import Level, Mark
from cnc_core.frontend.base.lexer import TokenStream, fail
from cnc_core.frontend.base.reader import BlockReader
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.port import Wait

from ..language.calls import Finder, LevelData, local_name
from ..language.g_functions import GFunctions
from ..language.text import PROGRAMS, comment_depth, head_of
from ..state.call import Call
from ..state.state import ProgramState
from .control import Control
from .search import Searcher

NAME_CHARACTERS = 83
Items = Sequence[Row | Wait]
Run = Callable[[], Items]


class ProgramLevels(BlockReader):
    """The part of the front end that knows where programs begin and end."""

    state: ProgramState
    control: Control
    _give_back: Callable[[GFunctions], list[Row]]
    _finder: Finder
    _searcher: Searcher
    _declaring: bool

    @property
    def program_name(self) -> str | None:
        """Of the main program, if it has one."""
        return self._main.name or None

    @property
    def _main(self) -> Level:
        return self.flow.levels[0]

    @property
    def _data(self) -> LevelData:
        data: LevelData = self.flow.level.user
        return data

    def _warn_at(self, code: int, text: str, offset: int) -> None:
        block = self.block_now
        self._warn(
            code,
            text,
            block.place(offset)
            if block is not None
            else Place(str(self.flow.file.path)),
        )

    # % lines

    def _program_line(self, stream: TokenStream) -> Run:
        """A % line.

        ``%NAME`` opens the main program of a file, ``%L NAME`` a local
        subprogram. Any other % line ends the level.
        """
        offset, mark = stream.next().offset, self.mark
        name = stream.text[offset + 1 :].strip()

        def run() -> Items:
            data, local = self._data, local_name(stream.text)
            if data.local or data.named or (local is None and self._began()):
                return self._next_program(name, local, offset)
            if local is not None:
                if self._began():
                    return self._next_program(name, local, offset)
                self._skip_local(name)
                return ()
            if len(name) > NAME_CHARACTERS:
                raise fail(
                    900012,
                    f"program name longer than {NAME_CHARACTERS} characters",
                    offset,
                )
            data.named = True
            self.flow.level.start = mark
            self.flow.level.name = name
            return ()

        return run

    def _began(self) -> bool:
        """A command stands before: the text up to here is a program without a name."""
        data = self._data
        return bool(data.statements or self.modal.programmed > data.programmed)

    def _next_program(self, name: str, local: str | None, offset: int) -> Items:
        """The level ends at a later % line."""
        data = self._data
        if local is None and not data.local:
            if not data.named:
                raise fail(
                    900017,
                    f"%{name}: a command stands before the first program definition",
                    offset,
                )
            if self.state.lenient:
                self._warn_at(
                    907040,
                    f"%{name} inside the program is taken as a comment",
                    offset,
                )
                return ()
            self._warn_at(900020, f"the main program ends at %{name}", offset)
        self._check_nesting(self.control.check_closed)
        self._level_end()
        return ()

    def _skip_local(self, name: str) -> None:
        """A local subprogram in front of the main program: on to the next % line."""
        source, line = self._source, self.modal.line + self._lines_left
        before, comment = source.position, 0
        while True:
            line += source.hop(PROGRAMS)
            mark = Mark(source.position, line)
            block = read_block(source, line)
            if block is None:
                source.seek(before)
                raise fail(
                    907033,
                    f"%{name} is the last program of the file, and there is no main program",
                    0,
                )
            line += block.lines_read
            head = head_of(block.text)
            comment = comment_depth(head, comment)
            if head.sign == "%" and not comment:
                source.seek(before)
                self.flow.skip(mark)
                return

    # calls and ends

    def _call(self, call: Call, rows: list[Row]) -> None:
        modal = self.state.modal_cycle
        try:
            if (
                call.arguments is not None
                and modal.call not in (None, call)
                and not self._in_cycle()
            ):
                raise fail(
                    21381,
                    f"{ERRORS[21381]}: end it with #DISABLE MODAL CYCLE",
                    call.offset,
                )
            level = self._finder.level(call)
            if level is not None:
                self.flow.call(level)
        except CncError as error:
            self._queue.extend(rows)
            for each in (error, *error.also):
                each.place.column = each.place.column or call.offset
            raise
        if call.modal:
            modal.select(call, self.flow.level)

    def _in_cycle(self) -> bool:
        """A cycle is being executed above the level of the modal cycle."""
        levels = self.flow.levels
        first = next(
            (
                i
                for i, level in enumerate(levels)
                if level is self.state.modal_cycle.level
            ),
            0,
        )
        return any(
            level.user.arguments is not None for level in levels[first + 1 :]
        )

    def _move(self) -> None:
        """Scopes follow the program levels."""
        depth, left = len(self.flow.levels), self.flow.level
        super()._move()
        if len(self.flow.levels) > depth:
            data = self._data
            data.programmed = self.modal.programmed
            self.state.store.push(data.arguments)
        elif len(self.flow.levels) < depth:
            self.state.store.pop()
            if self.state.modal_cycle.level is left:
                self.state.modal_cycle.deselect()
            if left.user.saved is not None:
                self._queue.extend(self._give_back(left.user.saved))

    def _level_end(self) -> None:
        """M17, M29."""
        if len(self.flow.levels) > 1:
            self.flow.leave()
        else:
            self._end()

    def _program_end(self) -> None:
        """M02, M30."""
        if len(self.flow.levels) > 1:
            self._warn_at(
                907032,
                "M02 or M30 inside a subprogram ends the whole program",
                0,
            )
        self._end()

    def _end(self) -> None:
        """The program is over."""
        if not self._ended and (why := self.state.channel.contouring.at_end()):
            self._warn_at(120206, why, 0)
        self._ended = True
        if self._collect and len(self.flow.levels) == 1:
            self._check_uncalled()

    def _check_uncalled(self) -> None:
        """Local subprograms of the main file that nobody has called."""
        file = self._main.file
        for mark in self._finder.locals_of(file).values():
            if (file.number, mark) not in self._finder.called:
                self.flow.level.start = mark
                self._check_nesting(partial(self._searcher.check_closed, mark))

    def _all_closed(self) -> None:
        self.control.check_closed()
        if self._declaring:
            self._declaring = False
            raise fail(907021, "#VAR without #ENDVAR", 0)

    def _check_nesting(self, check: Callable[[], None]) -> None:
        """Report open statements at the end of a level; the level ends."""
        try:
            check()
        except CncError as error:
            last = PhysicalLine(0, max(1, self.modal.line), "")
            self._error(
                error, BlockText(str(self.flow.file.path), lines=[last])
            )

    def _level_ended(self) -> None:
        """The end of the file, or of its part."""
        self._check_nesting(self._all_closed)
        super()._level_ended()
        if self._ended:
            self._end()
