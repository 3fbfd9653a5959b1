"""Smoothing: what the path is worth - curvature against the curve behind the
data, motion times, windows that fail.
"""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core.benchmarks.jerk_paths import contour
from cnc_core.blocks import NC_BLOCK, POLYNOMIAL, SMOOTHING
from cnc_core.geometry.stages.smoothing import SmoothingMachine
from support.drive import FloatArray, line_rows
from support.smoothed_paths import (
    derivatives,
    distance,
    executed,
    judge,
    sampled,
    smooth,
)

FAST = SmoothingMachine((0, 1, 2), 0, 3000.0, 300.0)


def contour_points(first: int, n: int) -> tuple[FloatArray, FloatArray]:
    """(points rounded to 4 decimals, curvature there) of the contour of the benchmarks."""
    knots = contour(first + n)
    bend = knots.d1[:, 0] * knots.d2[:, 1] - knots.d1[:, 1] * knots.d2[:, 0]
    points = np.column_stack([knots.q, np.zeros(first + n + 1)]).round(4)
    return points[first:], bend[first:]


@pytest.mark.parametrize("tolerance", [0.005, 0.01, 0.05])
def test_windows_do_not_show_in_the_curve(tolerance: float) -> None:
    """The curvature of the contour comes back, also where knots were first laid
    without knowing what follows.
    """
    points, bend = contour_points(0, 2000)
    rows = line_rows(points, 100.0)
    batch, report = smooth(rows, points[0], tolerance, machine=FAST)
    assert report.fallbacks == 0
    ends = derivatives(batch)[:, 1]
    found = ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]
    covered = np.cumsum(executed(batch)["value"])
    there = np.interp(
        covered, np.concatenate([[0.0], np.cumsum(rows["length"])]), bend
    )
    assert np.abs(found - there)[5:-5].max() < 0.15 * np.abs(bend).max()


@pytest.mark.parametrize("tolerance", [0.005, 0.01])
def test_noise_of_the_data_is_not_followed(tolerance: float) -> None:
    """Points of an arc that scatter by 2 um: the path is the arc within the
    tolerance, not the scatter.
    """
    angle = np.cumsum(np.random.default_rng(5).uniform(0.004, 0.012, 500))
    points = 20 * np.column_stack([np.cos(angle) - 1, np.sin(angle), 0 * angle])
    points = (
        points + np.random.default_rng(6).normal(size=points.shape) * 0.002
    ).round(4)
    rows = line_rows(points, 100.0)
    batch, report = smooth(rows, points[0], tolerance, machine=FAST)
    judge(rows, points[0], tolerance, batch)
    assert report.fallbacks == 0
    bend = np.linalg.norm(derivatives(batch)[5:-5, 0, 1], axis=1) * 20
    assert np.abs(bend - 1).max() < (3.0 if tolerance < 0.01 else 0.5)


@pytest.mark.ci
def test_a_surface_with_kinks_needs_no_fallback() -> None:
    """Raster over a surface with an edge in it, rounded to a micrometre: every
    window finds its curve.
    """
    x = np.concatenate(
        [np.arange(0, 22, 0.9), np.arange(22, 40, 0.35), np.arange(40, 90, 1.3)]
    )
    height = 8 * np.exp(-((x - 30) ** 2) / 60) + np.where(
        x > 60, np.minimum(x - 60, 4.0), 0.0
    )
    there = [
        np.column_stack([x, np.full(len(x), y), height])
        for y in (0.0, 0.4, 0.8)
    ]
    lines = [there[0], there[1][::-1], there[2]]
    points = np.vstack(lines).round(3)
    for tolerance in (0.005, 0.01, 0.02):
        rows = line_rows(points, 100.0)
        batch, report = smooth(rows, points[0], tolerance, machine=FAST)
        judge(rows, points[0], tolerance, batch)
        assert report.fallbacks == 0


