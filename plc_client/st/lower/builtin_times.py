"""The cell's clock, and functions of times and dates."""

from __future__ import annotations

from functools import partial

from ..errors import Position
from ..model import types
from ..syntax import tree
from . import convert, operators
from .builtin_arguments import Rule, count
from .context import Context
from .conversions import to_number
from .value import Value

_SUMS = {
    "ADD_TIME": ("+", "TIME", "TIME"),
    "ADD_LTIME": ("+", "LTIME", "LTIME"),
    "ADD_TOD_TIME": ("+", "TOD", "TIME"),
    "ADD_LTOD_LTIME": ("+", "LTOD", "LTIME"),
    "ADD_DT_TIME": ("+", "DT", "TIME"),
    "ADD_LDT_LTIME": ("+", "LDT", "LTIME"),
    "SUB_TIME": ("-", "TIME", "TIME"),
    "SUB_LTIME": ("-", "LTIME", "LTIME"),
    "SUB_DATE_DATE": ("-", "DATE", "DATE"),
    "SUB_LDATE_LDATE": ("-", "LDATE", "LDATE"),
    "SUB_TOD_TIME": ("-", "TOD", "TIME"),
    "SUB_LTOD_LTIME": ("-", "LTOD", "LTIME"),
    "SUB_TOD_TOD": ("-", "TOD", "TOD"),
    "SUB_LTOD_LTOD": ("-", "LTOD", "LTOD"),
    "SUB_DT_TIME": ("-", "DT", "TIME"),
    "SUB_LDT_LTIME": ("-", "LDT", "LTIME"),
    "SUB_DT_DT": ("-", "DT", "DT"),
    "SUB_LDT_LDT": ("-", "LDT", "LDT"),
}
_SCALES = {
    "MUL_TIME": ("*", "TIME"),
    "MUL_LTIME": ("*", "LTIME"),
    "MULTIME": ("*", "TIME"),
    "DIV_TIME": ("/", "TIME"),
    "DIV_LTIME": ("/", "LTIME"),
    "DIVTIME": ("/", "TIME"),
}


def _sum(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 2, 2, name, pos)
    sign, left, right = _SUMS[name]
    first = context.value(nodes[0], types.ELEMENTARY[left])
    second = context.value(nodes[1], types.ELEMENTARY[right])
    return operators.binary(context, sign, first, second, pos)


def _scale(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 2, 2, name, pos)
    sign, left = _SCALES[name]
    first = context.value(nodes[0], types.ELEMENTARY[left])
    second = context.value(nodes[1])
    return operators.binary(context, sign, first, second, pos)


def _now(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    """Time since the CNC started, on the cell's clock."""
    if len(nodes) == 1:
        value = context.value(nodes[0])
        return to_number(context, value, types.ELEMENTARY[name], pos)
    count(nodes, 0, 0, name, pos)
    if name == "LTIME":
        return Value(types.LTIME, "((st_u64)st_now)", bits=64)
    return Value(types.TIME, "((st_u32)(st_now / 1000000))", bits=32)


def _join(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 2, 2, "CONCAT_DATE_TOD", pos)
    day = context.value(nodes[0], types.DATE)
    clock = context.value(nodes[1], types.TOD)
    text = f"((st_u32)({day.text} + {clock.text} / 1000u))"
    return Value(types.DT, text, bits=32, calls=day.calls or clock.calls)


def _numbers(
    context: Context,
    nodes: list[tree.Node],
    pos: Position,
    *,
    name: str,
    many: int,
    goal: types.Elementary,
) -> Value:
    count(nodes, many, many, name, pos)
    values = [context.value(node) for node in nodes]
    values = [convert.cast(v, types.LINT) for v in values]
    inside = ", ".join(v.text for v in values)
    text = f"(({goal.c})st_{name.lower()}({inside}))"
    return Value(goal, text, bits=goal.bits, calls=any(v.calls for v in values))


def _day_of_week(
    context: Context, nodes: list[tree.Node], pos: Position
) -> Value:
    count(nodes, 1, 1, "DAY_OF_WEEK", pos)
    day = context.value(nodes[0], types.DATE)
    text = f"((st_u8)(({day.text} / 86400u + 4u) % 7u))"
    return Value(types.USINT, text, bits=8, calls=day.calls)


def _rules() -> dict[str, tuple[Rule, tuple[str, ...]]]:
    found: dict[str, tuple[Rule, tuple[str, ...]]] = {}
    for name in _SUMS:
        found[name] = (partial(_sum, name=name), ("IN1", "IN2"))
    for name in _SCALES:
        found[name] = (partial(_scale, name=name), ("IN1", "IN2"))
    for name in ("TIME", "LTIME"):
        found[name] = (partial(_now, name=name), ())
    found["CONCAT_DATE_TOD"] = (_join, ("IN1", "IN2"))
    found["DAY_OF_WEEK"] = (_day_of_week, ("IN",))
    shapes = [
        ("CONCAT_DATE", 3, types.DATE, ("YEAR", "MONTH", "DAY")),
        (
            "CONCAT_TOD",
            4,
            types.TOD,
            ("HOUR", "MINUTE", "SECOND", "MILLISECOND"),
        ),
        (
            "CONCAT_DT",
            7,
            types.DT,
            ("YEAR", "MONTH", "DAY", "HOUR", "MINUTE", "SECOND", "MS"),
        ),
    ]
    for name, many, goal, names in shapes:
        rule = partial(_numbers, name=name, many=many, goal=goal)
        found[name] = (rule, names)
    return found


RULES = _rules()
