"""The whole program as C: texts of POUs, the memory, the entries of its tasks."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from ..errors import Origin, Problem, StopHere, refuse
from ..model import collect, types
from ..model.classes import Class, Routine
from ..model.world import World
from ..source.units import Unit
from ..syntax import tree
from . import initial, places, routines
from .routines import CText

GROUP_LINES = 4000
"""Lines of C in one object; an edit compiles the objects it changes."""


class KeptUnits(Protocol):
    """The C of units of earlier builds: functions, prototypes, warnings."""

    def of(
        self, unit: Unit
    ) -> tuple[list[str], dict[str, str], list[Problem]]: ...

    def keep(
        self,
        unit: Unit,
        functions: list[str],
        prototypes: dict[str, str],
        warnings: list[Problem],
    ) -> None: ...


@dataclass
class Program:
    """C texts by group, the areas of memory, what went wrong by POU."""

    texts: dict[str, str] = field(default_factory=dict)
    areas: list[tuple[str, int, int]] = field(default_factory=list)
    memory: int = 0
    pous: int = 0
    entries: list[str] = field(default_factory=list)


class Lowering:
    """Lowers every POU of the program that is used or the user's own."""

    def __init__(self, world: World, kept: KeptUnits | None = None) -> None:
        self._world = world
        self._kept = kept
        self._texts: dict[str, CText] = {}
        self._of_library: set[str] = set()
        self.pous = 0
        self._too_deep = False

    def run(self) -> Program:
        """C of the program; errors are in the log."""
        world = self._world
        self._types()
        for holder in list(world.lists.values()):
            self._settle(holder.variables.values())
        for cls in list(world.classes.values()):
            self._guard(cls.origin, cls.name, lambda c=cls: self._prepare(c))
        self._place_lists()
        for cls in list(world.classes.values()):
            self._guard(cls.origin, cls.name, lambda c=cls: self._check(c))
        for cls in list(world.classes.values()):
            if cls.kind != "interface":
                self._guard(cls.origin, cls.name, lambda c=cls: self._class(c))
        for function in list(world.functions.values()):
            assert function.origin is not None
            self._guard(
                function.origin,
                function.name,
                lambda f=function: self._function(f),
            )
        self._structures()
        self._lists()
        return self._program()

    def _types(self) -> None:
        """Each type of the program is resolved, used or not."""
        for key, definition in list(self._world.typedefs.items()):
            origin = definition.origin
            if origin is None or origin.file.startswith("<library>"):
                continue
            self._guard(
                origin,
                definition.name,
                lambda k=key, d=definition: self._world.find_type(k, d.pos),
            )
            if self._too_deep:
                return

    def _guard(self, origin: Origin, pou: str, step: object) -> None:
        try:
            step()  # type: ignore[operator]
        except StopHere as stop:
            if stop.code:
                self._world.log.error(origin, stop, pou)
        except RecursionError:
            pos = (origin.first_line, 1)
            self._too_deep = True
            deep = refuse("nesting as deep as here", pos, "use variables")
            self._world.log.error(origin, deep, pou)

    def _settle(self, variables: object) -> None:
        for variable in list(variables):  # type: ignore[call-overload]
            try:
                variable.settle()
            except StopHere:
                continue

    def _prepare(self, cls: Class) -> None:
        assert self._world.declare is not None
        self._world.declare(cls)

    def _check(self, cls: Class) -> None:
        cls.layout()
        for routine in cls.methods.values():
            if not routine.declared and self._world.declare:
                self._world.declare(routine)
        collect.check_class(self._world, cls)

    def _class(self, cls: Class) -> None:
        self.pous += 1
        text = self._once(
            cls.pou, lambda: routines.class_text(self._world, cls)
        )
        self._texts[cls.name.upper()] = text
        self._note(cls.name.upper(), cls.origin)

    def _function(self, function: Routine) -> None:
        self.pous += 1
        assert self._world.declare is not None
        self._world.declare(function)

        def lowered() -> CText:
            text = CText()
            routines.routine(self._world, function, text)
            return text

        self._texts[function.c] = self._once(function.pou, lowered)
        self._note(function.c, function.origin)

    def _once(self, pou: tree.Pou, lowered: Callable[[], CText]) -> CText:
        """The C that is kept, or C that is made now and kept if it is right."""
        kept, log = self._kept, self._world.log
        if kept is None or pou.unit is None:
            return lowered()
        if pou.outlined:
            functions, prototypes, warnings = kept.of(pou.unit)
            log.warnings += warnings
            return CText(prototypes, functions)
        errors, warnings_before = len(log.errors), len(log.warnings)
        text = lowered()
        if len(log.errors) == errors:
            new = log.warnings[warnings_before:]
            kept.keep(pou.unit, text.functions, text.prototypes, new)
        return text

    def _note(self, key: str, origin: Origin | None) -> None:
        """The library's objects stay in the cache whatever the program is."""
        if origin is not None and origin.file.startswith("<library>"):
            self._of_library.add(key)

    def _structures(self) -> None:
        for key, type_ in list(self._world.types.items()):
            if not isinstance(type_, types.StructType):
                continue
            node = type_.initial
            definition = self._world.typedefs.get(key)
            if isinstance(node, tree.StructType) and definition is not None:
                origin = definition.origin
                assert origin is not None
                text = routines.struct_text(self._world, type_, node, origin)
                name = initial.struct_name(type_)
                self._texts[name] = text
                self._note(name, origin)

    # -- memory
    def _place_lists(self) -> None:
        for holder in self._world.lists.values():
            for variable in holder.variables.values():
                if variable.pending is not None or variable.offset:
                    continue
                own = f"G_{holder.name.upper()}"
                if variable.storage != "global" or variable.area != own:
                    continue
                if variable.constant is not None:
                    continue
                if variable.name.upper() in holder.layout.members:
                    continue
                member = types.Member(variable.name, variable.type)
                try:
                    holder.layout.add(member)
                except StopHere as stop:
                    assert holder.origin is not None
                    self._world.log.error(holder.origin, stop, holder.name)
                    continue
                variable.offset = member.offset

    def _lists(self) -> None:
        for key, holder in list(self._world.lists.items()):
            if holder.origin is None:
                continue
            variables = [
                v for v in holder.variables.values() if v.storage == "global"
            ]
            text = routines.list_text(
                self._world, key, variables, holder.origin
            )
            self._texts[f"L_{key}"] = text

    # -- texts
    def _program(self) -> Program:
        found = Program(pous=self.pous)
        self._memory(found)
        groups = self._grouped()
        found.texts = {
            name: _unit(parts) for name, parts in sorted(groups.items())
        }
        found.texts["main"] = _main(self._world, found)
        return found

    def _grouped(self) -> dict[str, list[CText]]:
        lines = {k: t.text().count("\n") for k, t in self._texts.items()}
        total = sum(lines.values())
        count = 1
        while count * GROUP_LINES < total:
            count *= 2
        groups: dict[str, list[CText]] = {}
        for key in sorted(self._texts):
            digest = hashlib.sha256(key.encode()).digest()
            name = f"g{int.from_bytes(digest[:4], 'big') % count}"
            if key in self._of_library:
                name = f"library_{key}"
            groups.setdefault(name, []).append(self._texts[key])
        return groups

    def _memory(self, found: Program) -> None:
        """Every area of the program in one stretch of memory."""
        sizes: list[tuple[str, int]] = []
        for key, holder in self._world.lists.items():
            name = key if key.startswith("S_") else f"G_{key}"
            sizes.append((name, max(holder.layout.size, 1)))
        for key, cls in self._world.classes.items():
            if cls.kind == "program" and key in self._texts:
                sizes.append((f"P_{key}", cls.layout().size))
        sizes += [(f"IMAGE_{a}", places.IMAGE_SIZE) for a in "IQM"]
        offset = 0
        for name, size in sizes:
            found.areas.append((name, offset, size))
            offset += -(-size // 16) * 16
        found.memory = offset


def _unit(parts: list[CText]) -> str:
    prototypes: dict[str, str] = {}
    for part in parts:
        prototypes |= part.prototypes
    lines = ['#include "st_runtime.h"', *prototypes.values()]
    for part in parts:
        lines += part.functions
    return "\n".join(lines) + "\n"


def _main(world: World, found: Program) -> str:
    """Memory, names of interfaces, start values, entries."""
    lines = ['#include "st_runtime.h"', "#include <stddef.h>"]
    lines.append(
        f"ST_HIDDEN st_byte st_memory[{max(found.memory, 1)}]"
        " __attribute__((aligned(16)));"
    )
    lines.append(f"const st_i64 st_memory_size ST_HIDDEN = {found.memory};")
    for name, offset, _ in found.areas:
        lines.append(
            f'__asm__(".globl {name}\\n.hidden {name}\\n'
            f'.set {name}, st_memory+{offset}");'
        )
    starts = _objects(world, found)
    inside = ", ".join(map(str, starts))
    lines.append(f"const uint32_t st_objects[] ST_HIDDEN = {{{inside}}};")
    lines.append(f"const uint32_t st_object_count ST_HIDDEN = {len(starts)};")
    lines += _interfaces(world)
    lines += _start(world, found)
    return "\n".join(lines) + "\n"


def _objects(world: World, found: Program) -> list[int]:
    """Offsets at which variables begin: pointer arithmetic stays inside of one."""
    places_ = {name: offset for name, offset, _ in found.areas}
    starts = set(places_.values())
    for key, holder in world.lists.items():
        base = places_[key if key.startswith("S_") else f"G_{key}"]
        members = holder.layout.members.values()
        starts |= {base + m.offset for m in members}
    for key, cls in world.classes.items():
        base = places_.get(f"P_{key}", -1)
        if base >= 0:
            members = cls.layout().members.values()
            starts |= {base + m.offset for m in members}
    return sorted(starts)


def _interfaces(world: World) -> list[str]:
    return [
        f'const char N_{key}[] ST_HIDDEN = "{key}";'
        for key, cls in world.classes.items()
        if cls.kind == "interface"
    ]


def _start(world: World, found: Program) -> list[str]:
    """``st_start`` gives all variables their initial values."""
    lines, calls = [], []
    lists = [k for k, h in world.lists.items() if h.origin is not None]
    for key in lists:
        lines.append(f"void L_{key}(void) ST_HIDDEN;")
        calls.append(f"L_{key}();")
    names = {name for name, _, _ in found.areas}
    programs = [k for k in world.classes if f"P_{k}" in names]
    for key in programs:
        lines.append(f"extern st_byte P_{key}[] ST_HIDDEN;")
        lines.append(f"void I_{key}(st_ptr) ST_HIDDEN;")
        lines.append(f"void B_{key}(st_ptr) ST_HIDDEN;")
        calls.append(f"I_{key}(P_{key});")
        lines.append(
            f"ST_API void st_program_{key}(void) {{ B_{key}(P_{key}); }}"
        )
    found.entries = programs
    head = '#define ST_API __attribute__((visibility("default")))'
    body = " ".join(calls)
    lines.append(
        "ST_API void st_start(void) { "
        f"memset(st_memory, 0, {found.memory}); {body} }}"
    )
    lines.append("ST_API st_byte *st_where(void) { return st_memory; }")
    return [head, *lines]
