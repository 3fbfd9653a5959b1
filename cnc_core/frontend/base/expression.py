"""Expressions of the dialects: operators, precedence, functions; angles in
degrees.

Precedence, high to low:
functions and ``[ ]``; sign; ``**``; ``* / MOD``; ``+ -``;
comparisons; ``&``; ``^``; ``|``; ``&&``; XOR; ``||``.

Operators of one level group from the left. Round brackets are comments, never
grouping.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

from cnc_core import plain
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail

NESTING_MAX = 40
CONSTANTS = {"PI": math.pi, "TRUE": 1.0, "FALSE": 0.0}


def round_half_away(value: float) -> int:
    """Nearest integer, halves away from zero, as the kernel rounds function numbers."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


def _quadrant(degrees: float) -> tuple[int, float]:
    """Number of right angles and the rest in radians, so that multiples of 90
    degrees give exact values.
    """
    turns = round(math.fmod(degrees, 360.0) / 90.0)
    return turns % 4, math.radians(math.fmod(degrees, 360.0) - 90.0 * turns)


def _sin(degrees: float) -> float:
    quadrant, rest = _quadrant(degrees)
    value = plain.cos(rest) if quadrant % 2 else plain.sin(rest)
    return (-value if quadrant > 1 else value) + 0.0


def _cos(degrees: float) -> float:
    return (
        _sin(degrees + 90.0)
        if abs(degrees) < 1e6
        else plain.cos(math.radians(degrees))
    )


def _int(value: float) -> int:
    return round_half_away(value)


FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "SQR": lambda x: x * x,
    "SQRT": math.sqrt,
    "EXP": math.exp,
    "LN": math.log,
    "DEXP": lambda x: math.pow(10.0, x),
    "LOG": math.log10,
    "INT": lambda x: float(math.trunc(x)),
    "FRACT": lambda x: x - math.trunc(x),
    "CEIL": lambda x: float(math.ceil(x)),
    "FLOOR": lambda x: float(math.floor(x)),
    "ROUND": lambda x: float(round_half_away(x)),
    "SIN": _sin,
    "COS": _cos,
    "TAN": lambda x: _sin(x) / _cos(x),
    "COT": lambda x: _cos(x) / _sin(x),
    "ASIN": lambda x: math.degrees(plain.asin(x)),
    "ACOS": lambda x: math.degrees(plain.acos(x)),
    "ATAN": lambda x: math.degrees(plain.atan(x)),
    "ACOT": lambda x: 90.0 - math.degrees(plain.atan(x)),
    "INV": lambda x: float(~_int(x)),
    "NOT": lambda x: float(not x),
}
FUNCTIONS_OF_TWO: dict[str, Callable[[float, float], float]] = {
    "ATAN2": lambda y, x: math.degrees(plain.atan2(y, x)),
    "MIN": min,
    "MAX": max,
}
Operators = dict[str, tuple[int, Callable[[float, float], float]]]
OPERATORS: Operators = {
    "||": (0, lambda a, b: float(bool(a) or bool(b))),
    "XOR": (1, lambda a, b: float(bool(a) != bool(b))),
    "&&": (2, lambda a, b: float(bool(a) and bool(b))),
    "|": (3, lambda a, b: float(_int(a) | _int(b))),
    "^": (4, lambda a, b: float(_int(a) ^ _int(b))),
    "&": (5, lambda a, b: float(_int(a) & _int(b))),
    "==": (6, lambda a, b: float(a == b)),
    "!=": (6, lambda a, b: float(a != b)),
    ">=": (6, lambda a, b: float(a >= b)),
    "<=": (6, lambda a, b: float(a <= b)),
    "<": (6, lambda a, b: float(a < b)),
    ">": (6, lambda a, b: float(a > b)),
    "+": (7, lambda a, b: a + b),
    "-": (7, lambda a, b: a - b),
    "*": (8, lambda a, b: a * b),
    "/": (8, lambda a, b: a / b),
    "MOD": (8, math.fmod),
    "**": (9, math.pow),
}


class ExpressionParser(ABC):
    """Reads expressions from a token stream and evaluates them at once.

    A dialect gives its tables and what stands between two operators.
    """

    operators: Operators
    word_operators: tuple[str, ...] = ()

    def __init__(self, stream: TokenStream) -> None:
        self._stream = stream
        self._depth = 0

    @abstractmethod
    def primary(self) -> float:
        """A number, a variable, a function call or an expression in brackets."""

    def expression(self, lowest: int = 0) -> float:
        """Operators of level ``lowest`` and higher."""
        left = self._signed()
        while (name := self._operator()) is not None and self.operators[name][
            0
        ] >= lowest:
            offset = self._take_operator(name)
            level, function = self.operators[name]
            right = self.expression(level + 1)
            left = finite(function, (left, right), name, offset)
        return left

    def _signed(self) -> float:
        if self._stream.accept("-"):
            return -self.primary()
        self._stream.accept("+")
        return self.primary()

    def _operator(self) -> str | None:
        token = self._stream.current
        if token.kind is Kind.OP and token.text in self.operators:
            return token.text
        if token.kind is not Kind.NAME:
            return None
        return next(
            (
                name
                for name in self.word_operators
                if token.text.upper().startswith(name)
            ),
            None,
        )

    def _take_operator(self, name: str) -> int:
        token = (
            self._stream.take_letters(len(name))
            if name in self.word_operators
            else self._stream.next()
        )
        return token.offset

    def _deeper(self, what: str, offset: int) -> None:
        """Into a bracket, or what else may stand in itself."""
        self._depth += 1
        if self._depth > NESTING_MAX:
            text = f"more than {NESTING_MAX} {what} in each other"
            raise fail(20927, text, offset)


def finite(
    function: Callable[..., float],
    arguments: tuple[float, ...],
    name: str,
    offset: int,
) -> float:
    """The function's value, or error 900012 where it is not a finite number."""
    try:
        value = float(function(*arguments))
    except (ValueError, ArithmeticError):
        value = math.nan
    if not math.isfinite(value):
        raise fail(900012, f"{name}: no finite result", offset)
    return value
