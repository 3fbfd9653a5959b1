"""Operators: the type they compute in and their C text; constants are folded."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..errors import RANGE, TYPE, Position, StopHere
from ..model import types
from ..model.classes import ClassType, InterfaceType
from ..model.literals import whole_type
from . import convert
from .context import Context
from .value import Value, constant

_COMPARE = {
    "=": "==",
    "<>": "!=",
    "<": "<",
    ">": ">",
    "<=": "<=",
    ">=": ">=",
}
_BITS = {"AND": "&", "OR": "|", "XOR": "^"}
_ARITHMETIC = {"+": "+", "-": "-", "*": "*"}
_FOLD: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "=": lambda a, b: int(a == b),
    "<>": lambda a, b: int(a != b),
    "<": lambda a, b: int(a < b),
    ">": lambda a, b: int(a > b),
    "<=": lambda a, b: int(a <= b),
    ">=": lambda a, b: int(a >= b),
    "AND": lambda a, b: a & b,
    "OR": lambda a, b: a | b,
    "XOR": lambda a, b: a ^ b,
}


def unary(
    context: Context, operator: str, value: Value, pos: Position
) -> Value:
    """``NOT``, ``-``, ``+``."""
    base = value.base
    if not isinstance(base, types.Elementary):
        raise StopHere(TYPE, f"{operator} does not work on {value.type}", pos)
    if operator == "NOT":
        return _not(value, base, pos)
    if base.family == "time" and operator == "+":
        return value
    if base.family not in ("int", "bit", "real"):
        raise StopHere(TYPE, f"{operator} does not work on {value.type}", pos)
    return value if operator == "+" else _negative(value, base)


def _not(value: Value, base: types.Elementary, pos: Position) -> Value:
    if base.family == "bool":
        if value.constant is not None:
            return constant(base, 1 - value.constant)
        return _result(value.with_text(f"(!{value.text})"), base)
    if not base.whole:
        raise StopHere(TYPE, f"NOT does not work on {value.type}", pos)
    if value.constant is not None and value.weak:
        found = constant(whole_type(~value.constant), ~value.constant, True)
        found.inverted = True
        return found
    if value.constant is not None:
        return constant(base, base.wrap(~value.constant))
    return _result(value.with_text(f"(({base.c})~{value.text})"), base)


def _result(value: Value, type_: types.Type) -> Value:
    value.type, value.weak = type_, False
    return value


def _negative(value: Value, base: types.Elementary) -> Value:
    if value.constant is not None:
        wide = base
        if base.whole and not base.signed and not value.weak:
            wide = convert.wider(base, types.SINT)
        return _folded(wide, -value.constant, value.weak)
    if not base.signed:
        bits = value.bits
        value = convert.cast(value, convert.wider(base, types.SINT))
        value.bits = bits
        base = value.base  # type: ignore[assignment]
    bits = value.bits
    found = _result(value.with_text(f"(({base.c})-{value.text})"), base)
    found.bits = bits
    return found


def _folded(base: types.Elementary, value: Any, weak: bool) -> Value:
    if base.family == "real":
        return constant(base, float(value), weak)
    if weak:
        return constant(whole_type(value), value, True)
    return constant(base, base.wrap(value))


def binary(
    context: Context, operator: str, left: Value, right: Value, pos: Position
) -> Value:
    """Two values and their operator."""
    if operator in ("AND_THEN", "OR_ELSE"):
        return _lazy(operator, left, right, pos)
    if operator in _COMPARE:
        return compare(context, operator, left, right, pos)
    if operator in _BITS:
        return _bitwise(context, operator, left, right, pos)
    timed = _timed(context, operator, left, right, pos)
    if timed is not None:
        return timed
    return arithmetic(context, operator, left, right, pos)


def _both(left: Value, right: Value) -> bool:
    return left.constant is not None and right.constant is not None


def _joined(
    context: Context,
    left: Value,
    right: Value,
    type_: types.Type,
    pattern: str,
) -> Value:
    calls = left.calls or right.calls
    before, (left, right) = context.in_order([left, right])
    text = pattern.format(left.text, right.text)
    if before:
        text = f"({', '.join(before)}, {text})"
    bits = getattr(types.plain(type_), "bits", 0)
    return Value(type_, text, bits=bits, calls=calls)


def _lazy(operator: str, left: Value, right: Value, pos: Position) -> Value:
    for value in (left, right):
        if value.base is not types.BOOL and value.type.name != "BIT":
            text = f"{operator} needs BOOL, not {value.type}"
            raise StopHere(TYPE, text, pos)
    sign = "&&" if operator == "AND_THEN" else "||"
    text = f"({left.text} {sign} {right.text})"
    return Value(types.BOOL, text, calls=left.calls or right.calls, bits=8)


def _bitwise(
    context: Context, operator: str, left: Value, right: Value, pos: Position
) -> Value:
    a, b = left.base, right.base
    booleans = [_is_bool(a), _is_bool(b)]
    if all(booleans):
        return _boolean(context, operator, left, right)
    if any(booleans) and not (_one_or_zero(left) and _one_or_zero(right)):
        raise _unfit(operator, left, right, pos)
    if any(booleans):
        return _boolean(context, operator, left, right)
    left, right = _inverted(left, right), _inverted(right, left)
    meeting = convert.common(left, right)
    if meeting is None or meeting.family == "real":
        raise _unfit(operator, left, right, pos)
    if _both(left, right):
        folded = _FOLD[operator](left.constant, right.constant)
        weak = left.weak and right.weak
        return _folded(meeting, folded, weak)
    width = max(left.bits, right.bits)
    left, right = convert.cast(left, meeting), convert.cast(right, meeting)
    pattern = f"(({meeting.c})({{0}} {_BITS[operator]} {{1}}))"
    found = _joined(context, left, right, meeting, pattern)
    found.bits = width
    return found


def _inverted(value: Value, other: Value) -> Value:
    """``NOT 16#80`` has the bits of the other operand."""
    base = other.base
    if not value.inverted or other.weak:
        return value
    if not isinstance(base, types.Elementary) or not base.whole:
        return value
    return constant(base, base.wrap(value.constant))


