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


@pytest.mark.parametrize("cycle_s", [0.004, 0.005])
def test_one_joint_of_small_arcs_does_not_hold_back_the_arc_ahead_of_it(
    program: Callable[[str], Path], cycle_s: float
) -> None:
    """Two arcs with a corner between them, in which nothing else jumps: at most
    1.03 of the time with a stop there (held back along the arc, 1.24).
    """
    cell = parse_config(
        f"cycle_s = {cycle_s}\n"
        + "".join(
            f"[axes.{axis}]\nv_max_mm_s = 300\na_max_mm_s2 = 10000\n"
            "j_max_mm_s3 = 50000\n"
            for axis in "XYZ"
        )
    )
    first = "G2 X-0.2544 Y-0.6580 Z0.3265 I-0.25912 J-0.27802"
    last = "G3 X-0.7318 Y-0.7691 Z0.3424 I0.01417 J-1.14274"

    def seconds(*between: str) -> float:
        path = program("\n".join(["F12000", first, *between, last, "M30", ""]))
        result = plan_program(Program(path, cell, "isg"))
        assert (result.max_ratio["jerk"] or 0.0) <= 1.02
        return result.motion_time_s

    assert seconds() <= 1.03 * seconds("#FLUSH")
