"""Figures smaller than the tolerance: driven where they are all there is, and
told where they are not.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program

SQUARE = np.array([[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1], [0, 0]])


def blocks(points: np.ndarray, start: float = 0.0) -> str:
    return "".join(f"X{start + x:.6f} Y{y:.6f}\n" for x, y in points[1:])


def farthest(points: np.ndarray, path: np.ndarray) -> float:
    """Of the points from the path, sampled densely."""
    return float(
        max(np.linalg.norm(path - point, axis=1).min() for point in points)
    )


@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("tolerance", [0.05, 0.3, 1.0, 30.0])
@pytest.mark.parametrize("lead", [0.0, 10.0])
def test_a_closed_figure_within_the_tolerance_is_driven(
    program: Callable[..., Path], lead: float, tolerance: float, jerk: bool
) -> None:
    """A square of 0.1 mm that ends the program, alone or behind a line: the
    path comes by all of its corners.
    """
    way = f"G1 X{lead} F600\n" if lead else "G1 F600\n"
    path = Program(
        program(way + blocks(SQUARE, lead) + "M30\n"),
        CellConfig(),
        "isg",
        tolerance=tolerance,
    )
    result = plan_program(path, window=120, jerk=jerk, keep_samples=True)
    assert result.samples is not None
    driven = result.samples["pos"][:, :2]
    off = farthest(SQUARE + np.array([lead, 0.0]), driven)
    assert off <= 0.05 + 0.01
    assert off - 0.01 <= path.smoothing.report.deviation <= tolerance
    assert result.path_deviation_mm <= tolerance


@pytest.mark.parametrize(
    ("ends", "least"), [("X20 Y0\n", 0.1), ("X10 Y0.01\n", 0.09)]
)
def test_what_is_left_out_counts_as_deviation(
    program: Callable[..., Path], ends: str, least: float
) -> None:
    """A square of 0.1 mm on a line is no motion within 1 mm: the smoothing
    tells how far it is from what is driven.
    """
    text = (
        "G1 X10 F600\n"
        + blocks(SQUARE[:4], 10.0)
        + ("X10 Y0\n" if least == 0.1 else "")
        + ends
        + "M30\n"
    )
    path = Program(program(text), CellConfig(), "isg", tolerance=1.0)
    plan_program(path, window=120)
    assert least <= path.smoothing.report.left_out
    assert least <= path.smoothing.report.deviation <= 1.0


@pytest.mark.ci_cases
@pytest.mark.parametrize("lead", [0.0, 20.0])
def test_a_path_that_ends_in_a_tiny_figure_meets_its_end(
    program: Callable[..., Path], lead: float
) -> None:
    """There and back within the tolerance, 20 of them: the last move was lost
    where it was shorter than a tenth of the figure.
    """
    for seed in range(20):
        rng = np.random.default_rng(seed)
        there = np.cumsum(rng.normal(size=(6, 2)) * 0.01, axis=0)
        points = np.vstack([[[0, 0]], there, there[::-1], [[0, 0]]])
        points = points.round(5)
        way = f"G1 X{lead} F600\n" if lead else "G1 F600\n"
        path = Program(
            program(way + blocks(points, lead) + "M30\n"),
            CellConfig(),
            "isg",
            tolerance=0.25,
        )
        result = plan_program(path, keep_samples=True)
        assert result.samples is not None
        end = result.samples["pos"][-1, :2]
        assert end == pytest.approx([lead, 0.0], abs=1e-9)
