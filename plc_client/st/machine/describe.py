"""What the loader must know of a program, as JSON: types, variables, tasks, lines."""

from __future__ import annotations

from typing import Any

from ..model import types
from ..model.classes import ClassType, InterfaceType, Variable
from ..model.literals import duration_ns
from ..model.world import World
from ..syntax import tree

_SKIPPED = ("S_",)


class _Table:
    """Types by number; each is written once."""

    def __init__(self) -> None:
        self.rows: list[Any] = []
        self._known: dict[str, int] = {}

    def number(self, type_: types.Type) -> int:
        key = _key(type_)
        if key not in self._known:
            self._known[key] = len(self.rows)
            self.rows.append(None)
            self.rows[self._known[key]] = self._row(type_)
        return self._known[key]

    def _row(self, type_: types.Type) -> list[Any]:  # noqa: PLR0911
        if isinstance(type_, types.StringType):
            return ["s", type_.length, type_.wide]
        if isinstance(type_, types.ArrayType):
            return ["a", self.number(type_.element), type_.dims]
        if isinstance(type_, types.EnumType):
            names = {type_.spelled[k]: v for k, v in type_.values.items()}
            return ["n", type_.base.name, type_.name, names]
        if isinstance(type_, types.StructType):
            return self._members(type_, type_.name)
        if isinstance(type_, ClassType):
            return self._members(type_.cls.layout(), type_.cls.name)
        if isinstance(type_, types.Subrange):
            return ["e", type_.base.name]
        if isinstance(type_, types.Elementary):
            return ["e", type_.name]
        return ["p", str(type_)]

    def _members(self, type_: types.StructType, name: str) -> list[Any]:
        rows = {
            m.name: [self.number(m.type), m.offset, m.bit]
            for m in type_.members.values()
        }
        return ["t", name, type_.size, rows]


def _key(type_: types.Type) -> str:
    if isinstance(type_, types.ArrayType):
        return f"{type_.dims} {_key(type_.element)}"
    return f"{type(type_).__name__} {type_.name}"


def describe(world: World, program: Any, options: Any) -> dict[str, Any]:
    """The description of a lowered program."""
    table = _Table()
    offsets = {name: offset for name, offset, _ in program.areas}
    roots: dict[str, Any] = {}
    for key in program.entries:
        cls = world.classes[key]
        type_ = ClassType(cls)
        roots[cls.name] = {
            "type": table.number(type_),
            "at": offsets[f"P_{key}"],
        }
    lists = {
        holder.name: _list(holder.variables.values(), offsets, table)
        for key, holder in world.lists.items()
        if not key.startswith(_SKIPPED)
    }
    return {
        "memory": program.memory,
        "roots": roots,
        "lists": lists,
        "types": table.rows,
        "images": {a: offsets[f"IMAGE_{a}"] for a in "IQM"},
        "tasks": tasks(world, program, options),
        "places": _places(world),
        "retained": _retained(world, offsets),
        "pous": program.pous,
        "areas": [list(a) for a in program.areas],
        "pointers": offsets["G_HLI_GLOBAL_VARIABLES"],
        "statics": _addressed(world, offsets, table),
    }


