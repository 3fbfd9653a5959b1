"""What a name means at a place: local, member, global, type, POU, standard function."""

from __future__ import annotations

from ..errors import CONSTANT, TYPE, Position, StopHere
from ..model import types
from ..model.classes import Class, Routine, Variable
from ..model.world import VariableList, unknown
from ..syntax import tree
from . import builtins
from .context import Context
from .value import (
    BuiltinRef,
    Entity,
    LibraryRef,
    NamespaceRef,
    PropertyRef,
    RoutineRef,
    TypeRef,
    Value,
    address,
    at,
    constant,
)

_WORDS = {"TRUE": (types.BOOL, 1), "FALSE": (types.BOOL, 0)}


def resolve(context: Context, node: tree.Name) -> Entity:
    """The meaning of a name.  StopHere: it has none."""
    key = node.name.upper()
    found = None if node.everywhere else _near(context, key, node.pos)
    if found is None:
        found = everywhere(context, key, node.pos)
    if found is None:
        raise unknown("name", node.name, _known(context), node.pos)
    return found


def _near(context: Context, key: str, pos: Position) -> Entity | None:
    """Names of the routine and of the instance."""
    routine = context.routine
    if routine is not None and key in routine.variables:
        return variable(context, routine.variables[key], "self", pos)
    cls = context.cls
    if cls is None:
        return None
    if cls.variable(key) is not None or cls.kind != "interface":
        return member_of(context, cls, "self", key, pos, static=False)
    return None


def member_of(
    context: Context,
    cls: Class,
    instance: str,
    key: str,
    pos: Position,
    static: bool,
) -> Entity | None:
    """A variable, property or method of an instance."""
    found = cls.variable(key)
    if found is not None:
        if found.storage == "member" and found.constant is None:
            _check_declared(cls, found, pos)
            cls.layout()
        return variable(context, found, instance, pos)
    type_ = cls.property_type(key)
    if type_ is not None:
        return PropertyRef(key, type_, instance, cls, static)
    routine = cls.method(key)
    if routine is not None:
        interface = cls if cls.kind == "interface" else None
        return RoutineRef(routine, instance, static, interface)
    return None


def _check_declared(cls: Class, found: Variable, pos: Position) -> None:
    if any(not c.declared for c in cls.ancestors()):
        text = f"{found.name} is no constant"
        raise StopHere(CONSTANT, text, pos)


def everywhere(context: Context, key: str, pos: Position) -> Entity | None:
    """Names that are known in the whole program."""
    world = context.world
    if key in _WORDS:
        return constant(*_WORDS[key])
    if key in world.globals:
        return variable(context, world.globals[key], "", pos)
    if key in world.enumerators:
        type_ = world.type_named(world.enumerators[key], pos)
        assert isinstance(type_, types.EnumType)
        return constant(type_, type_.values[key])
    if key == "NULL":
        return Value(types.PointerType(None), "((st_ptr)0)", constant=0)
    routine = world.routine(key)
    if routine is not None:
        return RoutineRef(routine)
    return _broad(context, key, pos)


def _broad(context: Context, key: str, pos: Position) -> Entity | None:
    """Programs, types, lists, libraries, standard functions."""
    world = context.world
    cls = world.classes.get(key)
    if cls is not None and cls.kind == "program":
        type_ = world.type_named(key, pos)
        return at(type_, context.area(f"P_{key}"))
    if builtins.known(key):
        return BuiltinRef(key)
    if key in world.lists:
        return NamespaceRef(world.lists[key])
    if key in world.library_names:
        return LibraryRef(key)
    found = world.find_type(key, pos)
    return TypeRef(found) if found is not None else None


def _known(context: Context) -> list[str]:
    names = [*context.world.names(), *builtins.names()]
    if context.routine is not None:
        names += [v.name for v in context.routine.variables.values()]
    if context.cls is not None:
        names += context.cls.spelled()
    return names


def in_list(
    context: Context, found: VariableList, name: str, pos: Position
) -> Value:
    """A variable by the name of its list."""
    key = name.upper()
    if key not in found.variables:
        known = [v.name for v in found.variables.values()]
        raise unknown(f"name {found.name}.", name, known, pos)
    return variable(context, found.variables[key], "", pos)


def variable(
    context: Context, found: Variable, instance: str, pos: Position
) -> Value:
    """The value of a variable; ``instance`` is the address of its holder."""
    value = _stored(context, found.settle(), instance, pos)
    value.spelled = found.name
    if found.read_only:
        value.writable = False
    return value


def _stored(
    context: Context, found: Variable, instance: str, pos: Position
) -> Value:
    if found.constant is not None:
        return constant(found.type, found.constant)
    if found.storage == "local":
        return _local(found)
    if found.storage == "parameter":
        value = at(found.type, found.c)
        value.bounds = _bounds(found)
        return value
    where = _address(context, found, instance)
    if found.storage == "member" and found.section == "VAR_IN_OUT":
        pointer = f"st_bound(*(st_ptr *)({where}), {context.here(pos)})"
        value = at(found.type, pointer)
        value.bounds = _stored_bounds(found.type, where)
        return value
    value = at(found.type, where)
    if found.index >= 0:
        value.bit = (found.index, 1)
        value.text = f"((*(st_u8 *)({where}) >> {found.index}) & 1)"
    value.trusted = found.area == "G_HLI_GLOBAL_VARIABLES"
    return value


def _address(context: Context, found: Variable, instance: str) -> str:
    if found.storage == "global":
        return address(context.area(found.area), found.offset)
    return address(instance, found.offset)


def _local(found: Variable) -> Value:
    if not found.type.scalar:
        return at(found.type, found.c)
    bits = getattr(types.plain(found.type), "bits", 0)
    place = f"((st_ptr)&{found.c})"
    return Value(
        found.type,
        found.c,
        place=place,
        bits=bits,
        writable=True,
        local=True,
    )


def _bounds(found: Variable) -> tuple[str, ...]:
    if not isinstance(found.type, types.OpenArray):
        return ()
    rank = found.type.rank
    return tuple(f"{found.c}_{k}" for k in range(2 * rank))


def _stored_bounds(type_: types.Type, where: str) -> tuple[str, ...]:
    """The bounds of an ARRAY [*] of an instance lie behind its address."""
    if not isinstance(type_, types.OpenArray):
        return ()
    return tuple(
        f"(*(st_i64 *)({address(where, 8 * k)}))"
        for k in range(1, 2 * type_.rank + 1)
    )


def routine_type(routine: Routine, pos: Position) -> types.Type:
    """The type of a call's result.  StopHere: it has none."""
    if routine.result is types.VOID:
        text = f"{routine.label} has no result"
        raise StopHere(TYPE, text, pos)
    return routine.result
