"""One C function while it is written: its lines, temporaries, prototypes and place for reports."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

from ..errors import LOSSY, Origin, Position, StopHere
from ..model import types
from ..model.classes import Class, ClassType, Routine
from ..model.world import World
from ..syntax import tree
from .value import Entity, PropertyRef, Value

HERE = "st_here"
"""Name of the C constant that holds the POU's name."""


@dataclass(eq=False)
class Loop:
    """A loop of the source; the labels are written where they are needed."""

    number: int
    exits: bool = False
    continues: bool = False


@dataclass(eq=False)
class Context(ABC):
    """Where expressions and statements are lowered.

    The abstract methods are the entries by which lowering calls itself.
    Modules below ``expressions`` know these entries alone.
    """

    world: World
    origin: Origin
    label: str
    first_line: int
    routine: Routine | None = None
    cls: Class | None = None
    lines: list[str] = field(default_factory=list)
    loops: list[Loop] = field(default_factory=list)
    marks: list[dict[str, str]] = field(default_factory=list)
    prototypes: dict[str, str] = field(default_factory=dict)
    statics: list[str] = field(default_factory=list)
    declared: list[str] = field(default_factory=list)
    counter: int = 0
    jumps_out: bool = False
    _free: dict[str, list[str]] = field(default_factory=dict)
    _taken: list[tuple[str, str]] = field(default_factory=list)

    # -- recursion
    @abstractmethod
    def value(self, node: tree.Node, wanted: types.Type | None = None) -> Value:
        """An expression as a value; with ``wanted`` as a value of that type."""

    @abstractmethod
    def as_value(self, found: Entity, pos: Position) -> Value:
        """Properties are read, references followed."""

    @abstractmethod
    def boolean(self, node: tree.Node) -> Value:
        """A condition."""

    @abstractmethod
    def entity(self, node: tree.Node) -> Entity:
        """The meaning of an expression."""

    @abstractmethod
    def get_property(self, found: PropertyRef, pos: Position) -> Value:
        """Call the getter."""

    @abstractmethod
    def set_property(
        self, found: PropertyRef, new: Value, pos: Position
    ) -> str:
        """C text that calls the setter."""

    # -- reports
    def warn(
        self, text: str, pos: Position, code: int = LOSSY, construct: str = ""
    ) -> None:
        """A warning at a place of this POU."""
        stop = StopHere(code, text, pos, construct)
        self.world.log.warn(self.origin, stop, self.label)

    def error(self, stop: StopHere) -> None:
        """An error at a place of this POU."""
        if stop.code:
            self.world.log.error(self.origin, stop, self.label)

    def here(self, pos: Position) -> str:
        """C arguments that name the place; lines count from the POU's first."""
        return f"{HERE}, {pos[0] - self.first_line}"

    # -- text
    def put(self, text: str) -> None:
        """One line of C."""
        self.lines.append(text)

    def number(self) -> int:
        """A number for a label or a name."""
        self.counter += 1
        return self.counter

    def scalar(self, type_: types.Type) -> str:
        """A temporary C variable, free again behind the statement."""
        return self._take(f"{types.c_type(type_)} %s;")

    def pointer(self) -> str:
        """A temporary address."""
        return self._take("st_ptr %s;")

    def buffer(self, size: int) -> str:
        """Temporary bytes."""
        return self._take(f"ST_BUFFER(%s, {max(size, 1)});")

    def _take(self, pattern: str) -> str:
        free = self._free.setdefault(pattern, [])
        if free:
            name = free.pop()
        else:
            name = f"t{self.number()}"
            self.declared.append(pattern % name)
        self._taken.append((pattern, name))
        return name

    def statement_ends(self, keep: int = 0) -> None:
        """Give the temporaries back that were taken since ``keep``."""
        for pattern, name in self._taken[keep:]:
            self._free[pattern].append(name)
        del self._taken[keep:]

    @property
    def taken(self) -> int:
        """How many temporaries are in use."""
        return len(self._taken)

    def prototype(self, name: str, text: str) -> str:
        """Declare a function of another C file; gives the name."""
        self.prototypes.setdefault(name, text)
        return name

    def area(self, name: str) -> str:
        """Declare an area of memory; gives the name."""
        return self.prototype(name, f"extern st_u8 {name}[] ST_HIDDEN;")

    # -- values
    def keep(self, value: Value) -> tuple[str, Value]:
        """(assignment, value): computed once, used often."""
        name = self.scalar(value.type) if value.type.scalar else self.pointer()
        found = value.with_text(name)
        found.calls = False
        return f"{name} = {value.text}", found

    def in_order(self, values: list[Value]) -> tuple[list[str], list[Value]]:
        """(assignments, values) for values that are read from left to right.

        C may read a variable before or after the call beside it. So all up to
        the last call are taken beforehand, one by one.
        """
        known = [value.constant is not None for value in values]
        last = max((k for k, v in enumerate(values) if v.calls), default=-1)
        if last < 0 or known.count(False) < 2:
            return [], values
        texts, found = [], []
        for k, value in enumerate(values):
            if known[k] or k > last or (k == last and all(known[k + 1 :])):
                found.append(value)
                continue
            text, kept = self._taken_now(value)
            texts.append(text)
            found.append(kept)
        return texts, found

    def _taken_now(self, value: Value) -> tuple[str, Value]:
        """As ``keep``; of a text or structure in a variable the bytes, too."""
        text, kept = self.keep(value)
        kept.bit, kept.flag = None, False
        whole = value.type.scalar or isinstance(value.type, ClassType)
        if whole or not value.place:
            return text, kept
        name = self.buffer(value.type.size)
        text = f"memcpy({name}, {value.text}, {value.type.size})"
        return text, kept.with_text(name)


@dataclass(slots=True)
class Settled(tree.Node):
    """An expression whose value has been taken."""

    value: Value
