"""The planner's CPU time for each ms of motion that it commits."""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.engine.causes import planner_pace
from support.inside import Inside

TEXT = "G01 X10 Y2 F6000\nX20 Y0\nG02 X30 Y10 I0 J10\n"
WITHOUT_JERK = "".join(f"[axes.{name}]\nj_max_mm_s3 = 0.0\n" for name in "XYZ")


@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "acceleration"])
def test_quantiles_are_in_order_and_begin_at_zero(
    tmp_path: Path, jerk: bool
) -> None:
    """Zeros ahead of the first commit, then half, 99 of 100 and all commits."""
    with Inside(tmp_path, TEXT, "" if jerk else WITHOUT_JERK) as cnc:
        assert set(planner_pace(cnc.engine.state).values()) == {0.0}
        cnc.end()
        pace = planner_pace(cnc.engine.state)
        assert 0.0 < pace["p50"] <= pace["p99"] <= pace["max"]
