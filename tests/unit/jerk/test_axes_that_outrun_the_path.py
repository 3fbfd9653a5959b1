"""Threads, winding and engraving: a rotary axis turns hundreds of degrees per
mm of path, so a mm of path is a long way.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig, parse_config
from cnc_core.engine.jerk_planner import (
    JerkPlanner,
    Limits,
    intervals_from_knots,
    run,
)
from cnc_core.planning import plan_program
from cnc_core.program import Program

LIMITS = Limits([300.0] * 4, [3000.0] * 4, [50_000.0] * 4)
# s from rest to rest beside way over speed: v/a + a/j of the built-in axis
RAMPS = 300.0 / 3000.0 + 3000.0 / 50_000.0


def _rotary() -> CellConfig:
    return parse_config(
        '[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.A]\nkind = "rotary"\n'
    )


def _curve_time(measure: float) -> float:
    """s over 400 degrees of two wavering axes, the path measured in units of
    `measure` degrees."""
    way = np.linspace(0.0, 400.0, 401)
    turn = 2.0 * np.pi / 100.0
    still = np.zeros_like(way)
    cos, sin = np.cos(turn * way), np.sin(turn * way)
    first = np.stack([still + 1 / 720, still, cos, sin], 1)
    second = np.stack([still, still, -turn * sin, turn * cos], 1)
    third = np.stack([still, still, -(turn**2) * cos, -(turn**2) * sin], 1)
    intervals = intervals_from_knots(
        way / measure,
        first * measure,
        second * measure**2,
        third * measure**3,
        1e9,
    )
    laws = run(JerkPlanner(LIMITS, window=120), intervals)
    return float(laws["time"].sum())


@pytest.mark.parametrize("measure", [30.0, 720.0, 30_000.0])
def test_the_time_does_not_depend_on_the_measure_of_the_path(
    measure: float,
) -> None:
    """The same motion with the path in other units: the same time (four times
    as long at 720 degrees a mm before)."""
    assert _curve_time(measure) == pytest.approx(_curve_time(1.0), rel=1e-3)


@pytest.mark.ci_cases
@pytest.mark.parametrize("pitch", [10.0, 0.5, 0.005])
@pytest.mark.parametrize("parts", [1, 7])
def test_turns_of_a_rotary_axis(
    tmp_path: Path, pitch: float, parts: int
) -> None:
    """Eight turns at pitches down to 72 000 degrees a mm, each turn in one block
    or several: within 1 % of degrees over speed, and the ramps."""
    count = 8 * parts
    lines = [
        f"G1 X{pitch / parts * (i + 1):.8f} A{360 / parts * (i + 1):.8f}"
        for i in range(count)
    ]
    (tmp_path / "a.nc").write_text("\n".join(["F1000000", *lines, "M30"]))
    result = plan_program(
        Program(tmp_path / "a.nc", _rotary(), "isg"), jerk=True
    )
    bound = 8 * 360.0 / 300.0 + RAMPS
    assert bound * 0.999 < result.motion_time_s < bound * 1.01
    ratio = result.max_ratio
    assert ratio["velocity"] is not None
    assert ratio["velocity"] <= 1.005
    assert ratio["acceleration"] is not None
    assert ratio["acceleration"] <= 1.02
    assert ratio["jerk"] is not None
    assert ratio["jerk"] <= 1.02


@pytest.mark.parametrize(("dialect", "decimals"), [("isg", 5), ("isons", 4)])
def test_a_thread_of_rounded_points_keeps_the_bound(
    tmp_path: Path, dialect: str, decimals: int
) -> None:
    """300 points of eight turns, written as a CAM does: the mm of a line jump by
    parts per thousand.  It took 28 s, the bound of the rotary axis is 9.76 s."""
    x, turn = np.linspace(0.0, 4.0, 300)[1:], np.linspace(0.0, 2880.0, 300)[1:]
    lines = [
        f"G1X{a:.{decimals}f}A{b:.{decimals}f}"
        for a, b in zip(x, turn, strict=True)
    ]
    head = "G60\nF1.2\n" if dialect == "isons" else "F1200\n"
    path = tmp_path / f"thread.{dialect}"
    path.write_text(head + "\n".join(lines) + "\n")
    result = plan_program(Program(path, _rotary(), dialect), keep_samples=True)
    assert result.samples is not None
    assert result.motion_time_s < 1.01 * (2880.0 / 300.0 + RAMPS)
    assert max(v for v in result.max_ratio.values() if v is not None) < 1.01
    pos = result.samples["pos"]
    along = np.interp(pos[:, 3], np.r_[0.0, turn], np.r_[0.0, x])
    assert np.abs(pos[:, 0] - along).max() < 2e-5 + 10.0**-decimals
