"""An override that changes with every commit: bounded work, and a speed that
follows.
"""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core.benchmarks.jerk_paths import contour
from cnc_core.engine.jerk_planner import (
    INTERVAL,
    JerkPlanner,
    Limits,
    sample,
)

LIMITS = Limits([300.0] * 2, [3000.0] * 2, [50000.0] * 2)
COMMIT_S = 0.01
WORK_PER_S = 4e4  # iterations times intervals that a second of motion earns


def test_each_change_costs_a_few_short_solves() -> None:
    """A plan for another override looks no further than to rest."""
    planner = JerkPlanner(LIMITS, window=120, knots=400)
    planner.push(contour(600, 2, per_block=2).intervals(100.0))
    planner.finish()
    planner.take(0.3)
    most = 0.0
    before = planner.stats["iterations"]
    commits = 60
    for k in range(commits):
        planner.override(0.6 + 0.4 * np.sin(0.09 * k))
        planner.take(COMMIT_S)
        now = planner.stats["iterations"]
        most = max(most, now - before)
        before = now
    assert planner.stats["solves"] < commits
    assert most <= 250


def test_changes_that_come_all_the_time_have_a_budget() -> None:
    """The motion earns the work of their plans, and the first one does not wait."""
    planner = JerkPlanner(LIMITS, window=120, knots=400)
    planner.push(contour(600, 2, per_block=2).intervals(100.0))
    planner.finish()
    planner.take(0.3)
    planner.override(0.7)
    before = planner.stats["solves"]
    planner.take(COMMIT_S)
    assert planner.stats["solves"] > before
    work, commits = planner.stats["work"], 100
    for k in range(commits):
        planner.override(0.6 + 0.4 * np.sin(0.09 * k))
        planner.take(COMMIT_S)
    assert planner.stats["work"] - work <= 1.5 * WORK_PER_S * commits * COMMIT_S


def test_an_override_that_limits_nothing_asks_for_no_plan() -> None:
    """Bends hold the speed far below every override that is asked for: the plan
    does not depend on them, so no other one is looked for.
    """
    slow = Limits([300.0] * 2, [300.0] * 2, [3000.0] * 2)
    driven, solves = [], []
    for noise in (0.0, 0.05):
        rng = np.random.default_rng(1)
        planner = JerkPlanner(slow, window=120, knots=400)
        planner.push(contour(600, 2, per_block=2).intervals(100.0))
        planner.finish()
        laws = [planner.take(0.3)]
        while len(laws[-1]):
            planner.override(1.0 + noise * rng.normal())
            laws.append(planner.take(COMMIT_S))
        driven.append(sample(np.concatenate(laws), 0.001))
        solves.append(planner.stats["solves"])
    assert driven[0][:, 1].max() < 70.0
    assert solves[0] == solves[1]
    assert len(driven[0]) == len(driven[1])
    assert np.allclose(driven[0][:, 0], driven[1][:, 0], atol=0.01)


def _speeds_behind_a_stop(commits: int, override: float) -> list[float]:
    """At the ends of 16 commits: an override of 0 for so many, then that one.
    The axes hold the speed far below what is asked for.
    """
    planner = JerkPlanner(
        Limits([20.0] * 2, [500.0] * 2, [5000.0] * 2), window=120, knots=400
    )
    planner.push(contour(600, 2, per_block=2).intervals(400.0))
    planner.finish()
    planner.take(0.5)
    speeds = []
    for k in range(16):
        planner.override(0.0 if k < commits else override)
        laws = planner.take(COMMIT_S)
        speeds.append(float(sample(laws, 0.001)[-1, 1]))
    return speeds


@pytest.mark.parametrize("commits", [1, 4, 8])
def test_an_override_of_0_that_goes_again_ends_its_stop(commits: int) -> None:
    """The stop is no plan that stays, although it is far below both overrides."""
    stops = _speeds_behind_a_stop(commits, 0.0)
    goes_on = _speeds_behind_a_stop(commits, 1.0)
    assert stops[-1] < 0.2 * stops[0]
    assert min(goes_on[commits:]) > 0.6 * goes_on[commits - 1]
    assert goes_on[-1] > goes_on[commits]


def test_the_speed_follows_a_falling_override() -> None:
    """It falls with every change, without a standstill and without waiting for the last one."""
    planner = JerkPlanner(LIMITS, window=120, knots=400)
    planner.push(contour(600, 2, per_block=2).intervals(100.0))
    planner.finish()
    planner.take(0.3)
    share = 1.0
    for _ in range(40):
        share *= 0.95
        planner.override(share)
        laws = planner.take(COMMIT_S)
        assert len(laws)
    speed = sample(laws, 0.001)[:, 1]
    assert speed.min() > 0.0
    assert speed.max() <= 1.3 * share * 100.0


@pytest.mark.parametrize("begun_ms", [0.2, 0.4, 0.8, 3.0])
@pytest.mark.parametrize("low", [0.01, 0.05])
def test_a_change_just_behind_the_start_takes_effect(
    low: float, begun_ms: float
) -> None:
    """A line is begun under a low override, which is raised before the speed comes
    to 1 mm/s: it is not driven to its end under the low one.
    """
    line = np.zeros(1, INTERVAL)
    line["length"], line["feed"], line["blocks"] = 60.0, 100.0, 1
    line["d1"][:, :, 0] = 1.0
    planner = JerkPlanner(LIMITS, window=120)
    planner.push(line)
    planner.finish()
    planner.override(low)
    time_s = float(planner.take(0.001 * begun_ms)["time"].sum())
    planner.override(1.0)
    while len(laws := planner.take(COMMIT_S)):
        time_s += float(laws["time"].sum())
    assert time_s < 0.8


def _planned_mm(override: float, read: bool) -> float:
    """Length of the plan behind a change from 60 percent at 100 mm/s."""
    planner = JerkPlanner(LIMITS, window=400, knots=1000)
    planner.push(contour(600, 2, per_block=2).intervals(100.0))
    planner.finish()
    planner.read_plan(read)
    planner.override(0.6)
    planner.take(0.3)
    planner.override(override)
    planner.take(COMMIT_S)
    return float(planner.tail()["length"].sum())


@pytest.mark.parametrize("override", [0.2, 1.0])
def test_behind_a_change_the_plan_is_short_unless_it_is_read(
    override: float,
) -> None:
    """Three ways to rest and a tenth of a second, as the next change may come
    soon.  A PLC that reads the plan sees all that is known.
    """
    short, whole = _planned_mm(override, False), _planned_mm(override, True)
    assert 5.0 < short < 25.0
    assert whole > 30.0
