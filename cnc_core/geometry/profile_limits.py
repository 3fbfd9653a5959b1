"""Dynamics of a profile (DIN) on the rows that are driven: path speeds at which its axes keep their own limits.

The speed of every row is bounded so that no axis exceeds its velocity, and none its acceleration by the path's bend
alone.  What an axis may accelerate along the path is the machine's; G00 lines with limits of their own become pieces
with a feed behind an element that stays rapid.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..blocks import BY_LENGTH, ELEMENT, LINEAR, PIECE, POLYNOMIAL, RAPID, BlockBatch
from ..profile import ProfileSpec
from .polynomial import coefficients, derivative, normalised

FloatArray = npt.NDArray[np.float64]
GRID = np.linspace(0.0, 1.0, 17)


@dataclass(frozen=True)
class AxisCaps:
    """(axes,) velocity and acceleration of cutting, velocity of rapid motion; infinite where the setup says nothing."""

    velocity: FloatArray
    acceleration: FloatArray
    rapid: FloatArray

    @classmethod
    def of(cls, spec: ProfileSpec, axes: int) -> AxisCaps | None:
        """None if the setup sets no limit."""
        caps = cls(*(np.full(axes, np.inf) for _ in range(3)))
        for axis in spec.axes:
            caps.velocity[axis.channel] = axis.cutting.velocity or np.inf
            caps.acceleration[axis.channel] = axis.cutting.acceleration or np.inf
            caps.rapid[axis.channel] = axis.rapid.velocity or np.inf
        found = np.isfinite([caps.velocity, caps.acceleration, caps.rapid]).any()
        return caps if found else None


class ProfileLimits:
    """Stage; ``caps``: by the block count of the profiles' rows, filled by the stage that makes them."""

    def __init__(self, caps: Mapping[int, AxisCaps], start: FloatArray, main: tuple[int, int, int]) -> None:
        self._caps, self._last, self._main = caps, start.copy(), [i for i in main if i >= 0]

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        driven = np.flatnonzero((rows["type"] <= POLYNOMIAL) & (rows["flags"] & ELEMENT == 0))
        if not len(driven):
            return batch
        ends = rows["end"][driven][:, : len(self._last)]
        starts = np.vstack([self._last, ends[:-1]])
        self._last = ends[-1].copy()
        out = batch
        for count, caps in self._caps.items():
            mine = rows["count"][driven] == count
            if mine.any():
                out = self._bounded(out, driven[mine], starts[mine], caps)
        return out

    def _bounded(
        self, batch: BlockBatch, which: npt.NDArray[np.int64], starts: FloatArray, caps: AxisCaps
    ) -> BlockBatch:
        rows = batch.rows.copy()
        part = rows[which]
        rapid = part["flags"] & RAPID != 0
        speed = np.full(len(part), np.inf)
        lines, curves = part["type"] == LINEAR, part["type"] == POLYNOMIAL
        moved = np.abs(part["end"][:, : starts.shape[1]] - starts) / part["length"][:, None]
        limit = np.where(rapid[:, None], caps.rapid, caps.velocity)
        with np.errstate(divide="ignore"):
            speed[lines] = (limit / moved).min(axis=1)[lines]
        if curves.any():
            speed[curves] = self._curve_speed(part[curves], batch.pool, caps)
        cutting = ~rapid & (speed < part["feed"])
        part["feed"][cutting] = speed[cutting]
        rows[which] = part
        slow = rapid & np.isfinite(speed)
        return self._as_pieces(BlockBatch(rows, batch.pool), which[slow], speed[slow])

    def _curve_speed(self, rows: npt.NDArray[Any], pool: FloatArray, caps: AxisCaps) -> FloatArray:
        """(n,) mm/s at which velocity, and acceleration by the bend alone, are kept."""
        coef = normalised(coefficients(rows, pool, len(caps.velocity)), rows["angle"])
        first = derivative(coef)
        second = derivative(first)
        d1 = np.einsum("nak,kg->nga", first, GRID ** np.arange(first.shape[2])[:, None])
        d2 = np.einsum("nak,kg->nga", second, GRID ** np.arange(second.shape[2])[:, None])
        by_length = rows["flags"] & BY_LENGTH != 0
        rate2 = np.where(by_length[:, None], rows["length"][:, None] ** 2, (d1[:, :, self._main] ** 2).sum(axis=2))
        rate2 = np.maximum(rate2, 1e-18)
        along = np.where(by_length[:, None], 0.0, (d1 * d2)[:, :, self._main].sum(axis=2)) / rate2
        slope = np.abs(d1) / np.sqrt(rate2)[:, :, None]
        bend = np.abs(d2 - d1 * along[:, :, None]) / rate2[:, :, None]
        with np.errstate(divide="ignore"):
            v = (caps.velocity / slope.max(axis=1)).min(axis=1)
            a = np.sqrt((caps.acceleration / bend.max(axis=1)).min(axis=1))
        return np.asarray(np.minimum(v, a))

    @staticmethod
    def _as_pieces(batch: BlockBatch, which: npt.NDArray[np.int64], speed: FloatArray) -> BlockBatch:
        """Rapid lines slower than the machine's: the element stays rapid, a piece with a feed is driven."""
        rows = batch.rows
        whole = rows["flags"][which] & PIECE == 0
        rows["flags"][which[~whole]] &= ~np.uint16(RAPID)
        rows["feed"][which[~whole]] = speed[~whole]
        which, speed = which[whole], speed[whole]
        if not len(which):
            return batch
        out = np.repeat(rows, np.where(np.isin(np.arange(len(rows)), which), 2, 1))
        element = which + np.arange(len(which))
        pieces = out[element + 1]
        pieces["flags"] = (pieces["flags"] & ~np.uint16(RAPID)) | PIECE
        pieces["feed"], pieces["value"] = speed, pieces["length"]
        out[element + 1] = pieces
        seen = out[element]
        seen["flags"] |= ELEMENT
        out[element] = seen
        return BlockBatch(out, batch.pool)

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self._last = position[: len(self._last)].copy()
