"""Machines with limits far from the ordinary: speeds that no path reaches, and
axes that do 0.01 mm in a second.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

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
from support.drive import drive, line_rows
from support.limits import ratios

ARCS = "G1 X10 F6000\n" + "G2 X10 Y0 I5 J0\n" * 4 + "G1 X0\n"
CORNERS = "F6000\n" + "".join(
    f"G1 X{i % 2 * 7 + i:.3f} Y{i % 3 * 5:.3f}\n" for i in range(1, 40)
)
SLOW = 0.01


def _cell(v: float, cycle_s: float = 0.001) -> CellConfig:
    axes = "".join(
        f"[axes.{a}]\nv_max_mm_s = {v}\na_max_mm_s2 = 3000\nj_max_mm_s3 = 50000\n"
        for a in "XYZ"
    )
    return parse_config(f"cycle_s = {cycle_s}\n" + axes)


@pytest.mark.parametrize("text", [ARCS, CORNERS], ids=["arcs", "corners"])
@pytest.mark.parametrize("v", [3e6, 1e9])
def test_a_speed_that_no_path_reaches_costs_nothing(
    tmp_path: Path, text: str, v: float
) -> None:
    """A machine of 3e6 mm/s and more takes as long as one of 1000 mm/s (1.4 and
    28 times as long before).
    """
    path = tmp_path / "fast.nc"
    path.write_text(text)
    usual, fast = (
        plan_program(Program(path, _cell(v_max), "isg", tolerance=0.01))
        for v_max in (1000.0, v)
    )
    assert fast.motion_time_s < 1.005 * usual.motion_time_s
    assert (
        max(ratio for ratio in fast.max_ratio.values() if ratio is not None)
        <= 1.02
    )


def _bend(angle: float) -> Any:
    """60 lines over 0.02 mm, each turned by `angle` rad."""
    turn = angle * np.arange(60)
    steps = (
        0.02 / 60 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(60)])
    )
    return line_rows(np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), 100.0)


@pytest.mark.parametrize("cycle_s", [0.00025, 0.001, 0.004])
def test_a_very_slow_machine_drives_at_its_speed(cycle_s: float) -> None:
    """0.02 mm with the slightest of bends take 2 s; they took 2.2 and more, as the solver crept."""
    pos, state = drive(_bend(0.0005), _cell(SLOW, cycle_s))
    assert max(ratios(pos, _cell(SLOW, cycle_s))) <= 1.02
    assert float(state.motion_time_s) < 1.01 * 0.02 / SLOW


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_override_and_hold_on_a_very_slow_machine(seed: int) -> None:
    """Steps of both: legal, and it goes on as fast as before (it crept for up
    to 50 times as long).
    """
    rng, cell, held = np.random.default_rng(seed), _cell(SLOW), [0]

    def live(_k: int, engine: Any) -> None:
        hold = bool(rng.random() < 0.2)
        held[0] += 1
        engine.set_override(
            1.0 if hold else float(rng.choice([0.5, 1.0, 1.5])), hold
        )

    pos, _ = drive(_bend(0.0005), cell, step=50, each_step=live)
    assert max(ratios(pos, cell)) <= 1.02
    assert np.linalg.norm(pos[-1]) == pytest.approx(0.02, rel=1e-3)
    assert held[0] * 50 * cell.cycle_s < 2.0 * 0.02 / SLOW


def test_a_very_slow_machine_is_not_planned_in_micrometres_of_a_micrometre() -> (
    None
):
    """1 mm in 100 s: some thousand planner intervals (8 million when the ramp,
    1e-6 mm, says how long they are).
    """
    planner = JerkPlanner(
        Limits([SLOW] * 2, [3000.0] * 2, [50000.0] * 2), knots=400
    )
    s, one, no = (
        np.linspace(0.0, 1.0, 11),
        np.tile([1.0, 0.0], (11, 1)),
        np.zeros((11, 2)),
    )
    laws = run(
        planner,
        intervals_from_knots(
            s, one, no, no, np.where(np.arange(10) % 2, 100.0, 0.008)
        ),
    )
    assert laws["length"].sum() == pytest.approx(1.0)
    assert laws["time"].sum() < 1.01 * (0.5 / SLOW + 0.5 / 0.008)
    assert planner.stats["segments"] < 20_000
