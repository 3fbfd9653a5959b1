"""Expressions of the dialect, compiled: round brackets, bit operators, angles
in radians or degrees (RAD, DRG).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.expression import NESTING_MAX, round_half_away
from cnc_core.frontend.base.formula import (
    LINKS_MAX,
    Constant,
    Formula,
    FormulaParser,
    Function,
    guarded,
    number_of,
)
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail

from ..base.store import Store
from ..base.words import Number
from .variables import SYSTEM_NAME, SystemVariables

POWER = 9
# what a block reads: the running machine; what belongs to the end of its motion
# under G61; what time alone changes
LIVE, BEHIND_MOTION, TIMED = 1, 2, 4


def bits(value: float) -> int:
    """Bit operators drop the fraction."""
    return math.trunc(value)


OPERATORS: dict[str, tuple[int, Callable[[float, float], float]]] = {
    "||": (0, lambda a, b: float(bool(a) or bool(b))),
    "&&": (1, lambda a, b: float(bool(a) and bool(b))),
    "=": (2, lambda a, b: float(a == b)),
    "<>": (2, lambda a, b: float(a != b)),
    ">=": (2, lambda a, b: float(a >= b)),
    "<=": (2, lambda a, b: float(a <= b)),
    "<": (2, lambda a, b: float(a < b)),
    ">": (2, lambda a, b: float(a > b)),
    "|": (3, lambda a, b: float(bits(a) | bits(b))),
    "XOR": (4, lambda a, b: float(bits(a) ^ bits(b))),
    "&": (5, lambda a, b: float(bits(a) & bits(b))),
    "<<": (6, lambda a, b: float(_shifted(a, b))),
    ">>": (6, lambda a, b: float(_shifted(a, -b))),
    "+": (7, lambda a, b: a + b),
    "-": (7, lambda a, b: a - b),
    "*": (8, lambda a, b: a * b),
    "/": (8, lambda a, b: a / b),
    "^": (POWER, math.pow),
}
BITS = frozenset({"|", "&", "XOR", "<<", ">>"})
COMPARES = frozenset({"=", "<>", ">=", "<=", "<", ">"})
OPERATORS |= {"OR": OPERATORS["||"], "AND": OPERATORS["&&"]}
SHIFT_MAX = 1000


def _shifted(value: float, places: float) -> int:
    count = bits(places)
    if abs(count) > SHIFT_MAX:
        raise ValueError("shift")
    return bits(value) << count if count >= 0 else bits(value) >> -count


FUNCTIONS: dict[str, Callable[[float], float]] = {
    "LOG": math.log,
    "EXP": math.exp,
    "SQR": math.sqrt,
    "ABS": abs,
    "INT": lambda x: float(round_half_away(x)),
    "FIX": lambda x: float(math.trunc(x)),
}
OF_ANGLES: dict[str, Callable[[float], float]] = {
    "SIN": math.sin,
    "COS": math.cos,
    "TAN": math.tan,
}
TO_ANGLES: dict[str, Callable[[float], float]] = {
    "ASIN": math.asin,
    "ACOS": math.acos,
    "ATAN": math.atan,
}
FUNCTION_NAMES = (*FUNCTIONS, *OF_ANGLES, *TO_ANGLES)


class Formulas(FormulaParser):
    """Compiles the expressions of one block.

    ``drain``: one of them reads what only executed blocks can tell.

    ``live``: LIVE, BEHIND_MOTION.
    """

    operators = OPERATORS
    functions = {
        name: Function(compute, 1, 1) for name, compute in FUNCTIONS.items()
    }
    constants: dict[str, float] = {}
    word_operators = ("XOR", "AND", "OR")

    def __init__(
        self, stream: TokenStream, store: Store, system: SystemVariables
    ) -> None:
        super().__init__(stream)
        self._store, self._system = store, system
        self.drain = False
        self.live = 0
        self._blanks_part = False
        self._kinds: set[str] = (
            set()
        )  # of the operators between the same brackets

    # grammar

    def expression(self, lowest: int = 0) -> Formula:
        if not self._depth and not lowest:
            self._links = 0
        outer = self._kinds
        if not lowest:
            self._kinds = set()
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
            self._note_kind(name, offset)
            level, function = self.operators[name]
            right = self.expression(level if level == POWER else level + 1)
            left = self._binary(
                "==" if name == "=" else name, function, left, right, offset
            )
        if not lowest:
            self._kinds = outer
        return left

    def _note_kind(self, name: str, offset: int) -> None:
        """Bit operators beside comparisons: the guide does not say which binds
        tighter (A-07).
        """
        kind = (
            "bits" if name in BITS else "compares" if name in COMPARES else ""
        )
        if not kind and OPERATORS[name][0] < OPERATORS["="][0]:
            self._kinds = set()
        if kind:
            self._kinds.add(kind)
        if kind and len(self._kinds) == 2:
            self._store.warn(909108, f"{name}: {ERRORS[909108]}", offset)

    def signed(self) -> Formula:
        """A number, a variable, a function or brackets, with a sign: an
        argument that ends at a blank.
        """
        return self._signed()

    def primary(self) -> Formula:
        stream, token = self._stream, self._stream.current
        if token.kind is Kind.NUMBER:
            return Constant(float(stream.next().text))
        if stream.is_op("("):
            opened = self.open()
            inner = self.expression()
            self.close(opened)
            return inner
        if stream.is_op("["):
            raise fail(
                900004,
                "square brackets enclose the value of a word; inside use ( )",
                token.offset,
            )
        if token.kind is Kind.VARIABLE or (
            stream.is_name("_PM") and stream.following.text == "["
        ):
            return self.variable()
        name = self._function_name()
        if name is None:
            raise stream.no_value()
        return self._call(name)

    def open(self) -> int:
        bracket = self._stream.expect("(", 900004)
        self._deeper(bracket.offset)
        return bracket.offset

    def close(self, opened: int) -> None:
        self._closed(opened, ")")

    def bracketed(self) -> Formula:
        """``[expression]``: the value of a word, an index."""
        bracket = self._stream.expect("[", 900004)
        self._deeper(bracket.offset)
        inner = self.expression()
        self._closed(bracket.offset, "]")
        return inner

    def value(self, name: str) -> Number:
        """The value of a word: a number with a sign, or an expression in square
        brackets.
        """
        stream, offset = self._stream, self._stream.current.offset
        if stream.is_op("["):
            return number_of(self.bracketed(), name, offset)
        sign = -1.0 if stream.accept("-") else 1.0
        if sign > 0:
            stream.accept("+")
        if stream.current.kind is Kind.VARIABLE:
            raise fail(
                900004,
                f"{name}: write [{stream.current.text}]",
                stream.current.offset,
            )
        if stream.current.kind is not Kind.NUMBER:
            raise fail(
                900004,
                f"{name}: a number or [ ] is expected, found {stream.describe()}",
                offset,
            )
        value = sign * float(stream.next().text)
        return lambda: value

    def argument(self, name: str) -> Number:
        """An argument of an instruction that ends at a blank or comma; square
        brackets are allowed too.
        """
        offset = self._stream.current.offset
        inner = self.bracketed() if self._stream.is_op("[") else self._signed()
        return number_of(inner, name, offset)

    def joined(self, name: str) -> Number:
        """An expression that ends at a blank: ``$A+1 -2`` are two."""
        if self._stream.is_op("["):
            return self.argument(name)
        self._blanks_part, offset = True, self._stream.current.offset
        try:
            return number_of(self.expression(), name, offset)
        finally:
            self._blanks_part = False

    def _operator(self) -> str | None:
        """In ``joined`` a blank ends the expression, outside brackets."""
        stream = self._stream
        at = stream.current.offset
        if (
            self._blanks_part
            and not self._depth
            and stream.text[:at][-1:].isspace()
        ):
            return None
        return super()._operator()

    def full(self, name: str) -> Number:
        """A whole expression."""
        offset = self._stream.current.offset
        return number_of(self.expression(), name, offset)

    # parts

    def _deeper(self, offset: int) -> None:
        self._depth += 1
        if self._depth > NESTING_MAX:
            raise fail(
                20927, f"more than {NESTING_MAX} brackets in each other", offset
            )

    def _closed(self, opened: int, sign: str) -> None:
        if self._stream.at_end:
            raise fail(900013, "bracket is not closed", opened)
        self._stream.expect(sign, 900004)
        self._depth -= 1

    def _signed(self) -> Formula:
        stream, offset = self._stream, self._stream.current.offset
        if not stream.is_op("-", "+", "!", "~"):
            return self.primary()
        self._deeper(offset)
        sign = stream.next().text
        inner = self._signed()
        self._depth -= 1
        if sign == "+":
            return inner
        if sign == "-":
            return guarded(lambda x: -x, (inner,), "-", offset)
        return guarded(lambda x: ~bits(x), (inner,), sign, offset)

    def _function_name(self) -> str | None:
        stream = self._stream
        name = stream.current.text.upper()
        if name not in FUNCTION_NAMES:
            return None
        if stream.following.text != "(":
            raise fail(
                900004,
                f"{name}: its argument stands in ( )",
                stream.current.offset,
            )
        return name

    def _call(self, name: str) -> Formula:
        offset = self._stream.next().offset
        arguments = self.arguments()
        if len(arguments) != 1:
            raise fail(
                900004, f"{name} takes 1 argument, not {len(arguments)}", offset
            )
        if name in FUNCTIONS:
            return guarded(FUNCTIONS[name], arguments, name, offset)
        argument = number_of(arguments[0], name, offset)
        system = self._system
        if name in OF_ANGLES:
            function = OF_ANGLES[name]
            later = [
                lambda: (
                    math.radians(argument()) if system.degrees else argument()
                )
            ]
            return guarded(function, later, name, offset)
        function = TO_ANGLES[name]

        def angle(value: float) -> float:
            return (
                math.degrees(function(value))
                if system.degrees
                else function(value)
            )

        return guarded(angle, [lambda: float(argument())], name, offset)

    # variables

    def variable(self) -> Formula:
        """``$NAME``, ``$ARR[i]``, ``$_Q0``, ``$_PM[n, par]``."""
        token = self._stream.next()
        name = variable_name(token.text)
        if name.startswith("_"):
            return self._system_variable(name, token.offset)
        if self._stream.is_op("[", "("):
            index, array = self.index(name), self._store
            return lambda: array.element(name, index(), token.offset)
        store = self._store
        return lambda: store.read(name, token.offset)

    def index(self, name: str) -> Number:
        """``[i]`` or ``(i)`` behind an array's name."""
        offset = self._stream.current.offset
        if self._stream.is_op("["):
            return number_of(self.bracketed(), name, offset)
        opened = self.open()
        inner = self.expression()
        self.close(opened)
        return number_of(inner, name, offset)

    def pair(self) -> tuple[Number, Number | None]:
        """``[n]`` or ``[n, par]`` of the positioners."""
        bracket = self._stream.expect("[", 900004)
        self._deeper(bracket.offset)
        first = self.full("positioner")
        second = self.full("par") if self._stream.accept(",") else None
        self._closed(bracket.offset, "]")
        return first, second

    def _system_variable(self, name: str, offset: int) -> Formula:
        system = self._system
        if name == "_PM":
            number, par = self.pair()
            self.live |= LIVE | BEHIND_MOTION | TIMED
            return lambda: system.positioners.status(
                number(), par() if par else 0.0, offset
            )
        found = SYSTEM_NAME.fullmatch(name)
        if not found:
            raise fail(909101, f"${name}: {ERRORS[909101]}", offset)
        family, number_text = found[1], int(found[2])
        read = system.reader(family, number_text, offset)
        self.drain = self.drain or system.drains(family)
        self.live |= (LIVE if system.lives(family) else 0) | (
            BEHIND_MOTION if system.moves(family) else 0
        )
        self.live |= TIMED if family == "T" else 0
        return read

    def target(self) -> Callable[[float], None]:
        """What an assignment or an instruction writes to: the variable at the
        current token.
        """
        stream = self._stream
        if stream.current.kind is not Kind.VARIABLE:
            raise fail(
                900004,
                f"a variable is expected, found {stream.describe()}",
                stream.current.offset,
            )
        token = stream.next()
        name = variable_name(token.text)
        store = self._store
        system = self._system
        if name.startswith("_"):
            found = SYSTEM_NAME.fullmatch(name)
            if not found:
                raise fail(909101, f"${name}: {ERRORS[909101]}", token.offset)
            return system.writer(found[1], int(found[2]), token.offset)
        if stream.is_op("[", "("):
            index = self.index(name)
            return lambda value: store.set_element(
                name, index(), value, token.offset
            )
        return lambda value: store.write(name, value, token.offset)


def variable_name(text: str) -> str:
    """Name in capitals without ``$``; a blank behind ``$`` stands for the
    underscore of the system variables.
    """
    name = text.removeprefix("$").upper()
    if name[:1].isspace():
        name = name.lstrip()
        return name if name.startswith("_") else "_" + name
    return name
