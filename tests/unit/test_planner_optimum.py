"""The jerk-limited planner beside optima that nobody here computed: COPP over the same path (``bench/planner_parts.py``)."""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.config import CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program

CORNER = "G90 G01 X7 Y0 F6000\nX7 Y7\nM30\n"
# the second corner is so sharp for its tolerance that the optimum nearly stands in it
SLOW_CORNER = "G90 G01 X-1.8784 Y-16.1039 F18000\nX2.2847 Y-15.4441\nX-14.8831 Y-14.2696\nM30\n"


@pytest.mark.parametrize("window", [30, 120, 190])
@pytest.mark.parametrize(
    ("text", "tolerance", "optimum"), [(CORNER, 0.01, 0.313726), (SLOW_CORNER, 0.003, 0.569978)]
)
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
