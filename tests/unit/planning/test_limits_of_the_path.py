"""Limits along the path (``#VECTOR LIMIT``): its acceleration and jerk, wherever
it bends, and nothing else.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.benchmarks.jerk_paths import contour
from cnc_core.engine.jerk_planner import JerkPlanner, Limits, run, sample
from support.programs import ended_program, planned

CELL = """
[axes.X]
v_max_mm_s = 300
a_max_mm_s2 = 3000
j_max_mm_s3 = 50000
[axes.Y]
v_max_mm_s = 250
a_max_mm_s2 = 2000
j_max_mm_s3 = 40000
"""
NINE = "".join(
    CELL.replace("X", a).replace("Y", b)
    for a, b in (("X", "Y"), ("Z", "U"), ("V", "W"), ("A", "B"))
) + CELL.split("[axes.Y]", maxsplit=1)[0].replace("X", "C")
PER_MIN2, PER_MIN3 = 60.0**2, 60.0**3
CYCLE_S = 0.001
SPLINE = """G91 #SPLINE ON
G01 F12000 X10
X10 Y5
X5 Y5
X0.5 Y2
X5 Y-10
X10
#SPLINE OFF
G90"""


def seen_of(
    folder: Path, text: str, cell: str = CELL
) -> tuple[float, float, float]:
    """Motion time, largest acceleration and jerk of the way that is driven."""
    result = planned(ended_program(folder, text, cell))
    assert result.samples is not None
    way = result.samples["s"]
    acc = np.abs(np.diff(way, n=2)).max() / CYCLE_S**2
    jerk = np.abs(np.diff(way, n=3)).max() / CYCLE_S**3
    return result.motion_time_s, float(acc), float(jerk)


@pytest.mark.parametrize("cell", [CELL, NINE], ids=["two axes", "nine axes"])
def test_the_bend_takes_nothing_of_the_acceleration(
    tmp_path: Path, cell: str
) -> None:
    """Full circles are driven at their feed: the path alone has the limit."""
    text = (
        f"#VECTOR LIMIT ON [ACC={100 * PER_MIN2}]\nF6000\n" + "G02 I10\n" * 10
    )
    took, acc, _ = seen_of(tmp_path, text, cell)
    steady = 200 * np.pi / 100
    assert took == pytest.approx(steady + 100 / 100, rel=0.02)
    assert 99 < acc <= 100


@pytest.mark.parametrize(
    "path",
    [
        "F6000 G02 X10 Y10 R10",
        "F6000 G02 X-30.7 Y-132.3 R325.7",
        "F6000 G91 G02 X1 Y1 R1\nG03 X1 Y1 R1\nX4 Y1 R4\nG01 X10",
        SPLINE,
    ],
)
def test_the_acceleration_of_the_path(tmp_path: Path, path: str) -> None:
    """It keeps its limit on arcs and splines, and uses it."""
    text = f"#VECTOR LIMIT ON [ACC={800 * PER_MIN2}]\n{path}\n"
    _, acc, _ = seen_of(tmp_path, text)
    assert 0.98 * 800 < acc <= 800 * 1.002


@pytest.mark.parametrize(
    ("acc", "times"), [(0.5, 1.8), (5.0, 1.2), (20.0, 1.1), (100.0, 1.02)]
)
def test_a_small_acceleration_alone_is_used(
    tmp_path: Path, acc: float, times: float
) -> None:
    """The way to rest is long and bent: no creeping, and no search without end.
    Windows hold less of it than there is where it is longest.
    """
    limit = f"#VECTOR LIMIT ON [ACC={acc * PER_MIN2}]\nF6000\n"
    way = 20 * 20 * np.pi
    took, seen, _ = seen_of(tmp_path, limit + "G02 I10\n" * 20)
    least = way / 100 + 100 / acc if way > 1e4 / acc else 2 * np.sqrt(way / acc)
    assert took <= least * times
    assert seen <= acc * 1.02


@pytest.mark.parametrize("jerk", [50.0, 1000.0, 10000.0])
def test_the_jerk_of_the_path(tmp_path: Path, jerk: float) -> None:
    """Little jerk means a long way to rest: the window holds it, and no more
    than a half of the time is added.
    """
    limit = f"#VECTOR LIMIT ON [JERK={jerk * PER_MIN3}]\n"
    circles = "F6000\n" + "G02 I10\n" * 10
    took, _, seen = seen_of(tmp_path, limit + circles)
    assert seen <= jerk * 1.02
    least = 2 * np.pi + 2 * np.sqrt(100 / jerk)
    assert took <= least * 1.05


def test_behind_the_limit_all_is_as_before(tmp_path: Path) -> None:
    """A line ahead of the limit and one behind it take what they take without it."""
    line = "G01 X100 F12000\n#FLUSH\n"
    limit = f"#VECTOR LIMIT ON [ACC={500 * PER_MIN2} JERK={9e3 * PER_MIN3}]\n"
    off = "#VECTOR LIMIT OFF ALL\n"
    back = "G02 X0 Y0 R60\n#FLUSH\n"
    alone = seen_of(tmp_path, line)[0]
    limited = seen_of(tmp_path, f"G00 X100\n#FLUSH\n{limit}{off}{line}")[0]
    ahead = seen_of(tmp_path, "G00 X100\n#FLUSH\n" + line)[0]
    assert limited == ahead
    bent = seen_of(tmp_path, f"{line}F12000 {back}")[0] - alone
    slow = seen_of(tmp_path, f"{line}{limit}F12000 {back}")[0] - alone
    both = seen_of(tmp_path, f"{line}{limit}F12000 {back}{off}{line}")[0]
    assert slow > bent * 1.05
    assert both == pytest.approx(2 * alone + slow, abs=2e-3)


@pytest.mark.parametrize("seed", range(6))
def test_under_orders_the_path_keeps_its_limits(seed: int) -> None:
    """Overrides and holds at any moment; every other stretch has limits."""
    rng = np.random.default_rng(seed)
    path = contour(600, 2, per_block=2).intervals(100.0)
    limited = np.arange(len(path)) // 40 % 2 == 1
    path["d1"][:, :, 2] = 1.0
    path["path_acc"][limited] = 400
    path["path_jerk"][limited] = 8000
    planner = JerkPlanner(Limits([300.0] * 2, [3000.0] * 2, [5e4] * 2))
    assert planner.push(path) == len(path)
    planner.finish()
    driven = 0.0
    for _ in range(4000):
        laws = planner.take(rng.uniform(0.004, 0.2))
        for law in laws:
            here = path[np.searchsorted(path["tag"], law["tag"])]
            if here["path_acc"] > 0:
                state = sample(np.array([law]), float(law["time"]) / 7)
                assert np.abs(state[:, 2]).max() <= 400 * 1.02
                jerk = np.abs(np.diff(state[:, 2])) / (law["time"] / 7)
                assert len(jerk) == 0 or jerk.max() <= 8000 * 1.02
            driven += law["length"]
        planner.override(float(rng.uniform(0.1, 1.5)))
        planner.hold(bool(rng.random() < 0.1))
        if driven >= path["length"].sum() - 1e-6:
            break
    assert driven == pytest.approx(path["length"].sum())


def test_a_limit_that_binds_nowhere_changes_nothing() -> None:
    """The path's own limit far above what the axes allow: the same time."""
    limits = Limits([300.0] * 2, [3000.0] * 2, [5e4] * 2)
    path = contour(300, 2, per_block=2).intervals(100.0)
    free = run(JerkPlanner(limits), path)["time"].sum()
    path["d1"][:, :, 2] = 1.0
    path["path_acc"] = 1e5
    path["path_jerk"] = 1e7
    assert run(JerkPlanner(limits), path)["time"].sum() == pytest.approx(
        free, rel=1e-3
    )