def _is_bool(type_: types.Type) -> bool:
    return isinstance(type_, types.Elementary) and type_.family == "bool"


def _one_or_zero(value: Value) -> bool:
    return _is_bool(value.base) or (value.weak and value.constant in (0, 1))


def _boolean(
    context: Context, operator: str, left: Value, right: Value
) -> Value:
    if _both(left, right):
        return constant(
            types.BOOL, _FOLD[operator](left.constant, right.constant)
        )
    sign = _BITS[operator]
    if context.world.short_circuit and operator != "XOR":
        text = f"({left.text} {sign * 2} {right.text})"
        calls = left.calls or right.calls
        return Value(types.BOOL, text, calls=calls, bits=8)
    return _joined(context, left, right, types.BOOL, f"({{0}} {sign} {{1}})")


def _unfit(operator: str, left: Value, right: Value, pos: Position) -> StopHere:
    text = f"{operator} does not work on {left.type} and {right.type}"
    return StopHere(TYPE, f"{text}; convert one of them", pos)


# -- comparison
def compare(
    context: Context, operator: str, left: Value, right: Value, pos: Position
) -> Value:
    """Numbers, texts, times, enumerations, addresses."""
    sign = _COMPARE[operator]
    a, b = left.type, right.type
    if isinstance(a, types.StringType) and isinstance(b, types.StringType):
        return _texts(context, sign, left, right, pos)
    if _address(a) or _address(b):
        return _addresses(context, sign, left, right, pos)
    meeting = convert.common(left, right) or _same_family(left, right)
    if meeting is None:
        raise _unfit(operator, left, right, pos)
    if _both(left, right):
        folded = _FOLD[operator](left.constant, right.constant)
        return constant(types.BOOL, folded)
    left, right = convert.cast(left, meeting), convert.cast(right, meeting)
    return _joined(context, left, right, types.BOOL, f"({{0}} {sign} {{1}})")


def _same_family(left: Value, right: Value) -> types.Elementary | None:  # noqa: PLR0911
    a, b = left.base, right.base
    if not isinstance(a, types.Elementary):
        return None
    if not isinstance(b, types.Elementary):
        return None
    if a.family == b.family and a.unit_ns == b.unit_ns:
        return a if a.bits >= b.bits else b
    if a.family == "bool" and right.weak and right.constant in (0, 1):
        return a
    if b.family == "bool" and left.weak and left.constant in (0, 1):
        return b
    for timed, other in ((a, right), (b, left)):
        if timed.family == "time" and other.weak and other.constant == 0:
            return timed
    return None


def _texts(
    context: Context, sign: str, left: Value, right: Value, pos: Position
) -> Value:
    assert isinstance(left.type, types.StringType)
    assert isinstance(right.type, types.StringType)
    if left.type.wide != right.type.wide:
        raise _unfit(sign, left, right, pos)
    function = "st_wcompare" if left.type.wide else "st_compare"
    return _joined(
        context,
        left,
        right,
        types.BOOL,
        f"({function}({{0}}, {{1}}) {sign} 0)",
    )


