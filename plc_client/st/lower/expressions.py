"""Expressions: one function for every kind of node."""

from __future__ import annotations

from collections.abc import Callable

from ..errors import CLASS, TYPE, Position, StopHere, refuse
from ..model import types
from ..model.classes import ClassType
from ..syntax import tree
from . import (
    builtins,
    calls,
    convert,
    literal_values,
    names,
    operators,
    places,
)
from .context import Context, Settled
from .value import (
    BuiltinRef,
    Entity,
    PropertyRef,
    RoutineRef,
    TypeRef,
    Value,
)


def value(
    context: Context, node: tree.Node, wanted: types.Type | None = None
) -> Value:
    """An expression as a value; with ``wanted`` as a value of that type."""
    found = as_value(context, entity(context, node), node.pos)
    if wanted is None:
        return found
    return convert.implicit(context, found, wanted, node.pos)


def as_value(context: Context, found: Entity, pos: Position) -> Value:
    """Properties are read, references followed; names of types are refused."""
    if isinstance(found, PropertyRef):
        return calls.get_property(context, found, pos)
    if isinstance(found, Value):
        return places.follow(context, found, pos)
    if isinstance(found, RoutineRef):
        text = f"{found.routine.label} is called with brackets: ()"
        raise StopHere(TYPE, text, pos)
    if isinstance(found, BuiltinRef):
        raise StopHere(TYPE, f"{found.name} is called with brackets: ()", pos)
    raise StopHere(TYPE, "a value is needed, not the name of a type", pos)


def boolean(context: Context, node: tree.Node) -> Value:
    """A condition."""
    found = value(context, node)
    base = found.base
    if isinstance(base, types.Elementary) and base.family == "bool":
        return found
    raise StopHere(TYPE, f"a condition is BOOL, not {found.type}", node.pos)


def entity(context: Context, node: tree.Node) -> Entity:
    """What an expression stands for."""
    return _RULES[type(node)](context, node)


class LoweringContext(Context):
    """The context of all code that is lowered: its recursive entries."""

    def value(self, node: tree.Node, wanted: types.Type | None = None) -> Value:
        return value(self, node, wanted)

    def as_value(self, found: Entity, pos: Position) -> Value:
        return as_value(self, found, pos)

    def boolean(self, node: tree.Node) -> Value:
        return boolean(self, node)

    def entity(self, node: tree.Node) -> Entity:
        return entity(self, node)

    def get_property(self, found: PropertyRef, pos: Position) -> Value:
        return calls.get_property(self, found, pos)

    def set_property(
        self, found: PropertyRef, new: Value, pos: Position
    ) -> str:
        return calls.set_property(self, found, new, pos)


def _name(context: Context, node: tree.Name) -> Entity:
    return names.resolve(context, node)


def _unary(context: Context, node: tree.Unary) -> Value:
    operand = value(context, node.operand)
    return operators.unary(context, node.operator, operand, node.pos)


def _binary(context: Context, node: tree.Binary) -> Value:
    left, right = value(context, node.left), value(context, node.right)
    return operators.binary(context, node.operator, left, right, node.pos)


def _called(context: Context, node: tree.Node) -> Entity:
    """What is called; a variable may have the name of a function."""
    base = entity(context, node)
    if not isinstance(node, tree.Name) or not isinstance(base, Value):
        return base
    if isinstance(base.type, (ClassType, types.PointerType)):
        return base
    key = node.name.upper()
    own, cls = context.routine, context.cls
    if own is not None and cls is not None and own.name.upper() == key:
        method = cls.method(key)  # the name is the result's, too
        if method is not None:
            return RoutineRef(method, "self")
    routine = context.world.routine(key)
    if routine is not None:
        return RoutineRef(routine)
    return BuiltinRef(key) if builtins.known(key) else base


def _call(context: Context, node: tree.Call) -> Entity:
    base = _called(context, node.base)
    if isinstance(base, TypeRef):
        raise StopHere(
            TYPE, f"{base.type} is a type; declare a variable of it", node.pos
        )
    if isinstance(base, BuiltinRef):
        return builtins.call(context, base.name, node)
    if isinstance(base, PropertyRef):
        base = calls.get_property(context, base, node.pos)
    if isinstance(base, RoutineRef):
        return calls.call_routine(context, base, node)
    if isinstance(base, Value):
        base = places.follow(context, base, node.pos)
        if isinstance(base.type, ClassType):
            return calls.call_instance(context, base, node)
        text = f"{base.type} is no function or function block"
        raise StopHere(TYPE, text, node.pos)
    raise StopHere(TYPE, "this cannot be called", node.pos)


def _this(context: Context, node: tree.This) -> Value:
    cls = context.cls
    if cls is None or cls.kind != "function_block":
        raise StopHere(CLASS, "THIS belongs into a function block", node.pos)
    target = context.world.type_named(cls.name, node.pos)
    found = Value(types.PointerType(target), "self", spelled="THIS")
    found.trusted = True
    return found


def _super(context: Context, node: tree.Super) -> Value:
    cls = context.cls
    if cls is None or cls.base is None:
        text = "SUPER needs a function block with EXTENDS"
        raise StopHere(CLASS, text, node.pos)
    target = context.world.type_named(cls.base.name, node.pos)
    found = Value(types.PointerType(target), "self", spelled="SUPER")
    found.trusted, found.exact = True, True
    return found


def _deref(context: Context, node: tree.Deref) -> Value:
    found = value(context, node.base)
    result = places.dereference(context, found, node.pos)
    if isinstance(node.base, tree.Super):
        result.exact = True
    return result


def _member(context: Context, node: tree.Member) -> Entity:
    base = entity(context, node.base)
    return places.member(context, base, node.name, node.pos)


def _index(context: Context, node: tree.Index) -> Value:
    base = value(context, node.base)
    return places.index(context, base, node.indices, node.pos)


def _bit(context: Context, node: tree.Bit) -> Value:
    base = value(context, node.base)
    return places.bit(context, base, node.number, node.width, node.pos)


def _direct(context: Context, node: tree.Direct) -> Value:
    return places.direct(context, node.address, node.pos)


def _struct_init(context: Context, node: tree.StructInit) -> Value:
    raise refuse("(a := 1) outside of a declaration", node.pos)


def _array_init(context: Context, node: tree.ArrayInit) -> Value:
    raise refuse("[1, 2] outside of a declaration", node.pos)


_RULES: dict[type, Callable[..., Entity]] = {
    tree.Name: _name,
    tree.Literal: literal_values.literal,
    tree.Unary: _unary,
    tree.Binary: _binary,
    tree.Call: _call,
    tree.This: _this,
    tree.Super: _super,
    tree.Deref: _deref,
    tree.Member: _member,
    tree.Index: _index,
    tree.Bit: _bit,
    tree.Direct: _direct,
    tree.StructInit: _struct_init,
    tree.ArrayInit: _array_init,
    Settled: lambda _, node: node.value,
}
