"""Addresses, sizes, blocks of memory, bounds, references."""

from __future__ import annotations

from functools import partial

from ..errors import ARGUMENT, RANGE, TYPE, Position, StopHere, refuse
from ..model import types
from ..model.classes import ClassType, InterfaceType
from ..syntax import tree
from . import convert
from .builtin_arguments import Rule, count
from .context import Context
from .value import RoutineRef, TypeRef, Value, constant


def _sizeof(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 1, 1, name, pos)
    found = context.entity(nodes[0])
    type_ = found.type if isinstance(found, TypeRef) else None
    if type_ is None:
        type_ = context.as_value(found, pos).type
    if isinstance(type_, types.OpenArray):
        raise refuse("SIZEOF of ARRAY [*]", pos, "use UPPER_BOUND")
    value = constant(types.UDINT, type_.size)
    value.weak = True
    return value


def _adr(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 1, 1, "ADR", pos)
    found = context.entity(nodes[0])
    if isinstance(found, RoutineRef):
        raise refuse("ADR of a function", pos)
    value = context.as_value(found, pos)
    if value.bit is not None:
        raise refuse("ADR of a bit", pos, "use the address of its byte")
    place = value.place
    if not place and isinstance(value.type, types.StringType):
        place = value.text
    if not place:
        raise StopHere(TYPE, "ADR needs a variable", nodes[0].pos)
    type_ = types.PointerType(value.type)
    return Value(
        type_, f"((st_ptr)({place}))", bits=64, calls=value.calls, exact=True
    )


def address(context: Context, node: tree.Node) -> Value:
    """A pointer, or a number that is one.  StopHere: it is neither."""
    value = context.value(node)
    if isinstance(value.type, types.PointerType):
        return value
    base = value.base
    if isinstance(base, types.Elementary) and base.whole:
        return value.with_text(f"((st_ptr)(st_uptr){value.text})")
    raise StopHere(TYPE, f"an address is needed, not {value.type}", node.pos)


def whole(context: Context, node: tree.Node) -> Value:
    """A number as LINT.  StopHere: it is none."""
    value = context.value(node)
    base = value.base
    if isinstance(base, types.Elementary) and base.whole:
        return convert.cast(value, types.LINT)
    raise StopHere(TYPE, f"a number is needed, not {value.type}", node.pos)


def _block(
    context: Context,
    nodes: list[tree.Node],
    pos: Position,
    *,
    name: str,
    shape: str,
) -> Value:
    """``shape``: a for an address, n for a number."""
    count(nodes, len(shape), len(shape), name, pos)
    values = [
        address(context, node) if letter == "a" else whole(context, node)
        for letter, node in zip(shape, nodes, strict=True)
    ]
    inside = ", ".join(v.text for v in values)
    text = f"st_{name.lower()}({inside}, {context.here(pos)})"
    type_ = types.DINT if name == "MEMCMP" else types.UDINT
    return Value(type_, f"(({type_.c}){text})", calls=True, bits=32)


def _bound(
    context: Context, nodes: list[tree.Node], pos: Position, *, upper: bool
) -> Value:
    count(nodes, 2, 2, "UPPER_BOUND" if upper else "LOWER_BOUND", pos)
    value = context.value(nodes[0])
    number = context.value(nodes[1])
    if number.constant is None:
        raise StopHere(ARGUMENT, "the dimension is a constant", pos)
    type_ = value.type
    if isinstance(type_, types.OpenArray):
        _check_rank(number.constant, type_.rank, pos)
        text = value.bounds[2 * (number.constant - 1) + int(upper)]
        return Value(types.DINT, f"((st_i32){text})", bits=32)
    if isinstance(type_, types.ArrayType):
        _check_rank(number.constant, len(type_.dims), pos)
        bound = type_.dims[number.constant - 1][int(upper)]
        return constant(types.DINT, bound)
    raise StopHere(TYPE, f"an array is needed, not {type_}", pos)


