"""Polynomial rows in numpy: coefficients out of the pool, values, exact
extremes, rows from pieces.

Coefficients are (..., axes, degree + 1), ascending powers of the programmed
parameter 0..``row["angle"]``.
"""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import POLYNOMIAL, TANGENTS, BlockBatch

FloatArray = npt.NDArray[np.float64]
ORDER = 6  # coefficients per axis at the most


def coefficients(
    rows: npt.NDArray[Any], pool: FloatArray, axes: int
) -> FloatArray:
    """(n, axes, 6) of n polynomial rows, zero above each row's degree."""
    out = np.zeros((len(rows), axes, ORDER))
    for degree in np.unique(rows["degree"]):
        which = np.flatnonzero(rows["degree"] == degree)
        order = int(degree) + 1
        at = rows["pool"][which].astype(np.int64)[:, None] + np.arange(
            axes * order
        )
        out[which, :, :order] = pool[at].reshape(-1, axes, order)
    return out


def normalised(coef: FloatArray, end: FloatArray) -> FloatArray:
    """The same polynomials over a parameter 0..1; ``end`` (n,)."""
    return np.asarray(coef * end[:, None, None] ** np.arange(coef.shape[2]))


def value(coef: FloatArray, w: FloatArray) -> FloatArray:
    """(n, axes) at one parameter each, w (n,)."""
    out = np.zeros(coef.shape[:2])
    for k in range(coef.shape[2] - 1, -1, -1):
        out = out * w[:, None] + coef[:, :, k]
    return out


def derivative(coef: FloatArray) -> FloatArray:
    """Coefficients of the derivative, (n, axes, order - 1)."""
    return np.asarray(coef[:, :, 1:] * np.arange(1, coef.shape[2]))


def bernstein(coef: FloatArray) -> FloatArray:
    """(n, axes, order) Bernstein coefficients over 0..1: their hull holds the curve."""
    degree = coef.shape[2] - 1
    convert = np.array(
        [
            [comb(i, j) / comb(degree, j) for j in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )
    return np.asarray(np.einsum("ij,naj->nai", convert, coef))


def extremes(coef: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(low, high), each (axes,): exact extremes of one polynomial (axes, order)
    over 0..1.
    """
    low, high = np.empty(len(coef)), np.empty(len(coef))
    for i, c in enumerate(coef):
        roots = np.roots(
            np.trim_zeros((c[1:] * np.arange(1, len(c)))[::-1], "f")
        )
        inside = [
            float(r.real)
            for r in roots
            if abs(r.imag) < 1e-9 and 0.0 < r.real < 1.0
        ]
        values = np.polynomial.polynomial.polyval(
            np.array([0.0, 1.0, *inside]), c
        )
        low[i], high[i] = values.min(), values.max()
    return low, high


def distance(coef: FloatArray, pos: FloatArray, grid: int = 40) -> FloatArray:
    """(n,) distance of each position (n, axes) from its polynomial over 0..1,
    by Newton from the nearest chords.
    """
    w = np.linspace(0.0, 1.0, grid + 1)
    points = np.einsum(
        "nak,kg->nga", coef, w ** np.arange(coef.shape[2])[:, None]
    )
    off, chord = points - pos[:, None, :], np.diff(points, axis=1)
    best = np.linalg.norm(off, axis=2).min(axis=1)
    long2 = (chord * chord).sum(axis=2)
    share = np.clip(
        -(off[:, :-1] * chord).sum(axis=2) / np.where(long2 > 0.0, long2, 1.0),
        0.0,
        1.0,
    )
    far = np.linalg.norm(off[:, :-1] + share[..., None] * chord, axis=2)
    first = derivative(coef)
    second = derivative(first)
    beside = np.pad(far, ((0, 0), (1, 1)), constant_values=np.inf)
    minima = np.where(
        (far <= beside[:, :-2]) & (far <= beside[:, 2:]), far, np.inf
    )
    each = np.arange(len(pos))
    for start in np.argsort(minima, axis=1)[:, :4].T:
        u = w[start] + share[each, start] / grid
        for _ in range(12):
            d, d1, d2 = value(coef, u) - pos, value(first, u), value(second, u)
            slope = (d1 * d1).sum(axis=1)
            bend = slope + (d * d2).sum(axis=1)
            u = np.clip(
                u
                - (d * d1).sum(axis=1)
                / np.where(bend > 0.1 * slope, bend, slope + 1e-300),
                0.0,
                1.0,
            )
            best = np.minimum(
                best, np.linalg.norm(value(coef, u) - pos, axis=1)
            )
    return np.asarray(best)


def joined(batches: list[BlockBatch]) -> BlockBatch:
    """One batch; the pools are put one behind the other."""
    if len(batches) == 1:
        return batches[0]
    if not batches:
        return BlockBatch.empty()
    parts, at = [], 0
    for batch in batches:
        rows = batch.rows
        owns = (rows["type"] == POLYNOMIAL) | (
            (rows["type"] < POLYNOMIAL) & (rows["degree"] == TANGENTS)
        )
        if at and owns.any():
            rows = rows.copy()
            rows["pool"][owns] += at
        parts.append(rows)
        at += len(batch.pool)
    return BlockBatch(
        np.concatenate(parts), np.concatenate([b.pool for b in batches])
    )
