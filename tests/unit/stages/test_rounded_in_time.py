"""Rounded and smoothed programs beside the exact path: no slower, and within the
limits at short cycles, too.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.planning import PlanResult
from support.programs import ended_program, planned

ROUNDED = "#CONTOUR MODE ON [{}]\n{}"
# by hand to three decimals: the joints turn by some 1e-4 rad
S_SHAPE = "G1 X3 Y0 F3000\nG3 X3.644 Y0.235 R1\nG2 X4.288 Y0.470 R1\nG1 X7.288"
AUTOMATIC = ["AUTO_DEV", "AUTO_VEL VEL=100", "DIST_SOFT", "DIST_MASTER"]


def result_of(folder: Path, text: str, cell: str = "") -> PlanResult:
    return planned(ended_program(folder, text, parse_config(cell)))


@pytest.mark.parametrize("mode", AUTOMATIC)
def test_joints_tangential_but_for_rounding_are_no_slower(
    tmp_path: Path, mode: str
) -> None:
    """A curve as long as the feed needs needs a length for the jerk, too: curves
    of 0.1 um were crept through.
    """
    exact = result_of(tmp_path, S_SHAPE)
    rounded = result_of(tmp_path, ROUNDED.format(mode, S_SHAPE))
    assert rounded.motion_time_s <= exact.motion_time_s * 1.001
    assert max(v for v in rounded.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.parametrize("mode", ["AUTO_DEV", "DIST_SOFT PATH_DIST=-1"])
@pytest.mark.parametrize("feed", [600, 2000])
def test_a_curve_as_large_as_the_feed_needs_keeps_it(
    tmp_path: Path, mode: str, feed: int
) -> None:
    """Its acceleration and its jerk are there at the feed, all over it."""
    text = f"G1 X20 F{feed}\nY20\n"
    result = result_of(tmp_path, ROUNDED.format(mode, text))
    assert result.samples is not None
    speed = result.samples["v"][200:-200]
    assert speed.min() >= 0.99 * feed / 60


@pytest.mark.parametrize("cycle_s", [0.0001, 0.00025])
def test_curves_that_use_up_a_block_meet(
    tmp_path: Path, cycle_s: float
) -> None:
    """What was left between them, 26 nm, was left out: the jerk reached 2.05."""
    text = (
        "G1 X0.19166 Y-0.00833 F6000\nG1 X2.01877 Y0.08683\n"
        "G1 X2.20548 Y0.13089\nG1 X2.39712 Y0.13961\nG1 X2.58720 Y0.11367"
    )
    result = result_of(
        tmp_path,
        ROUNDED.format("DEV PATH_DEV=0.02", text),
        f"cycle_s = {cycle_s}",
    )
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.parametrize("angle", [0.05, 1, 10])
@pytest.mark.parametrize(("radius", "tolerance"), [(0.2, 0.02), (5, 0.1)])
def test_arcs_are_smoothed_whatever_turn_stays_a_corner(
    tmp_path: Path, radius: float, tolerance: float, angle: float
) -> None:
    """MAX_ANGLE is for turns of the program, and a tangential arc has none: the
    path is the one without it.
    """
    arc = f"G1 X5 F3000\nG3 X5 Y{2 * radius} I0 J{radius}\nG1 X0"
    free, found = (
        result_of(
            tmp_path,
            f"#HSC ON [BSPLINE PATH_DEV={tolerance}{key}]\n{arc}\n#HSC OFF",
        )
        for key in ("", f" MAX_ANGLE={angle}")
    )
    assert free.samples is not None
    assert found.samples is not None
    assert np.array_equal(free.samples["pos"], found.samples["pos"])


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("turn", [6.0, 14.0])
@pytest.mark.parametrize(("radius", "tolerance"), [(0.2, 0.02), (2, 0.1)])
def test_max_angle_knows_the_corners_of_arcs(
    tmp_path: Path, radius: float, tolerance: float, turn: float, side: int
) -> None:
    """Between a line and an arc that bends on or back: above it the corner stays."""
    a = np.radians(side * turn)
    center = 5 - radius * np.sin(a), radius * np.cos(a)
    end = center[0] + radius * np.cos(a), center[1] + radius * np.sin(a)
    text = (
        f"#HSC ON [BSPLINE PATH_DEV={tolerance} MAX_ANGLE=10]\nG1 X5 F3000\n"
        f"G3 X{end[0]:.9f} Y{end[1]:.9f} I{center[0] - 5:.9f} J{center[1]:.9f}\n"
        "#HSC OFF"
    )
    result = result_of(tmp_path, text)
    assert result.samples is not None
    ahead = result.samples["pos"][:, :2] - [5.0, 0.0]
    near = np.hypot(*ahead.T) < 0.05 + tolerance
    speed = result.samples["v"][near]
    assert (speed.min() < 2.0) == (turn > 10)
