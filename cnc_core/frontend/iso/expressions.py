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
        super().__init__(stream)
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
        stream, token = self._stream, self._stream.current
        if stream.is_op("#"):
            return self._parameters.value(self.key(), token.offset)
        if stream.is_name("EXISTS"):
            return self._exists()
        if token.kind is Kind.NUMBER:
            return float(stream.next().text)
        if stream.is_op("["):
            return self._bracket()
        name = self._function_name()
        if name is None:
            raise stream.no_value()
        return self._call(name)

    def key(self) -> Key:
        """The parameter that stands here: ``#5``, ``#<name>``, ``#[expr]``, ``##5``."""
        stream = self._stream
        offset = stream.expect("#", 900004).offset
        if stream.current.text.startswith("<") and len(stream.current.text) > 1:
            return stream.next().text[1:-1].lower()
        self._deeper("parameters", offset)
        number = self.primary()
        self._depth -= 1
        return self._parameters.number(number, offset)

    def _exists(self) -> float:
        self._stream.next()
        opened = self._open()
        known = self._parameters.exists(self.key())
        self._close(opened)
        return float(known)

    def _function_name(self) -> str | None:
        name = self._stream.current.text.upper()
        known = self._stream.current.kind is Kind.NAME and name in {
            *self.functions,
            *self.functions_of_two,
        }
        return name if known and self._stream.following.text == "[" else None

    def _call(self, name: str) -> float:
        offset = self._stream.next().offset
        first = self._bracket()
        if name in self.functions:
            return finite(self.functions[name], (first,), name, offset)
        self._stream.expect("/", 900004)
        two = self.functions_of_two[name]
        return finite(two, (first, self._bracket()), name, offset)

    def _open(self) -> int:
        bracket = self._stream.expect("[", 900004)
        self._deeper("brackets", bracket.offset)
        return bracket.offset

    def _close(self, opened: int) -> None:
        if self._stream.at_end:
            raise fail(900013, "bracket is not closed", opened)
        self._stream.expect("]", 900004)
        self._depth -= 1

    def _bracket(self) -> float:
        opened = self._open()
        value = self.expression()
        self._close(opened)
        return value
