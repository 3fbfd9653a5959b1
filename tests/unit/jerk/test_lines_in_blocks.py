"""Straight lines cut into short blocks whose ends are rounded, driven exactly: their joints
turn by next to nothing and leave the jerk to the motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.engine.jerk_planner import INTERVAL, JerkPlanner, Limits
from cnc_core.planning import plan_program
from cnc_core.program import Program
from cnc_core.units import AnyArray
from support.limits import SLACK, shares

V, ACC, JERK = 300.0, 3000.0, 50000.0


def _polyline(angles: AnyArray, length: float, feed: float) -> AnyArray:
    """Lines of one length in these directions, rad."""
    lines = np.zeros(len(angles), INTERVAL)
    lines["length"], lines["feed"], lines["blocks"] = length, feed, 1
    lines["d1"][:, :, 0] = np.cos(angles)[:, None]
    lines["d1"][:, :, 1] = np.sin(angles)[:, None]
    return lines


@pytest.mark.parametrize("decimals", [5, 6])
def test_rounded_blocks_take_the_time_of_one_line(
    decimals: int, program: Callable[..., Path]
) -> None:
    """A line to the fifth decimal in blocks of 0.1 mm took 1.23 times as long: what its joints
    need at the axes' largest speed was set aside at any feed.
    """
    cell, length = CellConfig(), 10.0
    direction = np.array([math.cos(0.5), math.sin(0.5)])

    def plan(step: float) -> tuple[float, float]:
        ends = np.arange(1, round(length / step) + 1)[:, None] * step
        text = "".join(
            f"X{x:.{decimals}f} Y{y:.{decimals}f}\n"
            for x, y in ends * direction
        )
        planned = plan_program(
            Program(program(f"G1 F3000\n{text}M30\n"), cell), keep_samples=True
        )
        assert planned.samples is not None
        jerk = shares(planned.samples["pos"], cell).jerk
        return planned.motion_time_s, jerk

    in_blocks, jerk = plan(0.1)
    assert in_blocks <= 1.01 * plan(length)[0]
    assert jerk <= SLACK


@pytest.mark.parametrize("kink", [1e-5, 5e-5])
def test_a_hold_on_rounded_blocks_is_the_stop_of_one_line(kink: float) -> None:
    """It took 1.9 times the way at 5e-5 rad."""
    rng = np.random.default_rng(3)
    planner = JerkPlanner(Limits([V] * 2, [ACC] * 2, [JERK] * 2), window=120)
    planner.push(_polyline(kink * rng.normal(size=100), 0.1, 50.0))
    planner.finish()
    planner.take(0.12)
    assert planner.tail()["v0"][0] == pytest.approx(50.0, rel=1e-3)
    planner.hold(True)
    way = planner.take()["length"].sum()
    assert way <= 1.1 * 50.0 * math.sqrt(50.0 / JERK)


@pytest.mark.parametrize(
    ("feed", "over", "kink"),
    [
        (10.0, 2.0, 4e-5),
        (10.0, 4.0, 4e-5),
        (10.0, 4.0, 8e-5),
        (50.0, 2.0, 2e-5),
    ],
)
@pytest.mark.parametrize("low", [1.0, 0.5])
def test_a_lower_override_over_joints_is_met(
    feed: float, over: float, kink: float, low: float
) -> None:
    """The speed comes down from above what is asked for: joints show as they do at that speed."""
    planner = JerkPlanner(
        Limits([V] * 2, [ACC] * 2, [JERK] * 2), window=190, cycle_s=5e-4
    )
    planner.push(_polyline(kink * (-1.0) ** np.arange(2000), 0.2, feed))
    planner.override(over)
    planner.take(0.25)
    high = planner.tail()["v0"][0]
    assert high >= 0.95 * feed * over
    planner.override(low)
    planner.take(2.6 * math.sqrt((high - low * feed) / JERK) + 0.03)
    assert 0.8 * low * feed <= planner.tail()["v0"][0] <= 1.01 * low * feed
