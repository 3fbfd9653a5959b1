"""POUs as the checks see them: variables, methods, bases, interfaces, slots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ..errors import CLASS, CONSTANT, Origin, StopHere
from ..syntax import tree
from .types import (
    POINTER_SIZE,
    Member,
    ObjectType,
    OpenArray,
    PointerType,
    StructType,
    Type,
)

STANDARD_NAMES = {
    "R": "RESET",
    "LD": "LOAD",
    "S": "SET",
    "R1": "RESET1",
    "S1": "SET1",
}
"""The standard's names of inputs -> TwinCAT's, for blocks of the library."""


@dataclass(eq=False)
class Variable:
    """A declared variable; ``cell`` says where it lives.

    ``storage``: ``member`` of an instance, ``global``, ``local`` of a call,
    ``parameter`` handed over by address, ``constant`` without memory.
    """

    name: str
    type: Type
    section: str
    decl: tree.Decl | None = None
    storage: str = "member"
    offset: int = 0
    area: str = ""
    constant: object = None
    read_only: bool = False
    retain: str = ""
    address: str = ""
    namespace: str = ""
    c: str = ""
    index: int = -1
    pending: Callable[[], None] | None = None

    def settle(self) -> Variable:
        """Find type and constant of a global variable when first needed."""
        if self.pending is not None:
            pending, self.pending = self.pending, self._circle
            try:
                pending()
            except StopHere:
                if self.pending == self._circle:
                    self.pending = pending  # each use is told nothing more
                raise
            self.pending = None
        return self

    def _circle(self) -> None:
        self.pending = self._circle
        pos = self.decl.pos if self.decl is not None else (1, 1)
        raise StopHere(CONSTANT, f"{self.name} depends on itself", pos)


@dataclass(eq=False)
class Routine:
    """Anything that is called: function, method, action, accessor."""

    name: str
    pou: tree.Pou
    result: Type
    owner: Class | None = None
    variables: dict[str, Variable] = field(default_factory=dict)
    c: str = ""
    slot: int = -1
    abstract: bool = False
    origin: Origin | None = None
    refused: bool = False
    declared: bool = False
    access: str = "PUBLIC"

    @property
    def label(self) -> str:
        """The name for reports: ``FB.Method``."""
        if self.owner is None:
            return self.name
        if self.pou.kind == "body":
            return self.owner.name
        return f"{self.owner.name}.{self.name}"

    def of(self, *sections: str) -> list[Variable]:
        """Variables of these sections in order."""
        found = self.variables.values()
        return [v for v in found if v.section in sections]

    @property
    def parameters(self) -> list[Variable]:
        """Inputs, outputs and in-outs in the order of the declaration."""
        return self.of("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT")


@dataclass(eq=False)
class Class:
    """Function block, program or interface."""

    name: str
    pou: tree.Pou
    kind: str
    origin: Origin
    base: Class | None = None
    interfaces: list[Class] = field(default_factory=list)
    own: dict[str, Variable] = field(default_factory=dict)
    hidden: dict[str, Variable] = field(default_factory=dict)
    methods: dict[str, Routine] = field(default_factory=dict)
    properties: dict[str, Type] = field(default_factory=dict)
    refused: bool = False
    declared: bool = False
    opening: bool = False
    """Its declaration is under way."""
    abstract: bool = False
    body: Routine | None = None
    _layout: StructType | None = None
    _laying: bool = False

    def ancestors(self) -> list[Class]:
        """The class and its bases, the class first."""
        found: list[Class] = []
        cls: Class | None = self
        while cls is not None and cls not in found:
            found.append(cls)
            cls = cls.base
        return found

    @property
    def uncertain(self) -> bool:
        """Part of it was refused: it may have members that are not known."""
        return any(cls.refused for cls in self.ancestors())

    def variable(self, name: str) -> Variable | None:
        """A variable of the class or its bases, by its name in capitals."""
        for cls in self.ancestors():
            if name in cls.own:
                return cls.own[name]
        other = STANDARD_NAMES.get(name)
        if other and self.origin.file.startswith("<library>"):
            return self.own.get(other)
        return None

    def method(self, name: str) -> Routine | None:
        """A method of the class, its bases or, of an interface, its parents."""
        for cls in self.ancestors():
            if name in cls.methods:
                return cls.methods[name]
        if self.kind == "interface":
            for parent in self.interfaces:
                found = parent.method(name)
                if found is not None:
                    return found
        return None

    def property_type(self, name: str) -> Type | None:
        """The type of a property of the class, its bases or parents."""
        for cls in self.ancestors():
            if name in cls.properties:
                return cls.properties[name]
        for parent in self.interfaces:
            found = parent.property_type(name)
            if found is not None:
                return found
        return None

    def all_interfaces(self) -> list[Class]:
        """The interfaces of the class and its bases, with their parents."""
        found: list[Class] = []
        todo = [i for cls in self.ancestors() for i in cls.interfaces]
        while todo:
            interface = todo.pop(0)
            if interface not in found:
                found.append(interface)
                todo += interface.interfaces
        return found

    def interface_methods(self) -> list[str]:
        """Names of an interface's methods, those of its parents first."""
        found: list[str] = []
        for parent in self.interfaces:
            found += [n for n in parent.interface_methods() if n not in found]
        return found + [n for n in self.methods if n not in found]

    def slots(self) -> list[str]:
        """Names of the virtual methods in the order of the table."""
        found: list[str] = []
        for cls in reversed(self.ancestors()):
            found += [n for n in cls.methods if n not in found]
        return found

    def spelled(self) -> list[str]:
        """Names of variables, methods and properties as they are declared."""
        found: list[str] = []
        for cls in (*reversed(self.ancestors()), *self.all_interfaces()):
            found += [v.name for v in cls.own.values()]
            found += [m.name for m in cls.methods.values()]
            found += cls.properties
        return found

    def is_a(self, other: Class) -> bool:
        """Whether an instance may stand where the other is wanted."""
        if other in self.ancestors():
            return True
        return other in self.all_interfaces()

    def parameters(self) -> list[Variable]:
        """Inputs, outputs and in-outs, those of the base first."""
        sections = ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT")
        return [v for v in self.instance_variables() if v.section in sections]

    def instance_variables(self) -> list[Variable]:
        """All variables in memory, those of the base first."""
        found: list[Variable] = []
        for cls in reversed(self.ancestors()):
            found += [v for v in cls.own.values() if v.storage == "member"]
        return found

    def layout(self) -> StructType:
        """The bytes of an instance: the class's address, then the variables."""
        if self._layout is None:
            if self._laying:
                text = (
                    f"{self.name} contains itself; use POINTER TO {self.name}"
                )
                raise StopHere(CLASS, text, self.pou.pos)
            self._laying = True
            try:
                self._layout = self._place()
            finally:
                self._laying = False
        return self._layout

    def _place(self) -> StructType:
        found = StructType(self.name)
        if self.base is not None:
            base = self.base.layout()
            found.size, found.align = base.size, base.align
            found.members = dict(base.members)
        else:
            found.size, found.align = POINTER_SIZE, POINTER_SIZE
        for variable in self.own.values():
            if variable.storage != "member":
                continue
            type_ = variable.type
            open_array = isinstance(type_, OpenArray)
            if variable.section == "VAR_IN_OUT" and not open_array:
                type_ = PointerType(type_, True)
            member = Member(variable.name, type_, section=variable.section)
            found.add(member)
            variable.offset = member.offset
        found.close()
        return found


@dataclass(eq=False)
class ClassType(ObjectType):
    """Instances of a function block or program."""

    cls: Class

    @property
    def name(self) -> str:  # type: ignore[override]
        return self.cls.name

    @property
    def size(self) -> int:  # type: ignore[override]
        return self.cls.layout().size

    @property
    def align(self) -> int:  # type: ignore[override]
        return POINTER_SIZE


@dataclass(eq=False)
class InterfaceType(ObjectType):
    """A pointer to an instance whose class has the interface."""

    cls: Class
    size: int = POINTER_SIZE
    align: int = POINTER_SIZE

    @property
    def name(self) -> str:  # type: ignore[override]
        return self.cls.name

    @property
    def scalar(self) -> bool:
        return True
