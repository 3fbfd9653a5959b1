"""Polynomials in numpy: values, derivatives, hulls, exact extremes, distances.

Coefficients are (..., axes, degree + 1), ascending powers of the parameter.
"""

from __future__ import annotations

from math import comb

import numpy as np

from cnc_core import plain
from cnc_core.units import FloatArray

ORDER = 6  # coefficients per axis at the most
# of ``distance``: a curve is cut into so many cells, the nearest CELLS of them
# again, twice; then come so many steps in each
CUTS, CELLS, NEWTON_STEPS = (20, 6, 6), 4, 6


def normalised(coef: FloatArray, end: FloatArray) -> FloatArray:
    """The same polynomials over a parameter 0..1; ``end`` (n,)."""
    return np.asarray(
        coef * plain.powers(end[:, None, None], np.arange(coef.shape[2])),
    )


def value(coef: FloatArray, w: FloatArray) -> FloatArray:
    """(n, ..., axes) of n polynomials at the parameters w (n, ...)."""
    between = (slice(None), *(None,) * (w.ndim - 1))
    out = np.zeros((*w.shape, coef.shape[1]))
    for k in range(coef.shape[2] - 1, -1, -1):
        out = out * w[..., None] + coef[:, :, k][between]
    return out


def point(coef: FloatArray, w: float) -> FloatArray:
    """(axes,) of one polynomial (axes, order)."""
    return plain.product(coef, plain.powers(w, np.arange(coef.shape[1])))


def points(coef: FloatArray, w: FloatArray) -> FloatArray:
    """(n, axes) of one polynomial (axes, order) at the parameters w (n,)."""
    return value(np.broadcast_to(coef, (len(w), *coef.shape)), w)


def shifted(coef: FloatArray, by: float) -> FloatArray:
    """One polynomial (axes, order) over a parameter that begins ``by`` later."""
    out = np.zeros_like(coef)
    for k in range(coef.shape[1]):
        for j in range(k, coef.shape[1]):
            out[:, k] += comb(j, k) * by ** (j - k) * coef[:, j]
    return out


def derivative(coef: FloatArray) -> FloatArray:
    """Coefficients of the derivative, (..., axes, order - 1)."""
    return np.asarray(coef[..., 1:] * np.arange(1, coef.shape[-1]))


def bernstein(coef: FloatArray) -> FloatArray:
    """(n, axes, order) Bernstein coefficients over 0..1: their hull holds the curve."""
    degree = coef.shape[2] - 1
    convert = np.array(
        [
            [comb(i, j) / comb(degree, j) for j in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )
    return np.asarray(plain.summed("ij,naj->nai", convert, coef))


def extremes(coef: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(low, high), each (axes,): exact extremes of one polynomial (axes, order)
    over 0..1.
    """
    low = np.empty(len(coef))
    high = np.empty(len(coef))
    for i, c in enumerate(coef):
        slope = c[1:] * np.arange(1, len(c))
        roots = np.roots(np.trim_zeros(slope[::-1], "f"))
        inside = [
            float(r.real)
            for r in roots
            if abs(r.imag) < 1e-9 and 0.0 < r.real < 1.0
        ]
        values = np.polynomial.polynomial.polyval(
            np.array([0.0, 1.0, *inside]), c
        )
        low[i] = values.min()
        high[i] = values.max()
    return low, high


def distance(coef: FloatArray, pos: FloatArray) -> FloatArray:
    """(n,) distance of each position (n, axes) from its polynomial over 0..1.

    The cells that may be nearest (chords less what the curve may bulge beyond
    them) are cut anew, then Newton's iteration inside each.
    """
    first = derivative(coef)
    second = derivative(first)
    low, width = np.zeros((len(pos), 1)), 1.0
    best = np.full(len(pos), np.inf)
    for parts in CUTS:
        width /= parts
        w = low[..., None] + width * np.arange(parts + 1)
        off = value(coef, w) - pos[:, None, None, :]
        best = np.minimum(best, _length(off).min(axis=(1, 2)))
        bend = _length(value(second, w))
        least = _chord_distance(off) - width * width / 8.0 * np.maximum(
            bend[..., :-1], bend[..., 1:]
        )
        nearest = least.reshape(len(pos), -1).argsort(axis=1)[:, :CELLS]
        low = np.take_along_axis(
            w[..., :-1].reshape(len(pos), -1), nearest, axis=1
        )
    high = low + width
    u = 0.5 * (low + high)
    for _ in range(NEWTON_STEPS):
        d = value(coef, u) - pos[:, None, :]
        d1 = value(first, u)
        best = np.minimum(best, _length(d).min(axis=1))
        rise = (d * d1).sum(axis=-1)
        low = np.where(rise < 0.0, u, low)
        high = np.where(rise > 0.0, u, high)
        steep = (d1 * d1 + d * value(second, u)).sum(axis=-1)
        step = np.clip(u - rise / np.where(steep > 0.0, steep, 1.0), low, high)
        goes_on = (steep > 0.0) & (step != u)
        u = np.where(goes_on, step, 0.5 * (low + high))
    return np.asarray(best)


def _length(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _chord_distance(off: FloatArray) -> FloatArray:
    """(..., points - 1) of the origin from the chords between points (..., points,
    axes).
    """
    chord = np.diff(off, axis=-2)
    long2 = (chord * chord).sum(axis=-1)
    along = -(off[..., :-1, :] * chord).sum(axis=-1)
    share = np.clip(along / np.where(long2 > 0.0, long2, 1.0), 0.0, 1.0)
    return _length(off[..., :-1, :] + share[..., None] * chord)


def quintics(a: FloatArray, b: FloatArray, length: FloatArray) -> FloatArray:
    """(n, axes, 6) ascending over 0..length: the quintics that meet the jets a
    and b (n, 3, axes) at both ends.
    """
    h = length[:, None]
    p0, p1 = a[:, 0], b[:, 0]
    v0 = a[:, 1] * h
    v1 = b[:, 1] * h
    c0 = a[:, 2] * h * h
    c1 = b[:, 2] * h * h
    d = p1 - p0
    out = np.stack([
        p0, v0, 0.5 * c0,
        10 * d - 6 * v0 - 4 * v1 - 1.5 * c0 + 0.5 * c1,
        -15 * d + 8 * v0 + 7 * v1 + 1.5 * c0 - c1,
        6 * d - 3 * (v0 + v1) - 0.5 * (c0 - c1),
    ], axis=-1)  # fmt: skip
    return np.asarray(out / plain.powers(h[..., None], np.arange(6)))
