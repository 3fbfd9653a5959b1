"""Expressions of RS-274: ``[ ]``, unary functions, ``#`` parameters.

Angles are in degrees. Operators, high to low:
``**``; ``* / MOD``; ``+ -``; EQ NE GT GE LT LE; AND OR XOR.
They stand inside brackets only.
"""

from __future__ import annotations

import math

from cnc_core import plain
from cnc_core.frontend.base import expression
from cnc_core.frontend.base.expression import ExpressionParser, finite
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.iso.parameters import Key, Parameters

EQUAL = 1e-4  # EQ and NE


def _mod(a: float, b: float) -> float:
    rest = math.fmod(a, b)
    return rest + abs(b) if rest < 0 else rest


class Expressions(ExpressionParser):
    """Reads values and expressions of one line."""

    operators = {
        "AND": (0, lambda a, b: float(bool(a) and bool(b))),
        "OR": (0, lambda a, b: float(bool(a) or bool(b))),
        "XOR": (0, lambda a, b: float(bool(a) != bool(b))),
        "EQ": (1, lambda a, b: float(abs(a - b) < EQUAL)),
        "NE": (1, lambda a, b: float(abs(a - b) >= EQUAL)),
        "GT": (1, lambda a, b: float(a > b)),
        "GE": (1, lambda a, b: float(a >= b)),
        "LT": (1, lambda a, b: float(a < b)),
        "LE": (1, lambda a, b: float(a <= b)),
        "+": (2, lambda a, b: a + b),
        "-": (2, lambda a, b: a - b),
        "*": (3, lambda a, b: a * b),
        "/": (3, lambda a, b: a / b),
        "MOD": (3, _mod),
        "**": (4, math.pow),
    }
    functions = {
        name: expression.FUNCTIONS[name]
        for name in (
            "ABS",
            "ACOS",
            "ASIN",
            "COS",
            "EXP",
            "LN",
            "ROUND",
            "SIN",
            "SQRT",
            "TAN",
        )
    } | {
        "FIX": lambda x: float(math.floor(x)),
        "FUP": lambda x: float(math.ceil(x)),
    }
    functions_of_two = {"ATAN": lambda y, x: math.degrees(plain.atan2(y, x))}
    constants: dict[str, float] = {}
    word_operators = (
        "AND",
        "XOR",
        "MOD",
        "OR",
        "EQ",
        "NE",
        "GT",
        "GE",
        "LT",
        "LE",
    )

    def __init__(self, stream: TokenStream, parameters: Parameters) -> None:
        super().__init__(stream, parameters)
        self._parameters = parameters

    def starts_here(self) -> bool:
        stream = self._stream
        if stream.current.kind is Kind.NAME:
            return self._function_name() is not None or stream.is_name("EXISTS")
        return stream.current.kind is Kind.NUMBER or stream.is_op(
            "+", "-", "[", "#"
        )

    def value(self, name: str) -> float:
        """The value of a word: a number, ``[..]``, a parameter or a function,
        with a sign.
        """
        token = self._stream.current
        if not self.starts_here():
            raise fail(
                900004,
                f"{name} without a value, found {self._stream.describe()}",
                token.offset,
            )
        return self._signed()

    def primary(self) -> float:
        if self._stream.is_op("#"):
            offset = self._stream.current.offset
            return self._parameters.value(self.key(), offset)
        if self._stream.is_name("EXISTS"):
            return self._exists()
        return super().primary()

    def key(self) -> Key:
        """The parameter that stands here: ``#5``, ``#<name>``, ``#[expr]``, ``##5``."""
        stream = self._stream
        offset = stream.expect("#", 900004).offset
        if stream.current.text.startswith("<") and len(stream.current.text) > 1:
            return stream.next().text[1:-1].lower()
        self._depth += 1
        if self._depth > expression.NESTING_MAX:
            raise fail(
                20927,
                f"more than {expression.NESTING_MAX} parameters in each other",
                offset,
            )
        number = self.primary()
        self._depth -= 1
        return self._parameters.number(number, offset)

    def _exists(self) -> float:
        self._stream.next()
        opened = self._open()
        known = self._parameters.exists(self.key())
        self._close(opened)
        return float(known)

    def _is_variable(self) -> bool:
        return False  # primary and key read parameters

    def _function_name(self) -> str | None:
        name = self._stream.current.text.upper()
        known = self._stream.current.kind is Kind.NAME and name in {
            *self.functions,
            *self.functions_of_two,
        }
        return name if known and self._stream.following.text == "[" else None

    def _call(self, name: str) -> float:
        if name != "ATAN":
            return super()._call(name)
        offset = self._stream.next().offset
        y = self._bracket()
        self._stream.expect("/", 900004)
        return finite(
            self.functions_of_two[name], (y, self._bracket()), name, offset
        )
