"""Parts of values: members, elements, bits, what a pointer points to, the process image."""

from __future__ import annotations

import re

from ..errors import NAME, RANGE, TYPE, Position, StopHere
from ..model import types
from ..model.classes import Class, ClassType, InterfaceType
from ..model.world import Cascade, unknown
from ..syntax import tree
from . import literal_values, names
from .context import Context
from .value import (
    Entity,
    LibraryRef,
    NamespaceRef,
    PropertyRef,
    RoutineRef,
    TypeRef,
    Value,
    address,
    at,
)

_OLD_NAMES = {
    "DIST_PROG_START_HIGH": "DIST_PROG_START",
    "STOP_CONDITIONS_R": "STOP_CONDITION_R",
    "FEED_HOLD": "FEEDHOLD",
}
_FLAGS = frozenset({"PLEASE_RW", "DONE_W"})
_LATCHED = frozenset(
    [
        ("HLI_CHANNEL", "DECODER_STATE"),
        ("HLI_CHANNEL", "BAHN_STATE"),
        ("HLI_CONTOUR_LOOKAHEAD", "STATE"),
        ("HLI_AHEAD", "STATE"),
        ("HLI_AXIS", "LR_STATE"),
    ]
)
"""What the input image holds (plc_client/image.py)."""
_DIRECT = re.compile(r"%([IQM])([XBWDL]?)(\d+)(?:\.(\d+))?$")
_DIRECT_TYPES = {
    "": types.BOOL,
    "X": types.BOOL,
    "B": types.BYTE,
    "W": types.WORD,
    "D": types.DWORD,
    "L": types.LWORD,
}
IMAGE_SIZE = 65536
"""Bytes of each of the images %I, %Q and %M."""


def follow(context: Context, found: Value, pos: Position) -> Value:
    """What a reference refers to; any other value as it is."""
    type_ = found.type
    if not isinstance(type_, types.PointerType) or not type_.reference:
        return found
    assert type_.target is not None
    name = _text(found.spelled)
    pointer = f"st_bound_named({found.text}, {context.here(pos)}, {name})"
    result = at(type_.target, pointer)
    result.spelled = found.spelled
    return result


def _text(name: str) -> str:
    """A name as a C string; names hold letters, digits and _ alone."""
    return f'"{re.sub(r"[^A-Za-z0-9_.]", "", name)}"'


def dereference(context: Context, found: Value, pos: Position) -> Value:
    """``pointer^``."""
    type_ = found.type
    if not isinstance(type_, types.PointerType):
        if isinstance(type_, InterfaceType):
            return found
        text = f"^ needs a pointer, {found.spelled or 'this'} is {type_}"
        raise StopHere(TYPE, text, pos)
    if type_.target is None:
        raise StopHere(TYPE, "the pointer has no type; assign it to one", pos)
    if found.text == "self":
        return at(type_.target, "self")
    place, name = context.here(pos), _text(found.spelled)
    if found.trusted and found.array:
        name = _text(found.spelled.removesuffix("[]"))
        pointer = f"st_area({found.place}, {found.array}, {place}, {name})"
    elif found.trusted:
        pointer = f"st_set({found.text}, {place}, {name})"
    else:
        size = type_.target.size
        pointer = f"st_deref({found.text}, {size}, {place}, {name})"
    result = at(type_.target, pointer)
    result.calls = found.calls
    result.spelled = f"{found.spelled}^"
    return result


# -- members
def member(context: Context, base: Entity, name: str, pos: Position) -> Entity:
    """``base.name``."""
    if isinstance(base, NamespaceRef):
        return names.in_list(context, base.list, name, pos)
    if isinstance(base, LibraryRef):
        return _in_library(context, name, pos)
    if isinstance(base, TypeRef):
        return _of_type(context, base.type, name, pos)
    if isinstance(base, (RoutineRef,)):
        return _of_routine(context, base, name, pos)
    found = context.as_value(base, pos)
    return _of_value(context, found, name, pos)


def _in_library(context: Context, name: str, pos: Position) -> Entity:
    found = names.everywhere(context, name.upper(), pos)
    if found is None:
        raise unknown("name", name, [], pos)
    return found


def _of_type(
    context: Context, type_: types.Type, name: str, pos: Position
) -> Entity:
    if isinstance(type_, types.EnumType):
        return literal_values.enumerator(type_, name, pos)
    if isinstance(type_, ClassType):
        found = type_.cls.variable(name.upper())
        if found is not None and found.storage in ("global", "constant"):
            return names.variable(context, found, "", pos)
    text = f"{type_} is a type; .{name} needs a variable"
    raise StopHere(TYPE, text, pos)


