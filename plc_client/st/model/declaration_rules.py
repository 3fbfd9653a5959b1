"""Small questions about one declaration."""

from __future__ import annotations

from collections.abc import Callable

from ..errors import CLASS, TWICE, StopHere
from ..syntax import tree
from . import types
from .classes import ClassType
from .world import Cascade, World


def opening(world: World, key: str) -> bool:
    """Whether the target is a class whose declaration is under way."""
    cls = world.classes.get(key)
    return cls is not None and cls.kind != "interface"


def check_closed(type_: types.Type, declaration: tree.Decl) -> None:
    """A variable is no part of what its own type is made of, and no instance of an
    abstract block.
    """
    while isinstance(type_, (types.ArrayType, types.OpenArray)):
        type_ = type_.element
    if isinstance(type_, ClassType) and type_.cls.opening:
        text = f"{type_.cls.name} contains itself; use POINTER TO"
        raise StopHere(TWICE, text, declaration.pos)
    if isinstance(type_, ClassType) and type_.cls.abstract:
        text = f"{type_.cls.name} is ABSTRACT and has no instance"
        raise StopHere(CLASS, text, declaration.pos)


def retained(declaration: tree.Decl) -> str:
    """The qualifier that keeps a variable over restarts, or nothing."""
    for word in ("PERSISTENT", "RETAIN"):
        if word in declaration.qualifiers:
            return word
    return ""


def constants_first(declarations: list[tree.Decl]) -> list[tree.Decl]:
    """A constant may be declared behind the variable whose bound it is."""
    return sorted(declarations, key=lambda found: not _is_constant(found))


def _is_constant(declaration: tree.Decl) -> bool:
    own = declaration.section in ("VAR", "VAR_STAT", "VAR_TEMP")
    return own and "CONSTANT" in declaration.qualifiers


def broken(declaration: tree.Decl) -> Callable[[], None]:
    """What a use of a refused declaration does: it adds no error."""

    def again() -> None:
        raise Cascade(declaration.pos)

    return again
