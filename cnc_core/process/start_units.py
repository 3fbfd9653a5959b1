"""Level units of the PLC that are evaluated at program start."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import CncError

SKIP_LEVELS = 0x3FF  # program_block_ignore: bit n - 1 is level n
NO_FUNCTIONS = 0x2000  # execution_mode: no output of M, H and T functions


def _enabled(channel: Any, unit: Any) -> int:
    """Command of a level unit; 0 if the PLC does not enable it."""
    return (
        int(unit.command_w)
        if channel.head.plc_present_w and unit.enable_w
        else 0
    )


def skip_levels(channel: Any) -> int:
    """Bit mask of the block skip levels that are switched on."""
    unit = channel.decoder_mc_control.program_block_ignore
    levels = _enabled(channel, unit) & SKIP_LEVELS
    unit.state_r = levels
    return levels


def execution_mode(channel: Any, report: Callable[[CncError], None]) -> int:
    """The execution mode; 0 and an error for one that is not supported."""
    unit = channel.decoder_mc_control.execution_mode
    mode = _enabled(channel, unit)
    if mode & ~NO_FUNCTIONS:
        report(CncError(905021, f"execution_mode {mode:#x} is not supported"))
        mode = 0
    unit.state_r = mode
    return mode
