"""Dynamics of a profile (DIN, JRK): limits of its motions as shares of what the machine's axes can do.

``DYNAMICS`` rows at its beginning set them for feed and rapid motions, rows at its end free them; the planner keeps
them all along, in bends and along the path.  A share is never above 1: no setup raises a limit of the machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cnc_core._engine import lib

from ..blocks import DYNAMICS, NC_BLOCK, BlockBatch
from ..profile import ProfileSpec
from .profile_filter import TimeFilter

FloatArray = npt.NDArray[np.float64]
FEED_MOTIONS, RAPID_MOTIONS = 0, 1  # ``value`` of a DYNAMICS row
LOWEST = 1e-6  # share that the engine takes


@dataclass(frozen=True)
class AxisDynamics:
    """Limits of the machine's axes, (axes,) mm/s, mm/s2, mm/s3 (degrees); jerk 0: none."""

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


class ProfileLimits:
    """Rows that set and free the limits of one profile."""

    def __init__(self, spec: ProfileSpec, machine: AxisDynamics) -> None:
        self._spec, self._machine = spec, machine
        self._shares = [
            (code, which, shares) for code, which, shares in _shares(spec, machine) if (shares < 1.0).any()
        ]

    def time_filter(self, main: tuple[int, ...]) -> TimeFilter | None:
        """What smooths the speed (Tstab, Ttop), None if nothing does."""
        smooth = self._spec.smoothness
        window = max(smooth.window_s, smooth.constant_s)
        if not window > 0:
            return None
        velocity, acceleration = self._machine.velocity.copy(), self._machine.acceleration.copy()
        for code, which, shares in self._shares:
            if which == FEED_MOTIONS and code == lib.NC_DYNAMICS_VELOCITY:
                velocity *= shares
            if which == FEED_MOTIONS and code == lib.NC_DYNAMICS_ACCELERATION:
                acceleration *= shares
        return TimeFilter(window, velocity, acceleration, main)

    def begin(self) -> BlockBatch:
        return self._rows(None)

    def end(self) -> BlockBatch:
        return self._rows(1.0)

    def _rows(self, share: float | None) -> BlockBatch:
        rows = np.zeros(len(self._shares), NC_BLOCK)
        rows["type"], rows["count"], rows["file"] = DYNAMICS, self._spec.count, self._spec.file
        for row, (code, which, shares) in zip(rows, self._shares, strict=True):
            row["code"], row["value"] = code, which
            row["end"][: len(shares)] = shares if share is None else share
        return BlockBatch(rows)


def _shares(spec: ProfileSpec, machine: AxisDynamics) -> Iterator[tuple[int, int, FloatArray]]:
    """(code, motions, (axes,) shares).  Without a limit of jerk (DIS) only the machine's own one holds."""
    smooth = spec.smoothness
    for which in (FEED_MOTIONS, RAPID_MOTIONS):
        own = {axis.channel: axis.cutting if which == FEED_MOTIONS else axis.rapid for axis in spec.axes}
        yield lib.NC_DYNAMICS_VELOCITY, which, _share({i: d.velocity for i, d in own.items()}, machine.velocity)
        acceleration = {i: d.acceleration for i, d in own.items()}
        yield lib.NC_DYNAMICS_ACCELERATION, which, _share(acceleration, machine.acceleration)
        if smooth.jerk != "none":
            jerk = {i: (smooth.scale or 1.0) * (d.jerk or float(machine.jerk[i])) for i, d in own.items()}
            yield lib.NC_DYNAMICS_JERK, which, _share(jerk, machine.jerk)


def _share(own: Mapping[int, float | None], machine: FloatArray) -> FloatArray:
    """(axes,) of the machine's limits; 1 where the profile has none, or the machine none to take a share of."""
    out = np.ones(len(machine))
    for axis, limit in own.items():
        if limit is not None and machine[axis] > 0:
            out[axis] = min(1.0, max(LOWEST, limit / machine[axis]))
    return out
