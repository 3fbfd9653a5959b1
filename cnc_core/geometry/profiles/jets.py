"""Vectors with their first two derivatives by a curve's parameter: scalars (n,
3), vectors (n, 3, k) of n points.
"""

from __future__ import annotations

import numpy as np

from cnc_core.units import FloatArray


def of_columns(coef: FloatArray, u: FloatArray, first: int = 0) -> FloatArray:
    """(n, 3, columns) of polynomials (n, columns, order) at u (n,), beginning
    with derivative ``first``.
    """
    out = np.zeros((len(coef), 3, coef.shape[1]))
    for _ in range(first):
        coef = coef[:, :, 1:] * np.arange(1, coef.shape[2])
    for k in range(3):
        for i in range(coef.shape[2] - 1, -1, -1):
            out[:, k] = out[:, k] * u[:, None] + coef[:, :, i]
        coef = coef[:, :, 1:] * np.arange(1, coef.shape[2])
    return out


def times(a: FloatArray, b: FloatArray) -> FloatArray:
    """Scalar times scalar or vector."""
    if b.ndim == 3:
        a = a[:, :, None]
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[:, 0] = a[:, 0] * b[:, 0]
    out[:, 1] = a[:, 1] * b[:, 0] + a[:, 0] * b[:, 1]
    mixed = 2.0 * a[:, 1] * b[:, 1]
    out[:, 2] = a[:, 2] * b[:, 0] + mixed + a[:, 0] * b[:, 2]
    return out


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(
        sum(
            times(
                a[:, :, i],
                b[:, :, i],
            )
            for i in range(a.shape[2])
        )
    )


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    parts = [(1, 2), (2, 0), (0, 1)]
    return np.stack(
        [
            times(a[:, :, i], b[:, :, k]) - times(a[:, :, k], b[:, :, i])
            for i, k in parts
        ],
        axis=2,
    )


def power(a: FloatArray, exponent: float) -> FloatArray:
    """A positive scalar to a power."""
    v = a[:, 0]
    d = a[:, 1]
    c = a[:, 2]
    first = exponent * v ** (exponent - 1.0)
    second = exponent * (exponent - 1.0) * v ** (exponent - 2.0)
    return np.stack(
        [v**exponent, first * d, first * c + second * d * d], axis=1
    )


def unit(a: FloatArray) -> FloatArray:
    """The vector divided by its length, which must not be 0."""
    return times(power(dot(a, a), -0.5), a)


def still(value: FloatArray, n: int) -> FloatArray:
    """A vector (k,) that does not change."""
    out = np.zeros((n, 3, len(value)))
    out[:, 0] = value
    return out


def angle(x: FloatArray, y: FloatArray) -> FloatArray:
    """atan2(y, x), rad; the value in -pi..pi."""
    square = times(x, x) + times(y, y)
    turning = np.zeros_like(x)  # x y' - y x' and its derivative
    turning[:, 0] = x[:, 0] * y[:, 1] - y[:, 0] * x[:, 1]
    turning[:, 1] = x[:, 0] * y[:, 2] - y[:, 0] * x[:, 2]
    rate = turning[:, 0] / square[:, 0]
    lost = rate * square[:, 1] / square[:, 0]
    change = turning[:, 1] / square[:, 0] - lost
    return np.stack(
        [
            np.arctan2(y[:, 0], x[:, 0]),
            rate,
            change,
        ],
        axis=1,
    )
