"""The example's claims.

The tool follows the dome.
The PLC sees polynomial elements.
The optimizer's program runs.
"""

from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell
from cnc_core.config import load_config
from cnc_core.geometry.profiles.machine import machine_of
from cnc_core.optimize import optimize
from cnc_core.planning import plan_program
from cnc_core.program import Program

HERE = Path(__file__).parent
RADIUS_MM, LENGTH_MM = 40.0, 100.0


@pytest.mark.ci
def test_the_tip_follows_the_dome(tmp_path: Path) -> None:
    """The driven tip lies on the dome, and polynomial elements are seen ahead.

    Both processes run; forward kinematics give the tip.
    """
    with Cell(HERE / "cell.toml") as cell:
        result = cell.run(
            HERE / "part.osai",
            HERE / "watch_elements.py",
            record=tmp_path / "r.npz",
            watch=["Watch.ahead", "Watch.known_mm"],
        )
    assert result.end == "completed", result.errors
    columns = dict(np.load(tmp_path / "r.npz"))
    assert max(result.plc["watch"]["Watch.ahead"]) > 5
    assert max(result.plc["watch"]["Watch.known_mm"]) > 20.0
    program = Program(
        HERE / "part.osai", load_config(HERE / "cell.toml"), "osai"
    )
    specs = []
    while (item := program.reader.read(64)) is not None:
        specs += (
            [item.profile.spec]
            if getattr(item, "profile", None) is not None
            else []
        )
    program.reader.close()  # type: ignore[attr-defined]
    limits = (np.full(5, -1e5), np.full(5, 1e5))
    pose = machine_of(specs[0], 1, limits).forward(columns["pos"], LENGTH_MM)
    from_centre = pose.tip + np.array([0, 0, RADIUS_MM])
    off = np.linalg.norm(from_centre, axis=1) - RADIUS_MM
    y = pose.tip[:, 1]
    x = np.abs(pose.tip[:, 0])
    on_a_pass = np.abs(y - np.round(y / 6.0) * 6.0) < 0.01
    inside = (x > 3.0) & (x < 20.0)
    passes = on_a_pass & inside & (np.abs(off) < 1.0)
    assert passes.sum() > 1000
    assert np.abs(off[passes]).max() < 0.01


def test_the_optimized_program_runs(tmp_path: Path) -> None:
    """Fewer polynomials than points, within the tolerance."""
    cell = load_config(HERE / "cell.toml")
    result = optimize(
        HERE / "DOME", HERE / "CONFIG1", tmp_path / "smooth.osai", cell
    )
    assert result.polynomials < result.points_in
    assert result.max_deviation_mm <= 0.02
    assert (
        plan_program(Program(tmp_path / "smooth.osai", cell)).motion_time_s > 0
    )
