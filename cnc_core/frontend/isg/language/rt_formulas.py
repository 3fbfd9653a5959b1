"""Expressions of real-time cycles, compiled to instructions of the engine.

Only V.E, if synchronised, V.RTG and V.RTA are read while the cycle runs. All
else has the value that it had where the cycle was defined (public page
"Applicable variables").
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cnc_core.frontend.base.expression import OPERATORS
from cnc_core.frontend.base.formula import Formula, number_of
from cnc_core.frontend.base.lexer import Kind, fail
from cnc_core.frontend.base.variables import NOT_A_NUMBER, Value
from cnc_core.frontend.port import RtOp

from ..state.store import TYPES
from .formulas import Formulas

# codes and kinds as in c_ext/engine/state/api.h
CONSTANT, LOOP_ENABLED, LOOP_COUNT, POSITION, EXTERNAL = range(5)
SET_ENABLED, SET_EXTERNAL, UNARY, BINARY, JUMP, UNLESS = range(5, 11)
ONCE, EDGE, ALWAYS, SET_COUNT = range(11, 15)
OF_ONE = ["-", "ABS", "SQR", "SQRT", "EXP", "LN", "DEXP", "LOG", "INT"]
OF_ONE += ["FRACT", "CEIL", "FLOOR", "ROUND", "SIN", "COS", "TAN", "COT"]
OF_ONE += ["ASIN", "ACOS", "ATAN", "INV", "NOT", "ACOT"]
OF_TWO = [*OPERATORS, "ATAN2", "MIN", "MAX"]
LOOP = {"ENABLED": LOOP_ENABLED, "COUNT": LOOP_COUNT}
POSITIONS = ("ACT_POS", "CUR_POS")

Instruction = Callable[[], RtOp]


@dataclass(frozen=True)
class Code:
    """An expression whose value is known while the cycle runs.

    ``ops``: each gives its instruction where the cycle is defined.
    """

    ops: tuple[Instruction, ...]

    def __call__(self) -> Value:
        raise TypeError("a value of a real-time cycle is asked for too early")


class RealTimeFormulas(Formulas):
    """Compiles the expressions of one block of a real-time cycle."""

    def code(self, formula: Formula, offset: int) -> tuple[Instruction, ...]:
        """The instructions of an expression."""
        if isinstance(formula, Code):
            return formula.ops
        number = number_of(formula, "real-time cycle", offset)
        return (lambda: RtOp(CONSTANT, value=number()),)

    def variable(self) -> Formula:
        token = self._stream.current
        live = token.kind is Kind.VARIABLE and self._live()
        return live or super().variable()

    def _live(self) -> Code | None:
        """A variable that is read while the cycle runs."""
        stream, token = self._stream, self._stream.current
        _, family, *names = token.text.upper().split(".")
        if family == "RTG" and names[:1] == ["LOOP"] and names[1:]:
            code = LOOP.get(".".join(names[1:]))
            if code is not None:
                stream.next()
                return Code((lambda: RtOp(code),))
        if family == "RTA" and names[:1] == ["ACS"] and len(names) == 3:
            axis = self._system.axis_named(names[2], token.offset)
            if names[1] in POSITIONS:
                stream.next()
                return Code((lambda: RtOp(POSITION, at=axis()),))
        if family == "E":
            return self._external()
        return None

    def _external(self) -> Code | None:
        """A synchronised V.E; the other ones are constants."""
        place = self._stream.place
        made = self.external_op(EXTERNAL)
        if made is None:
            self._stream.go_to(place)
            return None
        return Code((made,))

    def external_op(self, code: int) -> Instruction | None:
        """The variable at the current token as an instruction.

        None: it is not synchronised.
        """
        token = self._stream.next()
        _, _, *names = token.text.upper().split(".")
        indices = self._indices()
        known, shape, element = self._store.external_place(
            ".".join(names), indices, token.offset
        )
        if not known.synchronised:
            return None
        if known.type not in TYPES:
            raise fail(
                NOT_A_NUMBER,
                f"{shape.name} is a text: a real-time cycle has numbers only",
                token.offset,
            )
        kind = list(TYPES).index(known.type)
        area = 0 if known.scope == "channel" else 1
        return lambda: RtOp(code, kind, area, known.place(element()))

    def _binary(
        self,
        name: str,
        function: Callable[[Any, Any], Any],
        left: Formula,
        right: Formula,
        offset: int,
    ) -> Formula:
        if not (isinstance(left, Code) or isinstance(right, Code)):
            return super()._binary(name, function, left, right, offset)
        return self._applied(name, function, (left, right), offset)

    def _applied(
        self,
        name: str,
        compute: Callable[..., Value],
        arguments: Sequence[Formula],
        offset: int,
    ) -> Formula:
        if not any(isinstance(argument, Code) for argument in arguments):
            return super()._applied(name, compute, arguments, offset)
        table = (OF_ONE, OF_TWO)[len(arguments) == 2]
        if name not in table:
            raise fail(
                900003, f"{name} is not supported in a real-time cycle", offset
            )
        last = RtOp((UNARY, BINARY)[len(arguments) == 2], table.index(name))
        ops = [
            op for argument in arguments for op in self.code(argument, offset)
        ]
        return Code((*ops, lambda: last))