def _address(type_: types.Type) -> bool:
    return isinstance(type_, (types.PointerType, InterfaceType))


def _addresses(
    context: Context, sign: str, left: Value, right: Value, pos: Position
) -> Value:
    texts = []
    for value in (left, right):
        base = value.base
        whole = isinstance(base, types.Elementary) and base.whole
        if _address(value.type) or whole:
            texts.append(f"(st_uptr){value.text}")
        elif isinstance(value.type, ClassType):
            texts.append(f"(st_uptr){value.place}")
        else:
            raise _unfit(sign, left, right, pos)
    return Value(
        types.BOOL,
        f"({texts[0]} {sign} {texts[1]})",
        calls=left.calls or right.calls,
        bits=8,
    )


# -- arithmetic
def arithmetic(
    context: Context, operator: str, left: Value, right: Value, pos: Position
) -> Value:
    """``+ - * / MOD **`` on numbers; pointers move by bytes."""
    if isinstance(left.type, types.PointerType):
        return _pointer(context, operator, left, right, pos)
    if isinstance(right.type, types.PointerType) and operator == "+":
        return _pointer(context, operator, right, left, pos)
    meeting = convert.common(left, right)
    if meeting is None:
        raise _unfit(operator, left, right, pos)
    if operator == "**":
        return _power(context, left, right, meeting)
    if operator == "MOD" and meeting.family == "real":
        text = f"MOD needs whole numbers, not {meeting}; use LMOD"
        raise StopHere(TYPE, text, pos)
    width = max(left.bits, right.bits)
    if _both(left, right):
        return _fold(operator, left, right, meeting, pos)
    left, right = convert.cast(left, meeting), convert.cast(right, meeting)
    if operator in _ARITHMETIC:
        pattern = f"(({meeting.c})({{0}} {operator} {{1}}))"
    else:
        pattern = _division(context, operator, right, meeting, pos)
    found = _joined(context, left, right, meeting, pattern)
    found.bits = width
    return found


def _division(
    context: Context,
    operator: str,
    right: Value,
    meeting: types.Elementary,
    pos: Position,
) -> str:
    if right.constant == 0 and meeting.family != "real":
        raise StopHere(RANGE, "division by zero", pos)
    if meeting.family == "real":
        if right.constant:
            return f"(({meeting.c})({{0}} / {{1}}))"
        return f"(({meeting.c})st_div_f({{0}}, {{1}}, {context.here(pos)}))"
    if right.constant is not None and right.constant > 0:
        sign = "/" if operator == "/" else "%"
        return f"(({meeting.c})({{0}} {sign} {{1}}))"
    word = "div" if operator == "/" else "mod"
    kind = "i" if meeting.signed else "u"
    call = f"st_{word}_{kind}({{0}}, {{1}}, {context.here(pos)})"
    return f"(({meeting.c}){call})"


def _fold(
    operator: str,
    left: Value,
    right: Value,
    meeting: types.Elementary,
    pos: Position,
) -> Value:
    a, b = left.constant, right.constant
    weak = left.weak and right.weak
    if operator in _FOLD:
        return _folded(meeting, _FOLD[operator](a, b), weak)
    if b == 0:
        raise StopHere(RANGE, "division by zero", pos)
    if meeting.family == "real":
        value = a / b if operator == "/" else math.fmod(a, b)
        return constant(meeting, value, weak)
    quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
    value = quotient if operator == "/" else a - quotient * b
    return _folded(meeting, value, weak)


def _power(
    context: Context, left: Value, right: Value, meeting: types.Elementary
) -> Value:
    if left.base is types.REAL and right.base is not types.LREAL:
        meeting = types.REAL
    if meeting.family == "real":
        pattern = f"(({meeting.c})pow({{0}}, {{1}}))"
        return _joined(context, left, right, meeting, pattern)
    if _both(left, right) and 0 <= right.constant < 64:
        value = left.constant**right.constant
        return _folded(meeting, value, left.weak and right.weak)
    left, right = convert.cast(left, meeting), convert.cast(right, types.LINT)
    pattern = f"(({meeting.c})st_power((st_i64){{0}}, {{1}}))"
    return _joined(context, left, right, meeting, pattern)


