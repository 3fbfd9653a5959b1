"""G60: without stops, within the tolerance of TOL_G60; filters in five axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.blocks import POLYNOMIAL
from cnc_core.config import CellConfig, load_config, parse_config
from cnc_core.planning import PlanResult, plan_program
from cnc_core.program import Program
from support.paths import FIVE_AXIS

HEAD_HEAD = FIVE_AXIS / "head_head.toml"


def _plan(folder: Path, text: str, cell: CellConfig) -> PlanResult:
    path = folder / "part.isons"
    path.write_text(text)
    result = plan_program(Program(path, cell, "isons"), keep_samples=True)
    ratio = {k: v or 0.0 for k, v in result.max_ratio.items()}
    assert ratio["feed"] <= 1.005
    assert max(ratio["velocity"], ratio["acceleration"], ratio["jerk"]) <= 1.02
    return result


def _wave(count: int) -> str:
    """Chords of 0.6 mm over a wave, and its length at F6."""
    x = np.linspace(0.0, 0.6 * count, count + 1)
    z = 2.0 * np.sin(x / 8.0)
    return "\n".join(
        f"G1X{a:.4f}Z{b:.4f}" for a, b in zip(x[1:], z[1:], strict=True)
    )


@pytest.mark.parametrize("tolerance", [0.005, 0.01, 0.05])
def test_chords_are_driven_at_the_feed(
    tmp_path: Path, tolerance: float
) -> None:
    """Turns of up to 2 degrees cost nothing; the path stays inside."""
    cell = parse_config(f"[isons]\nTOL_G60 = {tolerance * 1000:g}\n")
    result = _plan(tmp_path, f"G60G63F6\n{_wave(300)}\n", cell)
    assert result.samples is not None
    way = np.linalg.norm(np.diff(result.samples["pos"], axis=0), axis=1).sum()
    assert result.motion_time_s < 1.1 * way / 100.0
    assert 0.0 < result.path_deviation_mm <= tolerance


def test_without_a_tolerance_the_path_is_exact(tmp_path: Path) -> None:
    """TOL_G60 0, and G61 whatever TOL_G60."""
    for head, cell in (
        ("G60", parse_config("[isons]\nTOL_G60 = 0\n")),
        ("G61", CellConfig()),
    ):
        result = _plan(tmp_path, f"{head}G63F6\n{_wave(30)}\n", cell)
        assert result.path_deviation_mm < 1e-9


def test_the_tolerance_changes_with_the_mode(tmp_path: Path) -> None:
    """Corners of 10 degrees behind G61 are exact, behind G60 they are not."""
    text = "G60G63F3\nG1X10\nX20Y1.763\n{}\nX30Y1.763\nX40Y0\n"
    cell = CellConfig()
    loose = _plan(tmp_path, text.format("G60"), cell)
    mixed = _plan(tmp_path, text.format("G61"), cell)
    exact = _plan(tmp_path, text.replace("G60", "G61").format("G61"), cell)
    assert loose.motion_time_s < mixed.motion_time_s < exact.motion_time_s


def test_commands_act_at_their_programmed_place(tmp_path: Path) -> None:
    """The path is not rounded where G100 stands."""
    rows = []
    path = tmp_path / "part.isons"
    path.write_text("G60G63F3\nG1X10\nG100X1\nX20Y1.763\nX30\n")
    for batch in Program(path, CellConfig(), "isons").batches():
        rows += [row for row in batch.rows if row["type"] <= POLYNOMIAL]
    ends = [tuple(np.round(row["end"][:2], 9)) for row in rows]
    assert (10.0, 0.0) in ends


@pytest.mark.parametrize("code", ["G72X1Y2A0.3", "G74X1Y0.2", "G66X1"])
def test_filters_in_five_axes(tmp_path: Path, code: str) -> None:
    """Rotary axes move along: the run goes on (they ended it), and the path is
    driven as fast as the feed lets it."""
    turn = np.linspace(0.0, 4.0 * np.pi, 700)
    lines = [
        f"G1X{20 * np.cos(a):.4f}Y{20 * np.sin(a):.4f}"
        f"B{10 + 5 * np.cos(a):.4f}C{20 * np.sin(a):.4f}"
        for a in turn[1:]
    ]
    text = "\n".join(
        ["T1", "G60F2", "G104", "G0X20Y0Z0B15", f"G69X200{code}", *lines]
    )
    cell = load_config(HEAD_HEAD)
    result = _plan(tmp_path, text + "\nG105\n", cell)
    assert [f["blocks_in"] for f in result.filters] == [len(lines)]
    assert result.motion_time_s < 1.1 * (80.0 * np.pi / (2000.0 / 60.0)) + 1.0