def _of_routine(
    context: Context, base: RoutineRef, name: str, pos: Position
) -> Entity:
    """A local constant or static variable of a function by the function's name."""
    found = base.routine.variables.get(name.upper())
    if found is not None and found.storage in ("global", "constant"):
        return names.variable(context, found, "", pos)
    if base.routine.refused:
        raise Cascade(pos)
    text = f"{base.routine.label} has no {name} outside of its call"
    raise StopHere(NAME, text, pos)


def _of_value(
    context: Context, base: Value, name: str, pos: Position
) -> Entity:
    type_, key = base.type, name.upper()
    if isinstance(type_, types.StructType):
        return _of_struct(context, base, type_, key, name, pos)
    if isinstance(type_, ClassType):
        return _of_instance(context, base, type_, key, name, pos)
    if isinstance(type_, InterfaceType):
        return _of_interface(context, base, type_, key, name, pos)
    if isinstance(type_, types.PointerType):
        text = f"{base.spelled or 'this'} is a pointer; write ^.{name}"
        raise StopHere(TYPE, text, pos)
    found = _constant_bit(context, base, key, pos)
    if found is not None:
        return found
    if type_ is types.VOID and context.world.log.errors:
        raise Cascade(pos)
    array = isinstance(type_, types.ArrayType)
    spelled = base.spelled.replace("[]", "[i]")
    hint = f"; write {spelled}[n]" if array and spelled else ""
    raise StopHere(TYPE, f"{type_} has no member {name}{hint}", pos)


def _constant_bit(
    context: Context, base: Value, key: str, pos: Position
) -> Value | None:
    """``x.BIT_NUMBER`` with a constant."""
    whole = isinstance(base.base, types.Elementary) and base.base.whole
    routine, cls = context.routine, context.cls
    found = routine.variables.get(key) if routine is not None else None
    if found is None and cls is not None:
        found = cls.variable(key)
    found = found or context.world.globals.get(key)
    if not whole or found is None or not isinstance(found.constant, int):
        return None
    return bit(context, base, found.constant, 1, pos)


def _of_struct(
    context: Context,
    base: Value,
    type_: types.StructType,
    key: str,
    name: str,
    pos: Position,
) -> Value:
    found = type_.members.get(key)
    if found is None and type_.foreign:
        found = type_.members.get(_OLD_NAMES.get(key, ""))
    if found is None:
        raise unknown(f"member of {type_}:", name, _members(type_), pos)
    where = address(base.text, found.offset)
    if type_.foreign and (type_.name.upper(), key) in _LATCHED:
        where = f"st_latched({where})"
    value = at(found.type, where, base.writable)
    value.calls = base.calls
    value.spelled = f"{base.spelled}.{found.name}"
    if found.bit >= 0:
        value.bit = (found.bit, 1)
        value.text = f"((*(st_u8 *)({where}) >> {found.bit}) & 1)"
    if type_.foreign and (key.endswith("SEMAPHOR_RW") or key in _FLAGS):
        value.flag = True
        value.text = f"st_load_flag({where})"
    return value


def _members(type_: types.StructType) -> list[str]:
    return [member.name for member in type_.members.values()]


def _of_instance(
    context: Context,
    base: Value,
    type_: ClassType,
    key: str,
    name: str,
    pos: Position,
) -> Entity:
    cls = type_.cls
    static = base.exact or ("st_" not in base.text and base.text != "self")
    found = names.member_of(context, cls, base.text, key, pos, static)
    if found is None:
        if cls.uncertain:
            raise Cascade(pos)
        raise unknown(f"member of {cls.name}:", name, cls.spelled(), pos)
    _check_access(context, found, key, base, pos)
    if isinstance(found, Value):
        found.calls = base.calls
        found.spelled = f"{base.spelled}.{found.spelled}"
        if not base.writable or _is_output(context, cls, key, base):
            found.writable = False
        return found
    if isinstance(found, (RoutineRef, PropertyRef)):
        found.calls = base.calls
    return found


def _is_output(context: Context, cls: Class, key: str, base: Value) -> bool:
    """Only a block itself writes its outputs."""
    found = cls.variable(key)
    inside = base.text == "self" or context.origin.file.startswith("<")
    output = found is not None and found.section == "VAR_OUTPUT"
    return output and not inside