def _pointer(
    context: Context, operator: str, left: Value, right: Value, pos: Position
) -> Value:
    base = right.base
    if isinstance(right.type, types.PointerType) and operator == "-":
        pattern = "((st_i64)((st_uptr){0} - (st_uptr){1}))"
        return _joined(context, left, right, types.LINT, pattern)
    whole = isinstance(base, types.Elementary) and base.whole
    if operator not in ("+", "-") or not whole:
        raise _unfit(operator, left, right, pos)
    place = context.here(pos)
    pattern = f"st_move({{0}}, {operator}(st_i64){{1}}, {place})"
    found = _joined(context, left, right, left.type, pattern)
    found.bits = 64
    return found


# -- times and dates
def _timed(  # noqa: PLR0911
    context: Context, operator: str, left: Value, right: Value, pos: Position
) -> Value | None:
    """Operations with times and dates; None when there are none."""
    a, b = left.base, right.base
    if not isinstance(a, types.Elementary):
        return None
    if not isinstance(b, types.Elementary):
        return None
    families = (a.family, b.family)
    if "time" not in families and "date" not in families:
        return None
    if families == ("time", "time") and operator in ("+", "-"):
        meeting = types.LTIME if types.LTIME in (a, b) else a
        return _scaled(context, operator, left, right, meeting)
    if families == ("time", "time") and operator == "/":
        raise _unfit(operator, left, right, pos)
    if families == ("date", "date") and operator == "-":
        return _distance(context, left, right, pos)
    if families == ("date", "time") and operator in ("+", "-"):
        return _moved(context, operator, left, right)
    if a.family == "time" and operator in ("*", "/"):
        return _times(context, operator, left, right, pos)
    if b.family == "time" and operator == "*":
        return _times(context, operator, right, left, pos)
    raise _unfit(operator, left, right, pos)


def counts(value: Value, target: types.Elementary) -> str:
    """A time or date in the counts of another type."""
    source = value.base
    assert isinstance(source, types.Elementary)
    if source.unit_ns == target.unit_ns:
        return value.text
    if source.unit_ns > target.unit_ns:
        factor = source.unit_ns // target.unit_ns
        return f"((st_u64){value.text} * {factor}u)"
    return f"((st_u64){value.text} / {target.unit_ns // source.unit_ns}u)"


def _scaled(
    context: Context,
    operator: str,
    left: Value,
    right: Value,
    meeting: types.Elementary,
) -> Value:
    if _both(left, right) and left.base is right.base is meeting:
        value = _FOLD[operator](left.constant, right.constant)
        return constant(meeting, meeting.wrap(value))
    first, second = counts(left, meeting), counts(right, meeting)
    left, right = left.with_text(first), right.with_text(second)
    pattern = f"(({meeting.c})({{0}} {operator} {{1}}))"
    return _joined(context, left, right, meeting, pattern)


def _distance(
    context: Context, left: Value, right: Value, pos: Position
) -> Value:
    a, b = left.base, right.base
    assert isinstance(a, types.Elementary)
    if a is not b:
        raise _unfit("-", left, right, pos)
    target = types.LTIME if a.bits == 64 else types.TIME
    factor = a.unit_ns // target.unit_ns
    pattern = f"(({target.c})(((st_u64){{0}} - (st_u64){{1}}) * {factor}u))"
    return _joined(context, left, right, target, pattern)


def _moved(context: Context, operator: str, left: Value, right: Value) -> Value:
    base = left.base
    assert isinstance(base, types.Elementary)
    right = right.with_text(counts(right, base))
    pattern = f"(({base.c})({{0}} {operator} {{1}}))"
    if base.name.endswith("TIME_OF_DAY"):
        day = 86_400_000_000_000 // base.unit_ns
        moved = f"st_day({{0}}, {operator}(st_i64){{1}}, {day})"
        pattern = f"(({base.c}){moved})"
    return _joined(context, left, right, base, pattern)


def _times(
    context: Context,
    operator: str,
    left: Value,
    right: Value,
    pos: Position,
) -> Value:
    base, other = left.base, right.base
    assert isinstance(base, types.Elementary)
    assert isinstance(other, types.Elementary)
    if other.family == "real":
        function = "*" if operator == "*" else "/"
        pattern = f"(({base.c})st_round((st_f64){{0}} {function} {{1}}))"
        if operator == "/":
            place = context.here(pos)
            pattern = f"(({base.c})st_round(st_div_f({{0}}, {{1}}, {place})))"
        return _joined(context, left, right, base, pattern)
    if not other.whole:
        raise _unfit(operator, left, right, pos)
    if operator == "*":
        pattern = f"(({base.c})({{0}} * ({base.c}){{1}}))"
    else:
        pattern = f"(({base.c})st_div_i({{0}}, {{1}}, {context.here(pos)}))"
    return _joined(context, left, right, base, pattern)
