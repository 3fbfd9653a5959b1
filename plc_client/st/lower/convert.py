"""Conversions between types: those that happen by themselves and those by name."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..errors import RANGE, TYPE, Position, StopHere
from ..model import types
from ..model.classes import ClassType, InterfaceType
from ..model.literals import whole_type
from .value import Value, c_number, constant, round_to_real

if TYPE_CHECKING:
    from .context import Context

BY_NUMBER = ("HLI_CHANNEL", "HLI_AXIS")  # blocks take their index
_SIGNED = {8: types.SINT, 16: types.INT, 32: types.DINT, 64: types.LINT}


def common(left: Value, right: Value) -> types.Elementary | None:
    """The type in which two numbers meet; None: they do not."""
    a, b = left.base, right.base
    if not (_number(a) and _number(b)):
        return None
    assert isinstance(a, types.Elementary)
    assert isinstance(b, types.Elementary)
    if left.weak and not right.weak:
        return _meet(b, left)
    if right.weak and not left.weak:
        return _meet(a, right)
    return wider(a, b)


def _number(type_: types.Type) -> bool:
    return isinstance(type_, types.Elementary) and type_.family in (
        "int",
        "bit",
        "real",
    )


def _meet(type_: types.Elementary, literal: Value) -> types.Elementary:
    """The type of an operation with a literal."""
    other = literal.base
    assert isinstance(other, types.Elementary)
    if type_.family == "real":
        return type_
    if other.family == "real":
        return types.LREAL if type_.bits > 16 else types.REAL
    if type_.low <= literal.constant <= type_.high:
        return type_
    return wider(type_, whole_type(literal.constant))


def wider(a: types.Elementary, b: types.Elementary) -> types.Elementary:
    """The smallest type that holds both; 64 bits of both signs give LINT."""
    if a is b:
        return a
    if "real" in (a.family, b.family):
        if types.LREAL in (a, b):
            return types.LREAL
        return types.REAL
    if a.signed == b.signed:
        return a if a.bits >= b.bits else b
    signed, unsigned = (a, b) if a.signed else (b, a)
    if signed.bits > unsigned.bits:
        return signed
    return _SIGNED[min(unsigned.bits * 2, 64)]


def cast(value: Value, target: types.Type) -> Value:
    """A number as another number; C wraps whole numbers, reals are rounded."""
    source, base = value.base, types.plain(target)
    assert isinstance(source, types.Elementary)
    assert isinstance(base, types.Elementary)
    if value.constant is not None:
        return constant(target, cast_constant(value.constant, source, base))
    if source.c == base.c:
        text = value.text
    elif base.family == "bool":
        text = f"({value.text} != 0)"
    elif source.family == "real" and base.family != "real":
        text = _rounded(value.text, base)
    else:
        text = f"(({base.c}){value.text})"
    found = value.with_text(text)
    found.type, found.bits, found.weak = target, base.bits, False
    return found


def _rounded(text: str, base: types.Elementary) -> str:
    if base.bits == 64 and not base.signed:
        return f"st_round_u64({text})"
    return f"(({base.c})st_round({text}))"


def cast_constant(
    value: float, source: types.Elementary, base: types.Elementary
) -> float:
    """The same at compile time."""
    if base.family == "bool":
        return int(value != 0)
    if base.family == "real":
        return round_to_real(value) if base.bits == 32 else float(value)
    if source.family == "real":
        if not math.isfinite(value):
            return 0
        value = round(value)
    return base.wrap(int(value))


def implicit(
    context: Context, value: Value, target: types.Type, pos: Position
) -> Value:
    """The value as the target's type.  StopHere: TwinCAT does not allow it."""
    if value.type is target:
        return value
    if target is types.ANY:
        return as_any(context, value)
    if target is types.ANY_TYPE and value.type is types.ANY:
        return Value(target, value.text, calls=value.calls)
    for rule in (_address_like, _enum_like, _text_like, _number_like):
        found = rule(context, value, target, pos)
        if found is not None:
            return found
    if types.same(value.type, target):
        return value
    raise mismatch(value.type, target, pos)


