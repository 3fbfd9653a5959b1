"""Machines whose axes have very different jerk limits: large terms of the slow
axis' jerk cancel, so that what the grid or the planner's polynomials miss of a
curve counts many times.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import AxisConfig, CellConfig, parse_config
from cnc_core.planning import PlanResult, plan_program
from cnc_core.program import Program
from support.limits import ratios

# s: TOPP3 by COPP of the smoothed path, 4181 knots (bench/planner_parts.py;
# 1741 knots: 0.7066)
CIRCLE_COPP = 0.70414
WALK_S = 1.06887  # s: the best of W60, W120, W190, W250


def _saw_tooth(lines: int) -> str:
    """Up and down by 60 degrees."""
    return "".join(
        f"G1 X{1.4909 * k:.4f} Y{-2.4849 * min(k % 4, 4 - k % 4):.4f} F9928.9\n"
        for k in range(1, lines + 1)
    )


def _tooth_cell(jerk_y: float, cycle_s: float = 0.00025) -> CellConfig:
    limits = {
        "X": (1076, 11660, 8558),
        "Y": (81.57, 20620, jerk_y),
        "Z": (1046, 2028, 23230),
    }
    axes = "".join(
        f"[axes.{n}]\nv_max_mm_s={v}\na_max_mm_s2={a}\nj_max_mm_s3={j}\n"
        for n, (v, a, j) in limits.items()
    )
    return parse_config(f"cycle_s={cycle_s}\n" + axes)


def _plan(
    path: Path, text: str, cell: CellConfig, tolerance: float, window: int
) -> PlanResult:
    path.write_text(text)
    return plan_program(
        Program(path, cell, "isg", tolerance=tolerance),
        window=window,
        keep_samples=True,
    )


def _largest(plan: PlanResult, cell: CellConfig) -> float:
    """Largest velocity and acceleration sampled, over the limits; jerk up to 1.02 is asserted."""
    assert plan.samples is not None
    return max(ratios(plan.samples["pos"], cell))


@pytest.mark.parametrize("cycle_s", [0.0001, 0.00025])
@pytest.mark.parametrize("window", [30, 120])
@pytest.mark.ci
def test_blends_keep_the_jerk_of_the_slow_axis(
    tmp_path: Path, window: int, cycle_s: float
) -> None:
    """Jerk limits 138 times apart: sampled jerk 1.04 to 1.24 of the limit before."""
    cell = _tooth_cell(1.179e6, cycle_s)
    assert (
        _largest(
            _plan(tmp_path / "tooth.nc", _saw_tooth(40), cell, 0.02, window),
            cell,
        )
        <= 1.02
    )


@pytest.mark.ci
def test_more_jerk_is_not_slower(tmp_path: Path) -> None:
    """Y with fourteen times the jerk may not take longer: it took 1.16 times as long."""
    slow, quick = (
        _plan(
            tmp_path / "tooth.nc", _saw_tooth(40), _tooth_cell(jerk), 0.02, 120
        ).motion_time_s
        for jerk in (85580.0, 1.179e6)
    )
    assert quick <= 1.003 * slow


@pytest.mark.parametrize("window", [30, 120])
def test_a_circle_ends_as_fast_as_it_can(tmp_path: Path, window: int) -> None:
    """Standing at the end where the slow axis begins to bind: that interval
    must be short (it took 1.017).
    """
    s, r = np.arange(1, 102) * 0.3, 5.0
    text = "".join(
        f"G1 X{x:.4f} Y{y:.4f} F18000\n"
        for x, y in zip(r * np.sin(s / r), r - r * np.cos(s / r), strict=True)
    )
    names = CellConfig().axis_names
    cell = CellConfig(
        axes={
            n: AxisConfig(j_max_mm_s3=j)
            for n, j in zip(names, (50000.0, 5000.0, 20000.0), strict=True)
        }
    )
    plan = _plan(tmp_path / "circle.nc", text, cell, 0.01, window)
    assert _largest(plan, cell) <= 1.02
    assert plan.motion_time_s <= 1.003 * CIRCLE_COPP


def _walk(seed: int) -> tuple[CellConfig, float, str]:
    """A random machine, a tolerance, and a walk in the plane for it."""
    rng = np.random.default_rng(seed)
    jerk, acc = 10 ** rng.uniform(4.0, 5.83, 3), 10 ** rng.uniform(2.9, 4.2, 3)
    v = rng.uniform(40, 400, 3)
    feed = float(rng.choice([2000, 6000, 12000]))
    tolerance = float(rng.choice([0.01, 0.02, 0.05]))
    cell = parse_config(
        "".join(
            f"[axes.{n}]\nv_max_mm_s={v[i]:.3f}\na_max_mm_s2={acc[i]:.2f}\n"
            f"j_max_mm_s3={jerk[i]:.1f}\n"
            for i, n in enumerate("XYZ")
        )
    )
    at, angle, text = np.zeros(3), 0.0, f"F{feed:g}\n"
    for _ in range(40):
        angle += rng.normal() * 0.4
        way = np.array([np.cos(angle), np.sin(angle), 0.1 * rng.normal()])
        at = at + way * rng.uniform(0.4, 3)
        text += "G1 X{:.4f} Y{:.4f} Z{:.4f}\n".format(*at)
    return cell, tolerance, text


@pytest.mark.parametrize("window", [60, 120])
@pytest.mark.ci
def test_too_much_acceleration_inside_does_not_cost_jerk(
    tmp_path: Path, window: int
) -> None:
    """Within 0.3 % of the best of four windows: 1.19 times as long at W120
    when the jerk limit was lowered for it, which changed nothing.
    """
    cell, tolerance, text = _walk(5208)
    plan = _plan(tmp_path / "walk.nc", text, cell, tolerance, window)
    assert _largest(plan, cell) <= 1.02
    assert plan.motion_time_s <= 1.003 * WALK_S
