"""Trees of units become entries of the world; names stand once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import CLASS, TWICE, Origin, StopHere
from ..source.units import Unit
from ..syntax import tree
from . import types
from .classes import Class, Routine
from .declare import Declarations
from .world import VariableList, World

_PARTS = frozenset(["method", "property", "action"])
"""They belong to the POU they stand in, or behind."""
_EVERYWHERE = "a name stands once in the program"


class Collector:
    """Takes trees one by one; the library's names give way to the user's."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.declarations = Declarations(world)
        self._library: set[str] = set()
        self.library = False
        self._last: Class | None = None
        self.protected: frozenset[str] = frozenset()

    def take(self, unit: Unit, found: Any) -> None:
        """One parsed unit."""
        if found is None:
            return
        if isinstance(found, list):
            for definition in found:
                self._typedef(unit, definition)
        elif isinstance(found, tree.Globals):
            self._globals(unit, found)
        elif isinstance(found, tree.Configuration):
            found.origin = unit.origin
            self._world.configurations.append(found)
        else:
            self._pou(unit, found)

    def _free(self, origin: Origin, name: str, pos: tuple[int, int]) -> bool:
        """Whether the name may be taken; the program's wins over the library's."""
        key, world = name.upper(), self._world
        if key in self.protected and not self.library:
            return False
        taken = key in world.typedefs or key in world.classes
        taken = taken or key in world.functions
        if taken and key in self._library and not self.library:
            self._forget(key)
            taken = False
        if taken:
            text = f"{name} is declared twice; {_EVERYWHERE}"
            world.log.error(origin, StopHere(TWICE, text, pos), name)
            return False
        if self.library:
            self._library.add(key)
        return True

    def _forget(self, key: str) -> None:
        self._library.discard(key)
        for table in (
            self._world.typedefs,
            self._world.classes,
            self._world.functions,
        ):
            table.pop(key, None)

    def _typedef(self, unit: Unit, definition: tree.TypeDef) -> None:
        if not self._free(unit.origin, definition.name, definition.pos):
            return
        definition.origin = unit.origin
        definition.attributes = list(unit.attributes)
        key = definition.name.upper()
        self._world.typedefs[key] = definition
        node = definition.type
        qualified = any(a.name == "qualified_only" for a in unit.attributes)
        if isinstance(node, tree.EnumType) and not qualified:
            for name, _, _ in node.items:
                self._world.enumerators.setdefault(name.upper(), key)

    def _globals(self, unit: Unit, found: tree.Globals) -> None:
        key = unit.namespace.upper()
        if key in self.protected and not self.library:
            return
        found.origin = unit.origin
        holder = self._world.lists.get(key)
        if holder is None:
            holder = VariableList(unit.namespace, origin=unit.origin)
            holder.library = self.library
            self._world.lists[key] = holder
        qualified = any(a.name == "qualified_only" for a in unit.attributes)
        self.declarations.globals(found, holder, qualified)

    def _pou(self, unit: Unit, pou: tree.Pou) -> None:
        if pou.kind == "action" and "." in pou.name:
            self._loose_action(unit, pou)
            return
        if pou.kind in _PARTS:
            if self._last is not None and self._last.origin is unit.origin:
                self._part(self._last, pou, unit.origin)
                return
            text = f"{pou.kind} {pou.name} stands outside of its POU"
            self._world.log.error(
                unit.origin, StopHere(CLASS, text, pou.pos), pou.name
            )
            return
        pou.origin, pou.attributes = unit.origin, list(unit.attributes)
        if not self._free(unit.origin, pou.name, pou.pos):
            return
        self._last = None
        if pou.kind == "function":
            self._function(unit, pou)
        else:
            self._class(unit, pou)

    def _loose_action(self, unit: Unit, pou: tree.Pou) -> None:
        owner, _, name = pou.name.rpartition(".")
        cls = self._world.classes.get(owner.upper())
        if cls is None:
            text = f"{owner} of action {name} is unknown"
            self._world.log.error(
                unit.origin, StopHere(CLASS, text, pou.pos), pou.name
            )
            return
        pou.name = name
        self._method(cls, pou, unit.origin)

    def _function(self, unit: Unit, pou: tree.Pou) -> None:
        found = Routine(pou.name, pou, types.VOID, origin=unit.origin)
        found.c = f"F_{pou.name.upper()}"
        self._world.functions[pou.name.upper()] = found

    def _class(self, unit: Unit, pou: tree.Pou) -> None:
        cls = Class(pou.name, pou, pou.kind, unit.origin)
        cls.abstract = "ABSTRACT" in pou.modifiers
        self._world.classes[pou.name.upper()] = cls
        self._last = cls
        for child in pou.children:
            self._part(cls, child, child.origin or unit.origin)
        if pou.kind != "interface":
            body = tree.Pou(pou.pos, "body", pou.name, pou.modifiers)
            body.statements = pou.statements
            cls.body = Routine(
                pou.name, body, types.VOID, cls, origin=unit.origin
            )
            cls.body.c = f"B_{pou.name.upper()}"
            cls.body.name = "body"

    def _part(self, cls: Class, pou: tree.Pou, origin: Origin) -> None:
        if pou.kind == "property":
            self._property(cls, pou, origin)
        else:
            self._method(cls, pou, origin)

    def _method(self, cls: Class, pou: tree.Pou, origin: Origin) -> Routine:
        key = pou.name.upper()
        found = Routine(pou.name, pou, types.VOID, cls, origin=origin)
        if key in cls.methods:
            text = f"{pou.name} stands twice in {cls.name}"
            self._world.log.error(
                origin, StopHere(TWICE, text, pou.pos), cls.name
            )
            return found
        found.c = f"M_{len(cls.name)}{cls.name.upper()}_{key}"
        found.abstract = "ABSTRACT" in pou.modifiers
        found.abstract = found.abstract or cls.kind == "interface"
        for access in ("PRIVATE", "PROTECTED"):
            if access in pou.modifiers:
                found.access = access
        cls.methods[key] = found
        return found

    def _property(self, cls: Class, pou: tree.Pou, origin: Origin) -> None:
        accessors = list(pou.children)
        if not accessors and cls.kind != "interface":
            text = f"property {pou.name} has neither GET nor SET"
            self._world.log.error(
                origin, StopHere(CLASS, text, pou.pos), cls.name
            )
        if not accessors:
            accessors = [
                tree.Pou(pou.pos, kind, kind, frozenset())
                for kind in ("getter", "setter")
            ]
        for accessor in accessors:
            word = "GET" if accessor.kind == "getter" else "SET"
            accessor.name = f"{word}__{pou.name}"
            accessor.result = pou.result
            accessor.modifiers = accessor.modifiers | pou.modifiers
            accessor.variables = [*pou.variables, *accessor.variables]
            self._method(cls, accessor, accessor.origin or origin)