def mismatch(source: types.Type, target: types.Type, pos: Position) -> StopHere:
    """The error of a conversion that does not exist."""
    text = f"{source} does not convert to {target}"
    base, goal = types.plain(source), types.plain(target)
    if isinstance(base, types.Elementary) and isinstance(
        goal, types.Elementary
    ):
        text += f"; use {base.name}_TO_{goal.name}"
    return StopHere(TYPE, text, pos)


def _address_like(
    context: Context, value: Value, target: types.Type, pos: Position
) -> Value | None:
    if isinstance(target, types.PointerType) and not target.reference:
        return _pointer(context, value, target, pos)
    if isinstance(target, InterfaceType):
        return _interface(value, target, pos)
    base = types.plain(target)
    if isinstance(value.type, types.PointerType) and isinstance(
        base, types.Elementary
    ):
        if base.whole and base.bits == 64:
            text = f"(({base.c})(st_uptr){value.text})"
            found = value.with_text(text)
            found.type = target
            return found
        text = f"a pointer has 64 bits, {target} has not; use LWORD"
        if str(value.type.target) in BY_NUMBER:
            spelled = value.spelled.replace("[]", "[i]")
            text = f"{spelled} is a pointer; write its number, i"
        raise StopHere(TYPE, text, pos)
    return None


def _pointer(
    context: Context, value: Value, target: types.PointerType, pos: Position
) -> Value:
    source = value.type
    found = value.with_text(value.text)
    found.type = target
    if isinstance(source, types.PointerType):
        if not types.same(source, target) and not value.exact:
            context.warn(f"{source} is used as {target}", pos)
        return found
    base = types.plain(source)
    whole = isinstance(base, types.Elementary) and base.whole
    if whole and (base.size == 8 or value.constant is not None):
        found.text = f"((st_ptr)(st_uptr){value.text})"
        return found
    if isinstance(source, InterfaceType):
        return found
    raise mismatch(source, target, pos)


def _interface(value: Value, target: InterfaceType, pos: Position) -> Value:
    source = value.type
    if isinstance(source, InterfaceType):
        if source.cls is target.cls or source.cls.is_a(target.cls):
            return value
    elif isinstance(source, ClassType) and value.place:
        if source.cls.is_a(target.cls):
            found = value.with_text(value.place)
            found.type = target
            return found
        text = f"{source} does not implement {target}"
        raise StopHere(TYPE, text, pos)
    elif value.constant == 0:
        return Value(target, "((st_ptr)0)", constant=0)
    raise mismatch(source, target, pos)


def _enum_like(
    context: Context, value: Value, target: types.Type, pos: Position
) -> Value | None:
    source = value.type
    if not isinstance(target, types.EnumType):
        return None
    if source is target:
        return value
    if isinstance(source, types.EnumType):
        if not target.strict:
            context.warn(f"{source} is used as {target}", pos)
            return cast(value, target)
        raise mismatch(source, target, pos)
    base = value.base
    if isinstance(base, types.Elementary) and base.whole:
        if target.strict and value.constant not in target.values.values():
            raise mismatch(source, target, pos)
        return cast(value, target)
    return None


def _text_like(
    context: Context, value: Value, target: types.Type, pos: Position
) -> Value | None:
    source = value.type
    if not isinstance(source, types.StringType):
        return None
    if isinstance(target, types.StringType) and target.wide == source.wide:
        return value
    return None


def _number_like(
    context: Context, value: Value, target: types.Type, pos: Position
) -> Value | None:
    source, base = value.base, types.plain(target)
    if not isinstance(source, types.Elementary) or not isinstance(
        base, types.Elementary
    ):
        return None
    if source is base and not isinstance(target, types.Subrange):
        return value
    check_number(context, value, source, base, pos)
    found = cast(value, target)
    if isinstance(target, types.Subrange):
        return _in_subrange(context, found, target, pos)
    return found


def _in_subrange(
    context: Context, value: Value, target: types.Subrange, pos: Position
) -> Value:
    if value.constant is None:
        return value
    if not target.low <= value.constant <= target.high:
        text = f"{value.constant} is outside of {target}"
        raise StopHere(RANGE, text, pos)
    return value


