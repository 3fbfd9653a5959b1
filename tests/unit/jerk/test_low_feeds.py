"""Low feeds and large steps of the feed under a jerk limit, beside the shortest
time in closed form.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program

# of the built-in cell; steps of the feed stay below those that reach its
# acceleration
JERK = 50_000.0


def lost(slow: float, fast: float) -> float:
    """Least time (s) that a step between two speeds (mm/s) costs beside both of them
    held to its place. The slower block may lend speed: it dips, so that the
    acceleration is there already when the faster block begins. The dip has the jerk
    -J over a time t and then J until the speed is back.
    """
    t = np.linspace(0.0, np.sqrt(slow / JERK), 20_001)
    dip = (2.0 + np.sqrt(2.0)) * t
    back = (1.0 + np.sqrt(2.0)) * t
    below = JERK * (
        t**3 / 6.0 + t**2 * back / 2.0 + t * back**2 / 2.0 - back**3 / 6.0
    )
    a0 = JERK * (dip - 2.0 * t)
    peak = np.sqrt(JERK * (fast - slow) + a0**2 / 2.0)
    rise, fall = (peak - a0) / JERK, peak / JERK
    middle = slow + (a0 + peak) / 2.0 * rise
    way = (
        slow * rise
        + a0 * rise**2 / 2.0
        + JERK * rise**3 / 6.0
        + middle * fall
        + peak * fall**2 / 2.0
        - JERK * fall**3 / 6.0
    )
    costs = rise + fall - way / fast
    if slow > 0.0:
        costs += below / slow
    return float(costs[peak >= a0].min())


def shortest(blocks: list[tuple[float, float]]) -> float:
    """Time over collinear blocks (mm, mm/s) from rest to rest, each so long that
    neither of its steps reaches the other.
    """
    feeds = [0.0, *(v for _, v in blocks), 0.0]
    steps = sum(lost(min(a, b), max(a, b)) for a, b in pairwise(feeds))
    return sum(length / v for length, v in blocks) + steps


@pytest.mark.parametrize("window", [30, 120])
@pytest.mark.parametrize(
    "blocks",
    [
        [(0.1, 10), (1, 60), (0.1, 10)],
        [(1, 10), (9, 1000), (1, 10)],
        [(0.5, 2), (1, 10)],
        [(1, 5), (9, 30), (1, 5)],
        [(0.0137, 5), (0.5, 30)],
        [(0.02, 10), (0.5, 40), (0.02, 10)],
        [(2, 60), (5, 61), (2, 60)],
        [(0.3, 20), (3, 600), (0.3, 50), (3, 200)],
    ],
)
def test_low_feeds_are_left_at_once(
    blocks: list[tuple[float, float]], window: int, tmp_path: Path
) -> None:
    """mm/min of 2 to 3000: within 1 % of the shortest time, and no feed is exceeded."""
    mm_s = [(length, feed / 60.0) for length, feed in blocks]
    ends = np.cumsum([length for length, _ in blocks])
    lines = [
        f"G1 X{x:.4f} F{feed}"
        for x, (_, feed) in zip(ends, blocks, strict=True)
    ]
    (tmp_path / "a.nc").write_text("\n".join(["G90", *lines, "M30"]))
    result = plan_program(
        Program(tmp_path / "a.nc", CellConfig(), "isg"),
        window=window,
        jerk=True,
    )
    best = shortest(mm_s)
    assert 0.999 * best <= result.motion_time_s <= 1.01 * best
    assert result.max_ratio["feed"] <= 1.0015
    assert result.max_ratio["jerk"] <= 1.0125


@pytest.mark.parametrize(
    ("v", "a", "j"), [(500.0, 10000.0, 200000.0), (1000.0, 20000.0, 1e6)]
)
def test_a_low_feed_is_held_on_a_circle(
    v: float, a: float, j: float, tmp_path: Path
) -> None:
    """On stiff machines it fell to a third every few seconds: the plan was made anew when a
    stopping way was left of it, and the last of its intervals are longer than that.
    """
    axis = AxisConfig(v_max_mm_s=v, a_max_mm_s2=a, j_max_mm_s3=j)
    cell = CellConfig(axes=dict.fromkeys("XYZ", axis))
    path = tmp_path / "circle.nc"
    path.write_text("G17 G3 I-2 J0 X0 Y0 F60\nM30\n")
    plan = plan_program(Program(path, cell), keep_samples=True)
    assert plan.samples is not None
    steps = np.diff(plan.samples["pos"], axis=0)
    speed = np.linalg.norm(steps, axis=1) / cell.cycle_s
    assert speed[60:-60].min() >= 0.99
