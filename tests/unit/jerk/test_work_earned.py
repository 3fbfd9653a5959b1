"""Planning takes what motion has earned: on paths where windows fail or are dear the
plan is made anew more seldom, and the stored tail is driven meanwhile.
"""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core import plain
from cnc_core.benchmarks.jerk_paths import Knots, by_length
from cnc_core.engine.jerk_planner import JerkPlanner, Limits, run
from cnc_core.units import FloatArray

WORK_PER_S, WORK_KEPT = 1.8e5, 1e5
"""WINDOW_WORK_PER_S and WORK_KEPT of the planner's tuning table."""
PERIOD_MM, HEIGHT_MM = 0.3, 0.03
UNEQUAL = Limits([300.0, 300.0], [3000.0, 3000.0], [1.18e6, 8558.0])


def _wave(periods: int, height_mm: float = HEIGHT_MM) -> Knots:
    """A fine wave along the quick axis, across the slow one."""
    rate = 2.0 * np.pi / PERIOD_MM

    def curve(t: FloatArray, order: int) -> FloatArray:
        along = t if order == 0 else np.full_like(t, 1.0 if order == 1 else 0.0)
        turn = order * np.pi / 2
        across = height_mm * rate**order * plain.sines(rate * t + turn)
        return np.column_stack([along, across])

    return by_length(
        curve, np.linspace(0.0, periods * PERIOD_MM, 24 * periods + 1)
    )


@pytest.mark.ci
@pytest.mark.parametrize(("periods", "most_s"), [(20, 1.81), (200, 17.9)])
def test_windows_take_no_more_work_than_motion_earns(
    periods: int, most_s: float
) -> None:
    """Jerk limits 138 times apart on a wave of 0.3 mm: iterations times intervals, and
    what comes beside them, stay below what was there at first and what motion earns.
    The wave takes no longer than with three times as much.
    """
    planner = JerkPlanner(UNEQUAL, window=120, knots=360)
    path = _wave(periods)
    laws = run(planner, path.intervals(100.0))
    time_s = float(laws["time"].sum())
    assert abs(float(laws["length"].sum()) - path.length) < 1e-6
    assert time_s <= most_s
    assert planner.stats["spent"] <= WORK_KEPT + WORK_PER_S * time_s


def test_a_guess_near_the_limits_finds_its_solution() -> None:
    """Jerk limits ten times apart on that wave, in twelve heights that differ by
    rounding: every window is solved.  From a guess that knew nothing of the
    path jerk three of twenty were not.
    """
    limits = Limits([300.0, 300.0], [3000.0, 3000.0], [2e5, 2e4])
    solves = failed = 0
    for case in range(12):
        planner = JerkPlanner(limits, window=120, knots=360)
        path = _wave(20, HEIGHT_MM * (1.0 + 1e-9 * case))
        laws = run(planner, path.intervals(100.0))
        assert abs(float(laws["length"].sum()) - path.length) < 1e-6
        solves += planner.stats["solves"]
        failed += planner.stats["failed"]
    assert solves > 60
    assert failed == 0


def test_an_interval_counts_for_more_with_more_axes() -> None:
    """What an interval takes grows with the axes: with six it counts for 7/4 of one
    with up to three.  The four others move along by a thousandth, far below
    their limits, so that the plan stays the same.
    """
    ample, work = [1e3, 1e5, 1e7], {}
    path = _wave(20)
    for others in (0, 1, 4):
        limits = Limits(
            *(
                [limit, limit] + [more] * others
                for limit, more in zip([300.0, 3000.0, 1e5], ample, strict=True)
            )
        )
        along = [
            np.column_stack([d] + [1e-3 * d[:, 0]] * others)
            for d in (path.q, path.d1, path.d2, path.d3)
        ]
        planner = JerkPlanner(limits, window=120, knots=360)
        run(planner, Knots(path.s, *along).intervals(100.0))
        work[others] = planner.stats["work"]
    assert work[1] == pytest.approx(work[0], rel=0.05)
    assert work[4] == pytest.approx(7 / 4 * work[0], rel=0.05)
