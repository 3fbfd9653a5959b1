"""Typed variables of NC programs: types with ranges, arrays, scopes by program
level, lookup by name.

Numbers are Python floats whatever their declared type, texts are ``str``.
Errors carry the offset in the block's text that the caller gives.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.lexer import fail

Value = float | str

ELEMENTS_MAX = 1_000_000  # of one array
ELEMENTS_OF_ALL = 4_000_000  # of all arrays of a program together
DIMENSIONS_MAX = 4
LOOKED_THROUGH = 1000  # arrays taken before those that are gone are forgotten

NOT_DECLARED, NOT_A_NUMBER, NOT_A_TEXT, OUT_OF_RANGE = (
    907010,
    907011,
    907012,
    907013,
)
WRONG_INDEX, WRONG_INDICES, READ_ONLY, DECLARED_TWICE = (
    907014,
    907015,
    907016,
    907017,
)


@dataclass(frozen=True)
class DataType:
    """A type.  Whole numbers are rounded, halves away from zero, then checked
    against ``low`` and ``high``.
    """

    name: str
    low: float = -math.inf
    high: float = math.inf
    whole: bool = False
    characters: int | None = None  # of a text at most; None: not a text

    @property
    def initial(self) -> Value:
        return 0.0 if self.characters is None else ""

    def convert(self, value: Value, name: str, offset: int) -> Value:
        """The value as this type keeps it; an error if it cannot."""
        if self.characters is not None:
            return self._text(value, name, offset)
        if isinstance(value, str):
            raise fail(
                NOT_A_NUMBER,
                f"{name} is {self.name}, the value is a text",
                offset,
            )
        if self.whole:
            if not math.isfinite(value):
                raise fail(OUT_OF_RANGE, f"{name}: no finite number", offset)
            value = float(round_half_away(value))
        if not self.low <= value <= self.high or math.isinf(value):
            raise fail(
                OUT_OF_RANGE,
                f"{name}: {value:.17g} is no {self.name}{self._range()}",
                offset,
            )
        return value

    def number(self, value: Value, name: str, offset: int) -> float:
        """As ``convert``, of a type whose values are numbers."""
        found = self.convert(value, name, offset)
        assert not isinstance(found, str)
        return found

    def _range(self) -> str:
        return (
            f" ({self.low:.0f}..{self.high:.0f})"
            if math.isfinite(self.low)
            else ""
        )

    def _text(self, value: Value, name: str, offset: int) -> str:
        if not isinstance(value, str):
            raise fail(
                NOT_A_TEXT, f"{name} is a text, the value is a number", offset
            )
        if len(value) > (self.characters or 0):
            raise fail(
                OUT_OF_RANGE,
                f"{name}: text longer than {self.characters} characters",
                offset,
            )
        return value


REAL64 = DataType("REAL64")
TEXT_MAX = 126


def text_type(characters: int) -> DataType:
    """STRING[n]."""
    return DataType(f"STRING[{characters}]", characters=characters)


def whole_type(name: str, bits: int, signed: bool) -> DataType:
    """SGNxx, UNSxx and their like."""
    low, high = (
        (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        if signed
        else (0, 2**bits - 1)
    )
    return DataType(name, float(low), float(high), whole=True)


class Variable:
    """A variable or an array; ``dimensions`` is empty for a single value."""

    __slots__ = (
        "__weakref__",
        "dimensions",
        "name",
        "read_only",
        "type",
        "values",
    )

    def __init__(
        self, name: str, kind: DataType, dimensions: tuple[int, ...] = ()
    ) -> None:
        self.name, self.type, self.dimensions, self.read_only = (
            name,
            kind,
            dimensions,
            False,
        )
        self.values: list[Value] = [kind.initial] * math.prod(dimensions)

    def place(self, indices: Sequence[Value], offset: int) -> int:
        """Where the element stands in ``values``, row by row."""
        if len(indices) != len(self.dimensions):
            raise fail(
                WRONG_INDICES,
                f"{self.name} has {len(self.dimensions)} dimensions, not {len(indices)}",
                offset,
            )
        place = 0
        for value, size in zip(indices, self.dimensions, strict=True):
            if isinstance(value, str):
                raise fail(
                    NOT_A_NUMBER, f"{self.name}: an index is a text", offset
                )
            index = round_half_away(value)
            if not 0 <= index < size:
                raise fail(
                    WRONG_INDEX,
                    f"{self.name}: index {index} out of range 0..{size - 1}",
                    offset,
                )
            place = place * size + index
        return place

    def load(self, indices: Sequence[Value] = (), offset: int = 0) -> Value:
        return self.values[self.place(indices, offset)]

    def store(
        self, value: Value, indices: Sequence[Value] = (), offset: int = 0
    ) -> None:
        place = self.place(indices, offset)
        if self.read_only:
            raise fail(READ_ONLY, f"{self.name} is read only", offset)
        self.values[place] = self.type.convert(value, self.name, offset)

    def fill(self, values: Sequence[Value], offset: int) -> None:
        """Initial values, row by row; elements without one keep their initial
        value.
        """
        if len(values) > len(self.values):
            raise fail(
                WRONG_INDICES,
                f"{self.name}: {len(values)} values for {len(self.values)} elements",
                offset,
            )
        for place, value in enumerate(values):
            self.values[place] = self.type.convert(value, self.name, offset)


def check_dimensions(
    name: str, sizes: Sequence[Value], offset: int
) -> tuple[int, ...]:
    """The sizes of an array as whole numbers in their range."""
    whole = []
    for size in sizes:
        if (
            isinstance(size, str)
            or not 1 <= round_half_away(size) <= ELEMENTS_MAX
        ):
            raise fail(
                OUT_OF_RANGE,
                f"{name}: size {size} out of range 1..{ELEMENTS_MAX}",
                offset,
            )
        whole.append(round_half_away(size))
    if len(whole) > DIMENSIONS_MAX or math.prod(whole) > ELEMENTS_MAX:
        raise fail(
            OUT_OF_RANGE,
            f"{name}: at most {DIMENSIONS_MAX} dimensions and {ELEMENTS_MAX} elements",
            offset,
        )
    return tuple(whole)


class ArrayRoom:
    """Elements of the arrays of a program that have not been given up."""

    def __init__(self) -> None:
        self._held: list[tuple[weakref.ref[object], int]] = []
        self._elements, self._look_at = 0, LOOKED_THROUGH

    def take(self, array: object, size: int, name: str, offset: int) -> None:
        """Room for one more; the caller drops it where there is none."""
        self._held.append((weakref.ref(array), size))
        self._elements += size
        many = len(self._held) > self._look_at
        if many or self._elements > ELEMENTS_OF_ALL:
            self._look_through()
        if self._elements > ELEMENTS_OF_ALL:
            raise fail(
                OUT_OF_RANGE,
                f"{name}: more than {ELEMENTS_OF_ALL} elements in all arrays",
                offset,
            )

    def _look_through(self) -> None:
        self._held = [one for one in self._held if one[0]() is not None]
        self._elements = sum(size for _, size in self._held)
        self._look_at = 2 * len(self._held) + LOOKED_THROUGH


class Scope(dict[str, Variable]):
    """Variables of one family or one program level by name."""


class LevelScopes:
    """Scopes of nested program levels: a name is looked up from the innermost
    level outwards.
    """

    def __init__(self) -> None:
        self._scopes: list[Scope] = [Scope()]

    def push(self) -> None:
        """A program level begins."""
        self._scopes.append(Scope())

    def pop(self) -> None:
        """The scope ends: its declarations are gone."""
        self._scopes.pop()

    @property
    def depth(self) -> int:
        return len(self._scopes)

    @property
    def innermost(self) -> Scope:
        return self._scopes[-1]

    def get(self, name: str) -> Variable | None:
        for scope in reversed(self._scopes):
            if name in scope:
                return scope[name]
        return None

    def delete(self, name: str) -> bool:
        """Remove the innermost variable of this name; False if there is none."""
        for scope in reversed(self._scopes):
            if name in scope:
                del scope[name]
                return True
        return False

    def declare_beside(self, known: str, name: str, variable: Variable) -> None:
        """A variable in the scope that holds ``known``."""
        for scope in reversed(self._scopes):
            if known in scope:
                scope[name] = variable
                return

    def __iter__(self) -> Iterator[Variable]:
        for scope in self._scopes:
            yield from scope.values()
