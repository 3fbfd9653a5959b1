"""Conversions by name: ``INT_TO_REAL``, ``TO_STRING``, ``TRUNC_DINT``."""

from __future__ import annotations

from ..errors import TYPE, Position, StopHere
from ..model import types
from ..model.classes import InterfaceType
from ..syntax import tree
from . import convert
from .context import Context
from .operators import counts
from .value import Value, constant

_TEXTS = {
    "bool": "bool",
    "bit": "unsigned",
    "time": "duration",
}


def convert_named(
    context: Context, source: str, target: str, node: tree.Node, pos: Position
) -> Value:
    """One conversion; the source's name is checked by an implicit conversion."""
    value = context.value(node)
    if source == "TRUNC":
        return truncated(value, types.ELEMENTARY[target], pos)
    value = _as_source(context, source, value, pos)
    if target in ("STRING", "WSTRING"):
        return to_text(context, value, target == "WSTRING", pos)
    goal = types.ELEMENTARY[target]
    if isinstance(value.type, types.StringType):
        return from_text(context, value, goal)
    return to_number(context, value, goal, pos)


def _as_source(
    context: Context, source: str, value: Value, pos: Position
) -> Value:
    if source in ("", "ANY", "ENUM"):
        return value
    if source in ("STRING", "WSTRING"):
        wide = source == "WSTRING"
        if isinstance(value.type, types.StringType) and value.type.wide == wide:
            return value
        raise convert.mismatch(value.type, types.StringType(80, wide), pos)
    wanted = types.ELEMENTARY[source]
    base = value.base
    if isinstance(value.type, types.PointerType):
        return convert.implicit(context, value, wanted, pos)
    if not isinstance(base, types.Elementary):
        raise convert.mismatch(value.type, wanted, pos)
    if _is_number(base) and _is_number(wanted):
        convert.check_number(context, value, base, wanted, pos)
        return convert.cast(value, wanted)
    if base.family == wanted.family or value.weak:
        return _number_as(context, value, wanted)
    if wanted.family == "bool" or base.family == "bool":
        raise convert.mismatch(value.type, wanted, pos)
    if {base.family, wanted.family} <= {"time", "date", "int", "bit"}:
        return to_number(context, value, wanted, pos)
    raise convert.mismatch(value.type, wanted, pos)


def _is_number(type_: types.Elementary) -> bool:
    return type_.whole or type_.family == "real"


def _number_as(
    context: Context, value: Value, wanted: types.Elementary
) -> Value:
    base = value.base
    assert isinstance(base, types.Elementary)
    if base.unit_ns and base.unit_ns != wanted.unit_ns:
        found = value.with_text(f"(({wanted.c}){counts(value, wanted)})")
        found.type, found.bits = wanted, wanted.bits
        return found
    return convert.cast(value, wanted)


def to_number(
    context: Context, value: Value, goal: types.Elementary, pos: Position
) -> Value:
    """Between numbers, times and dates; durations become counts of their unit."""
    base = value.base
    if isinstance(value.type, (types.PointerType, InterfaceType)):
        text = f"(({goal.c})(st_uptr){value.text})"
        found = value.with_text(text)
        found.type, found.bits = goal, goal.bits
        return found
    if not isinstance(base, types.Elementary):
        raise convert.mismatch(value.type, goal, pos)
    if base.unit_ns and goal.unit_ns:
        return _between_times(context, value, base, goal)
    return convert.cast(value, goal)


def _between_times(
    context: Context,
    value: Value,
    base: types.Elementary,
    goal: types.Elementary,
) -> Value:
    text = counts(value, goal)
    long_goal = goal.name.removeprefix("L")
    day_ns = 86_400_000_000_000
    per_day = day_ns // goal.unit_ns
    if base.family == "date" and base is not goal:
        if long_goal == "TIME_OF_DAY" and "DATE" in base.name:
            source_day = day_ns // base.unit_ns
            inside = f"((st_u64){value.text} % {source_day}ull)"
            text = counts(Value(base, inside), goal)
        elif long_goal == "DATE":
            text = f"((st_u64)({text}) / {per_day}ull * {per_day}ull)"
    found = value.with_text(f"(({goal.c})({text}))")
    found.type, found.bits, found.weak = goal, goal.bits, False
    return found


