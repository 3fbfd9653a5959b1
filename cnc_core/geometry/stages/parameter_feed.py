"""Polynomials whose feed is that of their parameter: ds/dt = F (flag
``BY_PARAMETER``); those of a tool tip see ``kinematics.stage``.

The PLC sees an element with the curve's length and tangents.  The machine
drives a piece that runs with the parameter as its path length.  So S takes S / F
however fast the curve moves under it.  The planner's horizon and grid are made
for mm.  A unit of the parameter that is far from a mm counts for a power of two
of them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    BY_LENGTH,
    BY_PARAMETER,
    ELEMENT,
    EXACT_STOP,
    PIECE,
    POLYNOMIAL,
    TANGENTS,
    BlockBatch,
)
from cnc_core.blocks.pool import coefficients
from cnc_core.units import AnyArray, FloatArray

from ..shapes.polynomial import derivative, normalised

GRID = np.linspace(0.0, 1.0, 33)
# where a curve rests at an end, its direction is that so far inside; it rests if
# its derivative is below so much of that there
INSIDE, RESTS = 1e-6, 1e-3


def fastest(slope: FloatArray, span: FloatArray, main: list[int]) -> FloatArray:
    """(n,) largest speed over that of the parameter; ``slope``: derivatives (n,
    axes, order) over 0..1.
    """
    if not len(span):
        return np.empty(0)
    at = plain.summed(
        "nak,kg->nga",
        slope,
        plain.powers(GRID, np.arange(slope.shape[2])[:, None]),
    )
    moved, others = (
        np.linalg.norm(part, axis=2).max(axis=1)
        for part in (at[:, :, main], at)
    )
    return np.asarray(1.01 * np.where(moved > 0.0, moved, others) / span)


def stretches(rows: AnyArray) -> FloatArray:
    """(n,) path mm that a unit of the parameter counts for the planner, the
    same all over a profile (``value``).
    """
    return np.where(rows["value"] > 0.0, rows["value"], 1.0)


class ParameterFeed:
    """Stage; ``axes``: how many; ``main``: channel index of the main axes, -1
    where there is none.
    """

    def __init__(self, axes: int, main: tuple[int, int, int]) -> None:
        self._axes, self._main = axes, main

    idle = True

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        which = np.flatnonzero(
            (rows["type"] == POLYNOMIAL)
            & (rows["flags"] & (BY_PARAMETER | PIECE) == BY_PARAMETER)
        )
        if not len(which):
            return batch
        tangents, most = self._tangents(rows[which], batch.pool)
        out = np.repeat(
            rows,
            np.where(
                np.isin(np.arange(len(rows)), which),
                2,
                1,
            ),
        )
        element = which + np.arange(len(which))
        pools = [batch.pool, tangents.ravel()]
        self._pieces(out, element + 1, rows[which], pools)
        seen = out[element]
        seen["feed"] = rows["feed"][which] * most
        seen["value"] = 0.0
        seen["flags"] = (
            seen["flags"] & ~np.uint16(BY_PARAMETER | EXACT_STOP)
        ) | ELEMENT
        seen["degree"] = TANGENTS
        seen["pool"] = len(batch.pool) + 6 * np.arange(len(which))
        out[element] = seen
        return BlockBatch(out, np.concatenate(pools))

    def _pieces(
        self,
        out: AnyArray,
        at: npt.NDArray[np.int64],
        source: AnyArray,
        pools: list[FloatArray],
    ) -> None:
        driven, stretch = out[at], stretches(source)
        driven["flags"] |= PIECE | BY_LENGTH
        driven["value"] = source["length"]
        driven["feed"] *= stretch
        driven["angle"] = source["angle"] * stretch
        driven["length"] = driven["length_min"] = driven["angle"]
        scaled = np.flatnonzero(stretch != 1.0)
        if len(scaled):
            coef = coefficients(source[scaled], pools[0], self._axes)
            coef /= plain.powers(
                stretch[scaled][:, None, None], np.arange(coef.shape[2])
            )
            order = driven["degree"][scaled].astype(np.int64) + 1
            size = self._axes * order
            first = sum(map(len, pools)) + np.concatenate(
                [[0], np.cumsum(size)[:-1]]
            )
            driven["pool"][scaled] = first
            pools += [
                c[:, :n].ravel() for c, n in zip(coef, order, strict=True)
            ]
        out[at] = driven

    def _tangents(
        self, rows: AnyArray, pool: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(n, 6) tangents in and out over the main axes, and (n,) largest speed
        over that of the parameter.
        """
        slope = derivative(
            normalised(coefficients(rows, pool, self._axes), rows["angle"])
        )
        tangents = np.zeros((len(rows), 6))
        main = [i for i in self._main if i >= 0]
        places = [k for k, i in enumerate(self._main) if i >= 0]
        for side, (u, inside) in enumerate(
            ((0.0, INSIDE), (1.0, 1.0 - INSIDE))
        ):
            at, beside = (
                plain.summed(
                    "nak,k->na",
                    slope[:, main],
                    plain.powers(w, np.arange(slope.shape[2])),
                )
                for w in (u, inside)
            )
            rests = np.linalg.norm(at, axis=1) < RESTS * np.linalg.norm(
                beside, axis=1
            )
            at = np.where(rests[:, None], beside, at)
            norm = np.linalg.norm(at, axis=1)[:, None]
            tangents[:, [3 * side + k for k in places]] = np.divide(
                at, norm, out=np.zeros_like(at), where=norm > 1e-12
            )
        return tangents, fastest(slope, rows["angle"], main)

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        pass
