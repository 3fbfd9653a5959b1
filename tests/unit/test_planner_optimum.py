"""The jerk-limited planner beside optima of COPP over the same path (``bench/planner_parts.py``)."""

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
@pytest.mark.parametrize(("text", "tolerance", "optimum"), [(CORNER, 0.01, 0.313726), (SLOW_CORNER, 0.003, 0.569978)])
def test_blended_corners_take_the_optimal_time(
    text: str, tolerance: float, optimum: float, window: int, tmp_path: Path
) -> None:
    """From rest over blends to rest: within 0.4 % of TOPP3, at any window, and within the limits."""
    path = tmp_path / "part.nc"
    path.write_text(text)
    result = plan_program(Program(path, CellConfig(), "isg", tolerance=tolerance), window=window)
    assert result.motion_time_s < 1.004 * optimum
    assert result.max_ratio["jerk"] < 1.02
    assert result.max_ratio["acceleration"] < 1.02


def test_blends_of_small_angles_are_resolved(tmp_path: Path) -> None:
    """A corner of 2.6 degrees within 0.003 mm: 0.3444 s on a grid five times as fine (before: 0.3463 s)."""
    path = tmp_path / "part.nc"
    path.write_text("G90 G01 X4.4422 Y1.3742 F18000\nX22.9 Y8.0\nM30\n")
    result = plan_program(Program(path, CellConfig(), "isg", tolerance=0.003), window=120)
    assert result.motion_time_s < 0.3453
    assert result.max_ratio["jerk"] < 1.02


# a spiral of 2 mm chords within 0.03 mm: its curvature swells at every corner of the polygon
UNEQUAL = CellConfig(axes={n: AxisConfig(j_max_mm_s3=j) for n, j in (("X", 50000.0), ("Y", 5000.0), ("Z", 20000.0))})


@pytest.mark.parametrize(("cell", "optimum", "worst"), [(CellConfig(), 0.874589, 1.011), (UNEQUAL, 1.230657, 1.06)])
def test_swelling_curvature_is_resolved(cell: CellConfig, optimum: float, worst: float, tmp_path: Path) -> None:
    """Where third derivatives vary and a slow axis turns round beside a quick one (the grid before: 1.6, 18 %)."""
    s = np.arange(1, 31) * 2.0
    start = 6.95950
    turn, r = s / start, start * (1.0 - 0.4 * s / 60.0)
    points = zip(r * np.sin(turn), start - r * np.cos(turn), strict=True)
    path = tmp_path / "part.nc"
    path.write_text("G90 G01 F18000\n" + "".join(f"X{x:.4f} Y{y:.4f}\n" for x, y in points) + "M30\n")
    result = plan_program(Program(path, cell, "isg", tolerance=0.03), window=120)
    assert result.motion_time_s < worst * optimum
    assert result.max_ratio["jerk"] < 1.02
