"""Initial values: of variables where they are declared, of types where nothing else is said."""

from __future__ import annotations

from ..errors import RANGE, TYPE, StopHere
from ..model import after_init, types
from ..model.classes import ClassType
from ..model.world import Cascade, unknown
from ..syntax import tree
from . import calls, convert, expressions, names, store
from .context import Context
from .value import RoutineRef, Value, address, at, constant

LOOP_FROM = 5
"""Elements from which on a loop writes them."""


def needed(type_: types.Type) -> bool:
    """Whether zero bytes are no initial value."""
    if isinstance(type_, types.EnumType):
        return type_.default != 0
    if isinstance(type_, types.Subrange):
        return type_.low > 0
    if isinstance(type_, types.ArrayType):
        return needed(type_.element)
    if isinstance(type_, types.StructType):
        return type_.initial is not None
    return isinstance(type_, ClassType)


def default(context: Context, type_: types.Type, where: str) -> None:
    """C that gives memory of zeros the initial value of its type."""
    if not needed(type_):
        return
    if isinstance(type_, types.EnumType):
        _put(context, type_, where, constant(type_, type_.default))
    elif isinstance(type_, types.Subrange):
        _put(context, type_, where, constant(type_, type_.low))
    elif isinstance(type_, types.ArrayType):
        _elements(context, type_, where)
    elif isinstance(type_, types.StructType):
        name = struct_name(type_)
        context.prototype(name, f"void {name}(st_ptr) ST_HIDDEN;")
        context.put(f"{name}({where});")
    elif isinstance(type_, ClassType):
        name = f"I_{type_.cls.name.upper()}"
        context.prototype(name, f"void {name}(st_ptr) ST_HIDDEN;")
        context.put(f"{name}({where});")


def struct_name(type_: types.StructType) -> str:
    """The C function that writes the initial values of a structure."""
    return f"T_{type_.name.upper()}"


def _put(context: Context, type_: types.Type, where: str, value: Value) -> None:
    context.put(f"*({types.c_type(type_)} *)({where}) = {value.text};")


def _elements(context: Context, type_: types.ArrayType, where: str) -> None:
    size, count = type_.element.size, type_.count
    if count < LOOP_FROM:
        for k in range(count):
            default(context, type_.element, address(where, k * size))
        return
    name = f"k{context.number()}"
    context.put(f"for (st_i64 {name} = 0; {name} < {count}; {name}++) {{")
    default(context, type_.element, f"({where} + {name} * {size})")
    context.put("}")


def variable(
    context: Context,
    type_: types.Type,
    where: str,
    init: tree.Node | None,
    declared: tree.Node | None = None,
) -> None:
    """C for one variable; ``declared`` is its written type with FB_init's arguments."""
    default(context, type_, where)
    arguments = getattr(declared, "arguments", None)
    if isinstance(type_, ClassType):
        _construct(context, type_, where, arguments or [], declared)
    elif isinstance(type_, types.ArrayType):
        element = getattr(declared, "element", None)
        _construct_all(context, type_, where, element)
    if init is not None:
        written(context, type_, where, init)
    _after(context, type_, where)


def _after(context: Context, type_: types.Type, where: str) -> None:
    """The methods that want to run behind the initial values."""
    if isinstance(type_, types.ArrayType):
        _after_each(context, type_, where)
    if not isinstance(type_, ClassType):
        return
    for method in after_init.methods(type_.cls):
        pos = method.pou.pos
        call = tree.Call(pos, tree.Name(pos, method.name), [])
        found = calls.call_routine(context, RoutineRef(method, where), call)
        context.put(f"(void)({found.text});")


def _after_each(context: Context, type_: types.ArrayType, where: str) -> None:
    element = type_.element
    if not isinstance(element, ClassType) or not after_init.methods(
        element.cls
    ):
        return
    name = f"k{context.number()}"
    count, size = type_.count, element.size
    context.put(f"for (st_i64 {name} = 0; {name} < {count}; {name}++) {{")
    _after(context, element, f"({where} + {name} * {size})")
    context.put("}")


