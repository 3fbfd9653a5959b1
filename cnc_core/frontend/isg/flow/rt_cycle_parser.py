"""``#RT CYCLE`` and the blocks of a real-time cycle, compiled.

Inside stand $IF with its branches, a frequency (ONCE, EDGE, ALWAYS) if there is
one branch only, and assignments of V.E and V.RTG.LOOP (public pages "Realtime
cycles").
"""

from __future__ import annotations

import re
from collections.abc import Callable

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.port import (
    RT_DELETED,
    RT_HELD,
    RT_RUNNING,
    RT_STARTED,
    RtOp,
    Wait,
)

from ..language.rt_formulas import (
    ALWAYS,
    EDGE,
    JUMP,
    ONCE,
    SET_COUNT,
    SET_ENABLED,
    SET_EXTERNAL,
    UNLESS,
    Instruction,
    RealTimeFormulas,
)
from ..state.rt_cycles import Branch, OpenCycle, RealTimeCycles
from ..state.state import ProgramState
from ..state.system import System
from .program_levels import Items, Run

STATES = {
    "START": RT_STARTED,
    "HOLD": RT_HELD,
    "CONTINUE": RT_RUNNING,
    "DELETE": RT_DELETED,
}
FREQUENCIES = {"ONCE": ONCE, "EDGE": EDGE, "ALWAYS": ALWAYS}
WRITTEN = {
    "V.RTG.LOOP.ENABLED": SET_ENABLED,
    "V.RTG.LOOP.COUNT": SET_COUNT,
}
SCOPES = ("BLOCK", "PROG", "GLOBAL")
ACTIONS = ("MOVE_ABORT", "MOVE_CONT")
COMMAND = re.compile(r"#\s*RT\s+CYCLE\b\s*(?P<word>\w*)", re.I)
MANAGES = ("END", "ABORT", *STATES)
INSIDE = "only $IF and assignments may stand in a real-time cycle"


def rt_cycle(text: str) -> bool:
    """The block has a command ``#RT CYCLE``."""
    return COMMAND.search(text) is not None


def opens_rt_cycle(text: str) -> bool:
    """That command begins a definition."""
    found = COMMAND.search(text)
    return found is not None and found["word"].upper() not in MANAGES


