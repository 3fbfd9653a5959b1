"""Expressions of the dialect: variables, parameters, tests, texts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.formula import (
    Constant,
    Formula,
    FormulaParser,
    number_of,
)
from cnc_core.frontend.base.lexer import Kind, TokenStream, digits, fail
from cnc_core.frontend.base.variables import READ_ONLY, Value, Variable
from cnc_core.frontend.jobs import JobState
from cnc_core.frontend.machine import ProgramMachine

from ..state.store import Reference, Store
from ..state.system import System
from . import functions

MEMBERS = re.compile(r"(?:\s*\.\s*@?\w+)+")
STATES = {name: float(state) for name, state in JobState.__members__.items()}
NO_OPERATORS = ("MODAL", "MODAL_MOVE", "MODAL_BLOCK")
OWN = ("P", "S", "L", "CYC", "I")
SYSTEM = ("G", "A", "RTG", "RTA")


class Formulas(FormulaParser):
    """Compiles the expressions of one block.

    ``drain``: one of them reads a value for which the channel has to drain.
    """

    constants = FormulaParser.constants | STATES

    def __init__(
        self,
        stream: TokenStream,
        store: Store,
        system: System,
        machine: ProgramMachine,
        lenient: bool,
    ) -> None:
        super().__init__(stream)
        self._store, self._system, self._machine = store, system, machine
        self.functions = functions.LENIENT if lenient else functions.STRICT
        self.drain = False

    def starts_here(self) -> bool:
        return self._stream.current.kind is Kind.STRING or super().starts_here()

    def _operator(self) -> str | None:
        if self._stream.is_name(*NO_OPERATORS):
            return None  # of L CYCLE: not MOD
        return super()._operator()

    def is_variable(self) -> bool:
        token, after = self._stream.current, self._stream.following
        if token.kind is Kind.VARIABLE:
            return True
        if token.kind is not Kind.NAME:
            return token.text == "@"
        letters = token.text
        if letters[0] not in "pP" or letters.strip("pP"):
            return False
        return (
            after.kind is Kind.NUMBER
            or after.kind is Kind.VARIABLE
            or after.text == "["
        )

    def variable(self) -> Formula:
        return self.reference().load

    def reference(self) -> Reference:
        """The variable at the current token, to be read or written."""
        token = self._stream.current
        if token.kind is Kind.VARIABLE:
            found = self._named()
        elif token.text == "@":
            found = self._argument()
        else:
            found = self._parameter()
        self.drain = self.drain or found.drain
        return found

    # kinds of variables

    def _named(self) -> Reference:
        stream, token = self._stream, self._stream.next()
        _, family, *names = token.text.upper().split(".")
        indices = self._indices()
        if indices and stream.is_op("."):
            found = MEMBERS.match(stream.text, stream.current.offset)
            if found:
                stream.skip_to(found.end())
                names += [
                    "".join(part.split()).upper()
                    for part in found[0].split(".")[1:]
                ]
                indices += self._indices()
        if not names:
            raise fail(
                900004,
                f"{token.text} is no variable: a name is missing",
                token.offset,
            )
        if family in OWN:
            return self._store.reference(
                family, ".".join(names), indices, token.offset
            )
        if family == "E":
            return self._store.external(".".join(names), indices, token.offset)
        if family in SYSTEM:
            return self._system.reference(family, names, indices, token.offset)
        raise fail(
            900003,
            f"variable {token.text.upper()} is not supported",
            token.offset,
        )

    def _indices(self) -> list[Formula]:
        """``[a][b]`` or ``[a, b]``."""
        found: list[Formula] = []
        while self._stream.is_op("["):
            found += self.arguments()
        return found

    def _parameter(self) -> Reference:
        stream, token = self._stream, self._stream.next()
        number = self._parameter_number(token.offset)
        indices: list[Formula] = []
        if not isinstance(number, Constant):
            pass
        elif (
            stream.is_op("[")
            and not stream.text[stream.current.offset - 1].isspace()
        ):
            indices = self._indices()
        for _ in token.text[1:]:  # PP1: the parameter whose number is in P1
            number = self._store.parameter(number, (), token.offset).load
        return self._store.parameter(number, indices, token.offset)

    def _parameter_number(self, offset: int) -> Formula:
        """Behind ``P``: digits, ``[expression]`` or a variable."""
        stream = self._stream
        if stream.is_op("["):
            opened = self.open()
            inner = self.expression()
            self.close(opened)
            return inner
        if stream.current.kind is Kind.VARIABLE:
            return self._named().load
        token = stream.next()
        if not digits(token.text):
            raise fail(
                900004,
                f"P{token.text}: the number of a parameter is a whole one",
                offset,
            )
        return Constant(float(token.text))

    def _argument(self) -> Reference:
        stream, offset = self._stream, self._stream.next().offset
        if stream.is_name("PL"):
            stream.next()
            return self._job_value(self._parameter_number(offset), offset)
        if not stream.is_name("P"):
            raise fail(
                900003,
                f"@{stream.current.text.upper()} is not supported",
                offset,
            )
        stream.next()
        return self._store.argument(self._parameter_number(offset), offset)

    def _job_value(self, number: Formula, offset: int) -> Reference:
        """``@PL<number>``: what came with the job that this program is."""
        port = self._system.state.port

        def values() -> Mapping[int, float]:
            return port.jobs.values if port.jobs is not None else {}

        def key() -> int:
            found = number()
            return -1 if isinstance(found, str) else round_half_away(found)

        def load() -> Value:
            if key() not in values():
                raise fail(907010, f"@PL{key()} is not given", offset)
            return values()[key()]

        def store(_: Value) -> None:
            raise fail(READ_ONLY, "@PL can only be read", offset)

        return Reference("@PL", load, store, lambda: key() in values())

    def _wait_status(self, offset: int) -> Formula:
        """``MCV_WAIT_STATUS [number]``."""
        opened = self.open()
        number = number_of(self.expression(), "MCV_WAIT_STATUS", offset)
        self.close(opened)
        port = self._system.state.port

        def state() -> Value:
            if port.jobs is None:
                text = "MCV_WAIT_STATUS: the cell has one channel"
                raise fail(900003, text, offset)
            return float(port.jobs.seen(round_half_away(number())))

        return state

    # tests

    def special(self, name: str) -> Callable[[int], Formula] | None:
        return {
            "EXIST": self._exist,
            "SIZEOF": self._sizeof,
            "MCV_WAIT_STATUS": self._wait_status,
            "IS_STRING": lambda offset: self._is_kind(str),
            "IS_NUMBER": lambda offset: self._is_kind(float),
        }.get(name)

    def _exist(self, offset: int) -> Formula:
        stream, opened = self._stream, self.open()
        if stream.is_name("M") and stream.following.kind is Kind.NUMBER:
            stream.next()
            known = int(float(stream.next().text)) in self._machine.m_functions
            self.close(opened)
            return Constant(float(known))
        if (
            stream.current.kind is Kind.VARIABLE
            and stream.current.text[:4].upper() == "V.E."
        ):
            name = stream.next().text[4:].upper()
            self._indices()
            self.close(opened)
            return lambda: float(self._store.has_external(name))
        if not self.is_variable():
            raise fail(
                900004,
                f"EXIST: expected a variable, found {stream.describe()}",
                offset,
            )
        exists = self.reference().exists
        self.close(opened)
        return lambda: float(exists())

    def _sizeof(self, offset: int) -> Formula:
        """Elements of an array's dimension, the first one if none is named.

        A single value has 1.
        """
        stream, opened = self._stream, self.open()
        find = self._variable_itself(offset)
        dimension: Formula = Constant(1.0)
        if stream.accept(","):
            dimension = self.expression()
        self.close(opened)
        number = number_of(dimension, "SIZEOF", offset)

        def size() -> Value:
            sizes = find().dimensions or (1,)
            place = round_half_away(number())
            if not 1 <= place <= len(sizes):
                raise fail(
                    900012,
                    f"SIZEOF: dimension {place} out of range 1..{len(sizes)}",
                    offset,
                )
            return float(sizes[place - 1])

        return size

    def _variable_itself(self, offset: int) -> Callable[[], Variable]:
        stream, token = self._stream, self._stream.current
        if (
            token.kind is Kind.VARIABLE
            and token.text.upper().split(".")[1] in OWN
        ):
            _, family, *names = stream.next().text.upper().split(".")
            scope, name = self._store.scope_of(family), ".".join(names)
            return lambda: self._declared(scope.get(name), token.text, offset)
        if stream.is_name("P") and stream.following.kind is Kind.NUMBER:
            stream.next()
            number = int(float(stream.next().text))
            return lambda: self._declared(
                self._store.arrays.get(number), f"P{number}", offset
            )
        raise fail(
            900004,
            f"SIZEOF: expected a variable, found {stream.describe()}",
            offset,
        )

    @staticmethod
    def _declared(
        variable: Variable | None, name: str, offset: int
    ) -> Variable:
        if variable is None:
            raise fail(907010, f"{name} is not declared", offset)
        return variable

    def _is_kind(self, kind: type) -> Formula:
        opened = self.open()
        inner = self.expression()
        self.close(opened)
        return lambda: float(isinstance(inner(), kind))