def _construct_all(
    context: Context,
    type_: types.ArrayType,
    where: str,
    declared: tree.Node | None,
) -> None:
    element = type_.element
    if not isinstance(element, ClassType):
        return
    if isinstance(declared, tree.NamedType) and declared.each is not None:
        _construct_each(context, type_, where, declared)
        return
    routine = element.cls.method("FB_INIT")
    if routine is None or len(routine.parameters) > 2:
        return
    name = f"k{context.number()}"
    count, size = type_.count, element.size
    context.put(f"for (st_i64 {name} = 0; {name} < {count}; {name}++) {{")
    place = f"({where} + {name} * {size})"
    _construct(context, element, place, [], None)
    context.put("}")


def _construct_each(
    context: Context,
    type_: types.ArrayType,
    where: str,
    declared: tree.NamedType,
) -> None:
    """``ARRAY [1..2] OF FB[(n := 1), (n := 2)]``: arguments one by one."""
    element, each = type_.element, declared.each or []
    assert isinstance(element, ClassType)
    if len(each) != type_.count:
        text = f"{type_.count} elements need {type_.count} lists of arguments"
        raise StopHere(RANGE, text, declared.pos)
    for number, node in enumerate(each):
        arguments = [tree.Argument("", node, False, node.pos)]
        if isinstance(node, tree.StructInit):
            arguments = [
                tree.Argument(name, value, False, pos)
                for name, value, pos in node.members
            ]
        place = address(where, number * element.size)
        _construct(context, element, place, arguments, declared)


def _construct(
    context: Context,
    type_: ClassType,
    where: str,
    arguments: list[tree.Argument],
    declared: tree.Node | None,
) -> None:
    """Call FB_init; the two BOOLs in front are FALSE, FALSE."""
    routine = type_.cls.method("FB_INIT")
    pos = declared.pos if declared is not None else (1, 1)
    if routine is None:
        _named_inputs(context, type_, where, arguments)
        return
    first = [
        tree.Argument("", tree.Name(pos, "FALSE"), False, pos)
        for _ in routine.of("VAR_INPUT")[:2]
    ]
    call = tree.Call(pos, tree.Name(pos, "FB_init"), first + arguments)
    found = calls.call_routine(context, RoutineRef(routine, where), call)
    context.put(f"(void)({found.text});")


def _named_inputs(
    context: Context,
    type_: ClassType,
    where: str,
    arguments: list[tree.Argument],
) -> None:
    members = [
        (a.name, a.value, a.pos) for a in arguments if a.value is not None
    ]
    for name, _, pos in members:
        if not name:
            raise StopHere(TYPE, f"{type_} has no FB_init", pos)
    _members(context, type_, where, members)


# -- values that are written down
def written(
    context: Context, type_: types.Type, where: str, node: tree.Node
) -> None:
    """C for ``:= value``."""
    if isinstance(type_, types.ArrayType):
        items = node.items if isinstance(node, tree.ArrayInit) else [node]
        _array(context, type_, where, items, node)
    elif isinstance(node, tree.StructInit):
        _members(context, type_, where, node.members)
    else:
        place = at(type_, where)
        if isinstance(type_, types.PointerType) and type_.reference:
            value = store.bound(context, type_, node)
        else:
            value = expressions.value(context, node)
            value = convert.implicit(context, value, type_, node.pos)
        keep = context.taken
        context.put(store.assignment(context, place, value, node.pos) + ";")
        context.statement_ends(keep)


def _members(
    context: Context,
    type_: types.Type,
    where: str,
    members: list[tuple[str, tree.Node, tuple[int, int]]],
) -> None:
    for name, node, pos in members:
        found = _member(context, type_, name, pos)
        if isinstance(found, Value):
            _set_property(context, type_, where, name, node)
            continue
        written(context, found.type, address(where, found.offset), node)


