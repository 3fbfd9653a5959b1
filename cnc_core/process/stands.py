"""Why the path stands and who could end it, from the engine and the HLI."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from cnc_core._engine import lib
from hli import layout

from ..config import CellConfig, ChannelPlace
from ..config.synchronisation import SYNCH, SYNCH_BASES
from ..engine import Standstill

Reason = tuple[str, str]
"""What is waited for, and who could end it."""
KINDS = {1: "M", 2: "H", 3: "S", 4: "T"}  # fkt_ctrl_r
SHOWN_FUNCTIONS = 3
TWO_BLOCKS = "use TechnoServer or AcknowledgeAll"
CONTINUE = (
    "the PLC continues it: AutoContinue, or bahn_mc_control.continue_machining"
)
# one bit of the conditions each: what is waited for, who could end it
PLAIN: tuple[tuple[int, str, str], ...] = (
    (lib.ENGINE_STOP_M00, "continue at M0", CONTINUE),
    (lib.ENGINE_STOP_M01, "continue at M1", CONTINUE),
    (lib.ENGINE_STOP_SINGLE_BLOCK, "continue in single block", CONTINUE),
    (lib.ENGINE_STOP_INSERTED, "continue at an inserted stop", CONTINUE),
    (
        lib.ENGINE_STOP_FEEDHOLD,
        "the end of feed hold",
        "the PLC sets bahn_mc_control.feedhold.command_w to FALSE",
    ),
    (
        lib.ENGINE_STOP_MODE,
        "ACTIVE behind HOLD",
        "the PLC commands ACTIVE: ResumeProgram, or mode_and_state",
    ),
    (
        lib.ENGINE_STOP_ERROR,
        "the end of an error",
        "the PLC resets the channel: ResetChannel",
    ),
    (
        lib.ENGINE_STOP_OVERRIDE,
        "an override above 0",
        "the PLC raises bahn_mc_control.override.command_w",
    ),
    (
        lib.ENGINE_STOP_RAPID_OVERRIDE,
        "a rapid override above 0",
        "the PLC raises bahn_mc_control.rapid_override.command_w",
    ),
    (
        lib.ENGINE_STOP_EXTERNAL_SPEED,
        "an external speed other than 0",
        "the PLC writes bahn_mc_control.ext_command_speed.command_w",
    ),
    (
        lib.ENGINE_STOP_BACKWARD,
        "the end of backward motion",
        "the PLC sets bahn_mc_control.backward_motion.command_w to FALSE"
        " (or an ext_command_speed above 0)",
    ),
    (
        lib.ENGINE_STOP_DWELL,
        "the end of a dwell",
        "it ends by itself",
    ),
    (
        lib.ENGINE_STOP_NO_BLOCKS,
        "what its program waits for",
        "the PLC, by the variable or event that the block names",
    ),
    (
        lib.ENGINE_STOP_UNKNOWN,
        "motion",
        "unknown: no stop condition is set",
    ),
)
# which conditions say nothing beside these: rows are missing because ...
HIDES_BLOCKS = (
    lib.ENGINE_STOP_FUNCTION | lib.ENGINE_STOP_M00 | lib.ENGINE_STOP_M01
)
HIDES_OVERRIDES = lib.ENGINE_STOP_OVERRIDE


@dataclass(frozen=True)
class PlcSight:
    """What the CNC sees of its PLC; ``silent_s``: since its last scan."""

    attached: bool
    silent_s: float
    missing: str  # how to get one

    def trouble(self) -> str:
        """Why the PLC ends nothing at all; empty if it could."""
        if not self.attached:
            return f"no PLC is attached: {self.missing}"
        if self.silent_s > 1.0:
            return "no task of the PLC has returned since"
        return ""


def reasons(
    stands: Standstill,
    root: Any,
    cell: CellConfig,
    plc: PlcSight,
    place: ChannelPlace = ChannelPlace(),  # noqa: B008 - a constant
) -> list[Reason]:
    """All that holds the path, what the PLC has to do first."""
    axes = [root.axis[place.axis_base + i] for i in range(len(cell.axes))]
    bits = stands.conditions
    if bits & HIDES_BLOCKS:
        bits &= ~lib.ENGINE_STOP_NO_BLOCKS
    if bits & HIDES_OVERRIDES:
        bits &= ~lib.ENGINE_STOP_RAPID_OVERRIDE
    found: list[Reason] = []
    if bits & lib.ENGINE_STOP_FUNCTION:
        found += _functions(root, cell, place)
    found += [(what, who) for bit, what, who in PLAIN if bits & bit]
    if bits & lib.ENGINE_STOP_AXIS_HOLD:
        found.append(_held_axes(stands, cell))
    if bits & lib.ENGINE_STOP_RELEASE:
        found.append(_unreleased(axes, cell))
    trouble = plc.trouble()
    of_program = lib.ENGINE_STOP_DWELL | lib.ENGINE_STOP_UNKNOWN
    if trouble and not bits & of_program:
        found = [(what, trouble) for what, _ in found]
    return found


def _held_axes(stands: Standstill, cell: CellConfig) -> Reason:
    held = [
        name
        for i, name in enumerate(cell.axis_names)
        if stands.held_axes >> i & 1
    ]
    names = ", ".join(held)
    return (
        f"the end of the feed hold of axis {names}",
        "the PLC sets ipo_mc_control.feedhold.command_w of the axis to FALSE",
    )


def _unreleased(axes: list[Any], cell: CellConfig) -> Reason:
    """The axes' releases that are commanded FALSE."""
    missing = []
    for axis, name in zip(axes, cell.axis_names, strict=True):
        control = axis.lr_mc_control
        missing += [
            f"{unit} of axis {name}"
            for unit in ("release_feedhold", "drive_on", "torque_permission")
            if not getattr(control, unit).state_r
        ]
    return (
        " and ".join(missing[:SHOWN_FUNCTIONS]) or "the release of an axis",
        "the PLC sets command_w of it in lr_mc_control to TRUE",
    )


