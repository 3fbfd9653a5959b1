"""Smoothing: what the path is worth - curvature against the curve behind the data, motion times, windows that fail."""

from __future__ import annotations

import numpy as np
import pytest
from drive import FloatArray, line_rows
from test_smoothing import derivatives, executed, smooth

from cnc_core.geometry.smoothing import SmoothingMachine
from cnc_core.jerk_paths import contour

FAST = SmoothingMachine((0, 1, 2), 0, 3000.0, 300.0)


def contour_points(first: int, n: int) -> tuple[FloatArray, FloatArray]:
    """(points rounded to 4 decimals, curvature there) of the contour of the benchmarks."""
    knots = contour(first + n)
    bend = knots.d1[:, 0] * knots.d2[:, 1] - knots.d1[:, 1] * knots.d2[:, 0]
    points = np.column_stack([knots.q, np.zeros(first + n + 1)]).round(4)
    return points[first:], bend[first:]


@pytest.mark.parametrize("tolerance", [0.005, 0.01, 0.05])
def test_windows_do_not_show_in_the_curve(tolerance: float) -> None:
    """The curvature of the contour comes back, also where knots were first laid without knowing what follows."""
    points, bend = contour_points(0, 2000)
    rows = line_rows(points, 100.0)
    batch, report = smooth(rows, points[0], tolerance, machine=FAST)
    assert report.fallbacks == 0
    ends = derivatives(batch)[:, 1]
    found = ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]
    covered = np.cumsum(executed(batch)["value"])
    there = np.interp(covered, np.concatenate([[0.0], np.cumsum(rows["length"])]), bend)
    assert np.abs(found - there)[5:-5].max() < 0.15 * np.abs(bend).max()
