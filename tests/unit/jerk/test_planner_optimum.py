"""The jerk-limited planner beside optima that nobody here computed: COPP over the same path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program

CORNER = "G90 G01 X7 Y0 F6000\nX7 Y7\nM30\n"
# the second corner is so sharp for its tolerance that the optimum nearly stands in it
SLOW_CORNER = "G90 G01 X-1.8784 Y-16.1039 F18000\nX2.2847 Y-15.4441\nX-14.8831 Y-14.2696\nM30\n"


@pytest.mark.parametrize("window", [30, 120, 190])
@pytest.mark.parametrize(
    ("text", "tolerance", "optimum"),
    [(CORNER, 0.01, 0.313726), (SLOW_CORNER, 0.003, 0.569978)],
)
def test_blended_corners_take_the_optimal_time(
    text: str, tolerance: float, optimum: float, window: int, tmp_path: Path
) -> None:
    """From rest over blends to rest: within 0.4 % of TOPP3, at any window, and
    within the limits.
    """
    path = tmp_path / "part.nc"
    path.write_text(text)
    result = plan_program(
        Program(path, CellConfig(), "isg", tolerance=tolerance), window=window
    )
    assert result.motion_time_s < 1.004 * optimum
    assert result.max_ratio["jerk"] < 1.02
    assert result.max_ratio["acceleration"] < 1.02


def test_blends_of_small_angles_are_resolved(tmp_path: Path) -> None:
    """A corner of 2.6 degrees within 0.003 mm: 0.3444 s on a grid five times as
    fine (before: 0.3463 s).
    """
    path = tmp_path / "part.nc"
    path.write_text("G90 G01 X4.4422 Y1.3742 F18000\nX22.9 Y8.0\nM30\n")
    result = plan_program(
        Program(path, CellConfig(), "isg", tolerance=0.003), window=120
    )
    assert result.motion_time_s < 0.3453
    assert result.max_ratio["jerk"] < 1.02


# a spiral of 2 mm chords within 0.03 mm: its curvature swells at every corner of the polygon
UNEQUAL = CellConfig(
    axes={
        n: AxisConfig(j_max_mm_s3=j)
        for n, j in (("X", 50000.0), ("Y", 5000.0), ("Z", 20000.0))
    }
)


@pytest.mark.parametrize(
    ("cell", "optimum", "worst"),
    [(CellConfig(), 0.874589, 1.011), (UNEQUAL, 1.230657, 1.06)],
)
def test_swelling_curvature_is_resolved(
    cell: CellConfig, optimum: float, worst: float, tmp_path: Path
) -> None:
    """Where third derivatives vary and a slow axis turns round beside a quick
    one (the grid before: 1.6, 18 %).
    """
    s = np.arange(1, 31) * 2.0
    start = 6.95950
    turn, r = s / start, start * (1.0 - 0.4 * s / 60.0)
    points = zip(r * np.sin(turn), start - r * np.cos(turn), strict=True)
    path = tmp_path / "part.nc"
    path.write_text(
        "G90 G01 F18000\n"
        + "".join(f"X{x:.4f} Y{y:.4f}\n" for x, y in points)
        + "M30\n"
    )
    result = plan_program(
        Program(path, cell, "isg", tolerance=0.03), window=120
    )
    assert result.motion_time_s < worst * optimum
    assert result.max_ratio["jerk"] < 1.02


@pytest.mark.ci_cases
@pytest.mark.parametrize("cycle_ms", [0.25, 0.5, 1.0])
def test_jerk_between_the_ends_of_an_interval(
    cycle_ms: float, tmp_path: Path
) -> None:
    """A line into a steep helix within 0.1 mm: the jerk is larger inside one
    interval than at its ends.
    """
    (tmp_path / "a.ngc").write_text(
        "G21 G90 G19\nG1 X95.780406 Y-3.87026 Z-126.631358 F8713\nG1 X134.642275 Y-22.304956\n"
        "G3 Y-22.028073 Z-124.000048 X136.98457 J0.234256 K1.305573 F21980\nM30\n"
    )
    cell = CellConfig(cycle_s=cycle_ms * 1e-3)
    result = plan_program(
        Program(tmp_path / "a.ngc", cell, "iso", tolerance=0.1),
        window=120,
        jerk=True,
    )
    assert result.max_ratio["jerk"] <= 1.0125


def test_a_jerk_limit_that_nobody_sees_is_like_a_large_one(
    tmp_path: Path,
) -> None:
    """Full acceleration within nanoseconds: planned at once, as quick as within
    a third of a cycle.
    """
    (tmp_path / "a.nc").write_text("G1 X1 F6000\nY1\nX3 Y1.2\nX4 Y1.8\nM30\n")
    times = []
    for jerk in (9e6, 9e11):
        axis = {"v_max_mm_s": 300.0, "a_max_mm_s2": 3000.0, "j_max_mm_s3": jerk}
        cell = CellConfig(axes={"X": axis, "Y": axis, "Z": axis})  # type: ignore[dict-item]
        program = Program(tmp_path / "a.nc", cell, "isg", tolerance=0.01)
        times.append(plan_program(program, window=120, jerk=True).motion_time_s)
    assert times[1] <= times[0] * 1.001
