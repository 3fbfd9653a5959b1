"""Lines on which other axes turn far while the tool hardly moves: threads,
winding, engraving.

The path length counts the main axes.  Points of a thread are written with four
or five decimals, so its mm jump by parts per thousand from line to line.  The
path speed is continuous, and a rotary axis would have to jump with the mm.
Such lines are driven along a length that counts the turn too.  Then the linear
axes make the jump, which is nothing for them.

The PLC sees the programmed line as an element.  The machine drives a piece
behind it, a polynomial of degree 1 over the longer length.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import (
    BY_LENGTH,
    ELEMENT,
    EXACT_STOP,
    LINEAR,
    PIECE,
    POLYNOMIAL,
    RAPID,
    BlockBatch,
)
from cnc_core.units import AnyArray, FloatArray

# degrees (or mm) of the other axes that count as a mm of path
UNIT = 100.0
# of the norm that joins both: beyond UNIT a mm more or less hardly counts
NORM = 4
SHORTEST = 1e-12  # mm
# a line is driven so if its length grows by more than this share
GROWTH = 0.05


class RotaryLines:
    """Stage behind the kinematics.

    ``start``: (axes,) position before the first row.  ``main``: channel index
    of X, Y, Z, -1 where absent.
    """

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        self._last = start.copy()
        self._others = [
            i for i in range(len(start)) if i not in [m for m in main if m >= 0]
        ]

    idle = True

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        if not self._others:
            return batch
        driven = np.flatnonzero(
            (rows["type"] <= POLYNOMIAL) & (rows["flags"] & ELEMENT == 0)
        )
        if not len(driven):
            return batch
        ends = rows["end"][driven, : len(self._last)]
        starts = np.vstack([self._last, ends[:-1]])
        self._last = ends[-1].copy()
        turned = np.linalg.norm((ends - starts)[:, self._others], axis=1)
        length = rows["length"][driven]
        share = turned / UNIT / np.maximum(length, SHORTEST)
        stretch = (1.0 + share**NORM) ** (1.0 / NORM)
        plain = rows["flags"][driven] & (RAPID | PIECE) == 0
        mine = (rows["type"][driven] == LINEAR) & plain & (length > SHORTEST)
        mine &= rows["degree"][driven] == 0  # no chord of a curve
        moved = np.linalg.norm(
            np.delete(ends - starts, self._others, axis=1), axis=1
        )
        mine &= (stretch > 1.0 + GROWTH) & (moved > 0.5 * length)
        if not mine.any():
            return batch
        return self._stretched(
            batch, driven[mine], starts[mine], ends[mine], stretch[mine]
        )

    def _stretched(
        self,
        batch: BlockBatch,
        which: npt.NDArray[np.int64],
        starts: FloatArray,
        ends: FloatArray,
        stretch: FloatArray,
    ) -> BlockBatch:
        """An element and a piece in place of each of the lines ``which``."""
        rows = batch.rows
        count = np.ones(len(rows), np.int64)
        count[which] = 2
        out = np.repeat(rows, count)
        element = which + np.arange(len(which))
        coef = np.empty((len(which), ends.shape[1], 2))
        length = rows["length"][which] * stretch
        coef[:, :, 0] = starts
        coef[:, :, 1] = (ends - starts) / length[:, None]
        self._pieces(out, element + 1, length, stretch)
        first = len(batch.pool) + coef[0].size * np.arange(len(which))
        out["pool"][element + 1] = first
        out["flags"][element] = (
            out["flags"][element] & ~np.uint16(EXACT_STOP)
        ) | ELEMENT
        return BlockBatch(out, np.concatenate([batch.pool, coef.ravel()]))

    @staticmethod
    def _pieces(
        out: AnyArray,
        at: npt.NDArray[np.int64],
        length: FloatArray,
        stretch: FloatArray,
    ) -> None:
        piece = out[at]
        piece["value"] = piece["length"]
        piece["type"], piece["degree"] = POLYNOMIAL, 1
        piece["flags"] |= PIECE | BY_LENGTH
        piece["feed"] *= stretch
        piece["angle"] = piece["length"] = piece["length_min"] = length
        out[at] = piece

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self._last = position[: len(self._last)].copy()
