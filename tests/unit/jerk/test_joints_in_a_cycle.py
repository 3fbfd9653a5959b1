"""Curves driven exactly as short lines, several of them in a cycle, where the
jerk limit leaves the joints much.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.limits import ratios

CELL = "cycle_s = 0.004\n" + "".join(
    f"[axes.{name}]\na_max_mm_s2 = 1000.0\nj_max_mm_s3 = 2e6\n"
    for name in ("X", "Y", "Z")
)


@pytest.mark.parametrize(
    ("radius", "chord", "begins"),
    [
        (20.0, 0.02, 45.0),
        (10.0, 0.01, 20.0),
        (50.0, 0.03, 30.0),
        (5.0, 0.01, 45.0),
    ],
)
def test_joints_of_one_cycle_leave_the_acceleration_its_limit(
    radius: float, chord: float, begins: float, program: Callable[..., Path]
) -> None:
    """From rest on a circle of chords: what the joints turn and what the speed
    gains are one axis' acceleration.
    """
    cell = parse_config(CELL)
    angle = np.deg2rad(begins) + np.arange(301) * chord / radius
    q = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    lines = [f"G1 X{x:.6f} Y{y:.6f} F6000" for x, y in q[1:] - q[0]]
    plan = plan_program(
        Program(program("\n".join(["G90", *lines, "M30\n"])), cell),
        keep_samples=True,
    )
    assert plan.samples is not None
    assert ratios(plan.samples["pos"], cell)[1] <= 1.012
