"""Splines on which a rotary axis goes on while the main axes all but stand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.geometry.shapes.outrun import parts
from cnc_core.units import FloatArray
from support.limits import ratios
from support.programs import ended_program, planned

CELL = parse_config(
    "".join(
        f"[axes.{axis}]\nv_max_mm_s = 300\na_max_mm_s2 = 3000\nj_max_mm_s3 = 5e4\n"
        for axis in "XY"
    )
    + "[axes.A]\nkind = 'rotary'\nv_max_mm_s = 360\na_max_mm_s2 = 3600\n"
    "j_max_mm_s3 = 8e4\n"
)
OUTRUN = {
    "the main axes come back": "X10 A90|X0 A180",
    "the rotary axis turns alone": "X10 A10|X20 A90|A180|X30 A200|X40 Y10",
    "it turns alone at the end": "X5|A1|A91",
    "they come back aside": "X10 A90|X0 Y0.001 A180|X10 Y0.001 A270",
    "it comes back, too": "X10 A90|X0 A0|X10 A90|X0 A0",
    "slower than they": "A1|A2|X-10 Y-5 A2.01|Y0|A2.02",
}


def spline(kind: str, points: str) -> str:
    lines = points.replace("|", "\n")
    return f"F3000 G01\n#SPLINE TYPE {kind}\n#SPLINE ON\n{lines}\n#SPLINE OFF"


def seen_of(folder: Path, kind: str, points: str, jerk: bool) -> FloatArray:
    result = planned(
        ended_program(folder, spline(kind, points), CELL), jerk=jerk
    )
    assert result.samples is not None
    return result.samples["pos"]


@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "no jerk"])
@pytest.mark.parametrize("kind", ["AKIMA", "BSPLINE"])
@pytest.mark.parametrize("points", OUTRUN.values(), ids=OUTRUN)
def test_they_are_driven(
    tmp_path: Path, kind: str, points: str, jerk: bool
) -> None:
    """To their end and within the limits."""
    seen = seen_of(tmp_path, kind, points, jerk)
    assert max(ratios(seen, CELL, jerk)) <= 1.02
    last = dict.fromkeys("XYA", 0.0)
    for word in points.replace("|", " ").split():
        last[word[0]] = float(word[1:])
    assert np.abs(seen[-1] - list(last.values())).max() < 1e-9


@pytest.mark.parametrize("kind", ["AKIMA", "BSPLINE"])
def test_the_rotary_axis_does_not_stop(tmp_path: Path, kind: str) -> None:
    """The parts meet with one speed of all axes."""
    seen = seen_of(tmp_path, kind, "X10 A90|X0 A180", True)
    speed = np.abs(np.diff(seen[:, 2])) / CELL.cycle_s
    assert (speed[60:-60] > 1.0).all()


def test_a_turn_of_the_rotary_axis_alone_has_the_feed_in_degrees(
    tmp_path: Path,
) -> None:
    """The main axes rest all over the last segment."""
    seen = seen_of(tmp_path, "AKIMA", "X5|A1|A301", True)
    fastest = np.diff(seen[:, 2]).max() / CELL.cycle_s
    assert fastest == pytest.approx(3000 / 60, rel=0.01)


def test_the_parts_meet_where_the_main_axes_are_as_slow_as_the_rate() -> None:
    """Both sides of a cut have the same path speed."""
    # x' = u^2 - 0.25, slow around 0.5; a' = 5
    coef = np.array([[0, -0.25, 0, 1 / 3], [0, 5.0, 0, 0]])
    found = parts(coef, (0.0, 1.0), [0], 0.02)
    assert [outrun for _, _, outrun in found] == [False, True, False]
    low, high = found[1][:2]
    assert low == pytest.approx(np.sqrt(0.23))
    assert high == pytest.approx(np.sqrt(0.27))
    assert found[0][1] == low
    assert found[2][0] == high


@pytest.mark.parametrize(
    "slow", [[0, 0.3, 0, 0], [0, -0.25, 0, 1 / 3]], ids=["never", "alone"]
)
def test_nothing_is_cut_where_nothing_outruns(slow: list[float]) -> None:
    """The main axes are fast enough, or no other one moves."""
    coef = np.array([slow, [0, 5.0 if slow[1] > 0 else 0.0, 0, 0]])
    assert parts(coef, (0.0, 1.0), [0], 0.02) == [(0.0, 1.0, False)]


@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "no jerk"])
@pytest.mark.parametrize(
    "points",
    [
        "X10 A10|X10.1 A90|X20 A100",
        "X10|X10.001 A90|X20",
        "X10 A10|X10.1 A90|X10.2 A0|X30",
    ],
)
def test_a_turn_over_a_tiny_way_does_not_swing_beyond_its_points(
    tmp_path: Path, points: str, jerk: bool
) -> None:
    """The slope there, 800 degrees per mm and more, does not act on the long
    segments beside it.
    """
    seen = seen_of(tmp_path, "AKIMA", points, jerk)
    largest = max(
        float(w[1:]) for w in points.replace("|", " ").split() if "A" in w
    )
    assert seen[:, 2].min() > -1e-9
    assert seen[:, 2].max() < largest + 1e-9
    assert max(ratios(seen, CELL, jerk)) <= 1.02
