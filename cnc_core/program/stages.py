"""Filters of a program in their order, and what stages take from the cell."""

from __future__ import annotations

from cnc_core._engine import lib

from ..config import SYNCH, CellConfig, synch_value
from ..config.axes import AxisConfig
from ..geometry.filters.feed_control import FeedControl
from ..geometry.filters.low_pass import LowPass
from ..geometry.filters.noise import FineNoise, Noise
from ..geometry.filters.run_filter import RunFilter
from ..geometry.filters.short_segments import ShortSegments
from ..geometry.filters.spline_filter import SplineFilter
from ..geometry.stages.contouring import (
    AHEAD,
    BEHIND,
    ContourMachine,
)
from ..geometry.stages.smoothing import SmoothingMachine

FILTERS: tuple[type[RunFilter], ...] = (
    Noise,
    SplineFilter,
    FineNoise,
    ShortSegments,
    LowPass,
    FeedControl,
)


# length of a coarse chord: in a bend of that length an acceleration A allows no
# more jerk than A^1.5 / CHORD_MM^0.5
CHORD_MM = 2.0


def smoothing_machine(cell: CellConfig) -> SmoothingMachine:
    rotary = [axis.kind == "rotary" for axis in cell.axes.values()]
    linear = [
        axis for axis in cell.axes.values() if axis.kind == "linear"
    ] or list(cell.axes.values())
    seen = lib.ENGINE_JERK_SEEN / cell.cycle_s

    def jerk(axis: AxisConfig) -> float:
        # beside axes with a limit one without has what its acceleration allows
        most = float(seen * axis.a_max_mm_s2)
        return min(axis.j_max_mm_s3 or most, most)

    def in_chords(axis: AxisConfig) -> float:
        if axis.kind == "rotary":
            return jerk(axis)
        return min(jerk(axis), float(axis.a_max_mm_s2**1.5 / CHORD_MM**0.5))

    jerks = [jerk(axis) for axis in linear if axis.j_max_mm_s3 > 0.0]
    return SmoothingMachine(
        main=cell.main_axes,
        rotary=sum(1 << i for i, is_rotary in enumerate(rotary) if is_rotary),
        accel=min(axis.a_max_mm_s2 for axis in linear),
        feed=min(axis.v_max_mm_s for axis in linear),
        jerk=min(jerks, default=0.0),
        axis_jerk=tuple(in_chords(axis) for axis in cell.axes.values()),
        axis_feed=tuple(axis.v_max_mm_s for axis in cell.axes.values()),
    )


def _waits(cell: CellConfig) -> dict[tuple[str, int], int]:
    """Functions for which the channel stands, and where."""
    behind = SYNCH["MVS_SNS"] | SYNCH["MNS_SNS"]
    ahead = (
        SYNCH["MVS_SVS"]
        | SYNCH["MVS_SLM"]
        | SYNCH["MEP_SVS"]
        | SYNCH["MET_SVS"]
    )
    names: dict[tuple[str, int], str] = {
        ("M", number): name for number, name in cell.m_functions.items()
    }
    names |= {
        ("H", int(number)): name
        for number, name in cell.channel.h_synch.items()
    }
    names[("T", 0)] = cell.channel.tool_synch
    for spindle in list(cell.spindles.values())[:1]:
        names |= {
            ("M", number) if number else ("S", 0): name
            for number, name in spindle.functions.items()
        }
    found = {}
    for key, name in names.items():
        value = synch_value(name)
        if value & (ahead | behind):
            found[key] = BEHIND if value & behind else AHEAD
    return found


def contour_machine(cell: CellConfig) -> ContourMachine:
    smoothing = smoothing_machine(cell)
    return ContourMachine(
        cell.main_axes,
        smoothing.accel,
        smoothing.feed,
        _waits(cell),
        smoothing.jerk,
    )
