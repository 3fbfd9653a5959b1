"""The distance of positions from programmed arcs and helices, by the check that
`plan` reports with, beside the nearest of many points.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.planning.measure import ElementTable
from cnc_core.program import Program
from cnc_core.units import FloatArray

RADIUS = 5.0


def table_of(tmp_path: Path, motion: str) -> ElementTable:
    """One motion from X5 around the origin."""
    path = tmp_path / "p.nc"
    path.write_text(f"G0 X5 Y0 Z0\n{motion} F1000\nM30\n")
    table = ElementTable(CellConfig())
    for batch in Program(path, CellConfig(), "isg").batches():
        table.add(batch.rows, batch.pool)
    return table


def points(angle: float, climb: float) -> FloatArray:
    """Of the arc or helix, at most 0.4 um apart."""
    along = np.linspace(0.0, angle, 100_001)
    flat = RADIUS * np.column_stack([np.cos(along), np.sin(along)])
    return np.column_stack([flat, np.linspace(0.0, climb, len(along))])


@pytest.mark.parametrize(
    ("motion", "turn", "climb"),
    [
        ("G3 X0 Y5 I-5", 0.25, 0.0),
        ("G2 X0 Y5 I-5", -0.75, 0.0),
        ("G3 X5 Y0 I-5", 1.0, 0.0),
        ("G3 X0 Y5 Z2 I-5", 0.25, 2.0),
        ("G2 X0 Y5 Z2 I-5", -0.75, 2.0),
    ],
)
def test_the_distance_is_that_of_the_nearest_point(
    tmp_path: Path, motion: str, turn: float, climb: float
) -> None:
    """On the arc, beside it, ahead of its start and behind its end."""
    table = table_of(tmp_path, motion)
    path = points(2.0 * np.pi * turn, climb)
    rng = np.random.default_rng(11)
    near = path[rng.integers(0, len(path), 60)]
    near = np.vstack([near, np.repeat(path[[0, -1]], 20, axis=0)])
    near += rng.normal(size=near.shape) * rng.choice([0.01, 0.3], (100, 1))
    found = table.distance(np.ones(len(near), np.int64), near)
    nearest = [np.linalg.norm(path - at, axis=1).min() for at in near]
    assert found == pytest.approx(nearest, rel=1e-3, abs=1e-5)


@pytest.mark.parametrize("turns", [3, 200, 5000])
def test_many_turns_are_not_all_looked_at(tmp_path: Path, turns: int) -> None:
    """Points beside the helix at its normal: that is their distance.  The work
    does not grow with the turns.
    """
    climb = 0.5 * turns
    table = table_of(tmp_path, f"G3 X5 Y0 Z{climb} I-5 K0.5")
    rng = np.random.default_rng(turns)
    along = 2.0 * np.pi * rng.uniform(0.0, turns, 2000)
    off = rng.uniform(-0.1, 0.1, len(along))
    flat = (RADIUS + off)[:, None] * np.column_stack(
        [np.cos(along), np.sin(along)]
    )
    pos = np.column_stack([flat, climb * along / (2.0 * np.pi * turns)])
    found = table.distance(np.ones(len(pos), np.int64), pos)
    assert found == pytest.approx(np.abs(off), rel=1e-3, abs=1e-6)