def _list(
    variables: Any, offsets: dict[str, int], table: _Table
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for variable in variables:
        if variable.pending is not None:
            continue
        if variable.constant is not None:
            found[variable.name] = {"value": variable.constant}
        elif variable.storage == "global":
            at = offsets[variable.area] + variable.offset
            number = table.number(variable.type)
            found[variable.name] = {
                "type": number,
                "at": at,
                "bit": variable.index,
            }
    return found


def _addressed(
    world: World, offsets: dict[str, int], table: _Table
) -> dict[str, Any]:
    """Variables of programs and blocks that do not lie in the instance: AT, VAR_STAT."""
    found: dict[str, Any] = {}
    for cls in world.classes.values():
        inside = [v for v in cls.own.values() if v.storage == "global"]
        if inside:
            found[cls.name] = _list(inside, offsets, table)
    return found


def _places(world: World) -> dict[str, list[Any]]:
    """First line and file of every POU by its label."""
    found: dict[str, list[Any]] = {}
    for cls in world.classes.values():
        found[cls.name] = [cls.origin.file, cls.pou.pos[0]]
        for routine in [*cls.methods.values(), cls.body]:
            if routine is not None and routine.origin is not None:
                place = [routine.origin.file, routine.pou.pos[0]]
                found[routine.label] = place
    for routine in world.functions.values():
        if routine.origin is not None:
            found[routine.label] = [routine.origin.file, routine.pou.pos[0]]
    for name, holder in world.lists.items():
        if holder.origin is not None:
            found[name] = [holder.origin.file, 0]
    return found


# -- kept over restarts
def _retained(world: World, offsets: dict[str, int]) -> list[Any]:
    """(path, offset, size, kind, type) of everything RETAIN or PERSISTENT."""
    found: list[Any] = []
    for holder in world.lists.values():
        for variable in holder.variables.values():
            if variable.constant is None and variable.storage == "global":  # noqa: SIM102
                if variable.pending is None:
                    at = offsets[variable.area] + variable.offset
                    path = f"{holder.name}.{variable.name}"
                    _retain(found, path, variable, at)
    for key, cls in world.classes.items():
        base = offsets.get(f"P_{key}")
        if base is not None:
            for variable in cls.instance_variables():
                path = f"{cls.name}.{variable.name}"
                _retain(found, path, variable, base + variable.offset)
    return found


def _retain(found: list[Any], path: str, variable: Variable, at: int) -> None:
    type_ = variable.type
    if variable.retain and not isinstance(type_, ClassType):
        kind = [path, at, type_.size, variable.retain, str(type_)]
        found.append(kind)
    elif isinstance(type_, ClassType):
        for inner in type_.cls.instance_variables():
            if variable.retain and not inner.retain:
                if inner.section == "VAR_IN_OUT" or _pointing(inner.type):
                    continue
                inner_path = f"{path}.{inner.name}"
                size, word = inner.type.size, variable.retain
                if not isinstance(inner.type, ClassType):
                    row = [inner_path, at + inner.offset, size, word]
                    found.append([*row, str(inner.type)])
                continue
            _retain(found, f"{path}.{inner.name}", inner, at + inner.offset)


def _pointing(type_: types.Type) -> bool:
    return isinstance(type_, (types.PointerType, InterfaceType))


# -- tasks
def tasks(world: World, program: Any, options: Any) -> list[dict[str, Any]]:
    """Name, interval, priority and programs of every task."""
    configured = _configured(world)
    for text in options.tasks:
        configured = [t for t in configured if t["name"] != text.split(":")[0]]
        configured.append(_from_text(text))
    if configured:
        return [t for t in configured if t["programs"]]
    names = [world.classes[k].name for k in program.entries]
    chosen = _main_program(names)
    if not chosen:
        return []
    return [
        {
            "name": "PlcTask",
            "interval": options.interval,
            "priority": 0,
            "programs": chosen,
        }
    ]


def _main_program(names: list[str]) -> list[str]:
    """MAIN or PLC_PRG alone, else all programs in order."""
    for wanted in ("MAIN", "PLC_PRG"):
        for name in names:
            if name.upper() == wanted:
                return [name]
    return names


def _from_text(text: str) -> dict[str, Any]:
    """``NAME:INTERVAL_MS[:PRIORITY]=PROGRAM,PROGRAM``."""
    head, _, programs = text.partition("=")
    parts = head.split(":")
    return {
        "name": parts[0],
        "interval": float(parts[1]) / 1000.0 if len(parts) > 1 else 0.001,
        "priority": int(parts[2]) if len(parts) > 2 else 0,
        "programs": [p.strip() for p in programs.split(",") if p.strip()],
    }


def _configured(world: World) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for configuration in world.configurations:
        for task in configuration.tasks:
            row = _task(task)
            row["programs"] = [
                p.type
                for p in configuration.programs
                if p.task.upper() == task.name.upper()
            ]
            found.append(row)
    return found


def _task(task: tree.TaskDecl) -> dict[str, Any]:
    interval, priority = 0.001, 0
    for argument in task.arguments:
        text = getattr(argument.value, "text", "")
        if argument.name.upper() == "INTERVAL":
            ns = duration_ns(text.partition("#")[2], argument.pos)
            interval = ns / 1e9
        elif argument.name.upper() == "PRIORITY":
            priority = int(text)
    return {"name": task.name, "interval": interval, "priority": priority}
