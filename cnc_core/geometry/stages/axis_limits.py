"""Software limits of the axes (P-AXIS-00177, P-AXIS-00178), checked on whole
batches before anything moves there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cnc_core.blocks import (
    CIRCULAR,
    ELEMENT,
    LINEAR,
    POLYNOMIAL,
    SOFT_LIMITS,
    BlockBatch,
    motion_planes,
)
from cnc_core.blocks.arcs import arc_extremes
from cnc_core.blocks.pool import coefficients
from cnc_core.errors import CncError, Place
from cnc_core.units import AnyArray, FloatArray

from ..shapes.polynomial import bernstein, extremes, normalised
from .stage import RefusedRow

LOWEST = 98  # code of a SOFT_LIMITS row; the other is 99


class AxisLimits:
    """Stage that refuses the first motion leaving an axis's range (error 903001).

    ``names``: of the axes.  ``main``: channel index of X, Y, Z.  ``limits``:
    lowest and highest position, (axes,) each, mm or degrees.  ``start``:
    (axes,).  ``place``: of (file, line).
    """

    def __init__(
        self,
        names: Sequence[str],
        main: tuple[int, int, int],
        limits: tuple[FloatArray, FloatArray],
        start: FloatArray,
        place: Callable[[int, int], Place],
    ) -> None:
        self.names, self.main, self.place = list(names), main, place
        self.low, self.high = limits
        self.last = start.copy()

    idle = True

    def push(self, batch: BlockBatch) -> BlockBatch:
        """The same rows; those that set limits end here."""
        switches = np.flatnonzero(batch.rows["type"] == SOFT_LIMITS)
        if not len(switches):
            return self._checked(batch)
        first = 0
        for at in [*switches, len(batch)]:
            try:
                self._checked(BlockBatch(batch.rows[first:at], batch.pool))
            except RefusedRow as refused:
                ahead = batch.rows[: first + len(refused.ahead)]
                kept = BlockBatch(
                    ahead[ahead["type"] != SOFT_LIMITS], batch.pool
                )
                raise RefusedRow(refused.error, kept, refused.count) from None
            if at < len(batch):
                self._set(batch.rows[at])
            first = int(at) + 1
        return BlockBatch(
            batch.rows[batch.rows["type"] != SOFT_LIMITS], batch.pool
        )

    def _set(self, row: Any) -> None:
        """G98, G99 from here on."""
        values = row["end"][: len(self.names)].copy()
        if row["code"] == LOWEST:
            self.low = values
        else:
            self.high = values

    def set_range(self, place: int, name: str, low: float, high: float) -> None:
        """Another axis stands at this place."""
        self.names[place] = name
        self.low[place], self.high[place] = low, high

    def _checked(self, batch: BlockBatch) -> BlockBatch:
        moving = np.flatnonzero(
            (batch.rows["type"] <= POLYNOMIAL)
            & ((batch.rows["flags"] & ELEMENT) == 0)
        )
        if not len(moving):
            return batch
        # plain lines are not copied
        rows = batch.rows if len(moving) == len(batch) else batch.rows[moving]
        low, high = self._reach(rows, batch.pool)
        tolerance = 1e-9
        beyond = (low < self.low - tolerance) | (high > self.high + tolerance)
        if beyond.any():
            row, axis = (int(i) for i in np.argwhere(beyond)[0])
            value = (
                low[row, axis]
                if low[row, axis] < self.low[axis]
                else high[row, axis]
            )
            ahead = BlockBatch(batch.rows[: moving[row]], batch.pool)
            raise RefusedRow(
                self._error(rows[row], axis, value),
                ahead,
                int(rows["count"][row]),
            )
        return batch

    def _reach(
        self, rows: AnyArray, pool: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(low, high), each (n, axes), of the motions; their last end becomes
        the position.
        """
        ends = rows["end"][:, : len(self.names)]
        starts = np.vstack([self.last, ends[:-1]])
        if (rows["type"] == LINEAR).all():
            self.last = ends[-1].copy()
            return ends, ends
        low, high = ends.copy(), ends.copy()
        for plane in (17, 18, 19):
            arcs = np.flatnonzero(
                (rows["type"] == CIRCULAR) & (rows["plane"] == plane)
            )
            if len(arcs):
                first, second, _ = motion_planes(plane)
                at = (
                    arcs[:, None],
                    np.array([self.main[first], self.main[second]]),
                )
                low[at], high[at] = arc_extremes(
                    rows[arcs], starts[arcs], self.main
                )
        curves = np.flatnonzero(rows["type"] == POLYNOMIAL)
        if len(curves):
            low[curves], high[curves] = self._polynomial_reach(
                rows[curves], pool
            )
        self.last = ends[-1].copy()
        return low, high

    def _polynomial_reach(
        self, rows: AnyArray, pool: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bounds from the control points; exact extremes where those leave the
        range.
        """
        coef = normalised(
            coefficients(rows, pool, len(self.names)), rows["angle"]
        )
        points = bernstein(coef)
        low = points.min(axis=2)
        high = points.max(axis=2)
        for i in np.flatnonzero(
            ((low < self.low) | (high > self.high)).any(axis=1)
        ):
            low[i], high[i] = extremes(coef[i])
        return low, high

    def _error(self, row: Any, axis: int, value: float) -> CncError:
        allowed = f"{self.low[axis]:g} to {self.high[axis]:g}"
        place = self.place(int(row["file"]), int(row["line"]))
        return CncError(
            903001,
            f"axis {self.names[axis]} would reach {value:g}, allowed is {allowed}",
            place,
        )

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self.last = position[: len(self.names)].copy()
