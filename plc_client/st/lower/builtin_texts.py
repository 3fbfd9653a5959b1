"""Standard functions of STRING and WSTRING; results hold 255 characters, as in TwinCAT."""

from __future__ import annotations

from functools import partial

from ..errors import TYPE, Position, StopHere
from ..model import types
from ..syntax import tree
from .builtin_arguments import Rule, count
from .context import Context
from .literal_values import text_literal
from .value import Value

LONGEST = 255
"""Characters of a result."""


def _text(
    context: Context, node: tree.Node, wide: bool | None, name: str
) -> Value:
    value = context.value(node)
    type_ = value.type
    if isinstance(type_, types.StringType) and wide in (None, type_.wide):
        return value
    text = f"{name} needs a text, not {type_}"
    raise StopHere(TYPE, text, node.pos)


def _number(context: Context, node: tree.Node, name: str) -> Value:
    value = context.value(node)
    base = value.base
    if isinstance(base, types.Elementary) and base.whole:
        return value
    text = f"{name} needs a whole number, not {value.type}"
    raise StopHere(TYPE, text, node.pos)


def _call(
    context: Context,
    nodes: list[tree.Node],
    pos: Position,
    *,
    name: str,
    shape: str,
    wide: bool,
) -> Value:
    """``shape``: t for a text, n for a number, in the order of the arguments."""
    count(nodes, len(shape), len(shape), name, pos)
    values = []
    either: bool | None = True if wide else None
    for letter, node in zip(shape, nodes, strict=True):
        if letter == "t":
            values.append(_text(context, node, either, name))
            either = _wide(values[-1])
        else:
            values.append(_number(context, node, name))
    return _result(context, name, values, _wide(values[0]))


def _wide(value: Value) -> bool:
    return isinstance(value.type, types.StringType) and value.type.wide


def _result(
    context: Context, name: str, values: list[Value], wide: bool
) -> Value:
    word = name.lower().removeprefix("w") if wide else name.lower()
    if name == "WLEN":
        word = "len"
    function = f"st_{'w' if wide else ''}{word}"
    inside = ", ".join(v.text for v in values)
    calls = any(v.calls for v in values)
    if word in ("len", "find"):
        text = f"((st_i16){function}({inside}))"
        return Value(types.INT, text, calls=calls, bits=16)
    buffer = context.buffer((LONGEST + 1) * (2 if wide else 1))
    text = f"({function}({buffer}, {LONGEST}, {inside}), {buffer})"
    return Value(types.StringType(LONGEST, wide), text, calls=calls)


def _concat(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 2, 1000, name, pos)
    found = _text(context, nodes[0], None, name)
    wide = _wide(found)
    for node in nodes[1:]:
        value = _text(context, node, wide, name)
        found = _result(context, "CONCAT", [found, value], wide)
    return found


_SHAPES = {
    "LEN": ("t", ("IN",)),
    "LEFT": ("tn", ("IN", "L")),
    "RIGHT": ("tn", ("IN", "L")),
    "MID": ("tnn", ("IN", "L", "P")),
    "INSERT": ("ttn", ("IN1", "IN2", "P")),
    "DELETE": ("tnn", ("IN", "L", "P")),
    "REPLACE": ("ttnn", ("IN1", "IN2", "L", "P")),
    "FIND": ("tt", ("IN1", "IN2")),
}
_TWINCAT = {
    "LEN": ("STR",),
    "LEFT": ("STR", "SIZE"),
    "RIGHT": ("STR", "SIZE"),
    "MID": ("STR", "LEN", "POS"),
    "INSERT": ("STR1", "STR2", "POS"),
    "DELETE": ("STR", "LEN", "POS"),
    "REPLACE": ("STR1", "STR2", "L", "P"),
    "FIND": ("STR1", "STR2"),
}


class _Names(tuple[str, ...]):
    """Parameter names with TwinCAT's names as well."""

    twincat: tuple[str, ...] = ()

    def index(self, value: str, *_: int) -> int:  # type: ignore[override]
        if value in self.twincat:
            return self.twincat.index(value)
        return super().index(value)

    def __contains__(self, value: object) -> bool:
        return super().__contains__(value) or value in self.twincat


def _names(name: str) -> _Names:
    found = _Names(_SHAPES[name][1])
    found.twincat = _TWINCAT[name]
    return found


def _place(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    """The name of the POU, or the line and column of the call."""
    count(nodes, 0, 0, name, pos)
    text = context.label
    if name == "__POSITION":
        text = f"Line {pos[0] - context.first_line + 1}, Column {pos[1]}"
    return text_literal(context, text, False, pos)


def _rules() -> dict[str, tuple[Rule, tuple[str, ...]]]:
    found: dict[str, tuple[Rule, tuple[str, ...]]] = {}
    for name, (shape, _) in _SHAPES.items():
        for prefix in ("", "W"):
            rule = partial(
                _call, name=prefix + name, shape=shape, wide=bool(prefix)
            )
            found[prefix + name] = (rule, _names(name))
    for name in ("__POUNAME", "__POSITION"):
        found[name] = (partial(_place, name=name), ())
    for name in ("CONCAT", "WCONCAT"):
        found[name] = (partial(_concat, name=name), ("STR1", "STR2"))
    return found


RULES = _rules()
