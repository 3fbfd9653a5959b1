"""Motion time of hostile splines without jerk beside the optimum, which scipy's
linear programming finds.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog
from scipy.sparse import diags, vstack

from cnc_core.blocks import BlockBatch
from cnc_core.config import AxisConfig, CellConfig
from cnc_core.engine import Engine, Event
from support.curve_pieces import cell_of, pieces, spline
from support.drive import FloatArray, curve_rows

KNOTS = 1200  # of the oracle in a piece


def derivatives(coef: FloatArray, t: FloatArray, order: int) -> FloatArray:
    """(n, axes) of one piece, ascending coefficients (axes, order)."""
    return np.stack(
        [
            np.polynomial.polynomial.polyval(
                t, np.polynomial.polynomial.polyder(c, order)
            )
            for c in coef
        ],
        1,
    )


def optimum(
    coef: FloatArray,
    ends: FloatArray,
    feed: float,
    v: FloatArray,
    a: FloatArray,
    knots: int = KNOTS,
) -> float:
    """TOPP2 over the parameter: x = (dt/dtime)^2 at knots is largest everywhere
    at once, so the sum of all x is too.
    """
    t = [np.linspace(0.0, end, knots + 1) for end in ends]
    h = np.concatenate([np.diff(s) for s in t])
    middle = [0.5 * (s[1:] + s[:-1]) for s in t]
    d1, d2 = (
        np.vstack(
            [
                derivatives(c, m, order)
                for c, m in zip(coef, middle, strict=True)
            ]
        )
        * feed**order
        for order in (1, 2)
    )
    n = len(h)
    mean = diags([0.5, 0.5], [0, 1], shape=(n, n + 1))
    slope = diags(0.5 / h) @ diags([-1.0, 1.0], [0, 1], shape=(n, n + 1))
    # in units of the feed: x is near 1, however the parameter runs
    rows = [
        diags(d1[:, i] / feed) @ slope * feed**2 + diags(d2[:, i]) @ mean
        for i in range(3)
    ]
    matrix = vstack(
        [
            vstack([r / limit, -r / limit])
            for r, limit in zip(rows, a, strict=True)
        ]
    )
    speed2 = (d1**2).sum(axis=1)
    caps = np.minimum(
        feed**2 / speed2, (v**2 / np.maximum(d1**2, 1e-12)).min(axis=1)
    )
    right = np.concatenate([np.ones(6 * n), caps])
    bounds = [(0.0, 0.0)] + [(0.0, None)] * (n - 1) + [(0.0, 0.0)]
    found = linprog(
        -np.ones(n + 1),
        A_ub=vstack([matrix, mean]).tocsr(),
        b_ub=right,
        bounds=bounds,
        method="highs",
    )
    assert found.status == 0, found.message
    root = np.sqrt(np.maximum(found.x, 0.0))
    return float((2.0 * h / (root[1:] + root[:-1])).sum() / feed)


@pytest.mark.ci
@pytest.mark.parametrize("seed", [14, 23, 27, 42])
def test_hostile_splines_take_the_shortest_time(seed: int) -> None:
    """A slow axis beside quick ones, near cusps, few long pieces: within 1 % of
    the acceleration-limited optimum.
    """
    rng = np.random.default_rng(seed)
    curve = pieces(spline(rng))
    took, best = times(
        curve, cell_of(rng), float(rng.choice([20.0, 100.0, 2000.0]))
    )
    assert 0.995 * best <= took <= 1.01 * best


@pytest.mark.ci
@pytest.mark.parametrize("length", [0.2, 0.4, 0.8])
def test_ramps_over_many_gentle_pieces_take_the_shortest_time(
    length: float,
) -> None:
    """Pieces that bend little, the way to full speed many times as long: what
    each of them loses the ramp loses.
    """
    t, radius = np.arange(0.0, 20.0 + 0.5 * length, length), 200.0
    at = np.pi / 4 + t / radius
    curve = CubicSpline(
        t,
        radius
        * np.column_stack(
            [np.cos(at) - np.sqrt(0.5), np.sin(at) - np.sqrt(0.5), 0.0 * t]
        ),
    )
    axes = {
        n: AxisConfig(a_max_mm_s2=a)
        for n, a in zip("XYZ", (300.0, 10000.0, 3000.0), strict=True)
    }
    took, best = times(pieces(curve), CellConfig(axes=axes), 80.0, 40)
    assert 0.995 * best <= took <= 1.01 * best


def times(
    curve: tuple[FloatArray, FloatArray, FloatArray],
    cell: CellConfig,
    feed: float,
    knots: int = KNOTS,
) -> tuple[float, float]:
    """Motion time and the optimum, s."""
    coef, ends, lengths = curve
    rows, pool = curve_rows(coef, ends, lengths, feed)
    engine = Engine(cell, window=120, jerk=False)
    assert engine.push(BlockBatch(rows, pool)) == len(rows)
    engine.finish()
    while (event := engine.run(100_000)) is not Event.PROGRAM_END:
        assert event in (Event.NEED_BLOCKS, Event.DONE)
    took = engine.state.motion_time_s
    engine.close()
    limits = cell.axis_values("v_max_mm_s"), cell.axis_values("a_max_mm_s2")
    return took, optimum(coef, ends, feed, *limits, knots)
