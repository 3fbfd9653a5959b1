"""Smoothing in turned coordinates: the same motion as of the same path written
in the coordinates of the axes, whatever their limits are.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.planning import PlanResult
from cnc_core.units import FloatArray
from support.programs import ended_program, planned

UNEQUAL = """
[axes.X]
v_max_mm_s = 60
a_max_mm_s2 = 500
j_max_mm_s3 = 4000
[axes.Y]
v_max_mm_s = 300
a_max_mm_s2 = 3000
j_max_mm_s3 = 40000
[axes.Z]
v_max_mm_s = 100
a_max_mm_s2 = 1000
j_max_mm_s3 = 10000
"""
MODES = ["#HSC ON [BSPLINE PATH_DEV=0.02]\n", "#HSC ON [CONTERROR 0.05]\n"]


def result_of(folder: Path, text: str) -> PlanResult:
    return planned(ended_program(folder, text, parse_config(UNEQUAL)))


def turned(about: int, degrees: float) -> FloatArray:
    """(3, 3): by so much about X, Y or Z."""
    first, second = [(1, 2), (2, 0), (0, 1)][about]
    angle = np.radians(degrees)
    out = np.eye(3)
    out[first, first] = out[second, second] = np.cos(angle)
    out[first, second], out[second, first] = -np.sin(angle), np.sin(angle)
    return out


def frame(about: int, degrees: float) -> str:
    angles = ["0", "0", "0"]
    angles[about] = str(degrees)
    return f"#CS ON [0,0,0,{','.join(angles)}]\n"


def lines(points: FloatArray) -> str:
    rows = (f"X{x:.10f} Y{y:.10f} Z{z:.10f}" for x, y, z in points)
    return "G1 F6000 " + "\n".join(rows)


def wave(n: int) -> FloatArray:
    i = np.arange(1, n)
    return np.column_stack(
        [8 * np.sin(0.11 * i), 5 * np.cos(0.17 * i) - 5, 3 * np.sin(0.05 * i)]
    )


def walk(n: int) -> FloatArray:
    steps = np.random.default_rng(7).normal(size=(n, 3)) * [1.0, 1.0, 0.5]
    return np.asarray(np.cumsum(steps, axis=0))


def assert_same_motion(one: PlanResult, other: PlanResult) -> None:
    assert one.motion_time_s == pytest.approx(other.motion_time_s, rel=5e-4)
    assert one.path_deviation_mm == pytest.approx(
        other.path_deviation_mm, rel=0.02
    )
    assert one.samples is not None
    assert other.samples is not None
    assert one.samples["pos"][-1] == pytest.approx(other.samples["pos"][-1])
    assert max(v for v in one.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("points", [wave(60), walk(30)], ids=["wave", "walk"])
@pytest.mark.parametrize(
    ("about", "degrees"), [(2, 90.0), (2, 120.0), (1, 90.0), (0, -20.5)]
)
def test_a_turned_path_is_shaped_for_the_axes_that_drive_it(
    tmp_path: Path, mode: str, points: FloatArray, about: int, degrees: float
) -> None:
    """Curves were shaped for the axes of the words: up to 1.17 times as long."""
    written = lines(points @ turned(about, degrees).T)
    assert_same_motion(
        result_of(tmp_path, mode + frame(about, degrees) + lines(points)),
        result_of(tmp_path, mode + written),
    )


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("degrees", [90, 30])
def test_turned_arcs_are_shaped_for_the_axes_too(
    tmp_path: Path, mode: str, degrees: int
) -> None:
    """The turns at arcs are those of their tangents in any frame."""
    steps = [(3.19, -3.57, 2.74, -0.76), (2.48, 0.41, 0, 0), (2.66, 1.64, 0, 0)]
    steps += [(5.88, -1.82, 2.80, -1.36)]
    rotation = turned(2, degrees)[:2, :2]

    def program(by: FloatArray) -> str:
        at = np.zeros(2)
        text = "F9000\n"
        for x, y, i, j in steps:
            at = at + by @ [x, y]
            end = f"X{at[0]:.10f} Y{at[1]:.10f}"
            a, b = by @ [i, j]
            arc = f"G3 {end} I{a:.10f} J{b:.10f}\n"
            text += arc if i or j else f"G1 {end}\n"
        return text

    assert_same_motion(
        result_of(
            tmp_path,
            mode + f"#ROTATION ON [ANGLE={degrees}]\n" + program(np.eye(2)),
        ),
        result_of(tmp_path, mode + program(rotation)),
    )


def test_behind_a_frame_the_axes_are_those_of_the_words_again(
    tmp_path: Path,
) -> None:
    """A frame that has ended says nothing of what comes behind it."""
    alone = result_of(tmp_path, MODES[0] + lines(walk(30)))
    behind = result_of(
        tmp_path,
        MODES[0] + frame(2, 90.0) + "#CS OFF\n" + lines(walk(30)),
    )
    assert behind.motion_time_s == pytest.approx(alone.motion_time_s, rel=1e-6)
