"""How far a curve and the input's path lie apart, both ways: from the points,
and everywhere in between.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core.units import FloatArray

from ..geometry.shapes.polynomial import bernstein, normalised

IntArray = npt.NDArray[np.int64]
FOOT_STEPS = 4
NEIGHBOURS = (
    1  # segments on either side that a piece of the curve may belong to
)


def off_points(
    values: FloatArray,
    u: FloatArray,
    coef: FloatArray,
    breaks: FloatArray,
    linear: list[int],
) -> tuple[FloatArray, FloatArray]:
    """(n, columns) of each vertex from its foot on the curve, and (n,) where
    that is.

    Columns that are not linear: from the foot or at the vertex' own parameter,
    whichever is nearer.
    """
    at = u.copy()
    own = best = np.zeros_like(values)
    for turn in range(FOOT_STEPS + 1):
        k = np.clip(
            np.searchsorted(breaks, at, side="right") - 1, 0, len(coef) - 1
        )
        s = at - breaks[k]
        jets = [np.zeros_like(values) for _ in range(3)]
        c = coef[k]
        for order in range(3):
            for i in range(c.shape[2] - 1, -1, -1):
                jets[order] = jets[order] * s[:, None] + c[:, :, i]
            c = c[:, :, 1:] * np.arange(1, c.shape[2])
        best = jets[0] - values
        own = best if turn == 0 else own
        if turn == FOOT_STEPS:
            break
        d, d1, d2 = (j[:, linear] for j in (best, jets[1], jets[2]))
        slope = (d1 * d1).sum(axis=1)
        bend = np.maximum(slope + (d * d2).sum(axis=1), 0.25 * slope)
        step = (d * d1).sum(axis=1) / np.maximum(bend, 1e-300)
        at = np.clip(
            at - np.clip(step, -1.0, 1.0),
            breaks[0],
            breaks[-1],
        )
    out = np.where(np.abs(own) < np.abs(best), own, best)
    worse = np.linalg.norm(
        own[:, linear],
        axis=1,
    ) < np.linalg.norm(best[:, linear], axis=1)
    out[:, linear] = np.where(
        worse[:, None],
        own[:, linear],
        best[:, linear],
    )
    return np.asarray(out), np.where(worse, u, at)


def off_path(
    vertices: FloatArray,
    u: FloatArray,
    coef: FloatArray,
    breaks: FloatArray,
    pieces: int = 1,
) -> tuple[FloatArray, IntArray]:
    """(m,) upper bounds of the distance of the curve's pieces from the polyline
    of (n, d) ``vertices``, and (m,) their polynomials.

    The distance from a straight segment is a convex function and a polynomial
    lies in the hull of its Bernstein points, so what holds for these holds for
    every point between: nothing slips through between samples.
    """
    cuts = np.union1d(u, breaks)
    cuts = cuts[
        np.concatenate(
            [
                [True],
                np.diff(cuts) > 1e-12 * max(1.0, float(cuts[-1])),
            ]
        )
    ]
    share = np.arange(pieces) / pieces
    along = np.diff(cuts)[:, None] * share
    start = (cuts[:-1, None] + along).ravel()
    length = np.repeat(np.diff(cuts) / pieces, pieces)
    k = np.clip(
        np.searchsorted(breaks, start + 0.5 * length, side="right") - 1,
        0,
        len(coef) - 1,
    )
    # (m, d, 6)
    control = bernstein(
        normalised(shifted_all(coef[k], start - breaks[k]), length)
    )
    own = np.clip(
        np.searchsorted(u, start + 0.5 * length, side="right") - 1,
        0,
        len(u) - 2,
    )
    bound = np.full(len(start), np.inf)
    for by in range(-NEIGHBOURS, NEIGHBOURS + 1):
        j = np.clip(own + by, 0, len(u) - 2)
        a = vertices[j][:, :, None]
        chord = (vertices[j + 1] - vertices[j])[:, :, None]
        along = ((control - a) * chord).sum(axis=1) / np.maximum(
            (chord * chord).sum(axis=1), 1e-300
        )
        far = np.linalg.norm(
            control - a - np.clip(along, 0.0, 1.0)[:, None, :] * chord, axis=1
        ).max(axis=1)
        bound = np.minimum(bound, far)
    return bound, k


def shifted_all(coef: FloatArray, by: FloatArray) -> FloatArray:
    """The same polynomials (n, columns, order) with their parameters beginning
    at ``by`` (n,).
    """
    out, order = coef.copy(), coef.shape[2]
    for i in range(order - 1):
        for k in range(order - 2, i - 1, -1):
            out[:, :, k] += by[:, None] * out[:, :, k + 1]
    return out
