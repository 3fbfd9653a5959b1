"""More of a limit is never slower: of one axis among others within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program

Write = Callable[..., Path]
TURN = [
    "F6000",
    "G1 X-0.9107 Y-0.1364",
    "G1 X-1.7585 Y-0.4957",
    "G1 X-2.4752 Y-1.0738",
    "G1 X-2.9900 Y-1.8373",
    "G1 X-3.2446 Y-2.7222",
    "G1 X-3.2086 Y-3.6423",
    "G1 X-2.8875 Y-4.5053",
    "G1 X-2.3210 Y-5.2313",
]


@pytest.mark.parametrize("tolerance", [0.02, 0.05])
def test_no_jerk_limit_on_an_axis_is_as_quick_as_a_high_one(
    program: Write, tolerance: float
) -> None:
    """X and Z without a limit beside Y with one: as with 1e9 mm/s3."""

    def seconds(jerk: float) -> float:
        axes = {"X": (800, jerk), "Y": (300, 3e5), "Z": (300, jerk)}
        cell = parse_config(
            "".join(
                f"[axes.{axis}]\nv_max_mm_s = {v}\na_max_mm_s2 = 3000\n"
                f"j_max_mm_s3 = {j}\n"
                for axis, (v, j) in axes.items()
            )
        )
        path = program("\n".join([*TURN, "M30", ""]))
        read = Program(path, cell, "isg", tolerance=tolerance)
        return plan_program(read).motion_time_s

    assert seconds(0.0) <= 1.005 * seconds(1e9)


@pytest.mark.parametrize("seed", [13, 1, 5])
def test_more_jerk_of_linear_axes_beside_slow_rotary_ones(
    program: Write, seed: int
) -> None:
    """A walk of X, Y, Z, A and C: 1e6 instead of 5e4 mm/s3 is not slower."""
    rng = np.random.default_rng(seed)
    at, way = np.zeros(5), rng.normal(size=5)
    lines = []
    for _ in range(16):
        way += 0.15 * rng.normal(size=5)
        way /= np.linalg.norm(way)
        at = at + 0.5 * way * [1, 1, 0.3, 0.3, 0.3]
        lines.append(
            "G1 "
            + " ".join(f"{a}{p:.4f}" for a, p in zip("XYZAC", at, strict=True))
        )

    def seconds(jerk: float) -> float:
        linear = "v_max_mm_s = 300\na_max_mm_s2 = 3000\n"
        rotary = 'kind = "rotary"\nv_max_mm_s = 180\na_max_mm_s2 = 300\n'
        cell = parse_config(
            "cycle_s = 0.0005\n"
            + "".join(
                f"[axes.{a}]\n{linear}j_max_mm_s3 = {jerk}\n" for a in "XYZ"
            )
            + "".join(f"[axes.{a}]\n{rotary}j_max_mm_s3 = 3000\n" for a in "AC")
        )
        text = ["F3000", "#HSC ON [BSPLINE PATH_DEV=0.05 TRACK_DEV=0.1]"]
        path = program("\n".join([*text, *lines, "M30", ""]))
        return plan_program(Program(path, cell, "isg")).motion_time_s

    assert seconds(1e6) <= 1.01 * seconds(5e4)
