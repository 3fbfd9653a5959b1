"""Penalised least squares with quintic B-splines, in time that grows with the
number of control points alone.

A quintic B-spline couples neighbours up to five apart, so the normal equations
are block tridiagonal in blocks of five.  The penalty is the integral of the
squared second derivative, weighted where it acts.  Source: P-splines, Eilers
and Marx 1996.  The derivative of B-splines takes the place of differences, so
knots may stand anywhere.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core.units import FloatArray

IntArray = npt.NDArray[np.int64]
DEGREE = 5
ORDER = 2  # derivative that the penalty takes
TINY = 1e-13


def knot_vector(breaks: FloatArray) -> FloatArray:
    """Clamped knots over the breaks of the polynomials."""
    return np.concatenate(
        [
            np.full(DEGREE, breaks[0]),
            breaks,
            np.full(DEGREE, breaks[-1]),
        ]
    )


def local_basis(
    u: FloatArray, knots: FloatArray
) -> tuple[IntArray, FloatArray]:
    """(n,) number of the first basis function that is not 0 at u, and (n, 6)
    values from it on (de Boor).
    """
    count = len(knots) - DEGREE - 1
    k = np.clip(
        np.searchsorted(knots, u, side="right") - 1,
        DEGREE,
        count - 1,
    )
    local = np.zeros((len(u), DEGREE + 1))
    local[:, 0] = 1.0
    for d in range(1, DEGREE + 1):
        saved = np.zeros(len(u))
        for j in range(d):
            right = knots[k + j + 1]
            left = knots[k + 1 - d + j]
            part = local[:, j] / (right - left)
            local[:, j] = saved + (right - u) * part
            saved = (u - left) * part
        local[:, d] = saved
    return k - DEGREE, local


def derivative_rows(knots: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(count - 2, 3) rows that make the second derivative's control points, and
    (count - 2,) what each stands for.
    """
    count = len(knots) - DEGREE - 1
    rows = np.zeros((count, ORDER + 1))
    rows[:, 0] = 1.0
    for r in range(1, ORDER + 1):
        n, p = count - r, DEGREE - r + 1
        width = knots[DEGREE + 1 : DEGREE + 1 + n] - knots[r : r + n]
        new = np.zeros((n, ORDER + 1))
        new[:, 1:] = rows[1:, :-1]
        new -= rows[:-1]
        rows = new * (p / np.maximum(width, 1e-300))[:, None]
    n = count - ORDER
    share = (knots[DEGREE + 1 : DEGREE + 1 + n] - knots[ORDER : ORDER + n]) / (
        DEGREE - ORDER + 1
    )
    return rows, share


class Normal:
    """Normal equations (a band of six diagonals) of rows that begin at ``first``."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.band = np.zeros((DEGREE + 1, count))

    def add(
        self, first: IntArray, rows: FloatArray, weight: FloatArray
    ) -> None:
        width = rows.shape[1]
        for a in range(width):
            for b in range(a, width):
                part = np.bincount(
                    first + a,
                    weight * rows[:, a] * rows[:, b],
                    minlength=self.count,
                )
                self.band[b - a] += part[: self.count]

    def solved(
        self, right: FloatArray, begin: FloatArray, finish: FloatArray
    ) -> FloatArray:
        """(count, columns) control points; the first and (backwards) the last
        ones are given.
        """
        control = np.zeros((self.count, right.shape[1]))
        control[: len(begin)] = begin
        if len(finish):
            control[self.count - len(finish) :] = finish[::-1]
        low, high = len(begin), self.count - len(finish)
        if low >= high:
            return control
        rest = right - self._times(control)
        control[low:high] = _blocks_solved(
            self.band[:, low:high], rest[low:high]
        )
        return control

    def _times(self, x: FloatArray) -> FloatArray:
        out = self.band[0][:, None] * x
        for d in range(1, min(DEGREE, self.count - 1) + 1):
            part = self.band[d][: self.count - d, None]
            out[: self.count - d] += part * x[d:]
            out[d:] += part * x[: self.count - d]
        return np.asarray(out)


def _blocks_solved(band: FloatArray, right: FloatArray) -> FloatArray:
    """Symmetric system of six diagonals by blocks of five."""
    n = band.shape[1]
    blocks = -(-n // DEGREE)
    size = blocks * DEGREE
    full = np.zeros((DEGREE + 1, size))
    full[0] = 1.0
    full[:, :n] = band
    for d in range(1, DEGREE + 1):
        full[d, max(n - d, 0) :] = 0.0
    full[0, :n] += TINY * (1.0 + band[0].max())
    middle = np.zeros((blocks, DEGREE, DEGREE))
    upper = np.zeros((blocks, DEGREE, DEGREE))
    at = np.arange(size).reshape(blocks, DEGREE)
    for i in range(DEGREE):
        for j in range(i, DEGREE):
            middle[:, i, j] = middle[:, j, i] = full[j - i, at[:, i]]
        for j in range(i + 1):
            upper[:, i, j] = full[DEGREE + j - i, at[:, i]]
    x = np.zeros((size, right.shape[1]))
    x[:n] = right
    x = x.reshape(blocks, DEGREE, -1)
    for k in range(1, blocks):
        factor = np.linalg.solve(middle[k - 1], upper[k - 1]).T
        middle[k] -= factor @ upper[k - 1]
        x[k] -= factor @ x[k - 1]
    x[-1] = np.linalg.solve(middle[-1], x[-1])
    for k in range(blocks - 2, -1, -1):
        x[k] = np.linalg.solve(
            middle[k],
            x[k] - upper[k] @ x[k + 1],
        )
    return np.asarray(x.reshape(size, -1)[:n])
