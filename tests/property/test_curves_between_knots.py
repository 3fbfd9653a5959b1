"""Polynomials without jerk: legal on splines that are made to break it, and as
fast as the limits of the axes allow.
"""

from __future__ import annotations

import contextlib
import itertools
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from cnc_core.blocks import BlockBatch
from cnc_core.config import CellConfig
from cnc_core.engine import Engine
from cnc_core.errors import CncError
from support.curve_pieces import cell_of, pieces
from support.drive import FloatArray, curve_rows, drive
from support.limits import ratios
from support.seeds import few

pytestmark = pytest.mark.sanitize("curve", "engine")

ROUNDING = 1.0 + 1e-9


def hostile(rng: np.random.Generator, kind: str) -> PPoly:
    """A C2 or C4 spline whose curvature changes within micrometres somewhere, in any parameter."""
    n = int(rng.integers(6, 16))
    steps = rng.normal(size=(n, 3))
    if kind == "micrometres":
        steps *= rng.lognormal(-6.0, 1.5, (n, 1))
    elif kind == "all scales":
        steps *= 10 ** rng.uniform(-4, 1, (n, 1))
    elif kind == "noise":
        steps = np.column_stack(
            [
                rng.uniform(0.01, 2, n),
                rng.normal(size=(n, 2)) * 10 ** rng.uniform(-5, -1),
            ]
        )
    points = np.cumsum(steps, axis=0)
    if kind == "cusps":
        points[::2] += 10 ** rng.uniform(-3, 0)
        points[:, 1:] *= 10 ** rng.uniform(-3, 0)
    points -= points[0]
    chords = np.maximum(np.linalg.norm(np.diff(points, axis=0), axis=1), 1e-6)
    t = np.concatenate(
        [[0.0], np.cumsum(chords ** rng.choice([0.0, 0.5, 1.0]))]
    )
    if rng.random() < 0.5:
        return CubicSpline(t, points)
    each = [
        PPoly.from_spline(make_interp_spline(t, column, k=5))
        for column in points.T
    ]
    return PPoly(np.stack([p.c for p in each], axis=2), each[0].x)


def taken(rng: np.random.Generator, kind: str) -> tuple[Any, FloatArray]:
    """(rows, pool) of the first spline drawn that is not too wild for the
    engine: of the others it says so.
    """
    while True:
        coef, ends, lengths = pieces(hostile(rng, kind))
        rows, pool = curve_rows(
            coef, ends, lengths, float(rng.choice([20.0, 100.0, 2000.0]))
        )
        with contextlib.suppress(CncError):
            if Engine(CellConfig()).push(BlockBatch(rows, pool)) == len(rows):
                return rows, pool


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(8), 2))
@pytest.mark.parametrize(
    "kind", ["micrometres", "all scales", "noise", "cusps"]
)
@pytest.mark.parametrize(
    "live", [False, True], ids=["steady", "override and hold"]
)
def test_hostile_splines_are_driven_legally(
    seed: int, kind: str, live: bool
) -> None:
    """Whatever the curvature does, and wherever it is stopped: no sample above
    a limit, to the exact end.
    """
    rng = np.random.default_rng(seed)
    rows, pool = taken(rng, kind)
    cell = cell_of(rng)

    def change(_k: int, engine: Engine) -> None:
        engine.set_override(
            float(rng.choice([0.0, 0.1, 0.3, 1.0, 1.3, 2.0])),
            bool(rng.random() < 0.15),
        )

    step = int(rng.choice([7, 19, 41]))
    window = int(rng.choice([30, 120]))
    pos, state = drive(
        rows,
        cell,
        window,
        *((step, change) if live else ()),
        pool=pool,
        jerk=False,
    )
    velocity, acceleration = ratios(pos, cell, jerk=False)
    assert velocity <= ROUNDING
    assert acceleration <= 1.0
    assert (pos[-1] == rows["end"][-1][:3]).all()
    assert state.infeasible == 0


@pytest.mark.parametrize("seed", few(range(4), 2))
@pytest.mark.parametrize(
    "kind", ["micrometres", "all scales", "noise", "cusps"]
)
def test_hostile_splines_in_a_wide_window(seed: int, kind: str) -> None:
    """Beyond 512 motions a piece has 64 stretches at most: coarser, as legal.
    Under ASan: in the room for them.
    """
    rng = np.random.default_rng(seed)
    rows, pool = taken(rng, kind)
    cell = cell_of(rng)
    pos, state = drive(rows, cell, 600, pool=pool, jerk=False)
    velocity, acceleration = ratios(pos, cell, jerk=False)
    assert velocity <= ROUNDING
    assert acceleration <= 1.0
    assert (pos[-1] == rows["end"][-1][:3]).all()
    assert state.infeasible == 0


