"""All names of a program; each is resolved when it is first needed."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from ..errors import NAME, TWICE, Log, Origin, Position, StopHere
from ..syntax import tree
from . import types
from .classes import Class, ClassType, InterfaceType, Routine, Variable
from .types import Type


class Cascade(StopHere):
    """Something this depends on is wrong and was reported there."""

    def __init__(self, pos: Position) -> None:
        super().__init__(0, "", pos)


@dataclass(eq=False)
class VariableList:
    """One namespace of globals and its memory."""

    name: str
    variables: dict[str, Variable] = field(default_factory=dict)
    layout: types.StructType = field(
        default_factory=lambda: types.StructType("")
    )
    origin: Origin | None = None
    library: bool = False


@dataclass(eq=False)
class World:
    """The program as a whole."""

    log: Log
    short_circuit: bool = False
    typedefs: dict[str, tree.TypeDef] = field(default_factory=dict)
    types: dict[str, Type] = field(default_factory=dict)
    classes: dict[str, Class] = field(default_factory=dict)
    functions: dict[str, Routine] = field(default_factory=dict)
    lists: dict[str, VariableList] = field(default_factory=dict)
    globals: dict[str, Variable] = field(default_factory=dict)
    enumerators: dict[str, str] = field(default_factory=dict)
    configurations: list[tree.Configuration] = field(default_factory=list)
    offered: frozenset[str] = frozenset()
    resolve_type: Callable[[tree.TypeDef], Type] | None = None
    declare: Callable[[Class | Routine], None] | None = None
    library_names: frozenset[str] = frozenset(
        [
            "STANDARD",
            "TC2_STANDARD",
            "TC2_SYSTEM",
            "TC2_UTILITIES",
            "TC2_MATH",
            "UTIL",
            "TC2_MC2",
            "TC3_MODULE",
            "TCUNIT",
            "__SYSTEM",
            "HLI",
        ]
    )
    _open: list[str] = field(default_factory=list)

    def type_named(self, name: str, pos: Position) -> Type:
        """The type of a name.  StopHere: unknown, or wrong where it stands."""
        key = name.upper().rpartition(".")[2]
        found = self.find_type(key, pos)
        if found is None:
            known = [*self.offered, *types.ELEMENTARY]
            known += [t.name for t in self.types.values()]
            known += [d.name for d in self.typedefs.values()]
            known += [c.name for c in self.classes.values()]
            raise unknown("type", name, known, pos)
        return found

    def find_type(self, key: str, pos: Position) -> Type | None:
        """The same, or None."""
        elementary = types.ELEMENTARY.get(key)
        if elementary is not None:
            return elementary
        if key in self.types:
            return self.types[key]
        if key in self.typedefs:
            return self._type_of(key, pos)
        cls = self.classes.get(key)
        if cls is None:
            return types.ANY_TYPE if key == "ANYTYPE" else None
        if cls.kind == "interface":
            return self.types.setdefault(key, InterfaceType(cls))
        if self.declare is not None and not (cls.declared or cls.opening):
            self.declare(cls)
        return self.types.setdefault(key, ClassType(cls))

    def _type_of(self, key: str, pos: Position) -> Type:
        definition = self.typedefs[key]
        if key in self._open:
            text = f"{definition.name} contains itself; use POINTER TO"
            raise StopHere(TWICE, text, pos)
        self._open.append(key)
        try:
            assert self.resolve_type is not None
            found = self.resolve_type(definition)
        finally:
            self._open.pop()
        self.types[key] = found
        return found

    def names(self) -> list[str]:
        """Whatever may be named everywhere, as it is declared."""
        found = [*self.offered]
        for table in (self.globals, self.functions, self.lists):
            found += [each.name for each in table.values()]
        for key, name in self.enumerators.items():
            type_ = self.types.get(name.upper())
            spelled = type_.spelled if isinstance(type_, types.EnumType) else {}
            found.append(spelled.get(key, key))
        return found

    def declares(self, key: str) -> bool:
        """Whether a type or POU has this name, in capitals."""
        tables = (self.typedefs, self.types, self.classes, self.functions)
        return any(key in table for table in tables)

    def routine(self, name: str) -> Routine | None:
        """A function by its name in capitals, with its variables declared."""
        found = self.functions.get(name)
        if found is not None and not found.declared and self.declare:
            self.declare(found)
        return found


class LazyPointer(types.PointerType):
    """A pointer whose target is still being declared."""

    def __init__(self, world: World, key: str, reference: bool) -> None:
        object.__setattr__(self, "_world", world)
        object.__setattr__(self, "_key", key)
        object.__setattr__(self, "reference", reference)

    @property
    def target(self) -> Type:
        return self._world.type_named(self._key, (1, 1))  # type: ignore[attr-defined,no-any-return]

    @property
    def name(self) -> str:  # type: ignore[override]
        word = "REFERENCE TO" if self.reference else "POINTER TO"
        return f"{word} {self._key}"  # type: ignore[attr-defined]


def unknown(
    what: str, name: str, known: Iterable[str], pos: Position
) -> StopHere:
    """The error for a name that is not there; it tells the nearest one."""
    near = nearest(name, known)
    hint = f"did you mean {near}?" if near else "declare it"
    return StopHere(NAME, f"{what} {name} is unknown; {hint}", pos)


def nearest(name: str, known: Iterable[str], cutoff: float = 0.7) -> str:
    """The name that is most like one, as it is declared; empty: none is."""
    spelled = {each.upper(): each for each in known}
    near = difflib.get_close_matches(name.upper(), spelled, 1, cutoff)
    return spelled[near[0]] if near else ""
