"""Polynomials whose feed is that of their parameter: ds/dt = F (flag ``BY_PARAMETER``).

What the PLC sees is an element with the curve's length and tangents; what is driven is a piece that runs with the
parameter as its path length, so that S takes S / F however fast the curve moves under it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..blocks import BY_LENGTH, BY_PARAMETER, ELEMENT, EXACT_STOP, PIECE, POLYNOMIAL, TANGENTS, BlockBatch
from .polynomial import coefficients, derivative, normalised

FloatArray = npt.NDArray[np.float64]
GRID = np.linspace(0.0, 1.0, 33)


class ParameterFeed:
    """Stage; ``axes``: how many; ``main``: channel index of the main axes, -1 where there is none."""

    def __init__(self, axes: int, main: tuple[int, int, int]) -> None:
        self._axes, self._main = axes, main

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        which = np.flatnonzero((rows["type"] == POLYNOMIAL) & (rows["flags"] & BY_PARAMETER != 0))
        if not len(which):
            return batch
        tangents, fastest = self._tangents(rows[which], batch.pool)
        out = np.repeat(rows, np.where(np.isin(np.arange(len(rows)), which), 2, 1))
        element = which + np.arange(len(which))
        self._pieces(out, element + 1, rows[which])
        seen = out[element]
        seen["feed"] = rows["feed"][which] * fastest
        seen["flags"] = (seen["flags"] & ~np.uint16(BY_PARAMETER | EXACT_STOP)) | ELEMENT
        seen["degree"], seen["pool"] = TANGENTS, len(batch.pool) + 6 * np.arange(len(which))
        out[element] = seen
        return BlockBatch(out, np.concatenate([batch.pool, tangents.ravel()]))

    @staticmethod
    def _pieces(out: npt.NDArray[Any], at: npt.NDArray[np.int64], source: npt.NDArray[Any]) -> None:
        driven = out[at]
        driven["flags"] = (driven["flags"] & ~np.uint16(BY_PARAMETER)) | PIECE | BY_LENGTH
        driven["value"] = source["length"]
        driven["length"] = driven["length_min"] = source["angle"]
        out[at] = driven

    def _tangents(self, rows: npt.NDArray[Any], pool: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, 6) tangents in and out over the main axes, and (n,) largest speed over that of the parameter."""
        slope = derivative(normalised(coefficients(rows, pool, self._axes), rows["angle"]))
        tangents = np.zeros((len(rows), 6))
        main = [i for i in self._main if i >= 0]
        places = [k for k, i in enumerate(self._main) if i >= 0]
        for side, u in enumerate((0.0, 1.0)):
            at = np.einsum("nak,k->na", slope[:, main], u ** np.arange(slope.shape[2]))
            norm = np.linalg.norm(at, axis=1)[:, None]
            tangents[:, [3 * side + k for k in places]] = np.divide(at, norm, out=np.zeros_like(at), where=norm > 1e-12)
        speeds = np.einsum("nak,kg->nga", slope[:, main], GRID ** np.arange(slope.shape[2])[:, None])
        fastest = np.linalg.norm(speeds, axis=2).max(axis=1) / rows["angle"]
        return tangents, np.asarray(1.01 * fastest)

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        pass
