"""The HLI's own types, constants and pointers, from ``hli.layout``."""

from __future__ import annotations

import ctypes
from typing import Any

from hli import export, layout

from . import types
from .classes import Variable
from .world import VariableList, World

_ELEMENTARY = {
    "c_bool": "BOOL",
    "c_ubyte": "BYTE",
    "c_short": "INT",
    "c_ushort": "UINT",
    "c_int": "DINT",
    "c_uint": "UDINT",
    "c_double": "LREAL",
    "c_ulong": "ULINT",
    "c_long": "LINT",
}
POINTERS = export.GVL_VARIABLES
CONSTANTS = export.GVL_CONSTANTS


def structures() -> list[Any]:
    """The structures a PLC program sees."""
    return [
        cls
        for cls in layout.structures()
        if not cls.__name__.startswith(("HLI_SEGMENT", "HLI_SIDE"))
    ]


def _type(found: dict[str, types.Type], ctype: Any) -> types.Type:
    if layout.is_string(ctype):
        return types.StringType(ctype._length_ - 1)
    base, dims = layout.element_type(ctype)
    if issubclass(base, ctypes.Structure):
        element = found[base.__name__]
    else:
        element = types.ELEMENTARY[_ELEMENTARY[base.__name__]]
    if not dims:
        return element
    return types.ArrayType(element, tuple((0, n - 1) for n in dims))


def _structure(found: dict[str, types.Type], cls: Any) -> types.Type:
    result = types.StructType(cls.__name__, foreign=True)
    for name, ctype in cls._fields_:
        spelled = export.ST_RENAMED.get(name, name)
        offset = getattr(cls, name).offset
        member = types.Member(spelled, _type(found, ctype), offset)
        result.members[spelled.upper()] = member
    result.size, result.align = ctypes.sizeof(cls), 8
    return result


def declare(world: World) -> frozenset[str]:
    """Add all of them; gives the names a program does not declare again."""
    found: dict[str, types.Type] = {}
    for cls in structures():
        if cls is layout.HLI_EXT_VAR:
            last = layout.HLI_EXT_VAR_MAXIDX
            type_: types.Type = types.ArrayType(types.UDINT, ((0, last),))
        else:
            type_ = _structure(found, cls)
        found[cls.__name__] = type_
    world.types |= {name.upper(): type_ for name, type_ in found.items()}
    _constants(world)
    _pointers(world, found)
    names = {name.upper() for name in found}
    return frozenset(names | {POINTERS.upper(), CONSTANTS.upper()})


def _constants(world: World) -> None:
    holder = VariableList(CONSTANTS, library=True)
    world.lists[CONSTANTS.upper()] = holder
    for name, value in export.st_constants().items():
        found = Variable(name, types.UDINT, "VAR_GLOBAL", storage="constant")
        found.constant, found.read_only = value, True
        holder.variables[name.upper()] = found
    world.globals |= holder.variables


def _pointers(world: World, found: dict[str, types.Type]) -> None:
    holder = VariableList(POINTERS, library=True)
    world.lists[POINTERS.upper()] = holder
    channels, axes = layout.HLI_SYS_CH_MAXIDX, layout.HLI_SYS_AX_MAXIDX
    rows: list[tuple[str, types.Type]] = [
        ("gpPform", types.PointerType(found["HLI_PLATFORM"])),
        ("gpCh", _many(found["HLI_CHANNEL"], channels)),
        ("gpAx", _many(found["HLI_AXIS"], axes)),
        ("gpVECh", _many(found["HLI_EXT_VAR"], channels)),
        ("gpVEGlobal", types.PointerType(found["HLI_EXT_VAR"])),
        ("gpAhead", _many(found["HLI_AHEAD"], layout.HLI_AHEAD_CH_MAXIDX)),
        ("gNrCh", types.UINT),
        ("gNrAx", types.UINT),
    ]
    for name, type_ in rows:
        variable = Variable(name, type_, "VAR_GLOBAL", storage="global")
        variable.area = f"G_{POINTERS.upper()}"
        variable.read_only, variable.namespace = True, POINTERS
        member = types.Member(name, type_)
        holder.layout.add(member)
        variable.offset = member.offset
        holder.variables[name.upper()] = variable
    world.globals |= holder.variables


def _many(target: types.Type, last: int) -> types.Type:
    return types.ArrayType(types.PointerType(target), ((0, last),))