def truncated(value: Value, goal: types.Elementary, pos: Position) -> Value:
    """A real without its fraction."""
    base = value.base
    if not isinstance(base, types.Elementary) or base.family not in (
        "real",
        "int",
        "bit",
    ):
        raise StopHere(TYPE, f"TRUNC needs a REAL, not {value.type}", pos)
    if base.family != "real":
        return convert.cast(value, goal)
    if value.constant is not None:
        return constant(goal, goal.wrap(int(value.constant)))
    found = value.with_text(f"(({goal.c})st_truncate({value.text}))")
    found.type, found.bits = goal, goal.bits
    return found


# -- texts
def to_text(context: Context, value: Value, wide: bool, pos: Position) -> Value:
    """Any elementary value as TwinCAT writes it."""
    if isinstance(value.type, types.StringType):
        return _between_texts(context, value, wide)
    base = value.base
    if not isinstance(base, types.Elementary):
        raise convert.mismatch(value.type, types.StringType(80, wide), pos)
    if isinstance(value.type, types.EnumType) and value.type.named:
        found = _name_of(context, value, value.type)
        return _between_texts(context, found, True) if wide else found
    name = _text_function(base)
    buffer = context.buffer(82)
    text = f"(st_text_{name}({buffer}, {value.text}), {buffer})"
    found = Value(types.StringType(80), text, calls=value.calls)
    return _between_texts(context, found, True) if wide else found


def _name_of(context: Context, value: Value, enum: types.EnumType) -> Value:
    """The name of an enumeration's value; empty for a value without one."""
    kept, once = context.keep(value)
    text = '((st_ptr)"")'
    for key, number in reversed(enum.values.items()):
        name = enum.spelled.get(key, key)
        text = f'({once.text} == {number} ? ((st_ptr)"{name}") : {text})'
    return Value(types.StringType(80), f"({kept}, {text})", calls=value.calls)


def _text_function(base: types.Elementary) -> str:
    if base.family == "real":
        return f"f{base.bits}"
    if base.family == "int":
        return "signed" if base.signed else "unsigned"
    if base.family == "date":
        return base.name.lower()
    if base.family == "time":
        return "time" if base.bits == 32 else "ltime"
    return _TEXTS[base.family]


def _between_texts(context: Context, value: Value, wide: bool) -> Value:
    type_ = value.type
    assert isinstance(type_, types.StringType)
    if type_.wide == wide:
        return value
    size = 2 if wide else 1
    buffer = context.buffer((type_.length + 1) * size)
    function = "st_widen" if wide else "st_narrow"
    text = f"{function}({buffer}, {type_.length}, {value.text})"
    result = types.StringType(type_.length, wide)
    return Value(result, f"({text}, {buffer})", calls=value.calls)


def from_text(context: Context, value: Value, goal: types.Elementary) -> Value:
    """The number, time or date at the beginning of a text; 0 without one."""
    assert isinstance(value.type, types.StringType)
    if value.type.wide:
        value = _between_texts(context, value, False)
    kind = goal.family
    if kind in ("int", "bit"):
        text = f"(({goal.c})st_parse_whole({value.text}))"
    elif kind == "real":
        text = f"(({goal.c})st_parse_real({value.text}))"
    elif kind == "bool":
        text = f"st_parse_bool({value.text})"
    else:
        parse = f"st_parse_time({value.text})"
        text = f"(({goal.c})({parse} / {goal.unit_ns}))"
    return Value(goal, text, bits=goal.bits, calls=value.calls)
