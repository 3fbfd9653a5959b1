"""Expressions compiled to closures: parsed once, evaluated each time.

Values are floats and texts. Operators, precedence and numeric functions are
those of ``cnc_core.frontend.base.expression``. A dialect derives from
``FormulaParser`` and adds functions, special forms and its variables.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cnc_core.errors import CncError
from cnc_core.frontend.base.expression import (
    CONSTANTS,
    FUNCTIONS,
    FUNCTIONS_OF_TWO,
    NESTING_MAX,
    OPERATORS,
)
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.variables import NOT_A_NUMBER, NOT_A_TEXT, Value

Formula = Callable[[], Value]
LINKS_MAX = (
    500  # operators of one expression: they are evaluated inside each other
)


NEGATIVE: Callable[..., Value] = operator.neg


class Constant:
    """A formula whose value is known."""

    __slots__ = ("value",)

    def __init__(self, value: Value) -> None:
        self.value = value

    def __call__(self) -> Value:
        return self.value


@dataclass(frozen=True)
class Function:
    """A function, and how many arguments it takes: at least and at most."""

    compute: Callable[..., Value]
    fewest: int
    most: int


def _table() -> dict[str, Function]:
    one = {name: Function(compute, 1, 1) for name, compute in FUNCTIONS.items()}
    return one | {
        name: Function(compute, 2, 2)
        for name, compute in FUNCTIONS_OF_TWO.items()
    }


def number_of(formula: Formula, name: str, offset: int) -> Callable[[], float]:
    """The formula as a finite number.

    An error names ``name`` if the value is no finite number.
    """
    if isinstance(formula, Constant):
        value = _number(formula.value, name, offset)
        return lambda: value

    def evaluate() -> float:
        value = formula()
        if value.__class__ is float and -1.7e308 < value < 1.7e308:
            return value
        return _number(value, name, offset)

    return evaluate


def text_of(formula: Formula, name: str, offset: int) -> Callable[[], str]:
    """The formula as a text."""

    def evaluate() -> str:
        value = formula()
        if not isinstance(value, str):
            raise fail(
                NOT_A_TEXT, f"{name}: a text is expected, not a number", offset
            )
        return value

    return evaluate


def _number(value: Value, name: str, offset: int) -> float:
    if isinstance(value, str):
        raise fail(
            NOT_A_NUMBER, f"{name}: a number is expected, not a text", offset
        )
    if not math.isfinite(value):
        raise fail(900012, f"{name}: no finite result", offset)
    return value


def guarded(
    compute: Callable[..., Any],
    arguments: Sequence[Formula],
    name: str,
    offset: int,
) -> Formula:
    """``compute`` of the arguments; failures as errors at ``offset``."""

    def apply(*values: Value) -> Value:
        try:
            value = compute(*values)
        except CncError as error:
            error.place.column = error.place.column or offset
            raise
        except (ValueError, ArithmeticError):
            raise fail(900012, f"{name}: no finite result", offset) from None
        except (TypeError, AttributeError):
            kinds = (
                "a text"
                if any(isinstance(v, str) for v in values)
                else "a number"
            )
            raise fail(
                NOT_A_NUMBER, f"{name} does not take {kinds} here", offset
            ) from None
        return value if isinstance(value, str) else float(value)

    if all(isinstance(argument, Constant) for argument in arguments):
        return Constant(apply(*(argument() for argument in arguments)))
    if len(arguments) == 1:
        only = arguments[0]
        return lambda: apply(only())
    if len(arguments) == 2:
        first, second = arguments
        return lambda: apply(first(), second())
    return lambda: apply(*[argument() for argument in arguments])


def _fast(
    name: str, left: Formula, right: Formula, offset: int
) -> Formula | None:
    """The operators of most loops without the way through a table.

    None: another operator.
    """

    # texts are possible too: the operator's own TypeError tells them apart
    first: Callable[[], Any] = left
    second: Callable[[], Any] = right

    def wrong() -> Exception:
        return fail(NOT_A_NUMBER, f"{name} does not take a text here", offset)

    def add() -> Any:
        try:
            return first() + second()
        except TypeError:
            raise wrong() from None

    def subtract() -> Any:
        try:
            return first() - second()
        except TypeError:
            raise wrong() from None

    def multiply() -> Value:
        a, b = left(), right()
        if isinstance(a, str) or isinstance(b, str):
            raise wrong()
        return a * b

    def less() -> Value:
        try:
            return 1.0 if first() < second() else 0.0
        except TypeError:
            raise wrong() from None

    def equal() -> Value:
        return 1.0 if left() == right() else 0.0

    return {"+": add, "-": subtract, "*": multiply, "<": less, "==": equal}.get(
        name
    )


class FormulaParser:
    """Compiles the expressions of one token stream."""

    operators = OPERATORS
    functions: dict[str, Function] = _table()
    constants: dict[str, float] = CONSTANTS
    word_operators: tuple[str, ...] = ("MOD", "XOR")

    def __init__(self, stream: TokenStream) -> None:
        self._stream = stream
        self._depth = 0
        self._links = 0

    # what a dialect adds

    def is_variable(self) -> bool:
        """A variable begins at the current token."""
        return False

    def variable(self) -> Formula:
        """The variable at the current token."""
        raise NotImplementedError

    def special(self, name: str) -> Callable[[int], Formula] | None:
        """A form whose brackets hold something else than expressions: its
        parser, called at ``[``.
        """
        return None

    def text(self, literal: str, offset: int) -> Formula:
        """A quoted text."""
        return Constant(literal)

    # expressions

    def starts_here(self) -> bool:
        """The current token can begin an expression."""
        stream, token = self._stream, self._stream.current
        if token.kind is Kind.NUMBER or stream.is_op("+", "-", "["):
            return True
        if self.is_variable():
            return True
        return token.kind is Kind.NAME and (
            stream.is_name(*self.constants) or self._function_name() is not None
        )

    def expression(self, lowest: int = 0) -> Formula:
        """Operators of level ``lowest`` and higher."""
        if not self._depth and not lowest:
            self._links = 0
        left = self._signed()
        while (name := self._operator()) is not None and self.operators[name][
            0
        ] >= lowest:
            offset = self._take_operator(name)
            self._links += 1
            if self._links > LINKS_MAX:
                raise fail(
                    20927,
                    f"more than {LINKS_MAX} operators in one expression",
                    offset,
                )
            level, function = self.operators[name]
            right = self.expression(level + 1)
            left = self._binary(name, function, left, right, offset)
        return left

    def _binary(
        self,
        name: str,
        function: Callable[[Any, Any], Any],
        left: Formula,
        right: Formula,
        offset: int,
    ) -> Formula:
        if not (isinstance(left, Constant) and isinstance(right, Constant)):
            fast = _fast(name, left, right, offset)
            if fast is not None:
                return fast
        return guarded(function, (left, right), name, offset)

    def number(self, name: str, offset: int) -> Callable[[], float]:
        """An expression that gives a finite number."""
        return number_of(self.expression(), name, offset)

    def primary(self) -> Formula:
        """A number, a constant, a text, a variable, a function call or
        ``[expression]``.
        """
        stream, token = self._stream, self._stream.current
        if token.kind is Kind.NUMBER:
            return Constant(float(stream.next().text))
        if token.kind is Kind.STRING:
            stream.next()
            text = token.text[1:-1].replace('\\"', '"')
            return self.text(text, token.offset)
        if stream.is_op("["):
            opened = self.open()
            inner = self.expression()
            self.close(opened)
            return inner
        if stream.is_name(*self.constants):
            return Constant(self.constants[stream.next().text.upper()])
        if self.is_variable():
            return self.variable()
        name = self._function_name()
        if name is None:
            raise stream.no_value()
        return self._call(name)

    def open(self) -> int:
        """``[``; the offset where it stands."""
        bracket = self._stream.expect("[", 900004)
        self._depth += 1
        if self._depth > NESTING_MAX:
            raise fail(
                20927,
                f"more than {NESTING_MAX} brackets in each other",
                bracket.offset,
            )
        return bracket.offset

    def close(self, opened: int) -> None:
        if self._stream.at_end:
            raise fail(900013, "bracket is not closed", opened)
        self._stream.expect("]", 900004)
        self._depth -= 1

    def arguments(self) -> list[Formula]:
        """``[a, b, ...]``, at least one."""
        opened = self.open()
        found = [self.expression()]
        while self._stream.accept(","):
            found.append(self.expression())
        self.close(opened)
        return found

    def _signed(self) -> Formula:
        stream = self._stream
        offset = stream.current.offset
        if stream.accept("-"):
            return self._applied("-", NEGATIVE, [self.primary()], offset)
        stream.accept("+")
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

    def _function_name(self) -> str | None:
        """The function called at the current token, None if there is none."""
        stream = self._stream
        if stream.current.kind is not Kind.NAME:
            return None
        name, rest = (
            stream.current.text.upper(),
            stream.text[stream.following.offset :],
        )
        if name == "ATAN" and rest.startswith("2"):
            name, rest = "ATAN2", rest[1:].lstrip()
        known = name in self.functions or self.special(name) is not None
        return name if known and rest.startswith("[") else None

    def _call(self, name: str) -> Formula:
        stream = self._stream
        offset = stream.next().offset
        if name == "ATAN2":
            stream.next()
        special = self.special(name)
        if special is not None:
            return special(offset)
        function = self.functions[name]
        arguments = self.arguments()
        if not function.fewest <= len(arguments) <= function.most:
            raise fail(
                900004,
                f"{name} takes {function.fewest} arguments, not {len(arguments)}",
                offset,
            )
        return self._applied(name, function.compute, arguments, offset)

    def _applied(
        self,
        name: str,
        compute: Callable[..., Value],
        arguments: Sequence[Formula],
        offset: int,
    ) -> Formula:
        """A function, or a sign, of its arguments."""
        return guarded(compute, arguments, name, offset)