def _member(
    context: Context, type_: types.Type, name: str, pos: tuple[int, int]
) -> types.Member | Value:
    if isinstance(type_, types.StructType):
        known = type_.members
    elif isinstance(type_, ClassType):
        known = type_.cls.layout().members
        if type_.cls.property_type(name.upper()) is not None:
            return Value(types.VOID, "")
    else:
        raise StopHere(TYPE, f"{type_} has no members", pos)
    if isinstance(type_, ClassType) and type_.cls.uncertain:
        raise Cascade(pos)
    if name.upper() not in known:
        spelled = [member.name for member in known.values()]
        raise unknown(f"member of {type_}:", name, spelled, pos)
    return known[name.upper()]


def _set_property(
    context: Context,
    type_: types.Type,
    where: str,
    name: str,
    node: tree.Node,
) -> None:
    assert isinstance(type_, ClassType)
    found = names.member_of(
        context, type_.cls, where, name.upper(), node.pos, True
    )
    value = expressions.value(context, node)
    text = calls.set_property(context, found, value, node.pos)  # type: ignore[arg-type]
    context.put(text + ";")


def _array(
    context: Context,
    type_: types.ArrayType,
    where: str,
    items: list[tree.Node],
    node: tree.Node,
) -> None:
    inner = _rows(type_, items)
    element = inner or type_.element
    count = type_.count // (
        element.count if isinstance(element, types.ArrayType) and inner else 1
    )
    place = 0
    for item in items:
        times, values = _repeated(context, item)
        if place + times * len(values) > count:
            text = f"more than {count} initial values"
            raise StopHere(RANGE, text, node.pos)
        _run(context, element, where, place, times, values)
        place += times * len(values)


def _rows(
    type_: types.ArrayType, items: list[tree.Node]
) -> types.ArrayType | None:
    """The type of a row where rows stand in brackets of their own."""
    if len(type_.dims) < 2:
        return None
    if not any(isinstance(i, tree.ArrayInit) for i in items):
        return None
    return types.ArrayType(type_.element, type_.dims[1:])


def _repeated(
    context: Context, item: tree.Node
) -> tuple[int, list[tree.Node | None]]:
    """``3(5)`` is (3, [5]); ``4()`` leaves four elements as they are."""
    if not isinstance(item, tree.Call) or not _may_count(context, item.base):
        return 1, [item]
    number = expressions.value(context, item.base)
    if not isinstance(number.constant, int):
        return 1, [item]
    values: list[tree.Node | None] = [a.value for a in item.arguments]
    return number.constant, values or [None]


def _may_count(context: Context, node: tree.Node) -> bool:
    """A number, or the name of a variable: a constant one counts elements."""
    if isinstance(node, tree.Member) and isinstance(node.base, tree.Name):
        holder = context.world.lists.get(node.base.name.upper())
        return holder is not None and node.name.upper() in holder.variables
    if not isinstance(node, tree.Name):
        return isinstance(node, tree.Literal)
    name = node.name.upper()
    routine, cls = context.routine, context.cls
    return (
        name in context.world.globals
        or (routine is not None and name in routine.variables)
        or (cls is not None and cls.variable(name) is not None)
    )


def _run(
    context: Context,
    element: types.Type,
    where: str,
    place: int,
    times: int,
    values: list[tree.Node | None],
) -> None:
    size = element.size
    if times * len(values) >= LOOP_FROM and times > 1:
        name = f"k{context.number()}"
        context.put(f"for (st_i64 {name} = 0; {name} < {times}; {name}++) {{")
        for k, value in enumerate(values):
            offset = f"({place + k} + {name} * {len(values)}) * {size}"
            if value is not None:
                written(context, element, f"({where} + {offset})", value)
        context.put("}")
        return
    for k in range(times * len(values)):
        value = values[k % len(values)]
        if value is not None:
            spot = address(where, (place + k) * size)
            written(context, element, spot, value)
