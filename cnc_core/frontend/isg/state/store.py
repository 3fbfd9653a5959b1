"""The dialect's variables: V.P, V.S, V.L, V.CYC, P parameters, @P arguments,
and V.E behind the channel's port.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.variables import (
    DECLARED_TWICE,
    NOT_DECLARED,
    OUT_OF_RANGE,
    READ_ONLY,
    REAL64,
    TEXT_MAX,
    WRONG_INDEX,
    ArrayRoom,
    DataType,
    LevelScopes,
    Scope,
    Value,
    Variable,
    text_type,
    whole_type,
)
from cnc_core.frontend.machine import External
from cnc_core.frontend.port import ChannelPort

TYPES: dict[str, DataType] = {
    "BOOLEAN": DataType("BOOLEAN", 0.0, 1.0, whole=True),
    "SGN08": whole_type("SGN08", 8, signed=True),
    "UNS08": whole_type("UNS08", 8, signed=False),
    "SGN16": whole_type("SGN16", 16, signed=True),
    "UNS16": whole_type("UNS16", 16, signed=False),
    "SGN32": whole_type("SGN32", 32, signed=True),
    "UNS32": whole_type("UNS32", 32, signed=False),
    "REAL64": REAL64,
}
PARAMETER_MAX = 2**31 - 1
ARGUMENTS_MAX = 200
# V.CYC, [0] to [2] stand for ..X to ..Z
VECTOR_NAMES = ("SYSRETDIRVECTOR", "SYSRETSUPVECTOR")
Setter = Callable[[Value], None]


class Reference(NamedTuple):
    """A compiled variable: how to read and to write it.

    Without a writer it is read only.  ``drain``: the channel drains first.
    """

    name: str
    load: Formula
    store: Setter | None
    exists: Callable[[], bool]
    drain: bool = False


class Store:
    """All variables of one channel.  ``static`` may outlive the program.

    ``lenient``: undeclared variables of every family begin with their first
    write, unset P parameters read as 0.
    """

    def __init__(
        self,
        port: ChannelPort,
        externals: dict[str, External],
        *,
        lenient: bool = False,
        static: Scope | None = None,
    ) -> None:
        self._port, self._externals, self._lenient = (
            port,
            dict(externals),
            lenient,
        )
        self.program = Scope()
        self.static = Scope() if static is None else static
        self.internal = Scope()
        self.local = LevelScopes()
        self.cycle = LevelScopes()
        self.parameters: dict[int, float] = {}
        self.arrays: dict[int, Variable] = {}
        self._room = ArrayRoom()
        self.arguments: list[dict[int, Value]] = [{}]
        self._next_external = 1 + max(
            (e.number + e.blocks - 1 for e in self._externals.values()),
            default=0,
        )

    def push(self, arguments: dict[int, Value] | None) -> None:
        """A program level begins; None: it sees its caller's arguments."""
        self.local.push()
        self.cycle.push()
        self.arguments.append(
            self.arguments[-1] if arguments is None else arguments
        )

    def pop(self) -> None:
        """It ends."""
        self.local.pop()
        self.cycle.pop()
        self.arguments.pop()

    # families

    def scope_of(self, family: str) -> Scope | LevelScopes:
        scopes: dict[str, Scope | LevelScopes] = {
            "P": self.program,
            "S": self.static,
            "L": self.local,
            "CYC": self.cycle,
            "I": self.internal,
        }
        return scopes[family]

    def reference(
        self, family: str, name: str, indices: Sequence[Formula], offset: int
    ) -> Reference:
        """V.P, V.S, V.L, V.CYC, V.I with a name in capitals."""
        full = f"V.{family}.{name}"
        scope = self.scope_of(family)
        get = scope.get
        if family == "CYC" and name in VECTOR_NAMES and len(indices) == 1:
            return self._vector(name, indices, offset)

        def missing() -> Exception:
            return fail(NOT_DECLARED, f"{full} is not declared", offset)

        def load() -> Value:
            variable = get(name)
            if variable is None:
                raise missing()
            if indices or variable.dimensions:
                return variable.load([index() for index in indices], offset)
            return variable.values[0]

        def store(value: Value) -> None:
            variable = get(name)
            if variable is None:
                variable = self._implicit(family, name, indices, value, offset)
            if (
                not variable.dimensions
                and not indices
                and variable.type is REAL64
                and value.__class__ is float
            ):
                if variable.read_only:
                    raise fail(READ_ONLY, f"{full} is read only", offset)
                if not -1.7e308 < value < 1.7e308:
                    raise fail(
                        OUT_OF_RANGE, f"{full}: no finite number", offset
                    )
                variable.values[0] = value
                return
            variable.store(value, [index() for index in indices], offset)

        return Reference(full, load, store, lambda: get(name) is not None)

    def _vector(
        self, name: str, indices: Sequence[Formula], offset: int
    ) -> Reference:
        """``V.CYC.SysRetDirVector[0]`` is V.CYC.SysRetDirVectorX unless it is
        declared as an array.
        """
        scope = self.cycle

        def element() -> tuple[Variable, list[Value]]:
            known = scope.get(name)
            if known is not None and known.dimensions:
                return known, [indices[0]()]
            value = indices[0]()
            if isinstance(value, str) or round_half_away(value) not in (
                0,
                1,
                2,
            ):
                raise fail(
                    WRONG_INDEX,
                    f"V.CYC.{name}: index {value} out of range 0..2",
                    offset,
                )
            variable = scope.get(name + "XYZ"[round_half_away(value)])
            if variable is None:
                raise fail(
                    NOT_DECLARED, f"V.CYC.{name} is not declared", offset
                )
            return variable, []

        def load() -> Value:
            variable, place = element()
            return variable.load(place, offset)

        def store(value: Value) -> None:
            variable, place = element()
            if not place:
                raise fail(READ_ONLY, f"V.CYC.{name}[..] is read only", offset)
            variable.store(value, place, offset)

        def exists() -> bool:
            return (
                scope.get(name) is not None or scope.get(f"{name}X") is not None
            )

        return Reference(f"V.CYC.{name}", load, store, exists)

    def _implicit(
        self,
        family: str,
        name: str,
        indices: Sequence[Formula],
        value: Value,
        offset: int,
    ) -> Variable:
        """A variable that begins with its first write: V.P and V.S, single values."""
        scope = self.scope_of(family)
        if indices or not (isinstance(scope, Scope) or self._lenient):
            raise fail(
                NOT_DECLARED, f"V.{family}.{name} is not declared", offset
            )
        kind = text_type(TEXT_MAX) if isinstance(value, str) else REAL64
        variable = Variable(f"V.{family}.{name}", kind)
        (scope if isinstance(scope, Scope) else scope.innermost)[name] = (
            variable
        )
        return variable

    # P parameters

    def parameter(
        self, number: Formula, indices: Sequence[Formula], offset: int
    ) -> Reference:
        """``P<number>``, or an element of an array of that number."""
        values, arrays = self.parameters, self.arrays

        def key() -> int:
            value = number()
            if isinstance(value, str) or not 0 <= value <= PARAMETER_MAX:
                raise fail(
                    OUT_OF_RANGE,
                    f"P parameter: number {value} out of range",
                    offset,
                )
            if round_half_away(value) == 0:
                raise fail(20400, "P0 is not allowed", offset)
            return round_half_away(value)

        def load() -> Value:
            place = key()
            if indices:
                return self._array(place, offset).load(
                    [index() for index in indices], offset
                )
            if place not in values:
                if self._lenient:
                    return 0.0
                raise fail(NOT_DECLARED, f"P{place} has no value yet", offset)
            return values[place]

        def store(value: Value) -> None:
            place = key()
            if indices:
                self._array(place, offset).store(
                    value, [index() for index in indices], offset
                )
                return
            if place in arrays:
                arrays[place].store(value, (), offset)
            values[place] = REAL64.number(value, f"P{place}", offset)

        def exists() -> bool:
            return key() in (arrays if indices else values) or key() in arrays

        return Reference("P", load, store, exists)

    def _array(self, number: int, offset: int) -> Variable:
        if number not in self.arrays:
            raise fail(NOT_DECLARED, f"P{number}[..] is not declared", offset)
        return self.arrays[number]

    # @P arguments

    def argument(self, number: Formula, offset: int) -> Reference:
        """``@P<number>`` of the cycle that is being executed."""

        def key() -> int:
            value = number()
            if (
                isinstance(value, str)
                or not 1 <= round_half_away(value) <= ARGUMENTS_MAX
            ):
                raise fail(
                    OUT_OF_RANGE,
                    f"@P: number {value} out of range 1..{ARGUMENTS_MAX}",
                    offset,
                )
            return round_half_away(value)

        def load() -> Value:
            place = key()
            if place not in self.arguments[-1]:
                raise fail(NOT_DECLARED, f"@P{place} is not given", offset)
            return self.arguments[-1][place]

        def store(value: Value) -> None:
            self.arguments[-1][key()] = value

        return Reference("@P", load, store, lambda: key() in self.arguments[-1])

    def needs_cycle(self, name: str, offset: int) -> None:
        """Words with @ stand in cycles only."""
        if self.arguments[-1] is self.arguments[0]:
            raise fail(900001, f"{name} outside a cycle", offset)

    # V.E

    def external(
        self, name: str, indices: Sequence[Formula], offset: int
    ) -> Reference:
        """A variable of the area that the PLC shares."""
        known, shape, place = self.external_place(name, indices, offset)

        def store(value: Value) -> None:
            self._port.write_external(
                known, place(), shape.type.convert(value, shape.name, offset)
            )

        return Reference(
            shape.name,
            lambda: self._port.read_external(known, place()),
            store,
            lambda: True,
            known.synchronised,
        )

    def external_place(
        self, name: str, indices: Sequence[Formula], offset: int
    ) -> tuple[External, Variable, Callable[[], int]]:
        """A variable of that area, its shape, and the element meant."""
        found = self._externals.get(name)
        if found is None and self._lenient:
            found = External(name, "REAL64", self._next_external)
            self._next_external += found.blocks
            self._externals[name] = found
        if found is None:
            raise fail(
                NOT_DECLARED,
                f"V.E.{name} is not in the cell configuration ([external.{name}])",
                offset,
            )
        known, kind = (
            found,
            TYPES.get(found.type) or text_type(found.characters),
        )
        shape = Variable(
            f"V.E.{name}", kind, () if known.size is None else (known.size,)
        )

        return (
            known,
            shape,
            lambda: shape.place([index() for index in indices], offset),
        )

    def has_external(self, name: str) -> bool:
        return name in self._externals

    def init_external(self) -> None:
        """#INIT V.E: zeros and empty texts."""
        for variable in self._externals.values():
            kind = TYPES.get(variable.type)
            for element in range(variable.size or 1):
                self._port.write_external(
                    variable, element, "" if kind is None else 0.0
                )

    # #VAR and #DELETE

    def declare(
        self, family: str, name: str, variable: Variable, offset: int
    ) -> None:
        """A #VAR line; a name is declared once in its scope.

        ``family``: empty for P parameters.
        """
        if not family:
            self._declare_parameter(int(name), variable, offset)
            return
        scope = self.scope_of(family)
        target = scope if isinstance(scope, Scope) else scope.innermost
        old = target.get(name)
        if old is not None and (
            old.type != variable.type or old.dimensions != variable.dimensions
        ):
            raise fail(
                DECLARED_TWICE,
                f"{variable.name} is declared already, with another type",
                offset,
            )
        del old
        target.pop(name, None)  # its elements are free again
        self._take_room(variable, offset)
        target[name] = variable

    def _take_room(self, variable: Variable, offset: int) -> None:
        if variable.dimensions:
            size = len(variable.values)
            self._room.take(variable, size, variable.name, offset)

    def _declare_parameter(
        self, number: int, variable: Variable, offset: int
    ) -> None:
        if variable.dimensions:
            self.arrays.pop(number, None)
            self._take_room(variable, offset)
            self.arrays[number] = variable
        else:
            self.parameters[number] = float(variable.values[0])

    def delete(self, family: str, name: str, offset: int) -> None:
        """#DELETE of a variable or, with an empty family, a P parameter."""
        if not family:
            found = (
                self.parameters.pop(int(float(name)), None),
                self.arrays.pop(int(float(name)), None),
            )
            known = found != (None, None)
        else:
            scope = self.scope_of(family)
            known = (
                scope.pop(name, None) is not None
                if isinstance(scope, Scope)
                else scope.delete(name)
            )
        if not known:
            title = f"V.{family}.{name}" if family else f"P{name}"
            raise fail(NOT_DECLARED, f"#DELETE: {title} does not exist", offset)
