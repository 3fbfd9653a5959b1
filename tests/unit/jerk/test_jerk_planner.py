"""The jerk-limited planner: times against stored optima, holds, overrides,
refusals, evaluation of the laws.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cnc_core.benchmarks.jerk_paths import (
    Chain,
    Knots,
    Line,
    by_length,
    contour,
    raster_line,
)
from cnc_core.engine.jerk_planner import (
    JerkPlanner,
    Limits,
    Topp2,
    ffi,
    lib,
    run,
    sample,
)
from cnc_core.errors import CncError

pytestmark = pytest.mark.sanitize("jerk")

LIMITS = {
    n: Limits([300.0] * n, [3000.0] * n, [50000.0] * n) for n in (1, 2, 3)
}


def line(length: float, feed: float) -> npt.NDArray[Any]:
    """One straight interval along the first of three axes."""
    return Chain(
        [Line(np.zeros(3), np.array([1.0, 0.0, 0.0]), length)], [feed], [False]
    ).intervals()


def rest_to_rest(length: float, v: float, a: float, j: float) -> float:
    """Shortest time of a straight move from rest to rest, by the formulas of
    the seven-phase profile.
    """
    ramp = min(a, np.sqrt(v * j))
    if length >= v * (v / ramp + ramp / j):
        return float(length / v + v / ramp + ramp / j)
    if length >= 2 * a**3 / j**2:
        top = -(a**2) / (2 * j) + np.sqrt((a**2 / (2 * j)) ** 2 + a * length)
        return float(2 * (top / a + a / j))
    return float(4 * (length / (2 * j)) ** (1 / 3))


@pytest.mark.parametrize("length", [0.01, 0.3, 2.0, 10.0, 80.0])
@pytest.mark.parametrize("feed", [20.0, 100.0, 300.0])
def test_straight_move_is_nearly_time_optimal(
    length: float, feed: float
) -> None:
    """A move from rest to rest takes at most 3 % longer than the seven-phase
    optimum (the grid is finite).
    """
    planner = JerkPlanner(LIMITS[3], window=190, knots=400)
    laws = run(planner, line(length, feed))
    best = rest_to_rest(length, min(feed, 300.0), 3000.0, 50000.0)
    assert best * 0.995 <= laws["time"].sum() <= best * 1.03


# Optima of COPP 0.2.3 (copp-py: TOPP3 and TOPP2): `python bench/planner_reference.py`.
REFERENCE_TOPP3 = {("raster", 100.0): 1.13185, ("raster", 300.0): 0.65198}
REFERENCE_TOPP2 = {("raster", 100.0): 1.07514, ("raster", 300.0): 0.49115}


@pytest.mark.parametrize("window", [120, 190])
@pytest.mark.parametrize("feed", [100.0, 300.0])
def test_raster_line_against_the_optimum(feed: float, window: int) -> None:
    """One line of the raster takes at most 1.003 of the jerk-limited optimum,
    also where the window is short.
    """
    rows = raster_line(3, per_block=2).intervals(feed)
    rows["blocks"] = np.arange(len(rows)) % 2
    laws = run(JerkPlanner(LIMITS[3], window=window), rows)
    assert laws["time"].sum() <= 1.003 * REFERENCE_TOPP3["raster", feed]


@pytest.mark.parametrize("feed", [100.0, 300.0])
def test_acceleration_limited_against_the_optimum(feed: float) -> None:
    """The acceleration-limited planner takes at most 1.01 of the optimum."""
    planner = Topp2(LIMITS[3], window=190, capacity=4096)
    planner.push(raster_line(3).intervals(feed))
    assert (
        planner.take()["time"].sum() <= 1.01 * REFERENCE_TOPP2["raster", feed]
    )


def test_longer_windows_are_not_slower() -> None:
    """On a curve the motion time falls with the window, by no more than 3 % from 30 blocks on."""
    rows = contour(500).intervals(100.0)
    times = [
        run(JerkPlanner(LIMITS[2], window=w), rows)["time"].sum()
        for w in (30, 60, 120)
    ]
    assert times[0] <= 1.03 * times[2]
    assert times[1] <= 1.003 * times[2]


def test_passes_per_block_do_not_grow_with_length() -> None:
    """The acceleration-limited planner does a bounded number of steps a block."""
    counts = []
    for blocks in (1000, 4000):
        planner, rows, done = (
            Topp2(LIMITS[2], window=120),
            contour(blocks).intervals(100.0),
            0,
        )
        while len(planner.take(0.2)) or done < len(rows):
            done += planner.push(rows[done : done + min(1000, planner.room)])
        counts.append(planner.steps / blocks)
    assert counts[1] <= 1.1 * counts[0] < 10


@pytest.mark.parametrize("feed", [10.0, 50.0, 100.0, 300.0])
def test_hold_stops_in_the_shortest_distance(feed: float) -> None:
    """A hold from a steady speed needs at most 1.05 times the jerk-limited
    stopping distance; it can be resumed.
    """
    planner = JerkPlanner(LIMITS[3], window=120)
    planner.push(line(200.0, feed))
    planner.finish()
    before = planner.take(0.5)["length"].sum()
    planner.hold(True)
    stop = planner.take()
    ramp = min(3000.0, np.sqrt(feed * 50000.0))
    assert stop["length"].sum() <= 1.05 * 0.5 * feed * (
        feed / ramp + ramp / 50000.0
    )
    assert not len(planner.take())
    planner.hold(False)
    rest = 0.0
    while len(laws := planner.take()):
        rest += laws["length"].sum()
    assert before + stop["length"].sum() + rest == pytest.approx(
        200.0, abs=1e-9
    )


def test_reduced_override_is_met_as_soon_as_legal() -> None:
    """After a step from 100 % to 30 % the speed falls to the new feed within
    the shortest ramp, and stays there.
    """
    planner = JerkPlanner(LIMITS[3], window=120)
    planner.push(line(200.0, 100.0))
    planner.finish()
    planner.take(0.5)
    planner.override(0.3)
    states = sample(planner.take(1.0), 0.001)
    shortest = (
        70.0 * 4 / 50000.0
    ) ** 0.5  # two jerk ramps, the acceleration limit is not reached
    slow = np.argmax(states[:, 1] <= 30.0 * 1.005)
    assert slow * 0.001 <= 1.3 * shortest
    assert states[slow:, 1].max() <= 30.0 * 1.005
    assert states[slow + 50 :, 1].min() >= 29.0


def test_raised_override_is_used() -> None:
    """After a step from 100 % to 200 % the speed rises to the new feed."""
    planner = JerkPlanner(LIMITS[3], window=190)
    planner.push(line(200.0, 50.0))
    planner.finish()
    planner.take(0.5)
    planner.override(2.0)
    assert sample(planner.take(0.5), 0.001)[:, 1].max() == pytest.approx(
        100.0, rel=1e-3
    )


def test_tail_is_always_a_stop() -> None:
    """At every moment the tail leads to rest, on the path, from the state that was handed out."""
    planner, rows, done = (
        JerkPlanner(LIMITS[2], window=60),
        contour(400).intervals(100.0),
        0,
    )
    while True:
        done += planner.push(rows[done : done + 20])
        laws = planner.take(0.01)
        if not len(laws):
            break
        tail = planner.tail()
        if not len(tail):
            continue
        assert tail["v0"][0] == pytest.approx(
            sample(laws[-1:], laws["time"][-1] * (1 - 1e-12))[-1, 1], rel=1e-6
        )
        end = sample(tail[-1:], tail["time"][-1] * (1 - 1e-9))[-1]
        assert end[1] == pytest.approx(0.0, abs=1e-5)


def test_entry_is_checked() -> None:
    """Limits that are not positive, intervals without length and numbers that
    are none are refused.
    """
    with pytest.raises(CncError):
        JerkPlanner(Limits([300.0], [0.0], [50000.0]))
    with pytest.raises(CncError):
        JerkPlanner(Limits([300.0], [3000.0], [float("inf")]))
    planner = JerkPlanner(LIMITS[1])
    for name, value in (("length", 0.0), ("feed", np.nan), ("d2", np.inf)):
        rows = line(1.0, 100.0)
        rows[name] = value
        with pytest.raises(ValueError, match="refused"):
            planner.push(rows)


LAW_CASES = [
    (-4e4, 0.0, 0.0, 0.0),
    (5e4, -3e6, 0.0, 0.0),
    (0.0, 1e7, -2e9, 0.0),
    (1e-9, 1e-3, 1.0, 1e3),
    (2e4, 1e6, 3e8, -8e10),
]


@pytest.mark.parametrize(("jerk", "snap", "crackle", "pop"), LAW_CASES)
def test_law_solves_its_equation(
    jerk: float, snap: float, crackle: float, pop: float
) -> None:
    """s'' = a0 + jerk t + snap t^2/2 + crackle t^3/6 + pop t^4/24: the state
    agrees with a numerical integration.
    """
    fields = {"jerk": jerk, "snap": snap, "crackle": crackle, "pop": pop}
    law = ffi.new(
        "jerk_law *",
        {"s0": 5.0, "v0": 70.0, "a0": 200.0, "time": 0.03, **fields},
    )
    state, s, v, n = ffi.new("jerk_state *"), 5.0, 70.0, 20000
    dt = law.time / n

    def slope(t: float) -> float:
        return (
            200.0
            + jerk * t
            + snap * t**2 / 2
            + crackle * t**3 / 6
            + pop * t**4 / 24
        )

    for i in range(n):  # midpoint rule of second order is enough at this step
        v_mid = v + 0.5 * dt * slope((i + 0.25) * dt)
        s, v = s + dt * v_mid, v + dt * slope((i + 0.5) * dt)
    lib.jerk_at(law, law.time, state)
    assert state.s == pytest.approx(s, rel=1e-7)
    assert state.v == pytest.approx(v, rel=1e-6, abs=1e-6)
    assert state.a == pytest.approx(slope(law.time), rel=1e-6, abs=1e-4)


def test_what_is_left_of_a_law_is_the_same_motion() -> None:
    """A law that is cut goes on as it would have without."""
    law = ffi.new(
        "jerk_law *",
        [1, 5.0, 70.0, 200.0, 2e4, 1e6, 3e8, -8e10, 0.03, 0.0, 0, 0],
    )
    rest, whole, part = (
        ffi.new("jerk_law *", law[0]),
        ffi.new("jerk_state *"),
        ffi.new("jerk_state *"),
    )
    lib.jerk_begin_at(rest, 0.011)
    for t in (0.011, 0.02, 0.03):
        lib.jerk_at(law, t, whole)
        lib.jerk_at(rest, t - 0.011, part)
        assert (part.s, part.v, part.a) == pytest.approx(
            (whole.s, whole.v, whole.a), rel=1e-12
        )


def test_the_grid_is_as_fine_as_the_axes_that_move_ask_for() -> None:
    """An axis that stops within micrometres but does not move changes nothing:
    the others are planned as without it.
    """
    rows = contour(40, 2, per_block=2).intervals(
        100.0
    )  # the third axis of the rows stands
    quick = Limits(
        [300.0, 300.0, 20.0], [3000.0, 3000.0, 1000.0], [50000.0, 50000.0, 1e6]
    )
    assert run_stats(quick, rows) == run_stats(LIMITS[3], rows)


def test_unequal_limits_ask_for_no_more_than_the_slowest_axis_does() -> None:
    """On a slanting line an axis with 100 times the jerk of the others needs no
    finer grid than they do alone.
    """
    direction = np.array([0.8, 0.6, 0.001])
    rows = Chain(
        [Line(np.zeros(3), direction / np.linalg.norm(direction), 30.0)] * 2,
        [100.0, 99.0],
        [False] * 2,
    ).intervals()
    quick = Limits(
        [300.0, 300.0, 20.0], [3000.0, 3000.0, 1000.0], [50000.0, 50000.0, 5e6]
    )
    assert run_stats(quick, rows)[0] <= 1.1 * run_stats(LIMITS[3], rows)[0]


def run_stats(limits: Limits, rows: npt.NDArray[Any]) -> tuple[float, float]:
    """Segments handed out and motion time over the path."""
    planner = JerkPlanner(limits, window=120, knots=400)
    laws = run(planner, rows)
    return planner.stats["segments"], float(laws["time"].sum())


def _rounded_corner(radius_mm: float) -> Knots:
    """A right angle as a branch of a hyperbola, 300 radii to each side."""

    def curve(t: npt.NDArray[Any], order: int) -> npt.NDArray[Any]:
        r = np.sqrt(t**2 + radius_mm**2)
        along = (t, np.ones_like(t), 0.0 * t, 0.0 * t)[order]
        across = (
            r,
            t / r,
            radius_mm**2 / r**3,
            -3.0 * radius_mm**2 * t / r**5,
        )[order]
        return np.column_stack([along, across])

    return by_length(curve, radius_mm * np.sinh(np.linspace(-6.4, 6.4, 97)))


@pytest.mark.parametrize("radius_mm", [0.01, 0.03])
def test_steps_follow_the_speed_in_reach(radius_mm: float) -> None:
    """Steps are as long at the feed of 300 mm/s as at 50 mm/s, where the corner
    lets neither be reached: there were up to a fifth more of them.
    """
    planned = []
    for feed in (50.0, 300.0):
        planner = JerkPlanner(LIMITS[2], window=120, knots=360)
        path = _rounded_corner(radius_mm)
        laws = run(planner, path.intervals(feed))
        assert float(laws["length"].sum()) == pytest.approx(path.length)
        planned.append(len(laws))
    assert planned[0] == planned[1]