def _functions(
    root: Any, cell: CellConfig, place: ChannelPlace
) -> list[Reason]:
    """The functions that the PLC holds and the path waits for."""
    channel = root.channel[place.index]
    units = [*channel.techno_unit_std_sync, *channel.techno_unit_late_sync]
    behind = place.axis_base + len(cell.axes)
    for i in range(behind, behind + len(cell.spindles)):
        units += root.axis[i].techno_unit_std_sync
    found = [reason for unit in units for reason in _function(unit)]
    return found[:SHOWN_FUNCTIONS] or [
        ("acknowledgement of a function", f"the PLC: {TWO_BLOCKS}")
    ]


def _function(unit: Any) -> Iterator[Reason]:
    kind = KINDS.get(unit.fkt_ctrl_r, "")
    if not kind or not (unit.please_rw or not unit.done_w):
        return
    number, synch = _attributes(kind, bytes(unit.attribut_r.data))
    base = _synch_name(synch)
    if not base:
        return
    what = f"acknowledgement of {kind}{number} ({base})"
    if unit.please_rw:
        yield what, f"no task acknowledges {kind} functions: {TWO_BLOCKS}"
    else:
        yield (
            what,
            "a task has fetched it and not set done_w: done of its TechnoBlock",
        )


def _attributes(kind: str, data: bytes) -> tuple[str, int]:
    """Number and synchronisation type of a function."""
    if kind == "S":
        spindle = layout.HLI_S_PROZESS.from_buffer_copy(_padded(data))
        move = spindle.move_cmd or spindle.pos_cmd
        return (f" with M{move}" if move else ""), spindle.synch_mode
    if kind == "T":
        tool = layout.HLI_T_PROZESS.from_buffer_copy(_padded(data))
        return str(tool.id.basic), tool.synch_mode
    function = layout.HLI_M_H_PROZESS.from_buffer_copy(_padded(data))
    return str(function.nr), function.synch_mode


def _padded(data: bytes) -> bytes:
    """Room for the largest of the attributes."""
    size = max(
        map(
            ctypes.sizeof,
            (layout.HLI_S_PROZESS, layout.HLI_T_PROZESS),
        )
    )
    return data.ljust(size, b"\0")


def _synch_name(value: int) -> str:
    """Name of the base type; empty for one that holds nothing up."""
    for name in SYNCH_BASES:
        if SYNCH[name] and value & SYNCH[name] and name != "MOS":
            return name
    return ""