def test_corners_close_to_each_other_stay_corners() -> None:
    """A raster with right angles 0.5 mm apart: blends at every corner, exact
    lines between, whatever the tolerance.
    """
    x = np.array([0.0, 60.0, 60.0, 0.0] * 5)
    points = np.column_stack([x, np.arange(20) // 2 * 0.5, 0 * x])
    rows = line_rows(points, 200.0)
    for tolerance in (0.005, 0.01, 0.02, 0.05):
        batch, report = smooth(rows, points[0], tolerance, machine=FAST)
        judge(rows, points[0], tolerance, batch)
        assert report.curves == report.corners == len(rows) - 1
        longest = executed(batch)["length"].max()
        assert longest > 60 - 20 * tolerance


def test_lines_in_short_blocks_are_lines() -> None:
    """A scan with vertical steps, 0.25 mm a block: what is straight is driven
    exactly, curves are at the edges only.
    """
    x = np.arange(0, 60, 0.25)
    height = np.where((x > 15) & (x < 30), 5.0, 0.0) + np.where(
        x > 40, (x - 40) * 0.5, 0.0
    )
    points = np.column_stack([x, 0 * x, height])
    rows = line_rows(points, 150.0)
    for tolerance in (0.005, 0.02):
        batch, report = smooth(rows, points[0], tolerance, machine=FAST)
        judge(rows, points[0], tolerance, batch)
        pieces = executed(batch)
        curved = pieces["length"][pieces["type"] == POLYNOMIAL].sum()
        assert curved < 5 * 80 * tolerance
        assert report.pieces < 30


def test_points_left_out_on_a_line_stay_beside_it() -> None:
    """Thousands of nearly collinear points that wander by more than may be left
    out: the tolerance holds.
    """
    rng = np.random.default_rng(3)
    wander = np.cumsum(rng.normal(size=(3000, 2)) * 4e-6, axis=0)
    points = np.column_stack([np.arange(3000) * 0.01, wander - wander[0]])
    rows = line_rows(points, 100.0)
    batch, report = smooth(rows, points[0], 0.002, machine=FAST)
    judge(rows, points[0], 0.002, batch)
    assert report.pieces < 300


def test_turns_of_rotary_axes_over_microns_are_not_blended() -> None:
    """Degrees of a rotary axis over 3 um: driven as programmed, from rest to
    rest; what lies between is smoothed.
    """
    points = np.zeros((41, 5))
    points[1::2, 0] = points[2::2, 0] = np.arange(1, 21) * 2.0
    points[:, 1] = np.arange(41) // 2 * 0.003
    points[:, 3] = np.arange(41) // 2 * 5.0
    rows = line_rows(points, 100.0)
    rows["length"] = rows["length_min"] = np.linalg.norm(
        np.diff(points[:, :3], axis=0), axis=1
    )
    machine = SmoothingMachine((0, 1, 2), 0b11000, 3000.0, 300.0)
    batch, report = smooth(rows, points[0], 0.01, machine=machine)
    assert batch.rows.tobytes() == rows.tobytes()
    assert report.rotary_deviation == 0.0


def test_deviation_of_rotary_axes_is_told_in_degrees() -> None:
    """Also where a row sets both tolerances: measured below certified below allowed."""
    t = np.arange(200) * 0.02
    points = np.column_stack(
        [30 * np.sin(t), 30 * t, 0 * t, 20 * np.sin(5 * t), 0 * t]
    ).round(3)
    rows = line_rows(points, 100.0)
    switch = np.zeros(1, NC_BLOCK)
    switch["type"], switch["code"], switch["value"], switch["radius"] = (
        SMOOTHING,
        1,
        0.02,
        0.2,
    )
    machine = SmoothingMachine((0, 1, 2), 0b11000, 3000.0, 300.0)
    batch, report = smooth(
        np.concatenate([switch, rows]), points[0], 0.0, machine=machine
    )
    path = sampled(batch, points[0]).reshape(-1, 5)
    assert distance(points[:, 3:], path[:, 3:]) <= report.rotary_deviation * (
        1 + 1e-9
    )
    assert 0.01 < report.rotary_deviation <= 0.2 * (1 + 1e-9)
    assert distance(points[:, :3], path[:, :3]) <= report.deviation * (1 + 1e-9)
