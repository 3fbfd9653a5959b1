"""What an expression is: its type, its C text, where it lies, what it is worth."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from typing import Any

from ..model import types
from ..model.classes import Class, Routine
from ..model.world import VariableList


@dataclass(slots=True)
class Value:
    """A typed expression.

    ``text``: the C expression of a scalar, the address of all else.
    ``place``: the address where it lies, empty for results.
    ``constant``: its value where it is known now.
    ``weak``: a literal without a type of its own takes the other's.
    ``bits``: width that TwinCAT would give a whole number.
    ``calls``: computing it runs the user's code.
    ``inverted``: NOT of a literal; unsigned types take all its bits.
    ``array``: of an element of the HLI's pointers the address of their array.
    """

    type: types.Type
    text: str
    place: str = ""
    constant: Any = None
    weak: bool = False
    bits: int = 0
    calls: bool = False
    writable: bool = False
    bit: tuple[int, int] | None = None
    flag: bool = False
    local: bool = False
    spelled: str = ""
    bounds: tuple[str, ...] = ()
    trusted: bool = False
    array: str = ""
    exact: bool = False
    inverted: bool = False

    @property
    def base(self) -> types.Type:
        """The elementary type behind a subrange or enumeration."""
        return types.plain(self.type)

    def with_text(self, text: str) -> Value:
        """The same value behind another C text, now a mere result."""
        return replace(self, text=text, place="", constant=None, writable=False)


@dataclass(slots=True)
class NamespaceRef:
    """A list of global variables, by its name."""

    list: VariableList


@dataclass(slots=True)
class LibraryRef:
    """``Tc2_Standard`` in front of a name."""

    name: str


@dataclass(slots=True)
class TypeRef:
    """A type's name where a value may stand: ``E_Color`` of ``E_Color.Red``."""

    type: types.Type


@dataclass(slots=True)
class RoutineRef:
    """A method bound to an instance, or a function without one.

    ``instance`` is the address; ``static`` when the class is known exactly.
    """

    routine: Routine
    instance: str = ""
    static: bool = True
    interface: Class | None = None
    calls: bool = False


@dataclass(slots=True)
class PropertyRef:
    """A property of an instance."""

    name: str
    type: types.Type
    instance: str
    cls: Class
    static: bool
    calls: bool = False


@dataclass(slots=True)
class BuiltinRef:
    """A standard function."""

    name: str


Entity = (
    Value
    | NamespaceRef
    | LibraryRef
    | TypeRef
    | RoutineRef
    | PropertyRef
    | BuiltinRef
)


def c_number(type_: types.Type, value: Any) -> str:
    """A constant as C writes it, cast to its type."""
    base = types.plain(type_)
    if not isinstance(base, types.Elementary):
        return f"((st_ptr){int(value)}u)"
    if base.family == "real":
        return c_real(base, float(value))
    if base.family == "bool":
        return "1" if value else "0"
    if base.signed and value == -(1 << 63):
        return "((st_i64)(-9223372036854775807ll - 1))"
    suffix = "ll" if base.signed else "ull" if base.bits == 64 else "u"
    if base.signed and base.bits < 64:
        suffix = ""
    return f"(({base.c}){value}{suffix})"


def c_real(base: types.Elementary, value: float) -> str:
    """A REAL or LREAL, exactly."""
    if base.bits == 32:
        value = round_to_real(value)
    if value != value:  # noqa: PLR0124
        return f'(({base.c})__builtin_nan(""))'
    if value in (float("inf"), float("-inf")):
        sign = "-" if value < 0 else ""
        return f"(({base.c}){sign}__builtin_inf())"
    return f"(({base.c}){value.hex()})"


def round_to_real(value: float) -> float:
    """The nearest REAL."""
    try:
        return float(struct.unpack("f", struct.pack("f", value))[0])
    except OverflowError:
        return float("inf") if value > 0 else float("-inf")


def constant(type_: types.Type, value: Any, weak: bool = False) -> Value:
    """A value that is known now."""
    bits = getattr(types.plain(type_), "bits", 0)
    return Value(
        type_,
        c_number(type_, value),
        constant=value,
        weak=weak,
        bits=bits,
    )


def load(type_: types.Type, address: str) -> str:
    """C text that reads a scalar at an address."""
    base = types.plain(type_)
    if isinstance(base, types.Elementary) and base.family == "bool":
        return f"ST_BOOL({address})"
    return f"(*({types.c_type(type_)} *)({address}))"


def at(type_: types.Type, address: str, writable: bool = True) -> Value:
    """The value at an address."""
    text = load(type_, address) if type_.scalar else address
    bits = getattr(types.plain(type_), "bits", 0)
    return Value(type_, text, place=address, writable=writable, bits=bits)


def address(base: str, offset: int) -> str:
    """``base + offset`` in C."""
    return f"({base} + {offset})" if offset else base
