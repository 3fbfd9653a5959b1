"""What the variables of OPC 40502 show, from the HLI.

Lengths are in mm, angles in degrees, feeds in mm/s, overrides in percent.
What the emulated CNC does not have is 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hli import layout

MM = 1e-4  # of 0.1 um
ROTARY, SPINDLE = 2, 4
MANUAL, MDA, AUTOMATIC = 0, 1, 2
MODES = {
    layout.HLI_IMCM_MDI_MODE: MDA,
    layout.HLI_IMCM_MANUAL_MODE: MANUAL,
    layout.HLI_IMCM_REFERENCE_MODE: MANUAL,
}
ACTIVE = layout.HLI_IMCM_PROCESS_ACTIVE
HOLD = layout.HLI_IMCM_PROCESS_HOLD
ERROR = layout.HLI_IMCM_PROCESS_ERROR
STOPPED, RUNNING, WAITING, INTERRUPTED, CANCELED = range(5)
Value = Callable[[Any], Any]


@dataclass(frozen=True)
class Position:
    """What CncPositionDataType holds."""

    ActPos: float
    CmdPos: float
    RemDist: float


def _state(channel: Any) -> int:
    return int(channel.channel_mc_control.mode_and_state.state_r.state)


def _mode(channel: Any) -> int:
    mode = channel.channel_mc_control.mode_and_state.state_r.mode
    return MODES.get(mode, AUTOMATIC)


def _status(channel: Any) -> int:
    """CncChannelStatus: active, interrupted, reset."""
    return {ACTIVE: 0, HOLD: 1, ERROR: 1}.get(_state(channel), 2)


def _program_status(channel: Any) -> int:
    state = _state(channel)
    bahn = channel.bahn_state
    if state == ERROR:
        return CANCELED
    if state == HOLD or bahn.wait_continue_r:
        return INTERRUPTED
    if state != ACTIVE:
        return STOPPED
    waits = bahn.dwell_time_active_r or bahn.wait_techno_acknowledge_r
    return WAITING if waits else RUNNING


def _program(channel: Any) -> str:
    return str(channel.bahn_state.prog_name_r.decode("utf-8", "replace"))


def _codes(channel: Any) -> list[int]:
    return [int(code) for code in channel.bahn_state.g_function_r]


def _m_codes(channel: Any) -> list[int]:
    """M functions that stand in the technology units."""
    units = [*channel.techno_unit_std_sync, *channel.techno_unit_late_sync]
    found = []
    for unit in units:
        if unit.fkt_ctrl_r == 1:
            data = bytes(unit.attribut_r.data)
            found.append(layout.HLI_M_H_PROZESS.from_buffer_copy(data).nr)
    return found


def _of(coord: Any) -> Position:
    place = coord.current_position_r * MM
    target = coord.act_position_r * MM
    rest = (coord.cmd_position_r - coord.act_position_r) * MM
    return Position(place, target, rest)


def _named(name: str) -> Value:
    """The position of a channel's axis by its name; zeros: it has none."""
    wanted = name.encode()

    def value(channel: Any) -> Position:
        for coord in channel.bahn_state.coord_r:
            if coord.name == wanted:
                return _of(coord)
            if not coord.name:
                break
        return Position(0.0, 0.0, 0.0)

    return value