def _check_access(
    context: Context, found: Entity, key: str, base: Value, pos: Position
) -> None:
    """PRIVATE and PROTECTED methods stay inside; a test may be one of them."""
    runner = context.origin.file.startswith("<test runner>")
    if runner or not isinstance(found, RoutineRef):
        return
    routine, cls = found.routine, context.cls
    if routine.access == "PRIVATE" and cls is not routine.owner:
        text = f"{routine.label} is PRIVATE"
        raise StopHere(NAME, text, pos)
    owner = routine.owner
    if routine.access == "PROTECTED" and owner is not None:  # noqa: SIM102
        if cls is None or owner not in cls.ancestors():
            raise StopHere(NAME, f"{routine.label} is PROTECTED", pos)


def _of_interface(
    context: Context,
    base: Value,
    type_: InterfaceType,
    key: str,
    name: str,
    pos: Position,
) -> Entity:
    cls = type_.cls
    property_type = cls.property_type(key)
    if property_type is not None:
        return PropertyRef(
            key, property_type, base.text, cls, False, base.calls
        )
    routine = cls.method(key)
    if routine is None:
        if any(found.refused for found in (cls, *cls.all_interfaces())):
            raise Cascade(pos)
        raise unknown(f"method of {cls.name}:", name, cls.spelled(), pos)
    return RoutineRef(routine, base.text, False, cls, base.calls)


# -- elements
def index(
    context: Context, base: Value, indices: list[tree.Node], pos: Position
) -> Value:
    """``base[i, k]``."""
    type_ = base.type
    if isinstance(type_, types.ArrayType):
        return _element(context, base, type_, indices, pos)
    if isinstance(type_, types.OpenArray):
        return _open_element(context, base, type_, indices, pos)
    if isinstance(type_, types.PointerType) and type_.target is not None:
        return _pointer_element(context, base, type_, indices, pos)
    if isinstance(type_, types.StringType):
        return _character(context, base, type_, indices, pos)
    text = f"{base.spelled or 'this'} is {type_}, not an array"
    raise StopHere(TYPE, text, pos)


def _whole(context: Context, node: tree.Node) -> Value:
    found = context.value(node)
    base = found.base
    if isinstance(base, types.Elementary) and base.whole:
        return found
    raise StopHere(TYPE, f"an index is a number, not {found.type}", node.pos)


def _element(
    context: Context,
    base: Value,
    type_: types.ArrayType,
    indices: list[tree.Node],
    pos: Position,
) -> Value:
    if len(indices) > len(type_.dims):
        text = f"{len(type_.dims)} indices are needed, not {len(indices)}"
        raise StopHere(TYPE, text, pos)
    fixed, moving, calls = 0, [], base.calls
    stride = type_.size
    before, values = _indices(context, indices)
    calls = calls or bool(before)
    for node, found, (low, high) in zip(
        indices, values, type_.dims, strict=False
    ):
        stride //= high - low + 1
        calls = calls or found.calls
        if found.constant is not None:
            fixed += (_inside(found, low, high, node.pos) - low) * stride
        else:
            text = _index(context, base, found, node.pos, low, high)
            moving.append(f"{text} * {stride}")
    inner: types.Type = type_.element
    if len(indices) < len(type_.dims):
        inner = types.ArrayType(type_.element, type_.dims[len(indices) :])
    offset = " + ".join([*moving, *([str(fixed)] if fixed else [])])
    where = f"({base.text} + {offset})" if offset else base.text
    return _part(base, inner, _behind(before, where), calls)


def _indices(
    context: Context, nodes: list[tree.Node]
) -> tuple[list[str], list[Value]]:
    """(assignments, whole numbers) of an element, read from left to right."""
    return context.in_order([_whole(context, node) for node in nodes])


def _behind(before: list[str], where: str) -> str:
    return f"({', '.join(before)}, {where})" if before else where


def _index(
    context: Context,
    base: Value,
    found: Value,
    pos: Position,
    low: int,
    high: int,
) -> str:
    """C of a checked index; of the HLI's areas it names what they are."""
    function, more = "st_index", ""
    if base.trusted:
        function, more = "st_area_index", f", {_text(base.spelled)}"
    place = context.here(pos)
    return f"{function}({found.text}, {low}, {high}, {place}{more})"


def _part(base: Value, type_: types.Type, where: str, calls: bool) -> Value:
    result = at(type_, where, base.writable)
    result.calls, result.trusted = calls, base.trusted
    result.spelled = f"{base.spelled}[]"
    if base.trusted:
        result.array = base.text
    return result


