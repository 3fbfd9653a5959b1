"""Seeded smooth paths for the planner benchmarks: knots over path length with exact derivatives.

The shapes are those of the comparison with other planners: a contour of 100 000 segments and a raster in three axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BPoly, make_interp_spline

FloatArray = npt.NDArray[np.float64]
Curve = Callable[[FloatArray, int], FloatArray]


@dataclass(frozen=True)
class Path:
    """Knots of one smooth stretch: s (n+1,), q and its derivatives by s (n+1, axes)."""

    s: FloatArray
    q: FloatArray
    d1: FloatArray
    d2: FloatArray
    d3: FloatArray

    def at(self, s: FloatArray) -> FloatArray:
        """Positions between the knots, by the polynomials of degree 7 that meet all derivatives."""
        piece = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)
        lo, hi = piece.min(), piece.max() + 2
        values = np.stack([self.q, self.d1, self.d2, self.d3], axis=1)[lo:hi]
        return np.asarray(BPoly.from_derivatives(self.s[lo:hi], values)(s))


def by_length(curve: Curve, t: FloatArray) -> Path:
    """Turn a curve q(t) with derivatives up to the third into knots over path length."""
    q, q1, q2, q3 = (curve(t, order) for order in range(4))
    speed = np.linalg.norm(q1, axis=1)[:, None]
    speed1 = (q1 * q2).sum(axis=1)[:, None] / speed
    speed2 = ((q2 * q2).sum(axis=1)[:, None] + (q1 * q3).sum(axis=1)[:, None] - speed1**2) / speed
    d1 = q1 / speed
    d2 = (q2 - speed1 * d1) / speed**2
    d3 = (q3 - speed2 * d1 - 3 * speed * speed1 * d2) / speed**3
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(t)
    inner = (0.5 * (t[1:] + t[:-1]))[:, None] + half[:, None] * nodes
    lengths = (np.linalg.norm(curve(inner.ravel(), 1), axis=1).reshape(inner.shape) * weights).sum(axis=1) * half
    return Path(np.concatenate([[0.0], np.cumsum(lengths)]), q, d1, d2, d3)


def contour(blocks: int = 100_000) -> Path:
    """r(th) = 40 + 8 sin 7th + 2 sin 31th mm, 2500 points a turn, growing 0.05 mm a turn, in two axes."""

    def curve(t: FloatArray, order: int) -> FloatArray:
        def r(n: int) -> FloatArray:
            grow = 0.05 / (2 * np.pi)
            base = (40.0 + grow * t) if n == 0 else np.full_like(t, grow if n == 1 else 0.0)
            return np.asarray(
                base + 8 * 7.0**n * np.sin(7 * t + n * np.pi / 2) + 2 * 31.0**n * np.sin(31 * t + n * np.pi / 2)
            )

        e = [np.column_stack([np.cos(t + n * np.pi / 2), np.sin(t + n * np.pi / 2)]) for n in range(4)]
        binomial = [[1], [1, 1], [1, 2, 1], [1, 3, 3, 1]][order]
        return np.asarray(sum(binomial[n] * r(order - n)[:, None] * e[n] for n in range(order + 1)))

    return by_length(curve, 2 * np.pi / 2500 * np.arange(blocks + 1))


def raster_line(row: int) -> Path:
    """One line of the raster z = 3 sin(x/7) cos(y/5): 100 mm in 0.25 mm steps of x, lines 0.25 mm apart."""
    y = 0.25 * row
    a = 3 * np.cos(y / 5)

    def curve(t: FloatArray, order: int) -> FloatArray:
        x = t if order == 0 else np.full_like(t, 1.0 if order == 1 else 0.0)
        z = a * 7.0**-order * np.sin(t / 7 + order * np.pi / 2)
        return np.column_stack([x, np.full_like(t, y if order == 0 else 0.0), z])

    return by_length(curve, np.linspace(0.0, 100.0, 401))


def random_spline(seed: int, points: int = 40, axes: int = 3, spacing: float = 0.2) -> Path:
    """A smooth random path: a spline of degree 5 through a random walk."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(points, axes)) * rng.uniform(2, 6)
    walk = np.cumsum(steps + rng.normal(size=axes) * 3, axis=0)
    spline = make_interp_spline(np.arange(points), walk, k=5)
    length = float(np.linalg.norm(np.diff(walk, axis=0), axis=1).sum())
    t = np.linspace(0, points - 1, max(40, int(length / spacing)))

    def curve(at: FloatArray, order: int) -> FloatArray:
        return np.asarray(spline(at, nu=order))

    for _ in range(12):
        path = by_length(curve, t)
        wide = np.linalg.norm(np.diff(path.d1, axis=0), axis=1) > 0.1
        if not wide.any():
            break
        t = np.sort(np.concatenate([t, (0.5 * (t[1:] + t[:-1]))[wide]]))
    return path