def _check_rank(number: int, rank: int, pos: Position) -> None:
    if not 1 <= number <= rank:
        text = f"dimension {number} is outside of 1..{rank}"
        raise StopHere(RANGE, text, pos)


def _is_valid(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 1, 1, "__ISVALIDREF", pos)
    found = context.entity(nodes[0])
    if isinstance(found, Value) and isinstance(found.type, types.PointerType):
        return Value(types.BOOL, f"({found.text} != 0)", bits=8)
    raise StopHere(TYPE, "__ISVALIDREF needs a reference", pos)


def _query_interface(
    context: Context, nodes: list[tree.Node], pos: Position
) -> Value:
    count(nodes, 2, 2, "__QUERYINTERFACE", pos)
    source = context.value(nodes[0])
    target = context.value(nodes[1])
    if not isinstance(target.type, InterfaceType):
        raise StopHere(TYPE, "the second argument is an interface", pos)
    if not isinstance(source.type, (InterfaceType, ClassType)):
        text = "the first argument is an interface or an instance"
        raise StopHere(TYPE, text, pos)
    name = f"N_{target.type.cls.name.upper()}"
    context.prototype(name, f"extern const char {name}[] ST_HIDDEN;")
    holder = source.place or source.text
    if isinstance(source.type, InterfaceType):
        holder = source.text
    text = f"st_query({holder}, {name}, {target.place})"
    return Value(types.BOOL, text, calls=True, bits=8)


def _query_pointer(
    context: Context, nodes: list[tree.Node], pos: Position
) -> Value:
    count(nodes, 2, 2, "__QUERYPOINTER", pos)
    source = context.value(nodes[0])
    target = context.value(nodes[1])
    if not isinstance(target.type, types.PointerType) or not target.place:
        raise StopHere(TYPE, "the second argument is a pointer", pos)
    holder = source.place or source.text
    if isinstance(source.type, InterfaceType):
        holder = source.text
    where = f"*(st_ptr *)({target.place})"
    text = f"(({where} = {holder}) != 0)"
    return Value(types.BOOL, text, calls=True, bits=8)


def _refused(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    raise refuse(name, pos)


def _fail(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    """An assertion failed; the library alone calls it."""
    count(nodes, 1, 1, "__FAIL", pos)
    text = context.value(nodes[0], types.StringType(255))
    return Value(types.VOID, f"st_failed({text.text})", calls=True)


def _rules() -> dict[str, tuple[Rule, tuple[str, ...]]]:
    found: dict[str, tuple[Rule, tuple[str, ...]]] = {
        "ADR": (_adr, ("IN",)),
        "REF": (_adr, ("IN",)),
        "__FAIL": (_fail, ("TEXT",)),
        "__ISVALIDREF": (_is_valid, ("REF",)),
        "__QUERYINTERFACE": (_query_interface, ("FROM", "TO")),
        "__QUERYPOINTER": (_query_pointer, ("FROM", "TO")),
        "LOWER_BOUND": (partial(_bound, upper=False), ("ARR", "DIM")),
        "UPPER_BOUND": (partial(_bound, upper=True), ("ARR", "DIM")),
    }
    for name in ("SIZEOF", "XSIZEOF"):
        found[name] = (partial(_sizeof, name=name), ("IN",))
    copy = ("DESTADDR", "SRCADDR", "N")
    blocks = {
        "MEMCPY": ("aan", copy),
        "MEMMOVE": ("aan", copy),
        "MEMSET": ("ann", ("DESTADDR", "FILLBYTE", "N")),
        "MEMCMP": ("aan", ("PBUF1", "PBUF2", "N")),
    }
    for name, (shape, parameters) in blocks.items():
        found[name] = (partial(_block, name=name, shape=shape), parameters)
    for name in ("__NEW", "__DELETE", "__VARINFO", "INI", "BITADR", "__TRY"):
        found[name] = (partial(_refused, name=name), ())
    return found


RULES = _rules()
