"""Dynamics of a profile (DIN, JRK): limits of its motions as shares of what the
machine's axes can do.

``DYNAMICS`` rows at its beginning set them for feed and rapid motions, rows at
its end free them; the planner keeps them all along, in bends and along the
path.  No setup raises a limit of the machine, but for the jerk: with JRK DIS
the axes run on S ramps alone, whatever their jerk.  Where the jerk is the
profile's (ENA) that along the path is limited too: on straight stretches all
axes together have it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from cnc_core._engine import lib
from cnc_core.blocks import DYNAMICS, NC_BLOCK, BlockBatch
from cnc_core.blocks.profile_columns import Dynamics, ProfileSpec
from cnc_core.units import FloatArray

from .time_filter import TimeFilter

FEED_MOTIONS, RAPID_MOTIONS = 0, 1  # ``value`` of a DYNAMICS row
PATH_JERK = 4  # place of the jerk in a row of limits of the path
LOWEST = 1e-6  # share that the engine takes
HIGHEST_JERK = 1e4  # the same
S_RAMP_CYCLES = (
    4  # in which an axis reaches its acceleration where no jerk limit holds
)


@dataclass(frozen=True)
class AxisDynamics:
    """Limits of the machine's axes, (axes,) mm/s, mm/s2, mm/s3 (degrees); jerk
    0: none.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


class ProfileLimits:
    """Rows that set and free the limits of one profile."""

    def __init__(
        self,
        spec: ProfileSpec,
        machine: AxisDynamics,
        cycle_s: float,
        *,
        described: bool = False,
    ) -> None:
        self._spec, self._machine = spec, machine
        # what is ENA alone is no row for readers
        self._jerk = None if described else _path_jerk(spec, machine)
        self._shares = [
            (code, which, shares)
            for code, which, shares in _shares(spec, machine, cycle_s)
            if (shares != 1.0).any()
        ]

    @property
    def weakest(self) -> tuple[float, float]:
        """Acceleration and jerk (0: none) of the weakest linear axis when it cuts."""
        channels = [self._spec.axes[i].channel for i in self._spec.linear]
        limits = {
            lib.NC_DYNAMICS_ACCELERATION: self._machine.acceleration,
            lib.NC_DYNAMICS_JERK: self._machine.jerk,
        }
        for code, which, shares in self._shares:
            if which == FEED_MOTIONS and code in limits:
                limits[code] = limits[code] * shares
        acceleration, jerk = (
            float(limit[channels].min()) for limit in limits.values()
        )
        return acceleration, jerk

    def time_filter(self, main: tuple[int, ...]) -> TimeFilter | None:
        """What smooths the speed (Tstab, Ttop, Tintgr) and queues the beginning
        (Entities), None if nothing does.
        """
        smooth = self._spec.smoothness
        window = max(smooth.window_s, smooth.constant_s)
        if not (window > 0 or smooth.merge_s > 0 or smooth.entities > 0):
            return None
        limits = {
            lib.NC_DYNAMICS_VELOCITY: self._machine.velocity.copy(),
            lib.NC_DYNAMICS_ACCELERATION: self._machine.acceleration.copy(),
            lib.NC_DYNAMICS_JERK: self._machine.jerk.copy(),
        }
        for code, which, shares in self._shares:
            if which == FEED_MOTIONS and code in limits:
                limits[code] *= shares
        velocity, acceleration, jerk = limits.values()
        return TimeFilter(
            window,
            velocity,
            acceleration,
            np.where(jerk > 0.0, jerk, np.inf),
            main,
            smooth.merge_s,
            smooth.entities,
        )

    def begin(self) -> BlockBatch:
        return self._rows(True)

    def end(self) -> BlockBatch:
        return self._rows(False)

    def _rows(self, held: bool) -> BlockBatch:
        rows = np.zeros(len(self._shares) + (self._jerk is not None), NC_BLOCK)
        rows["type"] = DYNAMICS
        rows["count"] = self._spec.count
        rows["file"] = self._spec.file
        for row, (code, which, shares) in zip(rows, self._shares, strict=False):
            row["code"], row["value"] = code, which
            row["end"][: len(shares)] = shares if held else 1.0
        if self._jerk is not None:
            rows[-1]["code"] = lib.NC_DYNAMICS_PATH
            rows[-1]["value"] = FEED_MOTIONS
            rows[-1]["end"][PATH_JERK] = self._jerk if held else 0.0
        return BlockBatch(rows)


