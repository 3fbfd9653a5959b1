"""Motion times of planners nobody here wrote: COPP (TOPP2, TOPP3) and toppra,
offline, over the whole path.
"""

from __future__ import annotations

from typing import Any

import copp_py as copp
import numpy as np

from cnc_core.benchmarks.jerk_paths import Knots as Path
from cnc_core.engine.jerk_planner import FloatArray

UNLIMITED = 1e9


def _robot(
    path: Path,
    feed: float | FloatArray,
    v: FloatArray,
    a: FloatArray,
    j: FloatArray | None,
) -> Any:
    n, axes = path.q.shape
    robot = copp.Robot(axes, capacity=n)
    robot.append_s(path.s)
    if j is None:
        robot.set_q(path.q, path.d1, path.d2, 0)
    else:
        robot.set_q(path.q, path.d1, path.d2, 0, dddq=path.d3)
    robot.add_velocity_limits(v, -v, start_idx_s=0, length=n)
    robot.add_acceleration_limits(a, -a, start_idx_s=0, length=n)
    if j is not None:
        robot.add_jerk_limits(j, -j, start_idx_s=0, length=n)
    robot.constraints.add_constraint_1st(
        np.broadcast_to(feed, n)[:, None] ** 2, 0
    )
    return robot


def topp2_profile(
    path: Path, feed: float | FloatArray, v: FloatArray, a: FloatArray
) -> FloatArray:
    """x = (ds/dt)^2 at the knots, limited by velocity and acceleration; feed:
    one, or one a knot.
    """
    robot = _robot(path, feed, v, a, None)
    problem = copp.solver.topp2_ra.Problem(
        robot.constraints,
        idx_s_interval=(0, len(path.s) - 1),
        a_boundary=(0.0, 0.0),
    )
    return np.asarray(
        copp.solver.topp2_ra.solve(problem, copp.solver.topp2_ra.Options())
    )


def topp2_time(
    path: Path, feed: float | FloatArray, v: FloatArray, a: FloatArray
) -> float:
    """Motion time limited by velocity and acceleration."""
    return float(
        copp.interpolation.s_to_t_topp2(
            path.s, topp2_profile(path, feed, v, a), 0.0
        )[0]
    )


def topp2_time_by_middles(
    path: Path, feed: FloatArray, v: FloatArray, a: FloatArray
) -> float:
    """The same with every other knot as the middle of an interval, where
    accelerations are limited: of second order, and q'' may jump at the knots
    left. |q' u + q'' (x + 2 h u)| <= a, h: from the knot to the middle.
    """
    knots = slice(None, None, 2)
    d1, d2 = path.d1[1::2], path.d2[1::2]
    s = path.s[knots]
    before, middle = path.s[:-1:2], path.s[1::2]
    half = (middle - before)[:, None]
    middles = (d1 + 2.0 * half * d2, d2)
    rows = (np.vstack([row, row[-1:]]) for row in middles)
    slopes = np.maximum(np.abs(path.d1[knots]), 1e-12)
    cap = np.minimum(feed[knots], (v / slopes).min(axis=1))
    shifted = Path(s, path.q[knots], *rows, path.d3[knots])
    return topp2_time(shifted, cap, np.full(len(v), UNLIMITED), a)


def topp3_time(
    path: Path,
    feed: float,
    v: FloatArray,
    a: FloatArray,
    j: FloatArray,
    rounds: int = 20,
) -> float:
    """Motion time limited by velocity, acceleration and jerk: linearised again
    until the time stands still.

    Both of COPP's solvers, from two starts; the shortest time counts.
    """
    full = topp2_profile(path, feed, v, a)
    starts = [
        (solver, scale)
        for solver in (copp.solver.topp3_lp, copp.solver.topp3_socp)
        for scale in (1.0, 0.3)
    ]
    return min(
        _topp3(path, feed, v, a, j, rounds, solver, full * scale)
        for solver, scale in starts
    )


def _topp3(
    path: Path,
    feed: float,
    v: FloatArray,
    a: FloatArray,
    j: FloatArray,
    rounds: int,
    solver: Any,
    profile_a: FloatArray,
) -> float:
    best, profile_b = np.inf, None
    for _ in range(rounds):
        problem = solver.Problem(
            _robot(path, feed, v, a, j).constraints,
            np.maximum(profile_a, 1e-6),
            a_boundary=(0.0, 0.0),
            b_boundary=(0.0, 0.0),
            num_stationary_max=1,
            b_linearization=profile_b,
        )
        try:
            profile = solver.solve(problem)
            profile.force_positive_a(path.s)
        except copp.CoppError:
            return best
        time = float(copp.interpolation.s_to_t_topp3(path.s, profile, 0.0)[0])
        profile_a, profile_b = np.asarray(profile.a), np.asarray(profile.b)
        if abs(best - time) < 1e-6 * time:
            return min(best, time)
        best = min(best, time)
    return best
