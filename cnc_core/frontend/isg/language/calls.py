"""Subprogram calls (``L``, ``LL``, ``L CYCLE``, G80 ..) and the search for
programs.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cnc_core.errors import CncError
from cnc_core.frontend.base.block_text import read_block
from cnc_core.frontend.base.flow import START, Level, Mark, ProgramFile
from cnc_core.frontend.base.formula import Constant, Formula, text_of
from cnc_core.frontend.base.lexer import Kind, TokenStream, digits, fail
from cnc_core.frontend.base.variables import Value

from ..cycles import registry
from ..cycles.checking import glance
from ..cycles.running import CycleRunner
from ..state.call import MODAL_BLOCK, MODAL_MOVE, Call
from ..state.patterns import ID_MAX
from ..state.state import ProgramState
from ..state.store import ARGUMENTS_MAX
from .formulas import Formulas
from .g_functions import GFunctions
from .text import PROGRAMS, comment_depth, head_of

NAME = re.compile(r'[^\s();"\],#$]+')
NAME_CHARACTERS, DYNAMIC_CHARACTERS = 83, 80
LOCALS_MAX = 50  # P-CHAN-00505
MODAL = {
    "MODAL_MOVE": MODAL_MOVE,
    "MODAL_BLOCK": MODAL_BLOCK,
    "MODAL": MODAL_MOVE,
}


@dataclass
class LevelData:
    """Data that the dialect keeps with a program level.

    ``named``: its %NAME line has been read.
    ``saved``: the G functions that a cycle gives back.
    """

    local: bool = False
    named: bool = False
    statements: int = 0
    programmed: int = 0
    arguments: dict[int, Value] | None = None
    saved: GFunctions | None = None


class CallParser:
    """Compiles one call; the stream stands at ``L``."""

    def __init__(
        self, stream: TokenStream, formulas: Formulas, state: ProgramState
    ) -> None:
        self._stream, self._formulas, self._state = stream, formulas, state

    def parse(self, offset: int, letters: str) -> Callable[[], Call]:
        stream, local = self._stream, letters == "LL"
        begin = offset + len(letters)
        if digits(stream.text[begin : begin + 1]):
            self._state.warn(
                907040, "subprogram call without a blank behind L", offset
            )
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
            raise fail(
                900012,
                f"program name longer than {NAME_CHARACTERS} characters",
                begin,
            )
        stream.skip_to(found.end())
        call = Call(found[0], local, offset)
        return lambda: call

    def _dynamic(self, local: bool, offset: int) -> Callable[[], Call]:
        name = text_of(
            self._formulas.expression(), "the name of a subprogram", offset
        )

        def made() -> Call:
            text = name().strip()
            if not text or len(text) > DYNAMIC_CHARACTERS:
                raise fail(
                    900012,
                    f"program name empty or longer than {DYNAMIC_CHARACTERS} characters",
                    offset,
                )
            return Call(text, local, offset)

        return made

    # L CYCLE [NAME=.. @P1=..]

    def _cycle(self, local: bool, offset: int) -> Callable[[], Call]:
        stream, formulas = self._stream, self._formulas
        stream.next()
        opened = formulas.open()
        name: Callable[[], str] | None = None
        values: dict[int, Callable[[], Value]] = {}
        offsets: dict[int, int] = {}
        keys: dict[str, Callable[[], float]] = {}
        modal = ""
        while not stream.is_op("]"):
            token = stream.current
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            if name is None and stream.accept_name("NAME"):
                stream.expect("=", 900010)
                name = self._cycle_name(token.offset)
            elif stream.accept("@"):
                offsets[self._argument(values, token.offset)] = token.offset
            elif stream.accept_name("PATTERN_ID", "PATTERN_RETRACT"):
                self._pattern_key(keys, token.text.upper(), token.offset)
            elif stream.accept_name(*MODAL):
                modal = self._modal_key(modal, token.text.upper(), token.offset)
            else:
                raise self._no_parameter()
        formulas.close(opened)
        if name is None:
            raise fail(907034, "L CYCLE without NAME", offset)
        given = name
        if modal and keys:
            raise fail(907034, "L CYCLE: a call pattern is not modal", offset)
        identity, retract = keys.get("PATTERN_ID"), keys.get("PATTERN_RETRACT")
        if retract and not identity:
            raise fail(
                907034, "L CYCLE: PATTERN_RETRACT without PATTERN_ID", offset
            )

        if self._state.visiting:
            self._glance(given, values, offsets, offset)

        def made() -> Call:
            arguments = {number: value() for number, value in values.items()}
            pattern = (
                None if identity is None else pattern_id(identity(), offset)
            )
            plane = None if retract is None else retract()
            return Call(
                given(),
                local,
                offset,
                arguments,
                offsets,
                pattern,
                plane,
                modal,
            )

        return made

    def _glance(
        self,
        name: Callable[[], str],
        values: dict[int, Formula],
        offsets: dict[int, int],
        offset: int,
    ) -> None:
        """Check a call that the program does not reach, as far as its values
        are known.
        """
        try:
            cycle = (
                None if self._state.has_file(name()) else registry.find(name())
            )
        except CncError:
            return  # the name is in a variable
        if cycle is None:
            return
        known = {
            number: value.value if isinstance(value, Constant) else None
            for number, value in values.items()
        }
        problems = [
            fail(p.code, p.text, offsets.get(p.number, offset))
            for p in glance(cycle, known)
        ]
        if problems:
            first, *first.also = problems
            raise first

    def _pattern_key(
        self, keys: dict[str, Callable[[], float]], key: str, offset: int
    ) -> None:
        if key in keys:
            raise fail(907034, f"{key} twice in one call", offset)
        self._stream.expect("=", 900010)
        keys[key] = self._formulas.number(key, offset)

    def _modal_key(self, modal: str, key: str, offset: int) -> str:
        if modal:
            raise fail(907034, f"{key}: the call is modal already", offset)
        if key == "MODAL":
            self._state.warn(
                907040, "MODAL is an old name of MODAL_MOVE", offset
            )
        return MODAL[key]

    def _no_parameter(self) -> CncError:
        token = self._stream.current
        why = (
            "NAME twice in one call"
            if token.text.upper() == "NAME"
            else f"L CYCLE: unknown parameter {self._stream.describe()}"
        )
        return fail(907034, why, token.offset)

    def _cycle_name(self, offset: int) -> Callable[[], str]:
        stream = self._stream
        if stream.current.kind in (Kind.STRING, Kind.VARIABLE):
            return text_of(self._formulas.expression(), "NAME", offset)
        found = NAME.match(stream.text, stream.current.offset)
        if not found:
            raise fail(907034, "L CYCLE: NAME is empty", offset)
        stream.skip_to(found.end())
        return lambda: found[0]

    def _argument(
        self, values: dict[int, Callable[[], Value]], offset: int
    ) -> int:
        """Its number."""
        stream = self._stream
        if not stream.accept_name("P") or not digits(stream.current.text):
            raise fail(907034, "L CYCLE: expected @P and a number", offset)
        number = int(stream.next().text)
        if not 1 <= number <= ARGUMENTS_MAX:
            raise fail(
                907034,
                f"@P{number}: the number is not in 1..{ARGUMENTS_MAX}",
                offset,
            )
        if number in values:
            raise fail(907034, f"@P{number} twice in one call", offset)
        stream.expect("=", 900010)
        values[number] = self._formulas.expression()
        return number


class Finder:
    """Finds programs: files beside the main program, local subprograms inside a
    file.
    """

    def __init__(
        self, state: ProgramState, folder: Path, cycles: CycleRunner
    ) -> None:
        self._state, self._folder = state, folder
        self._cycles = cycles
        self.called: set[tuple[int, Mark]] = set()
        self._places: dict[tuple[str, Path], Path | None] = {}

    def level(self, call: Call) -> Level | None:
        """The program level that a call opens, None if the call is over at
        once.

        CncError 907030: no such subprogram. Wrong parameters of a cycle have
        errors of their own.
        """
        if call.pattern is not None:
            return self._made(
                self._cycles.start_pattern(call, lambda: self._check(call)),
                call,
            )
        cycle = (
            None
            if call.local or call.arguments is None
            else registry.find(call.name)
        )
        if cycle is None or self._found(call) is not None:
            return self._level(call)
        file = self._cycles.start(cycle, call)
        return None if file is None else self._made(file, call)

    def _made(self, file: ProgramFile, call: Call) -> Level:
        """The level of a program that stands in no file."""
        return Level(
            file,
            START,
            file.path.name.strip("<>").partition(",")[0],
            user=self._data(call),
        )

    def _check(self, call: Call) -> None:
        """The cycle exists and takes these parameters."""
        cycle = None if call.local else registry.find(call.name)
        if cycle is None or self._found(call) is not None:
            self._level(call)
        else:
            self._cycles.checked(cycle, call)

    def _data(self, call: Call) -> LevelData:
        data = LevelData(call.local, arguments=call.arguments)
        if call.arguments is not None:
            data.saved = GFunctions.of(self._state)
        return data

    def _level(self, call: Call) -> Level:
        data = self._data(call)
        if not call.local:
            return Level(self._file(call), START, user=data)
        file = self._cycles.owner.get(
            self._state.flow.file.number, self._state.flow.file
        )
        known = self.locals_of(file)
        mark = known.get(call.name.upper())
        if mark is None:
            raise fail(
                907030,
                f"the file has no local subprogram {call.name}",
                call.offset,
            )
        self.called.add((file.number, mark))
        return Level(file, mark, call.name, user=data)

    def has_file(self, name: str) -> bool:
        """A file of this name would be called."""
        return self._found(Call(name, False, 0)) is not None

    def _file(self, call: Call) -> ProgramFile:
        """Beside the main program first, then beside the calling file."""
        found = self._found(call)
        if found is None:
            raise fail(
                907030,
                f"subprogram file {call.name} not found beside the program",
                call.offset,
            )
        return self._state.flow.file_of(found)

    def _found(self, call: Call) -> Path | None:
        """The place of the file, looked up once for a name and a calling
        folder.
        """
        key = call.name, self._state.flow.file.path.parent
        if key not in self._places:
            self._places[key] = self._look_up(call)
        return self._places[key]

    def _look_up(self, call: Call) -> Path | None:
        flow = self._state.flow
        try:
            for folder in (self._folder, flow.file.path.parent):
                path = flow.folders.place(call.name, folder)
                found = path if flow.folders.has(path) else _other_case(path)
                if found is not None and flow.folders.has(found):
                    return found
        except CncError as error:
            if registry.find(call.name) is None:
                raise fail(error.code, error.text, call.offset) from None
        return None

    def locals_of(self, file: ProgramFile) -> dict[str, Mark]:
        """Local subprograms of a file by name in capitals: places behind their
        %L lines.
        """
        known: dict[str, Mark] | None = file.places.get("locals")
        if known is None:
            known = file.places["locals"] = self._search_locals(file)
        return known

    def _search_locals(self, file: ProgramFile) -> dict[str, Mark]:
        source, found, line, comment = file.source, {}, 0, 0
        before = source.position
        source.seek(0)
        while True:
            line += source.hop(PROGRAMS)
            block = read_block(source, line)
            if block is None:
                break
            line += block.lines_read
            head = head_of(block.text)
            comment = comment_depth(head, comment)
            name = None if comment else local_name(head.text)
            if name is not None and name not in found:
                found[name] = Mark(source.position, line)
            if len(found) > LOCALS_MAX:
                raise CncError(
                    907031,
                    f"more than {LOCALS_MAX} local subprograms in {file.path.name}",
                )
        source.seek(before)
        return found


def pattern_id(value: float, offset: int) -> int:
    """A pattern's number: whole, not negative."""
    if abs(value - round(value)) > 1e-9 or not 0 <= round(value) <= ID_MAX:
        raise fail(
            900012,
            f"pattern ID {value:g}: a whole number 0..{ID_MAX} is expected",
            offset,
        )
    return round(value)


def local_name(text: str) -> str | None:
    """Name in capitals if the block is ``%L NAME``."""
    text = text.strip()
    if text[:2].upper() != "%L" or not text[2:3].isspace():
        return None
    return text[2:].strip().upper() or None


def _other_case(path: Path) -> Path | None:
    """A file of this name in other letters."""
    try:
        return next(
            (
                p
                for p in path.parent.iterdir()
                if p.name.lower() == path.name.lower()
            ),
            None,
        )
    except OSError:
        return None


def positional(values: list[float | None]) -> dict[int, Value]:
    """@P1, @P2, ... of G80 [a, b]."""
    return {
        number: value
        for number, value in enumerate(values, 1)
        if value is not None
    }