def _shares(
    spec: ProfileSpec, machine: AxisDynamics, cycle_s: float
) -> Iterator[tuple[int, int, FloatArray]]:
    """(code, motions, (axes,) shares).

    Only S ramps (DIS) lift a share above 1: that of the jerk.
    """
    for which in (FEED_MOTIONS, RAPID_MOTIONS):
        own = {
            axis.channel: axis.cutting if which == FEED_MOTIONS else axis.rapid
            for axis in spec.axes
        }
        yield (
            lib.NC_DYNAMICS_VELOCITY,
            which,
            _share({i: d.velocity for i, d in own.items()}, machine.velocity),
        )
        acceleration = _share(
            {i: d.acceleration for i, d in own.items()}, machine.acceleration
        )
        yield lib.NC_DYNAMICS_ACCELERATION, which, acceleration
        if spec.smoothness.jerk == "none":
            yield (
                lib.NC_DYNAMICS_JERK,
                which,
                _s_ramps(spec, machine, acceleration, cycle_s),
            )
        else:
            yield (
                lib.NC_DYNAMICS_JERK,
                which,
                _share(_jerks(spec, own, machine), machine.jerk),
            )


def _path_jerk(spec: ProfileSpec, machine: AxisDynamics) -> float | None:
    """Jerk along the profile when it cuts (ENA): that of the weakest linear axis."""
    if spec.smoothness.jerk != "profile":
        return None
    jerks = _jerks(
        spec, {axis.channel: axis.cutting for axis in spec.axes}, machine
    )
    linear = [spec.axes[i].channel for i in spec.linear]
    limits = [
        jerk
        for i in linear
        if machine.jerk[i] > 0 and (jerk := jerks.get(i)) is not None
    ]
    return min(limits) if len(limits) == len(linear) else None


def _jerks(
    spec: ProfileSpec, own: Mapping[int, Dynamics], machine: AxisDynamics
) -> dict[int, float | None]:
    """Jerk of every axis (AXI).

    Where it is the profile's (ENA), all linear axes have that of the weakest of
    them.
    """
    scale = spec.smoothness.scale or 1.0
    jerk = {
        i: scale
        * min(
            d.jerk or np.inf,
            float(machine.jerk[i]) or np.inf,
        )
        for i, d in own.items()
    }
    if spec.smoothness.jerk == "profile":
        linear = [spec.axes[i].channel for i in spec.linear]
        jerk |= dict.fromkeys(linear, min(jerk[i] for i in linear))
    return {i: j for i, j in jerk.items() if np.isfinite(j)}


def _s_ramps(
    spec: ProfileSpec,
    machine: AxisDynamics,
    acceleration: FloatArray,
    cycle_s: float,
) -> FloatArray:
    """Shares of the jerk that reaches an axis' acceleration in
    ``S_RAMP_CYCLES``; never below the machine's own.
    """
    out = np.ones(len(machine.jerk))
    for axis in spec.axes:
        i = axis.channel
        if machine.jerk[i] > 0:
            reached = (
                acceleration[i]
                * machine.acceleration[i]
                / (S_RAMP_CYCLES * cycle_s * machine.jerk[i])
            )
            out[i] = min(max(1.0, reached), HIGHEST_JERK)
    return out


def _share(own: Mapping[int, float | None], machine: FloatArray) -> FloatArray:
    """(axes,) of the machine's limits; 1 where the profile has none, or the
    machine none to take a share of.
    """
    out = np.ones(len(machine))
    for axis, limit in own.items():
        if limit is not None and machine[axis] > 0:
            out[axis] = min(1.0, max(LOWEST, limit / machine[axis]))
    return out
