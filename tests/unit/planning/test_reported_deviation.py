"""The deviation that ``plan`` states, beside shapely."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely

from cnc_core.config import CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program


@pytest.mark.parametrize("tolerance", [0.01, 0.2, 1.0])
def test_blocks_far_shorter_than_the_tolerance(
    tolerance: float, program: Callable[..., Path]
) -> None:
    """A spiral into its centre in blocks of micrometres: stated is the distance
    from the contour, not from a part.
    """
    t = np.linspace(0.0, 12.0, 241)
    points = np.exp(-t / 3)[:, None] * np.column_stack(
        [np.cos(t), np.sin(t)]
    ) * [10.0, 10.0] - [10.0, 0.0]
    points = np.vstack([points.round(4), [[0.0, 8.0]]])
    text = "\n".join(f"G1 X{x:.4f} Y{y:.4f}" for x, y in points[1:])
    path = program(f"G90 F6000\n{text}\nM30\n")
    result = plan_program(
        Program(path, CellConfig(), tolerance=tolerance), keep_samples=True
    )
    assert result.samples is not None
    contour = shapely.LineString(points)
    away = float(
        shapely.distance(
            contour, shapely.points(result.samples["pos"][:, :2])
        ).max()
    )
    assert result.path_deviation_mm == pytest.approx(away, abs=1e-9)
    assert away <= tolerance
