"""What a PLC leaves in the memory: the next program ends, or the path stands
for a reason that has a name.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cnc_core._engine import lib

from cnc_core.config import parse_config
from cnc_core.process.stands import PlcSight, reasons
from hli import layout
from support.every_byte import leaves
from support.inside import Inside

PROGRAM = "N10 G01 X3 Y0 F6000\nN20 X3 Y4\nN30 G00 X0 Y0\n"
ENOUGH = 4000  # cycles


def units(
    structure: Any, offset: int, name: str
) -> Iterator[tuple[str, int, Any]]:
    """(name, offset, structure) of every control unit that can be enabled."""
    if "enable_w" in (declared[0] for declared in structure._fields_):
        yield name, offset, structure
    for field, declared in structure._fields_:
        at, kind = offset + getattr(structure, field).offset, declared
        while issubclass(kind, ctypes.Array):  # its first element
            kind = kind._type_
        if issubclass(kind, ctypes.Structure):
            yield from units(kind, at, f"{name}.{field}")


UNITS = [
    *units(layout.HLI_CHANNEL, layout.HLI_SEGMENT.channel.offset, "channel"),
    *units(layout.HLI_AXIS, layout.HLI_SEGMENT.axis.offset, "axis"),
]


@pytest.mark.parametrize("byte", [0x00, 0x01, 0xFF])
@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit[0])
def test_no_left_command_holds_the_path_without_a_name(
    tmp_path: Path, unit: tuple[str, int, Any], byte: int
) -> None:
    """Each control unit enabled, everything else in it zeros, ones, all bits."""
    name, offset, structure = unit
    with Inside(tmp_path, PROGRAM) as cnc:
        for axis in cnc.axes[:3]:
            axis.head.plc_present_w = True
        for member, at, size in leaves(structure, offset):
            if member.endswith("_r"):
                continue
            one = member.endswith(".enable_w") or byte == 1
            value = b"\1".ljust(size, b"\0") if one else bytes([byte]) * size
            ctypes.memmove(cnc.segment.base + at, value, size)
        cycle = 0
        while not cnc.state.program_end_r and cycle < ENOUGH:
            event = cnc.engine.run(100)
            if event.name == "MODE_COMMAND":
                cnc.engine.take_mode_command()
            elif event.name == "PLC_ERROR":
                cnc.engine.take_plc_error()
            else:
                cnc.prepare(event)
            cycle += 100
        if cnc.state.program_end_r:
            return
        stands = cnc.engine.standstill
        told = reasons(
            stands, cnc.segment.root, parse_config(""), PlcSight(True, 0.0, "")
        )
        assert stands.conditions, name
        assert not stands.conditions & lib.ENGINE_STOP_UNKNOWN, name
        assert all("the PLC" in who for _, who in told), told
