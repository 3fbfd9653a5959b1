"""Constant members of the shared memory: versions, sizes, numbers, names."""

from __future__ import annotations

import ctypes
import os
import tempfile
import time
from pathlib import Path
from typing import Any

from hli._sync import lib as sync

from hli import layout

from ..config import CellConfig, ChannelPlace

CLOCKS = {
    "lockstep": layout.HLI_CLOCK_LOCKSTEP,
    "freerun": layout.HLI_CLOCK_FREERUN,
    "realtime": layout.HLI_CLOCK_REALTIME,
}
SERVICES = {
    "cyclic": layout.HLI_SERVICE_CYCLIC,
    "immediate": layout.HLI_SERVICE_IMMEDIATE,
}

KERNEL_VERSION = b"hli-cosim 0.1"
LINEAR, ROTARY, SPINDLE = 1, 2, 4  # types of axes


def fill_identity(
    root: Any, cell: CellConfig, clock: str, service: str, program: str
) -> None:
    """Constant members of the areas of a cell with one channel."""
    fill_cell(root, cell.cycle_s, clock, service)
    fill_channel(root, cell, ChannelPlace(), program)


def fill_cell(root: Any, cycle_s: float, clock: str, service: str) -> None:
    """Versions, and the sidecar's identity."""
    for version in (
        root.platform.nc_config.hli_version_r,
        root.platform.nc_config.nc_kernel_version_r,
    ):
        version.zeichen = KERNEL_VERSION
    side = root.sidecar.cnc
    side.pid, side.start = os.getpid(), sync.hs_process_start(os.getpid())
    side.cycle_ns = round(cycle_s * 1e9)
    side.clock, side.service = CLOCKS[clock], SERVICES[service]
    side.generation = (time.monotonic_ns() // 1000) & 0x7FFFFFFF or 1
    side.phase = layout.HLI_PHASE_STARTING


def fill_channel(
    root: Any, cell: CellConfig, place: ChannelPlace, program: str
) -> None:
    """Sizes, numbers and names of a channel and of its axes."""
    channel = root.channel[place.index]
    channel.head.version_r.zeichen = KERNEL_VERSION
    channel.head.sizeof_interface_r = ctypes.sizeof(layout.HLI_CHANNEL)
    channel.head.channel_nr = place.index + 1
    channel.bahn_state.prog_name_r = _cut(program, 259)
    channel.bahn_state.file_offset_r = -1
    channel.bahn_mc_control.insert_cmd.state_r.distance_of_next_stop = -1.0
    own = len(cell.axes) - cell.guests
    for i, (name, axis) in enumerate(list(cell.axes.items())[:own]):
        number = axis.id or i + 1
        kind = ROTARY if axis.kind == "rotary" else LINEAR
        coord = channel.bahn_state.coord_r[i]
        coord.log_axis_nr_r, coord.axis_type_r = number, kind
        coord.name = coord.axis_name_r.zeichen = name.encode()
        _fill_axis(root.axis[place.axis_base + i], number, kind)
    behind = place.axis_base + own
    for i, spindle in enumerate(cell.spindles.values(), behind):
        _fill_axis(root.axis[i], spindle.id, SPINDLE)


def _fill_axis(axis: Any, number: int, kind: int) -> None:
    axis.head.log_ax_n_r = axis.ipo_state.log_achs_nr_r = number
    axis.head.axis_type_r = axis.ipo_state.type_r = kind
    axis.ipo_state.spindle_axis_r = kind == SPINDLE
    axis.head.sizeof_interface_r = ctypes.sizeof(layout.HLI_AXIS)


def _cut(text: str, length: int) -> bytes:
    return text.encode("latin-1", "replace")[:length]


def scratch_folder() -> Path:
    """A folder of this process; the next launcher removes it if it is killed."""
    me = os.getpid()
    name = f"hli-cosim-run-{me}-{sync.hs_process_start(me)}-"
    return Path(tempfile.mkdtemp(prefix=name))
