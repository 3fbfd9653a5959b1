"""Where the time goes: shares by what limits the speed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.engine.causes import CAUSES, hints, summary
from support.programs import planned, program_of

NO_JERK = "".join(
    f"[axes.{axis}]\nv_max_mm_s = 300.0\na_max_mm_s2 = 3000.0\n"
    "j_max_mm_s3 = 0.0\n"
    for axis in "XYZ"
)


def causes(folder: Path, text: str, cell: str = "", **options: float) -> dict:
    """Seconds by cause of a planned program, largest first."""
    result = planned(program_of(folder, text + "M30\n", cell, **options))
    found = result.time_by_cause
    assert list(found) == list(CAUSES)
    assert sum(found.values()) == pytest.approx(result.motion_time_s, abs=0.01)
    assert all(value >= 0.0 for value in found.values())
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def zigzag(points: int) -> str:
    """Short lines with sharp corners, as an ordinary CAM file has them."""
    lines = [f"X{0.5 * i} Y{0.3 * (i % 2)}\n" for i in range(1, points)]
    return "G1 F6000\n" + "".join(lines)


@pytest.mark.parametrize("cell", ["", NO_JERK])
def test_a_long_line_goes_to_its_feed(tmp_path: Path, cell: str) -> None:
    """Almost all of it is driven at F; the rest are the ramps of the axes."""
    found = causes(tmp_path, "G1 X1000 F6000\n", cell)
    assert found["feed"] > 9.5
    assert found["exact_corner"] == found["exact_stop"] == 0.0


def test_corners_driven_exactly_take_the_time(tmp_path: Path) -> None:
    """With a jerk limit the axes nearly stand at each: that is the cause, and
    the hint names what helps.
    """
    found = causes(tmp_path, zigzag(200))
    assert found["exact_corner"] > 0.95 * sum(found.values())
    assert "exact corners" in summary(found)
    assert any("--tolerance 0.01" in line for line in hints(found))


def test_a_tolerance_takes_the_corners_away(tmp_path: Path) -> None:
    """The same path within 0.2 mm: less time, and hardly any for corners."""
    exact = causes(tmp_path, zigzag(200))
    within = causes(tmp_path, zigzag(200), tolerance=0.2)
    assert sum(within.values()) < 0.5 * sum(exact.values())
    assert within["exact_corner"] < 0.2 * sum(within.values())


def test_exact_stops_of_the_program_are_no_corners(tmp_path: Path) -> None:
    """G60: the program wants the standstill, also on a straight line."""
    lines = "".join(f"G60 X{2 * i}\n" for i in range(1, 50))
    found = causes(tmp_path, "G1 F6000\n" + lines)
    assert found["exact_corner"] == 0.0
    assert found["exact_stop"] > 0.9 * sum(found.values())


def test_a_dwell_counts_by_itself(tmp_path: Path) -> None:
    """G4 of two seconds."""
    found = causes(tmp_path, "G1 X1 F6000\nG4 X2\nX2\n")
    assert found["dwell"] == pytest.approx(2.0, abs=0.002)


def test_rapid_is_limited_by_the_axis(tmp_path: Path) -> None:
    """G0 over a long way: the axis' velocity."""
    found = causes(tmp_path, "G0 X3000\n")
    assert found["velocity"] > 0.9 * sum(found.values())


def test_a_circle_is_limited_by_acceleration(tmp_path: Path) -> None:
    """A small circle at high feed, many turns."""
    turns = "G3 X10 Y0 I-10 J0\n" * 20
    found = causes(tmp_path, "G1 X10 F30000\n" + turns, NO_JERK)
    assert found["acceleration"] > 0.7 * sum(found.values())
    assert found["exact_corner"] < 0.2 * sum(found.values())


@pytest.mark.parametrize("seed", range(4))
def test_all_time_has_one_cause(tmp_path: Path, seed: int) -> None:
    """Random polylines and feeds: the causes add up to the time."""
    rng = np.random.default_rng(seed)
    lines = [
        f"X{x:.3f} Y{y:.3f} F{f:.0f}\n"
        for x, y, f in zip(
            rng.uniform(-50, 50, 40),
            rng.uniform(-50, 50, 40),
            rng.uniform(100, 20000, 40),
            strict=True,
        )
    ]
    causes(tmp_path, "G1 F1000\n" + "".join(lines))
