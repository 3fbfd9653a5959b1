"""Instructions: blocks that begin with a word of their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from cnc_core.blocks import DWELL
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail, shown
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.port import Wait

from ..base import parameters
from ..base.text import word_or_text
from ..base.words import Number
from ..language.formulas import (
    BEHIND_MOTION,
    LIVE,
    Formulas,
    variable_name,
)
from ..operator.dialogs import Dialogs
from . import levels
from .files import inside, numbers_of
from .program import Program

Items = Sequence[Row | Wait]
Run = Callable[[], Items]
POLL_S = 0.01
LINE = "\n"


class Instructions:
    """Compiles the instruction at the head of one block; ``drain``: everything
    before has to be executed first.
    """

    def __init__(
        self, program: Program, stream: TokenStream, formulas: Formulas
    ) -> None:
        self._program, self._stream = program, stream
        self._formulas = formulas
        self.drain = False
        self.live = 0
        self._start = 0

    def parse(self) -> Run | None:
        """What the block does; None if it does not begin with an instruction."""
        token = self._stream.current
        name = token.text.upper() if token.kind is Kind.NAME else ""
        make = TABLE.get(name)
        if name in _POSITIONERS and self._stream.following.text == "[":
            make = _POSITIONERS[name]
        if make is None:
            return self._dialog(name, token.offset)
        self._start = token.offset
        self._stream.next()
        if name in _STRUCTURE:
            self._program.control.index()
        return self._whole(name, make(self))

    def _dialog(self, name: str, offset: int) -> Run | None:
        """LIB_.."""
        if not name.startswith("LIB_"):
            return None
        self._stream.next()
        # they appear when the machine has come there
        self.drain = name in ("LIB_MESSAGE", "LIB_SHOWFORM")
        run = Dialogs(
            self._program.forms, self._stream, self._formulas, offset
        ).parse(name)
        if run is None:
            raise fail(900002, f"unknown instruction {name}", offset)
        return self._whole(name, run)

    def _whole(self, name: str, run: Run) -> Run:
        """Nothing stands behind an instruction."""
        if not self._stream.at_end:
            text = f"unexpected {self._stream.current.text!r} behind {name}"
            raise fail(900010, text, self._stream.current.offset)
        return run

    # arguments

    def _comma(self) -> None:
        self._stream.accept(",")

    def _name(self, what: str) -> str:
        return word_or_text(self._stream, what)

    def _variable(self) -> str:
        token = self._stream.next()
        if token.kind is not Kind.VARIABLE or variable_name(
            token.text
        ).startswith("_"):
            raise fail(
                900010,
                f"a user variable is expected, found {shown(token.text)}",
                token.offset,
            )
        return variable_name(token.text)

    def _simple(self, act: Callable[[], None]) -> Run:
        def run() -> Items:
            act()
            return ()

        return run

    # program flow

    def _if(self) -> Run:
        condition = self._formulas.full("IF")
        control = self._program.control
        mark = self._program.mark
        self._stream.accept_name("THEN")
        return self._simple(
            lambda: None if condition() else control.skip_branch(mark.position)
        )

    def _else(self) -> Run:
        mark = self._program.mark
        return self._simple(
            lambda: self._program.control.skip_branch(mark.position)
        )

    def _end_if(self) -> Run:
        return self._simple(lambda: None)

    def _loop(self) -> Run:
        token, mark = self._stream.current, self._program.mark
        literal = (
            token.kind is Kind.NUMBER
            and "." in token.text
            and self._stream.following.kind is Kind.END
        )
        passes = self._formulas.full("LOOP")
        if literal:  # a floating number, even if it is whole
            return self._simple(
                lambda: self._program.control.begin_loop(
                    mark.position, lambda: math.nan, token.offset
                )
            )
        return self._simple(
            lambda: self._program.control.begin_loop(
                mark.position, passes, token.offset
            )
        )

    def _end_loop(self) -> Run:
        mark = self._program.mark
        return self._simple(
            lambda: self._program.control.end_loop(mark.position)
        )

    def _label(self) -> tuple[str, int]:
        stream, offset = self._stream, self._stream.current.offset
        name = stream.text[offset:].strip()
        while not stream.at_end:
            stream.next()
        name = name.removeprefix("@").strip().upper()
        if not name:
            raise fail(900010, "a label is expected", offset)
        return name, offset

    def _goto(self) -> Run:
        name, offset = self._label()
        return self._simple(lambda: self._program.control.jump(name, offset))

    def _gosub(self) -> Run:
        name, offset = self._label()
        return self._simple(
            lambda: levels.call_subroutine(self._program, name, offset)
        )

    def _return(self) -> Run:
        return self._simple(
            lambda: levels.return_from_subroutine(self._program, self._start)
        )

    def _end_program(self) -> Run:
        return self._simple(self._program.end_program)

    def _import(self) -> Run:
        name = self._name("a file name")
        return self._simple(
            lambda: levels.call_import(self._program, name, self._start)
        )

    def _end_import(self) -> Run:
        return self._simple(
            lambda: levels.end_import(self._program, self._start)
        )

    def _error(self) -> Run:
        code = self._formulas.full("ERROR")

        def run() -> Items:
            raise fail(
                909130, f"ERROR {code():g}: {ERRORS[909130]}", self._start
            )

        return run

    def _wait_input(self) -> Run:
        arguments = self._arguments(4)
        mark, waits = self._program.mark, self._program.waits
        self.live = LIVE | BEHIND_MOTION

        def run() -> Items:
            number, state, seconds, alarm = (value() for value in arguments)
            if number not in range(256) or state not in (0, 1):
                raise fail(
                    900012,
                    "WAIT_INPUT: input 0..255 and state 0 or 1 are expected",
                    self._start,
                )
            if seconds < 0:
                raise fail(
                    900012,
                    f"WAIT_INPUT: the time {seconds:g} s is negative",
                    self._start,
                )
            if not self._program.answers:
                return ()  # nobody moves the inputs: it is taken as come true
            now = self._program.clock.now_s()
            begun = waits.setdefault(mark.position, now)
            if self._program.system.shared.read("I", int(number)) == state:
                waits.pop(mark.position)
                return ()
            if seconds > 0 and now - begun >= seconds - 1e-9:
                waits.pop(mark.position)
                if alarm:
                    text = (
                        f"alarm {alarm:g}: WAIT_INPUT {number:g} {state:g}: "
                        f"not within {seconds:g} s"
                    )
                    raise fail(909131, text, self._start)
                return ()
            self._program.flow.jump(mark)
            return (*self._program.held_rows(), Wait.CYCLE)

        return run

    def _arguments(self, count: int) -> list[Number]:
        found = []
        for i in range(count):
            if i:
                self._comma()
            found.append(self._formulas.argument("argument"))
        return found

    # variables

    def _dim(self) -> Run:
        made = []
        while not self._stream.at_end:
            name = self._variable()
            made.append((name, self._formulas.index(name)))
            self._comma()

        def run() -> Items:
            for name, size in made:
                levels.dimension(self._program, name, size(), self._start)
            return ()

        return run

    def _names(self) -> list[str]:
        names = []
        while not self._stream.at_end:
            names.append(self._variable())
            self._comma()
        if not names:
            raise fail(900010, "a variable is expected", self._start)
        return names

    def _global(self) -> Run:
        names = self._names()

        def run() -> Items:
            for name in names:
                self._program.store.share(name)
            return ()

        return run

    def _marker(self) -> Run:
        name = self._variable()
        self._comma()
        if not self._stream.at_end:
            self._name("a description")
        return self._simple(lambda: self._program.store.declare(name))

    def _get(self) -> Run:
        targets = []
        while not self._stream.at_end:
            targets.append(self._formulas.target())
            self._comma()

        def run() -> Items:
            arguments = levels.macro_arguments(self._program, self._start)
            for target in targets:
                if not arguments:
                    raise fail(909121, ERRORS[909121], self._start)
                target(arguments.pop())
            return ()

        return run

    def _angles(self, degrees: bool) -> Run:
        return self._simple(
            lambda: setattr(self._program.system, "degrees", degrees)
        )

    # the variable list

    def _load_var(self) -> Run:
        name = self._name("a file name")

        def run() -> Items:
            text = self._program.text_of(name, self._start)
            if text is None:
                raise fail(
                    901001, f"LOAD_VAR: file not found: {name}", self._start
                )
            self._program.count_values(len(text) // 2)
            self._program.store.list = numbers_of(name, text, self._start)
            return ()

        return run

    def _save_var(self) -> Run:
        name = self._name("a file name")

        def run() -> Items:
            self._program.count_values(len(self._program.store.list))
            text = "".join(
                f"{value!r}{LINE}" for value in self._program.store.list
            )
            self._program.write_file(inside(name, self._start), text)
            return ()

        return run

    def _file_exists(self) -> Run:
        target = self._formulas.target()
        self._comma()
        name = self._name("a file name")
        text = self._program.text_of
        return self._simple(
            lambda: target(float(text(name, self._start) is not None))
        )

    def _get_var(self) -> Run:
        target = self._formulas.target()
        self._comma()
        index = self._formulas.full("index")
        store = self._program.store
        return self._simple(
            lambda: target(store.list[store.list_place(index(), self._start)])
        )

    def _write_var(self) -> Run:
        value = self._formulas.argument("value")
        self._comma()
        index = self._formulas.full("index")
        store = self._program.store

        def run() -> Items:
            store.list[store.list_place(index(), self._start)] = value()
            return ()

        return run

    def _add_var(self) -> Run:
        value = self._formulas.full("ADD_VAR")
        return self._simple(lambda: self._program.store.list.append(value()))

    def _remove_var(self) -> Run:
        index = self._formulas.full("index")
        store = self._program.store

        def run() -> Items:
            del store.list[store.list_place(index(), self._start)]
            return ()

        return run

    def _clear_var(self) -> Run:
        return self._simple(
            lambda: self._program.store.resize_list(0.0, self._start)
        )

    def _dim_var(self) -> Run:
        size = self._formulas.full("DIM_VAR")
        return self._simple(
            lambda: self._program.store.resize_list(size(), self._start)
        )

    def _count_var(self) -> Run:
        target = self._formulas.target()
        return self._simple(
            lambda: target(float(len(self._program.store.list)))
        )

    # machine

    def _opt(self) -> Run:
        name = self._name("an event").upper()
        self._comma()
        value = self._formulas.argument("OPT")

        def run() -> Items:
            macros, number = self._program.macros, value()
            macros.set_event(name, number, self._start)
            if number >= 0 and macros.find("M", int(number)) is None:
                text = (
                    f"OPT {name}: macro M{number:g} not found beside the "
                    "program or in the macro folder"
                )
                self._program.warn(909124, text, self._start)
            return ()

        return run

    def _read_parmac(self) -> Run:
        name = self._name("a parameter").upper()
        self._comma()
        target = self._formulas.target()

        def run() -> Items:
            self._parameter(name)
            target(self._program.channel.parameter_in_force(name))
            return ()

        return run

    def _write_parmac(self) -> Run:
        name = self._name("a parameter").upper()
        self._comma()
        value = self._formulas.argument("value")

        def run() -> Items:
            known, given = self._parameter(name), value()
            wrong = parameters.wrong_value(name, known, given)
            if wrong:
                raise fail(900012, f"WRITE_PARMAC: {wrong}", self._start)
            why = known.stored or parameters.AT_START.get(name, "")
            if why and name not in self._program.parameters.written:
                self._program.channel.warn(
                    907042,
                    f"WRITE_PARMAC {name}: no effect: {why}",
                    self._start,
                )
            self._program.parameters[name] = given
            self._program.channel.refresh()
            return ()

        return run

    def _parameter(self, name: str) -> parameters.Parameter:
        known = parameters.parameter(name)
        if known is None:
            text = f"unknown machine parameter {name}; did you mean {parameters.nearest(name)}?"
            raise fail(909122, text, self._start)
        return known

    def _sdo_address(self) -> list[Number]:
        found = self._arguments(4)
        self._comma()
        return found

    def _sdo_read(self) -> Run:
        address = self._sdo_address()
        target = self._formulas.target()
        return self._simple(
            lambda: target(
                self._program.nodes.read(
                    tuple(value() for value in address), self._start
                )
            )
        )

    def _sdo_write(self) -> Run:
        address = self._sdo_address()
        value = self._formulas.argument("value")
        return self._simple(
            lambda: self._program.nodes.write(
                tuple(v() for v in address), value(), self._start
            )
        )

    def _resume_tool(self) -> Run:
        number = self._formulas.argument("RESUME_T")
        return self._simple(
            lambda: levels.resume_tool(self._program, number(), self._start)
        )

    def _save_tools(self) -> Run:
        def run() -> Items:
            for number, values in sorted(self._program.channel.tables.items()):
                user = ", ".join(f"{value!r}" for value in values[3:])
                text = f"[isons.tools.{number}]\ndiameter = {values[0]!r}\nlength = {values[1]!r}\n"
                self._program.port.append_file(
                    "isons_tools.toml",
                    f"{text}max_rpm = {values[2]!r}\nuser = [{user}]\n",
                )
            return ()

        return run

    # positioners

    def _position(self, relative: bool) -> Run:
        number, par = self._formulas.pair()
        self._stream.accept("=")
        value: Number = self._formulas.full("positioner")
        self.drain = True

        def run() -> Items:
            system = self._program.system
            seconds = system.positioners.move(
                number(), par() if par else 1.0, value(), relative, self._start
            )
            if not seconds:
                return ()
            self._program.clock.passes(seconds)
            if self._program.answers:  # the machine counts in cycles
                seconds = math.ceil(seconds / POLL_S) * POLL_S
            return (self._program.modal.row(DWELL, 0, value=seconds),)

        return run

    def _positioner_feed(self) -> Run:
        number, _ = self._formulas.pair()
        self._stream.accept("=")
        value = self._formulas.full("PF")
        self.drain = True
        return self._simple(
            lambda: self._program.system.positioners.set_feed(
                number(), value(), self._start
            )
        )

    def _positioner_stop(self) -> Run:
        number, _ = self._formulas.pair()
        self.drain = True
        return self._simple(
            lambda: self._program.system.positioners.stop(number(), self._start)
        )


Make = Callable[[Instructions], Run]
TABLE: dict[str, Make] = {
    "IF": Instructions._if,
    "ELSE": Instructions._else,
    "END_IF": Instructions._end_if,
    "LOOP": Instructions._loop,
    "END_LOOP": Instructions._end_loop,
    "GOTO": Instructions._goto,
    "GOSUB": Instructions._gosub,
    "RETURN": Instructions._return,
    "END_PROGRAM": Instructions._end_program,
    "IMPORT": Instructions._import,
    "END_IMPORT": Instructions._end_import,
    "ERROR": Instructions._error,
    "WAIT_INPUT": Instructions._wait_input,
    "DIM": Instructions._dim,
    "GLOBAL": Instructions._global,
    "MARKER": Instructions._marker,
    "GET": Instructions._get,
    "RAD": lambda i: i._angles(False),
    "DRG": lambda i: i._angles(True),
    "LOAD_VAR": Instructions._load_var,
    "SAVE_VAR": Instructions._save_var,
    "FILE_EXISTS": Instructions._file_exists,
    "GET_VAR": Instructions._get_var,
    "WRITE_VAR": Instructions._write_var,
    "ADD_VAR": Instructions._add_var,
    "REMOVE_VAR": Instructions._remove_var,
    "CLEAR_VAR": Instructions._clear_var,
    "DIM_VAR": Instructions._dim_var,
    "COUNT_VAR": Instructions._count_var,
    "OPT": Instructions._opt,
    "READ_PARMAC": Instructions._read_parmac,
    "WRITE_PARMAC": Instructions._write_parmac,
    "SDO_UL": Instructions._sdo_read,
    "SDO_DL": Instructions._sdo_write,
    "RESUME_T": Instructions._resume_tool,
    "SAVE_T": Instructions._save_tools,
}
_STRUCTURE = frozenset({"IF", "ELSE", "END_IF", "LOOP", "END_LOOP"})
_POSITIONERS: dict[str, Make] = {
    "PA": lambda i: i._position(False),
    "PD": lambda i: i._position(True),
    "PF": Instructions._positioner_feed,
    "PS": Instructions._positioner_stop,
}
