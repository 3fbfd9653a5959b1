"""Objects of the CNC's tasks (ports 550 to 553), as public clients name them.

Clients read the list of all objects first, 84 bytes each, and find by its
name where an object stands.  All are status: writing goes by the symbols of
the PLC's port.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hli import layout

from ..symbols.cell import ServedCell
from ..symbols.kinds import Kind, Number, Text, encode
from .codes import AdsError, Code

LIST, VALUES = 0x130100, 0x120100
CHANNELS = layout.HLI_SYS_CH_MAXIDX + 1
DESCRIPTION = struct.Struct("<IIHHII32s32s")
AXIS_STEP = 0x10000


@dataclass(frozen=True)
class Object:
    """One value: its place in its group, its name, how it is found."""

    offset: int
    name: str
    kind: Kind
    value: Callable[[Any], Any]


UDINT, UINT, LREAL, DINT = map(Number, ("UDINT", "UINT", "LREAL", "DINT"))
PLATFORM = (
    Object(1, "cnc_tick_counter_r", UDINT, lambda r: r.sidecar.cnc.cycle),
    Object(
        2,
        "cnc_cycle_time_r",
        UDINT,
        lambda r: r.sidecar.cnc.cycle_ns // 1000,
    ),
    Object(
        3,
        "cnc_version_r",
        Text(23),
        lambda r: r.platform.nc_config.nc_kernel_version_r.zeichen.decode(),
    ),
    Object(
        4, "cnc_number_of_axis_r", UDINT, lambda r: r.segment_head.axis_count
    ),
    Object(
        5,
        "cnc_number_of_channel_r",
        UINT,
        lambda r: r.segment_head.channel_count,
    ),
    Object(6, "cnc_number_of_axis_max_r", UDINT, lambda r: len(r.axis)),
    Object(7, "cnc_number_of_spindle_max_r", UDINT, lambda r: len(r.axis)),
    Object(8, "cnc_number_of_channel_max_r", UINT, lambda r: len(r.channel)),
)
CHANNEL = (
    Object(
        0x1001,
        "mc_cmd_bs_covered_distance_r",
        LREAL,
        lambda c: c.bahn_state.covered_distance_r,
    ),
    Object(
        0x1002,
        "mc_cmd_bs_distance_prog_start_r",
        LREAL,
        lambda c: c.bahn_state.dist_prog_start,
    ),
    Object(
        0x1003,
        "mc_block_count_r",
        UDINT,
        lambda c: c.bahn_state.block_count_r,
    ),
    Object(
        0x1004,
        "mc_command_feedrate_r",
        LREAL,
        lambda c: c.bahn_state.command_feed_r,
    ),
    Object(
        0x1005,
        "mc_active_feedrate_r",
        LREAL,
        lambda c: c.bahn_state.active_feed_r,
    ),
    Object(
        0x3,
        "mc_single_block_r",
        Number("BOOL"),
        lambda c: c.bahn_mc_control.single_block.state_r,
    ),
)
AXIS = (
    Object(0x1, "mc_log_axis_nr_r", UINT, lambda a: a.log_axis_nr_r),
    Object(0x2, "mc_axis_name_r", Text(15), lambda a: a.name.decode()),
    Object(0x3, "mc_axis_type_r", UINT, lambda a: a.axis_type_r),
    Object(
        0x4,
        "mc_dist_to_go_pcs_r",
        DINT,
        lambda a: a.cmd_position_r - a.act_position_r,
    ),
    Object(0x5, "mc_end_position_pcs_r", DINT, lambda a: a.cmd_position_r),
    Object(0x6, "mc_command_position_pcs_r", DINT, lambda a: a.act_position_r),
    Object(
        0x7, "mc_actual_position_pcs_r", DINT, lambda a: a.current_position_r
    ),
    Object(0x9, "mc_axis_state_r", UINT, lambda a: a.state_r),
)
PLATFORM_BY = {one.offset: one for one in PLATFORM}
CHANNEL_BY = {one.offset: one for one in CHANNEL}
AXIS_BY = {one.offset: one for one in AXIS}


class CncObjects:
    """The objects of the cell that is there."""

    def __init__(self, cell: ServedCell) -> None:
        self._cell = cell

    @staticmethod
    def knows(group: int) -> bool:
        """A group of objects, or of their list."""
        return any(base <= group <= base + CHANNELS for base in (LIST, VALUES))

    def read(self, group: int, offset: int, length: int) -> bytes:
        """The bytes of an object, or of the list.  AdsError."""
        areas = self._cell.observer.areas
        if areas is None:
            raise AdsError(Code.NOT_READY, self._cell.observer.problem)
        if group >= LIST:
            return self._list(areas, group - LIST, offset, length)
        root = areas.segment.root
        channel = group - VALUES
        if channel > areas.gNrCh:
            raise AdsError(Code.INVALID_GROUP, f"{group:#x}")
        one, part = _find(root, channel, offset)
        return encode(one.kind, one.value(part))[:length]

    def place(self, group: int, offset: int) -> tuple[int, int]:
        """AdsError, always: objects are status."""
        raise AdsError(Code.INVALID_ACCESS, f"{group:#x} {offset:#x}")

    def _list(
        self, areas: Any, channel: int, offset: int, length: int
    ) -> bytes:
        rows = _descriptions(areas, channel)
        if offset == 0:
            return struct.pack("<I", len(rows))[:length]
        count = length // DESCRIPTION.size
        if not count or offset > len(rows):
            raise AdsError(Code.INVALID_OFFSET, str(offset))
        return b"".join(rows[offset - 1 :][:count])


def _find(root: Any, channel: int, offset: int) -> tuple[Object, Any]:
    axis, inner = divmod(offset, AXIS_STEP)
    if channel == 0:
        one, part = PLATFORM_BY.get(offset), root
    elif axis:
        coords = root.channel[channel - 1].bahn_state.coord_r
        one = AXIS_BY.get(inner) if axis <= len(coords) else None
        part = coords[axis - 1] if one else None
    else:
        one, part = CHANNEL_BY.get(offset), root.channel[channel - 1]
    if one is None:
        raise AdsError(Code.INVALID_OFFSET, f"{offset:#x}")
    return one, part


def _descriptions(areas: Any, channel: int) -> list[bytes]:
    """Of one channel; 0: of the platform and the first channel."""
    found = []
    if channel == 0:
        found += [(VALUES, one) for one in PLATFORM]
    number = max(channel, 1)
    if number <= areas.gNrCh:
        found += [(VALUES + number, one) for one in CHANNEL]
    return [
        DESCRIPTION.pack(
            k,
            one.kind.size,
            0,
            0,
            group,
            one.offset,
            one.name.encode(),
            one.kind.name.encode(),
        )
        for k, (group, one) in enumerate(found, start=1)
    ]
