"""SEL, MUX, MAX, MIN, LIMIT."""

from __future__ import annotations

from functools import partial, reduce

from ..errors import TYPE, Position, StopHere
from ..model import types
from ..syntax import tree
from . import convert
from .builtin_arguments import Rule, count
from .context import Context
from .value import Value


def _meeting(
    context: Context, values: list[Value], name: str, pos: Position
) -> types.Type:
    """The type that all values take."""
    first = values[0].type
    if all(types.same(first, v.type) for v in values) and not any(
        v.weak for v in values
    ):
        return first
    texts = [v.type for v in values if isinstance(v.type, types.StringType)]
    if len(texts) == len(values):
        longest = max(t.length for t in texts)
        return types.StringType(longest, texts[0].wide)
    strong = [v for v in values if not v.weak] or values
    found = reduce(partial(_meet, context, name, pos), values[1:], values[0])
    if found.weak:
        return found.type
    typed = strong[0].type
    if isinstance(typed, types.EnumType):
        return typed
    return found.type


def _meet(
    context: Context, name: str, pos: Position, left: Value, right: Value
) -> Value:
    meeting = convert.common(left, right)
    if meeting is None:
        a, b = left.base, right.base
        both = isinstance(a, types.Elementary) and isinstance(
            b, types.Elementary
        )
        if both and a.family == b.family:  # type: ignore[attr-defined]
            return left if a.size >= b.size else right
        if right.weak and right.constant in (0, 1):
            return left
        if left.weak and left.constant in (0, 1):
            return right
        text = f"{name}: {left.type} and {right.type} do not meet"
        raise StopHere(TYPE, text, pos)
    found = Value(meeting, "", bits=meeting.bits)
    if left.weak and right.weak:
        found.weak = True
        found.constant = max(left.constant, right.constant)
    return found


def _values(
    context: Context, nodes: list[tree.Node], name: str, pos: Position
) -> tuple[types.Type, list[Value]]:
    """The values as one type, each computed once and in order."""
    values = [context.value(node) for node in nodes]
    meeting = _meeting(context, values, name, pos)
    found = []
    for value, node in zip(values, nodes, strict=True):
        if isinstance(meeting, types.StringType) or types.same(
            value.type, meeting
        ):
            found.append(value)
        else:
            found.append(_as(context, value, meeting, node.pos))
    return meeting, found


def _as(
    context: Context, value: Value, meeting: types.Type, pos: Position
) -> Value:
    a, b = value.base, types.plain(meeting)
    numbers = isinstance(a, types.Elementary) and isinstance(
        b, types.Elementary
    )
    if numbers:
        return convert.cast(value, meeting)
    return convert.implicit(context, value, meeting, pos)


def _kept(
    context: Context, values: list[Value]
) -> tuple[list[str], list[Value]]:
    before, found = [], []
    for value in values:
        if value.constant is not None:
            found.append(value)
            continue
        text, kept = context.keep(value)
        before.append(text)
        found.append(kept)
    return before, found


def _extreme(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 1, 10_000, name, pos)
    meeting, values = _values(context, nodes, name, pos)
    before, values = _kept(context, values)
    sign = ">" if name == "MAX" else "<"
    text = values[0].text
    for value in values[1:]:
        better = _ordered(meeting, text, value.text, sign)
        if value is values[-1] and len(values) == 2:
            text = f"({better} ? {text} : {value.text})"
        else:
            name_ = (
                context.scalar(meeting) if meeting.scalar else context.pointer()
            )
            before.append(f"{name_} = {better} ? {text} : {value.text}")
            text = name_
    return _whole(meeting, before, text)


def _ordered(type_: types.Type, left: str, right: str, sign: str) -> str:
    if isinstance(type_, types.StringType):
        function = "st_wcompare" if type_.wide else "st_compare"
        return f"({function}({left}, {right}) {sign} 0)"
    return f"({left} {sign} {right})"


def _whole(type_: types.Type, before: list[str], text: str) -> Value:
    whole = f"({', '.join([*before, text])})" if before else text
    bits = getattr(types.plain(type_), "bits", 0)
    return Value(type_, whole, bits=bits, calls=bool(before))


def _limit(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 3, 3, "LIMIT", pos)
    meeting, values = _values(context, nodes, "LIMIT", pos)
    before, (low, value, high) = _kept(context, values)
    below = _ordered(meeting, value.text, low.text, "<")
    above = _ordered(meeting, value.text, high.text, ">")
    text = f"({below} ? {low.text} : {above} ? {high.text} : {value.text})"
    return _whole(meeting, before, text)


def _sel(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 3, 3, "SEL", pos)
    gate = context.boolean(nodes[0])
    meeting, values = _values(context, nodes[1:], "SEL", pos)
    calls = gate.calls or any(v.calls for v in values)
    before: list[str] = []
    if calls:
        before, (gate, *values) = _kept(context, [gate, *values])
    text = f"({gate.text} ? {values[1].text} : {values[0].text})"
    return _whole(meeting, before, text)


def _mux(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 3, 10_000, "MUX", pos)
    key = context.value(nodes[0])
    base = key.base
    if not isinstance(base, types.Elementary) or not base.whole:
        raise StopHere(TYPE, "MUX: the selector is whole", nodes[0].pos)
    meeting, values = _values(context, nodes[1:], "MUX", pos)
    before, kept = _kept(context, [key, *values])
    key, values = kept[0], kept[1:]
    text = values[-1].text
    for number in reversed(range(len(values) - 1)):
        text = f"({key.text} == {number} ? {values[number].text} : {text})"
    return _whole(meeting, before, text)


RULES: dict[str, tuple[Rule, tuple[str, ...]]] = {
    "MAX": (partial(_extreme, name="MAX"), ("IN1", "IN2")),
    "MIN": (partial(_extreme, name="MIN"), ("IN1", "IN2")),
    "LIMIT": (_limit, ("MN", "IN", "MX")),
    "SEL": (_sel, ("G", "IN0", "IN1")),
    "MUX": (_mux, ("K",)),
}
