"""E and L variables, and the expressions that may be assigned to them."""

from __future__ import annotations

import math
import re

from cnc_core import plain
from cnc_core.frontend.base import expression
from cnc_core.frontend.base.expression import ExpressionParser
from cnc_core.frontend.base.lexer import Kind, Token, TokenStream, fail

PATTERN = re.compile(
    r"""(?P<NUMBER>[0-9]+(?:\.[0-9]*)?|\.[0-9]+)
      | (?P<VARIABLE>[EL][0-9]+|JRS(?![A-Za-z_])|XW03(?![0-9]))
      | (?P<NAME>[A-Za-z_]+)
      | (?P<OP>\S)""",
    re.X,
)
FIELD = re.compile(r"([+-]?)([EL])([0-9]+)$")  # a variable in place of a number
JERK_SCALE = "JRS"
MOVEMENT = "XW03"  # the type of movement that the machine logic reads
NUMBER_MAX = 100_000
VALUES_MAX = 1e30


def variable_number(digits: str, letter: str, offset: int) -> int:
    """Number of a variable; too large ones are an error, however many digits
    they have.
    """
    plain = digits.lstrip("0") or "0"
    if len(plain) > len(str(NUMBER_MAX)) or int(plain) > NUMBER_MAX:
        raise fail(
            900012,
            f"{letter}{plain[:12]}{'..' if len(plain) > 12 else ''}: "
            f"variables go up to {NUMBER_MAX}",
            offset,
        )
    return int(plain)


def no_movement(offset: int) -> Exception:
    """What a program that names XW03 is told."""
    return fail(
        900003,
        f"{MOVEMENT} is not supported: the values of the type of movement "
        "are not published",
        offset,
    )


class Variables:
    """Values by letter and number; what was never assigned is 0."""

    def __init__(self) -> None:
        self._values: dict[tuple[str, int], float] = {}

    def __call__(self, letter: str, number: int) -> float:
        return self._values.get((letter, number), 0.0)

    @property
    def jerk_scale(self) -> float | None:
        """JRS, which profiles without a scale of their own take; None: never
        assigned.
        """
        return self._values.get((JERK_SCALE, 0))

    def known(self, letter: str, number: int) -> bool:
        return (letter, number) in self._values

    def assign(
        self, letter: str, number: int, value: float, offset: int
    ) -> None:
        if not abs(value) < VALUES_MAX:
            raise fail(900012, f"{letter}{number}: value out of range", offset)
        self._values[letter, number] = value


class Formulas(ExpressionParser):
    """``+ - * /``, functions and round brackets."""

    operators = {
        "+": (0, lambda a, b: a + b),
        "-": (0, lambda a, b: a - b),
        "*": (1, lambda a, b: a * b),
        "/": (1, lambda a, b: a / b),
    }
    functions = {
        "SIN": expression.FUNCTIONS["SIN"],
        "COS": expression.FUNCTIONS["COS"],
        "TAN": expression.FUNCTIONS["TAN"],
        "ARS": lambda x: math.degrees(plain.asin(x)),
        "ARC": lambda x: math.degrees(plain.acos(x)),
        "ART": lambda x: math.degrees(plain.atan(x)),
        "SQR": math.sqrt,
        "ABS": abs,
        "INT": lambda x: float(math.trunc(x)),
        "NEG": lambda x: -x,
    }
    functions_of_two = {"MOD": math.fmod}

    def __init__(self, stream: TokenStream, variables: Variables) -> None:
        super().__init__(stream)
        self._values = variables

    def primary(self) -> float:
        stream, token = self._stream, self._stream.current
        if token.kind is Kind.VARIABLE:
            stream.next()
            return self._values(*_named(token))
        if token.kind is Kind.NUMBER:
            return float(stream.next().text)
        name = token.text.upper() if token.kind is Kind.NAME else ""
        if name in self.functions or name in self.functions_of_two:
            stream.next()
            arguments = self._arguments()
            return self._call_with(name, arguments, token.offset)
        if stream.is_op("("):
            return self._arguments(1)[0]
        raise fail(
            900004,
            f"a value is expected, found {stream.describe()}",
            token.offset,
        )

    def _arguments(self, count: int = 2) -> list[float]:
        self._deeper("brackets", self._stream.current.offset)
        self._stream.expect("(", 900004)
        values = [self.expression()]
        while len(values) < count and self._stream.accept(","):
            values.append(self.expression())
        self._stream.expect(")", 900004)
        self._depth -= 1
        return values

    def _call_with(
        self, name: str, arguments: list[float], offset: int
    ) -> float:
        one = self.functions.get(name)
        two = self.functions_of_two.get(name)
        if (len(arguments) == 1) != (one is not None):
            raise fail(900004, f"{name}: wrong number of values", offset)
        if one is not None:
            return expression.finite(one, (arguments[0],), name, offset)
        assert two is not None
        return expression.finite(
            two, (arguments[0], arguments[1]), name, offset
        )


def assignment(text: str, variables: Variables, begin: int) -> None:
    """``E1=..``, ``L1=..`` or ``JRS=..`` from ``begin`` on, executed."""
    stream = TokenStream(text, PATTERN)
    stream.skip_to(begin)
    target = stream.next()
    stream.expect("=", 900004)
    value = Formulas(stream, variables).expression()
    if not stream.at_end:
        raise fail(
            900004,
            f"{stream.describe()} behind the assignment",
            stream.current.offset,
        )
    letter, number = _named(target)
    if letter == JERK_SCALE and value < 0.0:
        raise fail(900012, f"JRS={value:g}: it is not negative", target.offset)
    variables.assign(letter, number, value, target.offset)


def _named(token: Token) -> tuple[str, int]:
    """Letter and number of a variable; JRS has the number 0."""
    if token.text == JERK_SCALE:
        return JERK_SCALE, 0
    if token.text == MOVEMENT:
        raise no_movement(token.offset)
    letter = token.text[0]
    return letter, variable_number(token.text[1:], letter, token.offset)
