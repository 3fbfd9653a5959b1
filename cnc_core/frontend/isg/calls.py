"""Subprogram calls: ``L``, ``LL``, ``L CYCLE``, G80 and the like; finding what they call."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cnc_core.errors import CncError
from cnc_core.frontend.base.block_text import read_block
from cnc_core.frontend.base.flow import START, Level, Mark, ProgramFile
from cnc_core.frontend.base.formula import text_of
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.variables import Value
from cnc_core.frontend.isg.context import Context
from cnc_core.frontend.isg.formulas import Formulas
from cnc_core.frontend.isg.store import ARGUMENTS_MAX
from cnc_core.frontend.isg.text import PROGRAMS, head_of

NAME = re.compile(r'[^\s();"\],#$]+')
NAME_CHARACTERS, DYNAMIC_CHARACTERS = 83, 80
LOCALS_MAX = 50  # P-CHAN-00505
KEYS = re.compile(r"PATTERN_ID|PATTERN_RETRACT|MODAL_MOVE|MODAL_BLOCK", re.I)


@dataclass(frozen=True)
class Call:
    """``local``: of the same file.  ``arguments``: @P values of a cycle call, None for plain calls."""

    name: str
    local: bool
    offset: int
    arguments: dict[int, Value] | None = None


@dataclass
class LevelData:
    """What the dialect keeps with a program level.

    ``named``: its %NAME line has been read.  ``saved``: modal state that a cycle gives back.
    """

    local: bool = False
    named: bool = False
    statements: int = 0
    programmed: int = 0
    arguments: dict[int, Value] | None = None
    saved: Any = None


class CallParser:
    """Compiles one call; the stream stands at ``L``."""

    def __init__(self, stream: TokenStream, formulas: Formulas, context: Context) -> None:
        self._stream, self._formulas, self._context = stream, formulas, context

    def parse(self, offset: int, letters: str) -> Callable[[], Call]:
        stream, local = self._stream, letters == "LL"
        begin = offset + len(letters)
        if stream.text[begin : begin + 1].isdigit():
            self._context.warn(907040, "subprogram call without a blank behind L", offset)
        while stream.text[begin : begin + 1].isspace():
            begin += 1
        stream.skip_to(begin)
        if stream.is_name("CYCLE") and stream.following.text == "[":
            return self._cycle(local, offset)
        if stream.is_name("SEQUENCE"):
            raise fail(900003, "L SEQUENCE is not supported", offset)
        if stream.current.kind in (Kind.STRING, Kind.VARIABLE):
            return self._dynamic(local, offset)
        found = NAME.match(stream.text, begin)
        if not found:
            raise fail(900004, f"{letters} without a name", offset)
        if len(found[0]) > NAME_CHARACTERS:
            raise fail(900012, f"program name longer than {NAME_CHARACTERS} characters", begin)
        stream.skip_to(found.end())
        call = Call(found[0], local, offset)
        return lambda: call

    def _dynamic(self, local: bool, offset: int) -> Callable[[], Call]:
        name = text_of(self._formulas.expression(), "the name of a subprogram", offset)

        def made() -> Call:
            text = name().strip()
            if not text or len(text) > DYNAMIC_CHARACTERS:
                raise fail(900012, f"program name empty or longer than {DYNAMIC_CHARACTERS} characters", offset)
            return Call(text, local, offset)

        return made

    # L CYCLE [NAME=.. @P1=..]

    def _cycle(self, local: bool, offset: int) -> Callable[[], Call]:
        stream, formulas = self._stream, self._formulas
        stream.next()
        opened = formulas.open()
        name: Callable[[], str] | None = None
        values: dict[int, Callable[[], Value]] = {}
        while not stream.is_op("]"):
            token = stream.current
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            if stream.accept_name("NAME"):
                stream.expect("=", 900010)
                name = self._cycle_name(token.offset)
            elif stream.accept("@"):
                self._argument(values, token.offset)
            else:
                raise self._unknown_key(token.offset)
        formulas.close(opened)
        if name is None:
            raise fail(907034, "L CYCLE without NAME", offset)
        given = name
        return lambda: Call(given(), local, offset, {number: value() for number, value in values.items()})

    def _cycle_name(self, offset: int) -> Callable[[], str]:
        stream = self._stream
        if stream.current.kind in (Kind.STRING, Kind.VARIABLE):
            return text_of(self._formulas.expression(), "NAME", offset)
        found = NAME.match(stream.text, stream.current.offset)
        if not found:
            raise fail(907034, "L CYCLE: NAME is empty", offset)
        stream.skip_to(found.end())
        return lambda: found[0]

    def _argument(self, values: dict[int, Callable[[], Value]], offset: int) -> None:
        stream = self._stream
        if not stream.accept_name("P") or not stream.current.text.isdigit():
            raise fail(907034, "L CYCLE: expected @P and a number", offset)
        number = int(stream.next().text)
        if not 1 <= number <= ARGUMENTS_MAX:
            raise fail(907034, f"@P{number}: the number is not in 1..{ARGUMENTS_MAX}", offset)
        if number in values:
            raise fail(907034, f"@P{number} twice in one call", offset)
        stream.expect("=", 900010)
        values[number] = self._formulas.expression()

    def _unknown_key(self, offset: int) -> CncError:
        found = KEYS.match(self._stream.text, offset)
        if found:
            return fail(900003, f"L CYCLE with {found[0].upper()} is not supported", offset)
        return fail(907034, f"L CYCLE: unknown parameter {self._stream.describe()}", offset)


class Finder:
    """Finds programs: files beside the main program, local subprograms inside a file."""

    def __init__(self, context: Context, folder: Path) -> None:
        self._context, self._folder = context, folder
        self.called: set[tuple[int, Mark]] = set()

    def level(self, call: Call) -> Level:
        """The program level that a call opens; CncError 907030 if there is no such subprogram."""
        data = LevelData(call.local, arguments=call.arguments)
        if call.arguments is not None:
            data.saved = (self._context.executor.feeds.mode, self._context.modal.saved())
        if not call.local:
            return Level(self._file(call), START, user=data)
        file = self._context.flow.file
        known = self.locals_of(file)
        mark = known.get(call.name.upper())
        if mark is None:
            raise fail(907030, f"the file has no local subprogram {call.name}", call.offset)
        self.called.add((file.number, mark))
        return Level(file, mark, call.name, user=data)

    def _file(self, call: Call) -> ProgramFile:
        """Beside the main program first, then beside the calling file."""
        wanted = Path(call.name.replace("\\", "/"))
        folders = [self._folder, self._context.flow.file.path.parent]
        for folder in folders:
            path = folder / wanted
            if path.is_file():
                return self._context.flow.file_of(path)
            other = _other_case(path)
            if other is not None:
                return self._context.flow.file_of(other)
        raise fail(907030, f"subprogram file {call.name} not found beside the program", call.offset)

    def locals_of(self, file: ProgramFile) -> dict[str, Mark]:
        """Local subprograms of a file by name in capitals: places behind their %L lines."""
        known: dict[str, Mark] | None = file.places.get("locals")
        if known is None:
            known = file.places["locals"] = self._search_locals(file)
        return known

    def _search_locals(self, file: ProgramFile) -> dict[str, Mark]:
        source, found, line = file.source, {}, 0
        before = source.position
        source.seek(0)
        while True:
            line += source.hop(PROGRAMS)
            block = read_block(source, line)
            if block is None:
                break
            line += block.lines_read
            name = local_name(head_of(block.text).text)
            if name is not None and name not in found:
                found[name] = Mark(source.position, line)
            if len(found) > LOCALS_MAX:
                raise CncError(907031, f"more than {LOCALS_MAX} local subprograms in {file.path.name}")
        source.seek(before)
        return found


def local_name(text: str) -> str | None:
    """Name in capitals if the block is ``%L NAME``."""
    text = text.strip()
    if text[:2].upper() != "%L" or not text[2:3].isspace():
        return None
    return text[2:].strip().upper() or None


def _other_case(path: Path) -> Path | None:
    """A file of this name in other letters."""
    try:
        return next((p for p in path.parent.iterdir() if p.name.lower() == path.name.lower() and p.is_file()), None)
    except OSError:
        return None


def positional(values: list[float | None]) -> dict[int, Value]:
    """@P1, @P2, ... of G80 [a, b]."""
    return {number: value for number, value in enumerate(values, 1) if value is not None}
