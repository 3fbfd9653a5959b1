"""Smoothing of micro-segments and corners within a tolerance, as a streaming
stage.

The geometry is in C (``c_ext/stages/smoothing``, told in ``docs/explanation/smoothing.md``).
Programmed motions go on as *elements* (flag ``ELEMENT``: what the PLC sees),
among them *pieces* (flag ``PIECE``: what the machine executes; ``value`` is the
programmed distance they cover).  A motion that is driven as programmed stays
one row without flags.  ``SMOOTHING`` rows switch; those with the flag
``HAS_VALUE`` say how the axes may drive what the rows describe, and describe
nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cnc_core._engine import ffi, lib
from cnc_core.blocks import (
    HAS_VALUE,
    NC_AXES,
    NC_BLOCK,
    POLYNOMIAL,
    SMOOTHING,
    BlockBatch,
)
from cnc_core.blocks.to_c import OUTSIDE, pool_pointer, row_pointer
from cnc_core.units import AnyArray, FloatArray

TURN_MAX = np.radians(120.0)
CARRIED_SHARE = 0.1


@dataclass(frozen=True)
class SmoothingMachine:
    """What the stage has to know of the machine: main axes by channel index,
    mask of rotary axes, mm/s2, mm/s, mm/s3 (0: no limit); the jerk of each axis,
    mm/s3 or degrees/s3 (0: no limit; none given: all as `jerk`), and the speed of
    each, mm/s (none given: all as `feed`; those of rotary axes do not count).
    """

    main: tuple[int, int, int]
    rotary: int
    accel: float
    feed: float
    jerk: float = 0.0
    axis_jerk: tuple[float, ...] = ()
    axis_feed: tuple[float, ...] = ()


@dataclass(frozen=True)
class SmoothingReport:
    """What was done so far; deviations are certified bounds (mm, degrees)."""

    rows: int
    pieces: int
    curves: int
    corners: int
    windows: int
    solves: int
    fallbacks: int
    irregular: int
    deviation: float
    rotary_deviation: float
    left_out: (
        float  #: mm: farthest from its neighbour that a point was left out
    )


class Smoothing:
    """Rows of the programmed contour in, elements and pieces out.

    ``tolerance``: mm, 0 = exactly until a row says otherwise.
    ``rotary_tolerance``: degrees.  ``turn_max``: rad, larger turns stay exact
    corners.  ``described``: rows are listed, not driven.  ``carried``: mm, what
    stages behind this one may add to the deviation; so much of every tolerance
    is left to them, at most ``CARRIED_SHARE`` of it.
    """

    def __init__(
        self,
        start: FloatArray,
        machine: SmoothingMachine,
        tolerance: float,
        rotary_tolerance: float = 0.05,
        turn_max: float = TURN_MAX,
        *,
        described: bool = False,
        carried: float = 0.0,
    ) -> None:
        config = ffi.new("nc_smooth_config *")
        config.axes = len(start)
        config.main_axis = list(machine.main)
        config.rotary = machine.rotary
        config.accel, config.jerk = machine.accel, machine.jerk
        jerks = machine.axis_jerk or (machine.jerk,) * len(start)
        config.axis_jerk = [*jerks, *[0.0] * (NC_AXES - len(jerks))]
        feeds = machine.axis_feed or (machine.feed,) * len(start)
        turning = [bool(machine.rotary >> i & 1) for i in range(len(start))]
        for axis, feed in enumerate(feeds):
            counts = not turning[axis] or all(turning)
            config.axis_feed[axis] = feed if counts else 0.0
        self._carried = carried
        # what is left to them now: less from the first tolerance on that has no
        # room for it
        self.carried = carried
        config.tolerance = tolerance - self._left_to_carry(tolerance)
        config.rotary_tolerance, config.turn_max = rotary_tolerance, turn_max
        handle = lib.nc_smooth_new(config, _full(start))
        if handle == ffi.NULL:
            raise MemoryError("smoothing")
        self._exact = tolerance == 0.0  # nothing is smoothed yet, rows pass
        self._tolerance, self._described = tolerance, described
        self._state: Any = ffi.gc(handle, lib.nc_smooth_free)

    @property
    def idle(self) -> bool:
        return self._exact

    def push(self, batch: BlockBatch) -> BlockBatch:
        """Rows and pieces that are final now."""
        rows = self._switched(batch.rows)
        if self._exact and not (rows["type"] == SMOOTHING).any():
            self._follow(batch.rows)
            return batch
        self._exact = not self._smooths(rows)
        rows = np.ascontiguousarray(rows)
        pool = np.ascontiguousarray(batch.pool)
        pointer = pool_pointer(pool)
        taken = lib.nc_smooth_push(
            self._state, row_pointer(rows), len(rows), pointer, len(pool)
        )
        if taken == -2:
            raise ValueError(f"smoothing: {OUTSIDE}")
        if taken < 0:
            raise MemoryError("smoothing")
        return self._taken()

    def _smooths(self, rows: AnyArray) -> bool:
        """Behind these rows a tolerance is in force."""
        switches = rows[rows["type"] == SMOOTHING]
        if not len(switches):
            return True
        last = switches[-1]
        return bool(last["code"] and (last["value"] > 0.0 or self._tolerance))

    def _switched(self, rows: AnyArray) -> AnyArray:
        """Rows that only say how to drive give way to a larger tolerance, and
        to none if nothing is driven; every tolerance is less what is left to
        the stages behind.
        """
        switch = rows["type"] == SMOOTHING
        if not switch.any():
            return rows
        rows = rows.copy()
        weak = (
            switch
            & ((rows["flags"] & HAS_VALUE) != 0)
            & (self._described | (rows["value"] <= self._tolerance))
        )
        for name in ("value", "length", "angle"):
            rows[name][weak] = 0.0
        for at in np.flatnonzero(switch & (rows["value"] > 0.0)):
            rows["value"][at] -= self._left_to_carry(float(rows["value"][at]))
        return rows

    def _left_to_carry(self, tolerance: float) -> float:
        """mm of a tolerance."""
        if tolerance <= 0.0:
            return 0.0
        left = min(self._carried, CARRIED_SHARE * tolerance)
        self.carried = min(self.carried, left)
        return left

    def drain(self) -> BlockBatch:
        """The section in work ends where the program stands."""
        if lib.nc_smooth_drain(self._state) < 0:
            raise MemoryError("smoothing")
        return self._taken()

    def turn(self, rotation: FloatArray) -> None:
        """From the next ``resync`` on stages behind this one turn the path: (3, 3)
        of the main axes, programmed coordinates to those of the axes.
        """
        lib.nc_smooth_turn(
            self._state,
            ffi.new("double[9]", [float(v) for v in rotation.ravel()]),
        )

    def resync(self, position: FloatArray) -> None:
        lib.nc_smooth_resync(self._state, _full(position))

    def _follow(self, rows: AnyArray) -> None:
        moving = np.flatnonzero(rows["type"] <= POLYNOMIAL)
        if len(moving):
            self.resync(rows["end"][moving[-1]])

    @property
    def report(self) -> SmoothingReport:
        """Counts and certified deviations."""
        out = ffi.new("nc_smooth_stats *")
        lib.nc_smooth_get_stats(self._state, out)
        return SmoothingReport(
            **{
                name: getattr(out, name)
                for name in SmoothingReport.__dataclass_fields__
            }
        )

    def _taken(self) -> BlockBatch:
        rows = np.empty(lib.nc_smooth_rows(self._state), NC_BLOCK)
        pool = np.empty(lib.nc_smooth_coefficients(self._state))
        lib.nc_smooth_take(
            self._state,
            row_pointer(rows),
            pool_pointer(pool),
        )
        return BlockBatch(rows, pool)


def _full(position: FloatArray) -> Any:
    full = ffi.new("double[]", lib.NC_AXES)
    full[0 : len(position)] = [float(v) for v in position]
    return full
