"""Smoothing where the main axes turn back while other axes go on: the way is
measured along the main axes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program


def _away(a: np.ndarray, b: np.ndarray) -> float:
    return float(
        shapely.distance(shapely.LineString(a), shapely.points(b)).max()
    )


@pytest.mark.parametrize(("other", "kind"), [("A", "rotary"), ("U", "linear")])
@pytest.mark.parametrize("pattern", ["strokes", "sines", "noise"])
def test_strokes_with_another_axis_going_on(
    pattern: str, other: str, kind: str, tmp_path: Path
) -> None:
    """X goes to and fro, the other axis steadily on: planned to its end, both
    paths near each other, no 904001.
    """
    rng = np.random.default_rng(7)
    k = np.arange(1, 41)
    x = {
        "strokes": 2.0 * (k % 2),
        "sines": 3.0 * np.sin(0.3 * k),
        "noise": rng.normal(size=40),
    }[pattern]
    points = np.vstack([np.zeros((1, 2)), np.column_stack([x, 1.5 * k])]).round(
        4
    )
    cell = parse_config(f"[axes.X]\n[axes.{other}]\nkind = '{kind}'\n")
    path = tmp_path / "part.nc"
    path.write_text(
        "G90 F6000\n"
        + "".join(f"G1 X{a:.4f} {other}{b:.4f}\n" for a, b in points[1:])
        + "M30\n"
    )
    program = Program(path, cell, "isg", tolerance=0.1)
    result = plan_program(program, keep_samples=True)
    assert program.smoothing.report.irregular == 0
    assert result.samples is not None
    assert result.max_ratio["acceleration"] <= 1.02
    assert result.max_ratio["jerk"] <= 1.02
    driven = result.samples["pos"]
    assert np.abs(driven[-1] - points[-1]).max() < 1e-9
    allowed = (
        0.1
        if kind == "linear"
        else np.hypot(0.1, program.smoothing.report.rotary_deviation)
    )
    assert _away(points, driven) <= allowed
    assert _away(driven, points) <= allowed + 0.05