def derivatives(
    coef: FloatArray, ends: FloatArray, n: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(path length, q', q'') by length at n places of every piece, by the
    trapezoidal rule over 16 times as many.
    """
    places, first, second = [0.0], [], []
    powers = np.arange(coef.shape[2])
    for c, end in zip(coef, ends, strict=True):
        u = np.linspace(0.0, end, 16 * n + 1)
        one = (c[:, 1:] * powers[1:]) @ u ** powers[:-1, None]
        two = (c[:, 2:] * (powers[2:] * powers[1:-1])) @ u ** powers[:-2, None]
        speed = np.linalg.norm(one, axis=0)
        along = (one * two).sum(axis=0) / speed
        way = np.concatenate(
            [[0.0], np.cumsum(np.diff(u) * (speed[1:] + speed[:-1]) / 2)]
        )[::16]
        skip = 1 if first else 0
        places.extend(places[-1] + way[1:])
        first.append((one / speed).T[::16][skip:])
        second.append(((two - one / speed * along) / speed**2).T[::16][skip:])
    return np.array(places), np.vstack(first), np.vstack(second)


def shortest_time(
    s: FloatArray,
    d1: FloatArray,
    d2: FloatArray,
    feed: float,
    v: FloatArray,
    a: FloatArray,
) -> float:
    """Over the grid: backwards the largest x = v^2 among all corners of what
    the axes allow, forwards the largest u.
    """
    cap = np.minimum(
        feed**2, ((v / np.maximum(np.abs(d1), 1e-9)) ** 2).min(axis=1)
    )
    need, pairs = (
        np.zeros(len(s)),
        np.array(list(itertools.combinations(range(2 * len(a) + 4), 2))),
    )
    for k in range(len(s) - 2, -1, -1):
        h = s[k + 1] - s[k]
        rows = np.array(
            [[2 * h, 1.0], [-2 * h, -1.0], [0.0, 1.0], [0.0, -1.0]]
        )  # over (u, x)
        rows = np.vstack(
            [
                np.column_stack([d1[k], d2[k]]),
                -np.column_stack([d1[k], d2[k]]),
                rows,
            ]
        )
        most = np.concatenate([a, a, [need[k + 1], 0.0, cap[k], 0.0]])
        one, other = rows[pairs[:, 0]], rows[pairs[:, 1]]
        det = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
        good = np.abs(det) > 1e-14
        b0, b1, det = (
            most[pairs[:, 0]][good],
            most[pairs[:, 1]][good],
            det[good],
        )
        u = (b0 * other[good, 1] - b1 * one[good, 1]) / det
        x = (b1 * one[good, 0] - b0 * other[good, 0]) / det
        slack = 1e-9 * (1.0 + np.abs(most))
        allowed = (
            rows[:, :1] * u + rows[:, 1:] * x <= (most + slack)[:, None]
        ).all(axis=0)
        need[k] = x[allowed].max()
    x = np.zeros(len(s))
    for k in range(len(s) - 1):
        with np.errstate(divide="ignore"):
            u = ((a - np.sign(d1[k]) * d2[k] * x[k]) / np.abs(d1[k])).min()
        x[k + 1] = min(need[k + 1], max(0.0, x[k] + 2 * (s[k + 1] - s[k]) * u))
    v_at = np.sqrt(x)
    return float((2 * np.diff(s) / (v_at[1:] + v_at[:-1])).sum())


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(4), 2))
def test_a_spline_takes_the_shortest_time(seed: int) -> None:
    """Within 1 % of the optimum over a fine grid: feed, axis speeds and
    accelerations bind in turn.
    """
    rng = np.random.default_rng(seed)
    points = np.cumsum(
        rng.normal(size=(8, 3)) * 6.0 + np.array([4.0, 0.0, 0.0]), axis=0
    )
    points -= points[0]
    t = np.concatenate(
        [
            [0.0],
            np.cumsum(np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))),
        ]
    )
    coef, ends, lengths = pieces(CubicSpline(t, points))
    feed, cell = float(rng.choice([100.0, 300.0, 2000.0])), CellConfig()
    rows, pool = curve_rows(coef, ends, lengths, feed)
    pos, state = drive(rows, cell, 120, pool=pool, jerk=False)
    limits = cell.axis_values("v_max_mm_s"), cell.axis_values("a_max_mm_s2")
    assert state.motion_time_s <= 1.01 * shortest_time(
        *derivatives(coef, ends, 400), feed, *limits
    )
    assert max(ratios(pos, cell, jerk=False)) <= ROUNDING