# -- inheritance
def connect(world: World) -> None:
    """Bases and interfaces by their names; wrong ones are errors."""
    for cls in list(world.classes.values()):
        _guarded(world, cls, _connect)
    for cls in list(world.classes.values()):
        _guarded(world, cls, _check_circle)


def _guarded(
    world: World, cls: Class, step: Callable[[World, Class], None]
) -> None:
    try:
        step(world, cls)
    except StopHere as stop:
        world.log.error(cls.origin, stop, cls.name)
        cls.refused = True


def _connect(world: World, cls: Class) -> None:
    pou = cls.pou
    if cls.kind == "interface":
        cls.interfaces = [
            _find(world, cls, n, "interface") for n in pou.extends
        ]
        return
    if len(pou.extends) > 1:
        text = "a function block EXTENDS one other"
        raise StopHere(CLASS, text, pou.pos)
    if pou.extends:
        cls.base = _find(world, cls, pou.extends[0], "function_block")
        if "FINAL" in cls.base.pou.modifiers:
            text = f"{cls.base.name} is FINAL"
            cls.base = None
            raise StopHere(CLASS, text, pou.pos)
    cls.interfaces = [_find(world, cls, n, "interface") for n in pou.implements]


def _find(world: World, cls: Class, name: str, kind: str) -> Class:
    found = world.classes.get(name.upper().rpartition(".")[2])
    if found is None or found.kind != kind:
        word = kind.replace("_", " ")
        text = f"{name} is no {word}; {cls.name} needs one"
        raise StopHere(CLASS, text, cls.pou.pos)
    return found


def _check_circle(world: World, cls: Class) -> None:
    slow, seen = cls, {id(cls)}
    while slow.base is not None:
        slow = slow.base
        if id(slow) in seen:
            cls.base = None
            text = f"{cls.name} extends itself"
            raise StopHere(CLASS, text, cls.pou.pos)
        seen.add(id(slow))
    if cls.kind == "interface" and cls in cls.all_interfaces():
        cls.interfaces = []
        text = f"{cls.name} extends itself"
        raise StopHere(CLASS, text, cls.pou.pos)


def check_class(world: World, cls: Class) -> None:
    """Interfaces are complete, overridden methods fit, abstract ones are filled."""
    if cls.kind == "interface":
        return
    for interface in cls.all_interfaces():
        for name in interface.interface_methods():
            _check_implemented(cls, interface, name)
    for name, routine in cls.methods.items():
        base = cls.base.method(name) if cls.base is not None else None
        if base is not None:
            _check_override(base, routine)
    if not cls.abstract:
        for name in cls.slots():
            found = cls.method(name)
            if found is not None and found.abstract:
                text = f"{found.label} is ABSTRACT and {cls.name} lacks it"
                raise StopHere(CLASS, text, cls.pou.pos)


def _check_implemented(cls: Class, interface: Class, name: str) -> None:
    wanted, found = interface.method(name), cls.method(name)
    assert wanted is not None
    accessor = name.startswith(("GET__", "SET__"))
    if found is None and accessor:
        return
    if found is None:
        text = f"{cls.name} lacks {wanted.name} of {interface.name}"
        raise StopHere(CLASS, text, cls.pou.pos)
    _check_override(wanted, found)


def _check_override(base: Routine, found: Routine) -> None:
    if found.name.upper() == "FB_INIT" or base is found:
        return
    if "FINAL" in base.pou.modifiers:
        text = f"{base.label} is FINAL"
        raise StopHere(CLASS, text, found.pou.pos)
    shapes = [
        [(v.section, str(v.type)) for v in r.parameters] for r in (base, found)
    ]
    if shapes[0] != shapes[1] or str(base.result) != str(found.result):
        text = f"{found.label} does not have the parameters of {base.label}"
        raise StopHere(CLASS, text, found.pou.pos)
