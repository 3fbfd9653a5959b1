"""Values with their first and second derivative along a path: product rule and
chain rule on arrays.

A *jet* is an array (n, 3, ...): value, first, second derivative with respect to
one scalar, for n points.
"""

from __future__ import annotations

import numpy as np

from cnc_core.units import FloatArray


def constant(value: FloatArray, n: int) -> FloatArray:
    """A jet (n, 3, ...) whose derivatives are 0."""
    out = np.zeros((n, 3, *value.shape))
    out[:, 0] = value
    return out


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Matrix product of jets (n, 3, i, j) and (n, 3, j, k)."""
    out = np.empty(
        (
            len(a),
            3,
            a.shape[2],
            b.shape[3],
        )
    )
    out[:, 0] = a[:, 0] @ b[:, 0]
    out[:, 1] = a[:, 1] @ b[:, 0] + a[:, 0] @ b[:, 1]
    mixed = 2.0 * (a[:, 1] @ b[:, 1])
    out[:, 2] = a[:, 2] @ b[:, 0] + mixed + a[:, 0] @ b[:, 2]
    return out


def times(a: FloatArray, v: FloatArray) -> FloatArray:
    """Matrix jet (n, 3, i, j) times vector jet (n, 3, j)."""
    return product(a, v[..., None])[..., 0]


def turn(angle: FloatArray) -> FloatArray:
    """(n, 3, 3, 3): the rotation Rz by a jet (n, 3) of angles in rad."""
    q = angle[:, 0]
    q1 = angle[:, 1]
    q2 = angle[:, 2]
    c, s = np.cos(q), np.sin(q)
    out = np.zeros((len(angle), 3, 3, 3))
    cosine = np.stack(
        [
            c,
            -s * q1,
            -c * q1 * q1 - s * q2,
        ],
        axis=1,
    )
    sine = np.stack(
        [
            s,
            c * q1,
            -s * q1 * q1 + c * q2,
        ],
        axis=1,
    )
    out[:, :, 0, 0] = out[:, :, 1, 1] = cosine
    out[:, :, 1, 0] = sine
    out[:, :, 0, 1] = -sine
    out[:, 0, 2, 2] = 1.0
    return out


def solve(m: FloatArray, b: FloatArray) -> FloatArray:
    """The jet x (n, 3, i) with m x = b, matrix jet m (n, 3, i, i)."""
    inverse = np.linalg.inv(m[:, 0])

    def apply(v: FloatArray) -> FloatArray:
        return np.asarray((inverse @ v[..., None])[..., 0])

    def by(a: FloatArray, v: FloatArray) -> FloatArray:
        return np.asarray((a @ v[..., None])[..., 0])

    x = np.empty_like(b)
    x[:, 0] = apply(b[:, 0])
    x[:, 1] = apply(
        b[:, 1] - by(m[:, 1], x[:, 0]),
    )
    rest = b[:, 2] - by(m[:, 2], x[:, 0])
    x[:, 2] = apply(rest - 2.0 * by(m[:, 1], x[:, 1]))
    return x