class RtCycleParser:
    """One block; its stream stands at the statement."""

    def __init__(
        self, stream: TokenStream, system: System, state: ProgramState
    ) -> None:
        self._stream, self._state = stream, state
        self._formulas = RealTimeFormulas(
            stream, state.store, system, state.machine, state.lenient
        )
        self._cycles: RealTimeCycles = state.rt_cycles

    def block(self) -> tuple[Run, bool]:
        """A block's effect, and whether the channel drains ahead of it."""
        if self._stream.is_op("#") and rt_cycle(self._stream.text):
            return self._command()
        return self._statement(), False

    def _command(self) -> tuple[Run, bool]:
        """``#RT CYCLE ..``"""
        stream = self._stream
        stream.next()
        offset = stream.next().offset
        stream.next()
        word = stream.accept_name("DEF", "END", "ABORT", *STATES)
        name = word.text.upper() if word else ""
        if name == "END":
            self._at_end(name)
            return self._end(offset), True
        if name == "ABORT":
            raise fail(
                900003, "#RT CYCLE ABORT ACTION is not supported", offset
            )
        try:
            number, scope = self._keys(offset)
            self._at_end(name or "CYCLE")
        except CncError:
            self._cycles.refused = name not in STATES
            raise
        if name in STATES:
            return self._manage(number, name, offset), True
        starts = name != "DEF"

        def begin() -> Items:
            self._cycles.begin(
                number and number(),
                scope=scope,
                starts=starts,
                offset=offset,
            )
            return ()

        return begin, True

    def _statement(self) -> Run:
        """A block between #RT CYCLE and its END."""
        stream, token = self._stream, self._stream.current
        if stream.at_end:
            return tuple
        if stream.accept("$"):
            made = self._control()
        elif stream.is_op("#"):
            raise fail(22004, ERRORS[22004], token.offset)
        elif token.kind is Kind.VARIABLE:
            made = self._assignment()
        else:
            raise fail(900003, f"{stream.describe()}: {INSIDE}", token.offset)
        self._at_end(token.text)

        def run() -> Items:
            opened = self._cycles.opened
            if opened is not None:
                made(opened)
            return ()

        return run

    # #RT CYCLE

    def _end(self, offset: int) -> Run:
        def run() -> Items:
            self._cycles.end(offset)
            return (Wait.CYCLE,)  # it runs before the next block

        return run

    def _manage(
        self, number: Callable[[], int] | None, name: str, offset: int
    ) -> Run:
        if number is None:
            raise fail(22003, f"#RT CYCLE {name} without an ID", offset)

        def run() -> Items:
            self._cycles.manage(number(), STATES[name], name, offset)
            return (Wait.CYCLE,)

        return run

    def _keys(self, offset: int) -> tuple[Callable[[], int] | None, str]:
        """``[ID=.. SCOPE=.. END_ACTION=..]``: the ID, and the scope."""
        stream, number, scope = self._stream, None, "PROG"
        if not stream.accept("["):
            return None, scope
        while not stream.accept("]"):
            key = stream.accept_name("ID", "SCOPE", "END_ACTION")
            if stream.accept(","):
                continue
            if key is None:
                raise fail(
                    900010,
                    f"#RT CYCLE: expected ID, SCOPE or END_ACTION, "
                    f"found {stream.describe()}",
                    stream.current.offset,
                )
            stream.expect("=", 900010)
            name, at = key.text.upper(), stream.current.offset
            if name == "ID":
                number = self._number(at)
            elif name == "SCOPE":
                scope = self._name(SCOPES, "SCOPE")
            else:
                self._name(ACTIONS, "END_ACTION")
        return number, scope

    def _number(self, offset: int) -> Callable[[], int]:
        value = self._formulas.number("ID", offset)

        def whole() -> int:
            found = value()
            if found != round(found) or not 0 <= found < 2**31:
                raise fail(900012, "ID: a whole number from 0", offset)
            return round(found)

        return whole

    def _name(self, known: tuple[str, ...], key: str) -> str:
        stream, offset = self._stream, self._stream.current.offset
        word = stream.accept_name(*known)
        if word is None:
            raise fail(
                900010,
                f"{key}: expected {' or '.join(known)}, "
                f"found {stream.describe()}",
                offset,
            )
        return word.text.upper()

    # inside

    def _control(self) -> Callable[[OpenCycle], None]:
        token = self._stream.next()
        word, offset = token.text.upper(), token.offset
        if word == "IF":
            return self._if(offset)
        if word == "ENDIF":
            return lambda opened: _endif(opened, offset)
        if word not in ("ELSE", "ELSEIF"):
            raise fail(900003, f"${word}: {INSIDE}", offset)
        test = self._test() if word == "ELSEIF" else None
        return lambda opened: _else(opened, word, test, offset)

    def _test(self) -> tuple[Instruction, ...]:
        offset = self._stream.current.offset
        return self._formulas.code(self._formulas.expression(), offset)

    def _if(self, offset: int) -> Callable[[OpenCycle], None]:
        word = self._stream.accept_name(*FREQUENCIES)
        frequency = FREQUENCIES[word.text.upper()] if word else None
        if frequency is not None:
            self._stream.accept("=")
        test = self._test()
        place = self._state.place

        def run(opened: OpenCycle) -> None:
            opened.ops += test
            if frequency is not None:
                op = RtOp(frequency)
                opened.ops.append(lambda: op)
            skip = opened.jump(UNLESS)
            opened.branches.append(
                Branch(place(offset), skip, frequency is not None)
            )

        return run

    def _assignment(self) -> Callable[[OpenCycle], None]:
        stream, token = self._stream, self._stream.current
        name = token.text.upper()
        if name in WRITTEN:
            stream.next()
            op = RtOp(WRITTEN[name])
            target: Instruction | None = lambda: op  # noqa: E731
        elif name.startswith("V.E."):
            target = self._formulas.external_op(SET_EXTERNAL)
        else:
            target = None
        if target is None and name.startswith(("V.RTG.", "V.RTA.")):
            text = f"{name} cannot be written here, {' and '.join(WRITTEN)} can"
            raise fail(900003, text, token.offset)
        if target is None:
            raise fail(22009, f"{name}: {ERRORS[22009]}", token.offset)
        stored = target
        stream.expect("=", 900010)
        value = self._test()

        def run(opened: OpenCycle) -> None:
            opened.ops += (*value, stored)

        return run

    def _at_end(self, name: str) -> None:
        if not self._stream.at_end:
            raise fail(
                900010,
                f"unexpected {self._stream.current.text!r} behind {name}",
                self._stream.current.offset,
            )


def _else(
    opened: OpenCycle,
    word: str,
    test: tuple[Instruction, ...] | None,
    offset: int,
) -> None:
    branch = opened.branches[-1] if opened.branches else None
    if branch is None or branch.last:
        raise fail(907020, f"${word} without $IF", offset)
    if branch.alone:
        raise fail(
            900010, f"${word}: an $IF with a frequency has one branch", offset
        )
    branch.ends.append(opened.jump(JUMP))
    opened.lands(branch.skip)
    branch.skip, branch.last = None, test is None
    if test is not None:
        opened.ops += test
        branch.skip = opened.jump(UNLESS)


def _endif(opened: OpenCycle, offset: int) -> None:
    if not opened.branches:
        raise fail(907020, "$ENDIF without $IF", offset)
    branch = opened.branches.pop()
    for jump in (branch.skip, *branch.ends):
        opened.lands(jump)
