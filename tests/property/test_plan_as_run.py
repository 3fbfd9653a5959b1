"""``plan`` drives what ``run`` drives: the same program through the planning
feeder and through a running channel's preparation.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig, parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.inside import Inside
from support.limits import FloatArray
from support.osai_programs import SETUP_3
from support.seeds import few

Lines = list[str]


def _lines(rng: np.random.Generator, count: int, feed: str) -> Lines:
    """Lines of 0.3 to 20 mm that turn as they like."""
    out = []
    x, y = 0.0, 0.0
    for _ in range(count):
        step = float(rng.choice([0.3, 3.0, 20.0]))
        angle = rng.uniform(0, 2 * np.pi)
        x += step * float(np.cos(angle))
        y += step * float(np.sin(angle))
        out.append(f"G1 X{x:.4f} Y{y:.4f} {feed}")
    return out


def _between(rng: np.random.Generator, lines: Lines, others: Lines) -> Lines:
    """Something else behind every third line."""
    out = []
    for line in lines:
        out.append(line)
        if rng.random() < 0.33:
            out.append(str(rng.choice(others)))
    return out


def _isg(rng: np.random.Generator, _folder: Path) -> Lines:
    others = ["#FLUSH WAIT", "G04 X0.05", "#FLUSH"]
    return [*_between(rng, _lines(rng, 40, "F6000"), others), "M30"]


def _iso(rng: np.random.Generator, _folder: Path) -> Lines:
    others = ["G4 P0.05", "G61", "G64 P0.02", "M3 S100"]
    return [*_between(rng, _lines(rng, 40, "F6000"), others), "M2"]


def _isons(rng: np.random.Generator, folder: Path) -> Lines:
    (folder / "M44.isons").write_text("$A=$_Q0\n")
    (folder / "HM45.isons").write_text("GET $B\nG4F0.1\n")
    others = ["G62", "M44", "HM45 3", "G60", "G61", "G4F0.1", "$C=$_Q1"]
    return ["G60", *_between(rng, _lines(rng, 40, "F6"), others)]


def _osai(rng: np.random.Generator, folder: Path) -> Lines:
    (folder / "CONFIG1").write_text(SETUP_3)
    body = [line[2:].replace(" ", "") for line in _lines(rng, 40, "F6000")]
    marks = ["G62", "G63", "G66", "G67"]
    inside = _between(rng, [f"{body[0]}Z0", *body[1:-1]], marks)
    return [
        "G1X0Y0Z0F3000",
        "(HSM,CONFIG1)",
        "G61",
        *inside,
        body[-1],
        "G60",
        "G1X0Y0Z0F3000",
    ]


PROGRAMS: dict[str, Callable[[np.random.Generator, Path], Lines]] = {
    "isg": _isg,
    "iso": _iso,
    "isons": _isons,
    "osai": _osai,
}


def _moving(pos: FloatArray) -> FloatArray:
    """Without samples at which the axes stand: how long M functions and waits
    last is the channel's business."""
    keep = np.any(np.abs(np.diff(pos, axis=0)) > 1e-9, axis=1)
    out: FloatArray = pos[1:][keep]
    return out


def _run(folder: Path, text: str, cell: CellConfig, dialect: str) -> FloatArray:
    with Inside(folder, text, cell, dialect) as cnc:
        cnc.end()
        assert cnc.preparation.error is None
        return cnc.pos


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(4), 2))
@pytest.mark.parametrize("dialect", PROGRAMS)
def test_plan_drives_what_run_drives(
    tmp_path: Path, dialect: str, seed: int
) -> None:
    """Every sample in motion is the same, standstills of G62, macros, waits and
    live variables included (M44 was passed at 10 mm/s by ``plan``)."""
    rng = np.random.default_rng(seed)
    text = "\n".join(PROGRAMS[dialect](rng, tmp_path)) + "\n"
    cell = parse_config("")
    path = tmp_path / "planned.nc"
    path.write_text(text)
    result = plan_program(Program(path, cell, dialect), keep_samples=True)
    assert result.samples is not None
    planned = _moving(result.samples["pos"])
    driven = _moving(
        np.vstack(
            [result.samples["pos"][:1], _run(tmp_path, text, cell, dialect)]
        )
    )
    assert planned.shape == driven.shape
    np.testing.assert_allclose(planned, driven, atol=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_threads_too(tmp_path: Path, seed: int) -> None:
    """Lines on which a rotary axis outruns the path, among others."""
    rng = np.random.default_rng(seed)
    x = np.round(np.cumsum(rng.uniform(0.001, 0.05, 40)), 4)
    turn = np.round(np.cumsum(rng.uniform(0.1, 20.0, 40)), 3)
    lines = [f"G1X{a}A{b}" for a, b in zip(x, turn, strict=True)]
    others = ["G62", "G60", "G61", "G4F0.1", "$C=$_Q3", "G1DX0.5", "G0DA5"]
    text = "\n".join(["G60", "F1.2", *_between(rng, lines, others)]) + "\n"
    cell = parse_config(
        "[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.A]\nkind = 'rotary'\n"
    )
    path = tmp_path / "planned.nc"
    path.write_text(text)
    result = plan_program(Program(path, cell, "isons"), keep_samples=True)
    assert result.samples is not None
    pos = result.samples["pos"]
    driven = np.vstack([pos[:1], _run(tmp_path, text, cell, "isons")])
    np.testing.assert_allclose(_moving(pos), _moving(driven), atol=1e-9)
