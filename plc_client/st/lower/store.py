"""Writing a value to a place: scalars, bits, texts, structures, properties, references."""

from __future__ import annotations

from hli.owners import cnc_writes, members_of

from ..errors import OWNER, TARGET, TYPE, UNHEARD, Position, StopHere
from ..model import types
from ..model.classes import ClassType
from ..syntax import tree
from . import convert, places
from .context import Context
from .value import PropertyRef, Value

_WITH_A_FLAG = ("override", "rapid_override")
"""Units that the CNC looks at while another unit is TRUE, too."""


def text(context: Context, node: tree.Node, value: Value, pos: Position) -> str:
    """C text that stores a value where a node of the source says."""
    found = context.entity(node)
    if isinstance(found, PropertyRef):
        return _to_property(context, found, value, pos)
    if not isinstance(found, Value):
        raise StopHere(TARGET, "only variables can be written", node.pos)
    place = places.follow(context, found, node.pos)
    check_writable(place, node.pos)
    note(context, place, node.pos)
    value = convert.implicit(context, value, place.type, pos)
    return assignment(context, place, value, pos)


def _to_property(
    context: Context, found: PropertyRef, value: Value, pos: Position
) -> str:
    type_ = found.type
    if isinstance(type_, types.PointerType) and type_.reference:
        read = context.get_property(found, pos)
        value = convert.implicit(context, value, read.type, pos)
        return assignment(context, read, value, pos)
    return context.set_property(found, value, pos)


def check_writable(place: Value, pos: Position) -> None:
    """StopHere: the place is a constant, an input image or a result."""
    if place.constant is not None or not place.place:
        what = place.spelled or "this"
        text = f"{what} is no variable and cannot be written"
        raise StopHere(TARGET, text, pos)
    if not place.writable:
        what = place.spelled or "this"
        why = "a constant or an output of another block"
        text = f"{what} is {why} and cannot be written"
        raise StopHere(TARGET, text, pos)


def note(context: Context, place: Value, pos: Position) -> None:
    """Warn of an assignment to ``gpCh[0]^...`` and its like."""
    path = place.spelled
    if path[:2].upper() != "GP" or context.origin.file.startswith("<"):
        return
    spelled = path.replace("[]", "[i]")
    if cnc_writes(path):
        text = f"{spelled} is written by the CNC in each cycle; write"
        context.warn(f"{text} command_w or another _w member", pos, OWNER)
        return
    names = [member for _, member in members_of(path)]
    if "command_w" not in names:
        return
    unit = names[names.index("command_w") - 1]
    needed = [("enable_w", "a unit")]
    if unit in _WITH_A_FLAG:
        needed.append((f"{unit}_valid", unit))
    for name, what in needed:
        text = f"{spelled} is written, and {name} nowhere; the CNC looks at"
        text += f" {what} while {name} is TRUE"
        context.warn(text, pos, UNHEARD, name)


def assignment(
    context: Context, place: Value, value: Value, pos: Position
) -> str:
    """C text that stores a value of the place's type."""
    type_ = place.type
    if place.bit is not None:
        return _bits(place, value)
    if place.flag:
        return f"st_store_flag({place.place}, {value.text})"
    if isinstance(type_, types.StringType):
        return _text(place, type_, value)
    if isinstance(type_, types.Subrange) and value.constant is None:
        limits = f"{type_.low}, {type_.high}, {context.here(pos)}"
        checked = f"st_range({value.text}, {limits})"
        value = value.with_text(f"(({type_.base.c}){checked})")
    if type_.scalar:
        return f"{_target(place)} = {value.text}"
    if not types.same(type_, value.type):
        raise convert.mismatch(value.type, type_, pos)
    if isinstance(type_, types.OpenArray):
        raise StopHere(TYPE, "ARRAY [*] is written by elements", pos)
    return f"memmove({place.place}, {value.text}, {type_.size})"


def _target(place: Value) -> str:
    """The C place of a scalar."""
    if place.local:
        return place.text
    return f"*({types.c_type(place.type)} *)({place.place})"


def _bits(place: Value, value: Value) -> str:
    assert place.bit is not None
    first, width = place.bit
    where = f"{place.place} + {first // 8}" if first >= 8 else place.place
    if width == 1:
        return f"st_set_bit({where}, {first % 8}, {value.text})"
    return f"*({types.c_type(place.type)} *)({where}) = {value.text}"


def _text(place: Value, type_: types.StringType, value: Value) -> str:
    function = "st_wcopy" if type_.wide else "st_copy"
    return f"{function}({place.place}, {type_.length}, {value.text})"


def bound(context: Context, type_: types.PointerType, node: tree.Node) -> Value:
    """The address of a place for a reference of this type."""
    raw = context.entity(node)
    if isinstance(raw, Value) and isinstance(raw.type, types.PointerType):  # noqa: SIM102
        if raw.type.reference or raw.constant == 0:
            found = raw.with_text(raw.text)
            found.type = type_
            if raw.constant != 0:
                _check_target(context, raw.type.target, type_, node.pos)
            return found
    found = context.as_value(raw, node.pos)
    if found.constant == 0 and found.weak:
        return Value(type_, "((st_ptr)0)")
    if not found.place or found.bit is not None:
        text = "a reference needs a variable"
        raise StopHere(TARGET, text, node.pos)
    _check_target(context, found.type, type_, node.pos)
    return Value(type_, f"((st_ptr)({found.place}))", calls=found.calls)


def _check_target(
    context: Context,
    actual: types.Type | None,
    type_: types.PointerType,
    pos: Position,
) -> None:
    wanted = type_.target
    if actual is None or wanted is None or types.same(actual, wanted):
        return
    if (
        isinstance(actual, ClassType)
        and isinstance(wanted, ClassType)
        and actual.cls.is_a(wanted.cls)
    ):
        return
    if (
        isinstance(actual, types.StringType)
        and isinstance(wanted, types.StringType)
        and actual.wide == wanted.wide
        and actual.length >= wanted.length
    ):
        return
    text = f"{type_} cannot refer to {actual}"
    raise StopHere(TYPE, text, pos)
