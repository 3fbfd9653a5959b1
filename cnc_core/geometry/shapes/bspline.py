"""B-splines as polynomials: exact conversion of every span by blossoming (de
Boor, A Practical Guide to Splines).
"""

from __future__ import annotations

from math import comb

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.units import FloatArray


def spans(
    points: FloatArray, knots: FloatArray, degree: int
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int64]]:
    """(m, columns, degree + 1) coefficients over 0..length, (m,) lengths and
    (m,) numbers of the non-empty spans.

    ``points``: (n, columns) control points.  ``knots``: (n + degree + 1,)
    non-decreasing, clamped.
    """
    number = (
        np.flatnonzero(np.diff(knots[degree : len(points) + 1]) > 0) + degree
    )
    low, high = knots[number], knots[number + 1]
    bezier = _blossoms(points, knots, degree, number)
    length = high - low
    return (
        _power(bezier)
        / plain.powers(length[:, None, None], np.arange(degree + 1)),
        length,
        number,
    )


def _blossoms(
    points: FloatArray,
    knots: FloatArray,
    degree: int,
    number: npt.NDArray[np.int64],
) -> FloatArray:
    """(m, columns, degree + 1) Bezier points: number k is the blossom at k
    times the upper, else the lower limit of the spans.
    """
    ends = np.arange(degree + 1)[:, None]
    low, high = knots[number], knots[number + 1]
    # (degree + 1, m, columns) each
    d = [points[None, number - degree + i] for i in range(degree + 1)]
    for r in range(1, degree + 1):
        u = np.where(r <= ends, high, low)
        for j in range(degree, r - 1, -1):
            left = knots[number - degree + j]
            right = knots[number + j - r + 1]
            share = ((u - left) / (right - left))[:, :, None]
            d[j] = (1.0 - share) * d[j - 1] + share * d[j]
    return np.moveaxis(d[degree], 0, 2)


def _power(bezier: FloatArray) -> FloatArray:
    """Power basis over 0..1 of Bezier points (m, columns, order)."""
    n = bezier.shape[2] - 1
    convert = np.array(
        [
            [
                comb(n, k) * comb(k, i) * (-1.0) ** (k - i) if i <= k else 0.0
                for i in range(n + 1)
            ]
            for k in range(n + 1)
        ]
    )
    return np.asarray(plain.summed("ki,mci->mck", convert, bezier))
