"""Software limits of the axes (P-AXIS-00177, P-AXIS-00178), checked on whole batches before anything moves there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..blocks import CIRCULAR, POLYNOMIAL, BlockBatch, motion_planes
from ..config import CellConfig
from ..errors import CncError, Place

FloatArray = npt.NDArray[np.float64]


def arc_extremes(
    rows: npt.NDArray[Any], starts: FloatArray, main: tuple[int, int, int]
) -> tuple[FloatArray, FloatArray]:
    """(low, high), each (n, 2): what circular rows of one plane reach on the plane's first and second axis, mm."""
    first, second, _ = motion_planes(int(rows["plane"][0]))
    axes = [main[first], main[second]]
    centre, end = rows["center"], rows["end"][:, axes]
    d = starts[:, axes] - centre
    radius, angle0, sweep = np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0]), rows["angle"]
    low, high = np.minimum(starts[:, axes], end), np.maximum(starts[:, axes], end)
    for quadrant in range(4):
        angle = quadrant * np.pi / 2
        turn = np.mod(np.where(sweep > 0, angle - angle0, angle0 - angle), 2 * np.pi)
        point = centre + radius[:, None] * np.array([np.cos(angle), np.sin(angle)])
        passed = (turn <= np.abs(sweep))[:, None]
        low = np.where(passed, np.minimum(low, point), low)
        high = np.where(passed, np.maximum(high, point), high)
    return low, high


class AxisLimits:
    """Stage that refuses the first motion leaving an axis's range (error 903001)."""

    def __init__(self, cell: CellConfig, place: Callable[[int, int], Place], start: FloatArray | None = None) -> None:
        self.names, self.main, self.place = cell.axis_names, cell.main_axes, place
        self.low, self.high = cell.axis_values("min_mm"), cell.axis_values("max_mm")
        self.last = cell.axis_values("start_mm") if start is None else start.copy()

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows[batch.rows["type"] <= POLYNOMIAL]
        if not len(rows):
            return batch
        n = len(self.names)
        ends = rows["end"][:, :n]
        starts = np.vstack([self.last, ends[:-1]])
        self._check(rows, ends, ends)
        for plane in (17, 18, 19):
            arcs = (rows["type"] == CIRCULAR) & (rows["plane"] == plane)
            if arcs.any():
                self._check_arcs(rows[arcs], starts[arcs], plane)
        self.last = ends[-1].copy()
        return batch

    def _check_arcs(self, rows: npt.NDArray[Any], starts: FloatArray, plane: int) -> None:
        first, second, _ = motion_planes(plane)
        low, high = rows["end"][:, : len(self.names)].copy(), rows["end"][:, : len(self.names)].copy()
        columns = [self.main[first], self.main[second]]
        low[:, columns], high[:, columns] = arc_extremes(rows, starts, self.main)
        self._check(rows, low, high)

    def _check(self, rows: npt.NDArray[Any], low: FloatArray, high: FloatArray) -> None:
        tolerance = 1e-9
        beyond = (low < self.low - tolerance) | (high > self.high + tolerance)
        if not beyond.any():
            return
        row, axis = (int(i) for i in np.argwhere(beyond)[0])
        value = low[row, axis] if low[row, axis] < self.low[axis] else high[row, axis]
        text = f"axis {self.names[axis]} would reach {value:g}, allowed is {self.low[axis]:g} to {self.high[axis]:g}"
        raise CncError(903001, text, self.place(int(rows["file"][row]), int(rows["line"][row])))

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self.last = position[: len(self.names)].copy()
