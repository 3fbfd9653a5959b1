"""Random splines as polynomial pieces, a cell for them, and how far positions lie from them."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline
from scipy.spatial import cKDTree

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.geometry.shapes.polynomial import distance, normalised
from support.drive import FloatArray


def spline(rng: np.random.Generator, axes: int = 3) -> PPoly:
    """A random C2 cubic or C4 quintic through points at all scales, parameter
    about the chord length.
    """
    n = int(rng.integers(6, 40))
    scale = rng.lognormal(0.0, 1.2)
    steps = rng.normal(size=(n, axes)) + np.eye(axes)[0] * rng.uniform(0.0, 3.0)
    points = np.cumsum(steps * scale, axis=0)
    points[0] = 0.0
    t = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    )
    if rng.random() < 0.5:
        return CubicSpline(t, points)
    each = [
        PPoly.from_spline(make_interp_spline(t, column, k=5))
        for column in points.T
    ]
    return PPoly(np.stack([p.c for p in each], axis=2), each[0].x)


def pieces(
    curve: PPoly, main: int = 3
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(coefficients ascending (n, axes, order), parameter ends, lengths by
    scipy's quadrature) without empty spans.
    """
    keep = np.diff(curve.x) > 1e-9
    coef = np.moveaxis(curve.c[::-1], 0, 2)[keep]
    ends = np.diff(curve.x)[keep]
    powers = np.arange(1, coef.shape[2])

    def speed(u: float, c: FloatArray) -> float:
        return float(
            np.linalg.norm(
                ((c[:main, 1:] * powers) * u ** (powers - 1)).sum(axis=1)
            )
        )

    found = [
        quad(speed, 0.0, u, args=(c,), epsabs=1e-12, epsrel=1e-13, limit=200)[0]
        for c, u in zip(coef, ends, strict=True)
    ]
    return coef, ends, np.array(found)


def deviation(coef: FloatArray, ends: FloatArray, pos: FloatArray) -> float:
    """Largest distance of the positions from the curve: nearest dense samples,
    then the exact feet on their pieces.

    Where the curve passes twice within the samples' distance the nearest one
    may be of the other pass: more are tried.
    """
    unit = normalised(coef, ends)
    w = np.linspace(0.0, 1.0, 200)
    dense = np.einsum(
        "nak,kg->nga", unit, w ** np.arange(coef.shape[2])[:, None]
    )
    tree = cKDTree(dense.reshape(-1, dense.shape[2]))

    def feet(near: Any, pos: FloatArray) -> FloatArray:
        candidates = [
            np.clip(near // len(w) + k, 0, len(unit) - 1) for k in (-1, 0, 1)
        ]
        return np.asarray(
            np.min([distance(unit[c], pos) for c in candidates], axis=0)
        )

    far = feet(tree.query(pos)[1], pos)
    for i in np.flatnonzero(far > 1e-6):
        near = np.unique(tree.query(pos[i], 40)[1])
        far[i] = feet(near, np.repeat(pos[i : i + 1], len(near), axis=0)).min()
    return float(far.max())


def cell_of(rng: np.random.Generator, names: str = "XYZ") -> CellConfig:
    accel = rng.choice([300.0, 3000.0, 20000.0], len(names))
    return CellConfig(
        axes={
            n: AxisConfig(
                kind="rotary" if n in "ABC" else "linear", a_max_mm_s2=float(a)
            )
            for n, a in zip(names, accel, strict=True)
        }
    )