def check_number(  # noqa: PLR0911
    context: Context,
    value: Value,
    source: types.Elementary,
    base: types.Elementary,
    pos: Position,
) -> None:
    """StopHere or a warning for conversions that lose something."""
    if source is base:
        return
    if base.family == "real" and source.family in ("int", "bit"):
        return
    if base.family == "real" and source.family == "real":
        _check_real(value, base, pos)
        if base.bits < source.bits and not value.weak:
            context.warn(f"{source} to {base} may lose digits", pos)
        return
    if base.whole and source.whole:
        _check_whole(context, value, source, base, pos)
        return
    if base.family == source.family == "time":  # noqa: SIM102
        if base.bits >= source.bits or value.constant is not None:
            return
    if value.weak and value.constant in (0, 1) and base.family == "bool":
        return
    if base.family == "time" and source.whole and value.constant == 0:
        return
    raise mismatch(value.type, base, pos)


def _check_real(value: Value, base: types.Elementary, pos: Position) -> None:
    """StopHere: the constant is larger than any number of the type."""
    number = value.constant
    if number is None or not value.weak or not math.isfinite(number):
        return
    if math.isinf(cast_constant(number, types.LREAL, base)):
        text = f"{number:g} does not fit {base}, which holds up to 3.4028235e38"
        raise StopHere(RANGE, text, pos)


def _check_whole(
    context: Context,
    value: Value,
    source: types.Elementary,
    base: types.Elementary,
    pos: Position,
) -> None:
    if value.constant is not None:
        fits = base.low <= value.constant <= base.high
        bits = (1 << base.bits) - 1
        if value.inverted and -bits - 1 <= value.constant:
            return
        if not fits and not (value.exact and 0 <= value.constant <= bits):
            if value.weak:
                text = f"{value.constant} does not fit {base}"
                text += f", which holds {base.low}..{base.high}"
                raise StopHere(RANGE, text, pos)
            raise mismatch(value.type, base, pos)
        return
    width = value.bits or source.bits
    if width > base.bits:
        raise mismatch(value.type, base, pos)
    if (
        source.bits > base.bits or source.signed != base.signed
    ) and source.bits >= base.bits:
        context.warn(f"{source} to {base} may change the value", pos)


def text_constant(value: Value, target: types.Type) -> str:
    """A constant number as C text of another type."""
    return c_number(target, value.constant)


# -- ANY: where the value is, its size, its class
_ORDER = [
    "BOOL",
    "BIT",
    "BYTE",
    "WORD",
    "DWORD",
    "LWORD",
    "SINT",
    "INT",
    "DINT",
    "LINT",
    "USINT",
    "UINT",
    "UDINT",
    "ULINT",
    "REAL",
    "LREAL",
    "STRING",
    "WSTRING",
    "TIME",
    "DATE",
    "DATE_AND_TIME",
    "TIME_OF_DAY",
]
_POINTER, _REFERENCE, _SUBRANGE, _ENUM, _ARRAY, _USER = 22, 23, 24, 25, 26, 28
_LTIME = 37


_KINDS: list[tuple[type, int]] = [
    (types.Subrange, _SUBRANGE),
    (types.EnumType, _ENUM),
    (types.ArrayType, _ARRAY),
]


def class_of(type_: types.Type) -> int:
    """The number in TYPE_CLASS."""
    name = type_.name
    if isinstance(type_, types.StringType):
        name = "WSTRING" if type_.wide else "STRING"
    elif isinstance(type_, types.PointerType):
        return _REFERENCE if type_.reference else _POINTER
    elif not isinstance(type_, types.Elementary):
        found = (n for kind, n in _KINDS if isinstance(type_, kind))
        return next(found, _USER)
    return _ORDER.index(name) if name in _ORDER else _LTIME


def as_any(context: Context, value: Value) -> Value:
    """A variable is handed over by its address, all else by that of a copy."""
    type_ = value.type
    where = value.place if value.bit is None else ""
    before = ""
    if not where and type_.scalar and not isinstance(type_, InterfaceType):
        name = context.scalar(type_)
        before, where = f"{name} = {value.text}, ", f"(st_ptr)&{name}"
    elif not where or isinstance(type_, ClassType):
        where = value.place or value.text
    buffer = context.buffer(types.ANY.size)
    text = (
        f"({before}*(st_ptr *){buffer} = (st_ptr)({where}), "
        f"*(st_i32 *)({buffer} + 8) = {type_.size}, "
        f"*(st_i32 *)({buffer} + 12) = {class_of(type_)}, {buffer})"
    )
    return Value(types.ANY, text, calls=value.calls)