def _inside(found: Value, low: int, high: int, pos: Position) -> int:
    number = int(found.constant)
    if not low <= number <= high:
        text = f"index {number} is outside of {low}..{high}"
        raise StopHere(RANGE, text, pos)
    return number


def _open_element(
    context: Context,
    base: Value,
    type_: types.OpenArray,
    indices: list[tree.Node],
    pos: Position,
) -> Value:
    if len(indices) != type_.rank:
        text = f"{type_.rank} indices are needed, not {len(indices)}"
        raise StopHere(TYPE, text, pos)
    offset = ""
    calls = base.calls
    before, values = _indices(context, indices)
    calls = calls or bool(before)
    for k, (node, found) in enumerate(zip(indices, values, strict=True)):
        calls = calls or found.calls
        low, high = base.bounds[2 * k : 2 * k + 2]
        place = context.here(node.pos)
        part = f"st_index({found.text}, {low}, {high}, {place})"
        offset = (
            f"({offset}) * ({high} - {low} + 1) + {part}" if offset else part
        )
    size = type_.element.size
    where = f"({base.text} + ({offset}) * {size})"
    return _part(base, type_.element, _behind(before, where), calls)


def _pointer_element(
    context: Context,
    base: Value,
    type_: types.PointerType,
    indices: list[tree.Node],
    pos: Position,
) -> Value:
    assert type_.target is not None
    found = _whole(context, indices[0])
    size, place = type_.target.size, context.here(pos)
    moved = f"({base.text} + (st_i64){found.text} * {size})"
    name = _text(base.spelled)
    where = f"st_deref({moved}, {size}, {place}, {name})"
    if base.text == "self":
        where = moved
    result = at(type_.target, where)
    result.calls = base.calls or found.calls
    return result


def _character(
    context: Context,
    base: Value,
    type_: types.StringType,
    indices: list[tree.Node],
    pos: Position,
) -> Value:
    found = _whole(context, indices[0])
    width = 2 if type_.wide else 1
    place = context.here(indices[0].pos)
    offset = f"st_index({found.text}, 0, {type_.length}, {place})"
    element = types.WORD if type_.wide else types.BYTE
    where = f"({base.text} + {offset} * {width})"
    return _part(base, element, where, base.calls or found.calls)


# -- bits
_WIDTH_TYPES = {
    8: types.BYTE,
    16: types.WORD,
    32: types.DWORD,
    64: types.LWORD,
}


def bit(
    context: Context, base: Value, number: int, width: int, pos: Position
) -> Value:
    """``base.3`` and ``base.%B1``."""
    whole = base.base
    if not isinstance(whole, types.Elementary) or not whole.whole:
        text = f".{number} needs an integer or bit string, not {base.type}"
        raise StopHere(TYPE, text, pos)
    first = number * width
    if first + width > whole.bits:
        last = whole.bits // width - 1
        text = f"{whole} has no part {number}; the last one is {last}"
        raise StopHere(RANGE, text, pos)
    type_ = types.BOOL if width == 1 else _WIDTH_TYPES[width]
    mask = "1u" if width == 1 else f"{(1 << width) - 1:#x}ull"
    text = f"(({type_.c})(((st_u64){base.text} >> {first}) & {mask}))"
    result = Value(type_, text, bits=type_.bits, calls=base.calls)
    if base.constant is not None:
        result.constant = (base.constant >> first) & ((1 << width) - 1)
    result.place, result.writable = base.place, base.writable
    result.bit = (first, width)
    return result


# -- the process image
def direct(context: Context, text: str, pos: Position) -> Value:
    """``%IX0.3``, ``%QW10``: addresses count bytes, as TwinCAT does."""
    match = _DIRECT.match(text)
    if match is None:
        raise StopHere(TYPE, f"{text} has no place outside of AT", pos)
    area, width, byte, number = match.groups()
    type_ = _DIRECT_TYPES[width]
    offset = int(byte)
    if offset + type_.size > IMAGE_SIZE:
        text = f"{text} is outside of the image of {IMAGE_SIZE} bytes"
        raise StopHere(RANGE, text, pos)
    where = address(context.area(f"IMAGE_{area}"), offset)
    found = at(type_, where)
    found.spelled = text
    if type_ is types.BOOL:
        found.bit = (int(number or 0), 1)
        found.text = f"((*(st_u8 *)({where}) >> {found.bit[0]}) & 1)"
    return found
