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
from collections.abc import Callable
from typing import Protocol

from cnc_core import plain
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail

NESTING_MAX = 40
CONSTANTS = {"PI": math.pi, "TRUE": 1.0, "FALSE": 0.0}
WORD_OPERATORS = ("MOD", "XOR")
REFUSED_FUNCTIONS = frozenset({"SIZEOF", "EXIST", "IS_STRING", "IS_NUMBER"})


class VariableSource(Protocol):
    """Where the values of variables and parameters come from.

    ``read`` stands at the first token of a variable (``V.``, ``P1``, ``@P1``),
    takes its tokens and returns its value.
    """

    def read(self, stream: TokenStream) -> float: ...


class NoVariables:
    """Refuses every variable by name."""

    def read(self, stream: TokenStream) -> float:
        raise fail(
            900003,
            f"{variable_name(stream)} is not supported",
            stream.current.offset,
        )


def variable_name(stream: TokenStream) -> str:
    """How the variable at the current token is called, for messages."""
    text = stream.text[stream.current.offset :]
    end = 0
    while end < len(text) and (text[end].isalnum() or text[end] in "._@"):
        end += 1
    kind = "variable" if text[:1] in "vV" else "parameter"
    return f"{kind} {text[:end].upper()}"


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
OPERATORS: dict[str, tuple[int, Callable[[float, float], float]]] = {
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


class ExpressionParser:
    """Reads expressions from a token stream and evaluates them at once.

    A dialect with other operators and functions derives from it and replaces
    the tables.
    """

    operators = OPERATORS
    functions = FUNCTIONS
    functions_of_two = FUNCTIONS_OF_TWO
    constants = CONSTANTS
    word_operators: tuple[str, ...] = WORD_OPERATORS

    def __init__(self, stream: TokenStream, variables: VariableSource) -> None:
        self._stream = stream
        self._variables = variables
        self._depth = 0

    def starts_here(self) -> bool:
        """The current token can begin an expression."""
        stream, token = self._stream, self._stream.current
        if token.kind is Kind.NAME:
            return (
                self._is_variable()
                or stream.is_name(*self.constants)
                or self._function_name() is not None
            )
        return token.kind is Kind.NUMBER or stream.is_op("+", "-", "[", "@")

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

    def primary(self) -> float:
        """A number, a constant, a variable, a function call or ``[expression]``."""
        stream, token = self._stream, self._stream.current
        if token.kind is Kind.NUMBER:
            return float(stream.next().text)
        if stream.is_op("["):
            return self._bracket()
        if stream.is_name(*self.constants):
            return self.constants[stream.next().text.upper()]
        if self._is_variable():
            return self._variables.read(stream)
        name = self._function_name()
        if name is None:
            raise fail(
                900004,
                f"expected a number or an expression, found {stream.describe()}",
                token.offset,
            )
        return self._call(name)

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

    def _is_variable(self) -> bool:
        token, after = self._stream.current, self._stream.following
        if token.kind is not Kind.NAME:
            return self._stream.is_op("@")
        letters = token.text.upper()
        if letters == "V":
            return after.kind is Kind.OP and after.text == "."
        indexed = after.kind is Kind.NUMBER or (
            after.kind is Kind.OP and after.text == "["
        )
        return indexed and set(letters) == {"P"}

    def _function_name(self) -> str | None:
        """The function called at the current token, None if there is none."""
        stream = self._stream
        name, rest = (
            stream.current.text.upper(),
            stream.text[stream.following.offset :],
        )
        if name == "ATAN" and rest.startswith("2"):
            name, rest = "ATAN2", rest[1:].lstrip()
        known = (
            name in self.functions
            or name in self.functions_of_two
            or name in REFUSED_FUNCTIONS
        )
        return name if known and rest.startswith("[") else None

    def _call(self, name: str) -> float:
        stream = self._stream
        offset = stream.next().offset
        if name in REFUSED_FUNCTIONS:
            raise fail(900003, f"{name} is not supported", offset)
        if name == "ATAN2":
            stream.next()
        if name in self.functions:
            return finite(
                self.functions[name], (self._bracket(),), name, offset
            )
        return finite(
            self.functions_of_two[name], self._two_arguments(), name, offset
        )

    def _open(self) -> int:
        bracket = self._stream.expect("[", 900004)
        self._depth += 1
        if self._depth > NESTING_MAX:
            raise fail(
                20927,
                f"more than {NESTING_MAX} brackets in each other",
                bracket.offset,
            )
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

    def _two_arguments(self) -> tuple[float, float]:
        opened = self._open()
        first = self.expression()
        self._stream.expect(",", 900004)
        second = self.expression()
        self._close(opened)
        return first, second


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