CHANNEL: dict[str, Value] = {
    "ActFeedrate": lambda c: c.bahn_state.active_feed_r * 1e-3,
    "ActGFunctions": _codes,
    "ActJogIncrement": lambda c: 0.0,
    "ActMainProgramFile": _program,
    "ActMainProgramName": _program,
    "ActMFunctions": _m_codes,
    "ActModalOffsetFunction": lambda c: 0,
    "ActOperationMode": _mode,
    "ActOverride": lambda c: c.bahn_state.override_r / 10.0,
    "ActProgramBlock": lambda c: [f"N{c.bahn_state.block_number_r}"],
    "ActProgramFile": _program,
    "ActProgramLine": lambda c: str(c.bahn_state.block_count_r),
    "ActProgramName": _program,
    "ActProgramStatus": _program_status,
    "ActStatus": _status,
    "BlockMode": lambda c: bool(c.bahn_mc_control.single_block.state_r),
    "CmdFeedrate": lambda c: c.bahn_state.command_feed_r * 1e-3,
    "CmdOperationMode": _mode,
    "CmdOverride": lambda c: c.bahn_mc_control.override.state_r / 10.0,
    "DryRunFeed": lambda c: 0.0,
    "FeedHold": lambda c: bool(c.bahn_state.feedhold_active_r),
    "Id": lambda c: c.head.channel_nr,
    "ToolId": lambda c: max(0, c.bahn_state.tool_nr_r),
    **{f"PosTcpBcs{name}": _named(name) for name in "ABCXYZ"},
    **{f"PosTcpWcs{name}": _named(name) for name in "ABCXYZ"},
}


@dataclass(frozen=True)
class Drive:
    """An axis or spindle: its area, and its place in the channel if any."""

    area: Any
    coord: Any
    moves: bool


def _position(drive: Drive) -> Position:
    if drive.coord is not None:
        return _of(drive.coord)
    state = drive.area.lr_state
    place = state.current_position_acs_r * MM
    target = state.active_position_acs_r * MM
    rest = (state.end_position_acs_r - state.active_position_acs_r) * MM
    return Position(place, target, rest)


def spindle_speed(drive: Drive) -> tuple[int, float]:
    """Direction (CncSpindleTurnDirection) and turns a minute, as commanded."""
    for unit in drive.area.techno_unit_std_sync:
        if unit.fkt_ctrl_r == 3:
            data = bytes(unit.attribut_r.data)
            found = layout.HLI_S_PROZESS.from_buffer_copy(data)
            turn = {3: 1, 4: 2}.get(found.move_cmd, 0)
            return turn, found.rev / 6000.0 if turn else 0.0
    return 0, 0.0


DRIVE: dict[str, Value] = {
    "ActLoad": lambda d: 0.0,
    "ActPower": lambda d: 0.0,
    "ActTorque": lambda d: 0.0,
    "CmdTorque": lambda d: 0.0,
    "IsInactive": lambda d: bool(d.area.head.error_r),
    "IsVirtual": lambda d: True,
}
AXIS: dict[str, Value] = {
    **DRIVE,
    "ActStatus": lambda d: int(d.moves),
    "IsReferenced": lambda d: True,
    "IsRotational": lambda d: d.area.head.axis_type_r == ROTARY,
    "PosDirect": _position,
    "PosIndirect": _position,
    "ZeroOffset": lambda d: 0.0,
}
TURNS: dict[str, Value] = {
    **DRIVE,
    "ActGear": lambda d: 0,
    "ActOverride": lambda d: d.area.ipo_mc_control.override.state_r / 10.0,
    "ActSpeed": lambda d: spindle_speed(d)[1],
    "ActStatus": lambda d: 1 if spindle_speed(d)[0] else 0,
    "ActTurnDirection": lambda d: spindle_speed(d)[0],
    "AnglePos": _position,
    "CmdGear": lambda d: 0,
    "CmdOverride": lambda d: d.area.ipo_mc_control.override.state_r / 10.0,
    "CmdSpeed": lambda d: spindle_speed(d)[1],
}


def coord_of(root: Any, axis: Any) -> Any:
    """The place in the first channel of an axis; None: it has none."""
    for coord in root.channel[0].bahn_state.coord_r:
        if not coord.name:
            return None
        if coord.log_axis_nr_r == axis.head.log_ax_n_r:
            return coord
    return None


def drive_of(root: Any, index: int) -> Drive:
    """An axis of the HLI with what the channel says of it."""
    area = root.axis[index]
    moves = area.lr_state.axis_state_r == 3
    return Drive(area, coord_of(root, area), moves)
