"""Rows gathered across waits come out as those that are put through one by one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import NC_BLOCK, BlockBatch
from cnc_core.errors import CncError
from cnc_core.program import Program
from support.isons_programs import CELL, exact_cell

MACROS = {
    "M44.isons": "GLOBAL $S\n$S=$S+$_Q0*($_Q1+2)\n",
    "M45.isons": "G91\nG1X0.25Y-0.5\nG62\nG90\n",
    "HM46.isons": "GLOBAL $S\nGET $B\nG1Z[$_Q2+$B]\n$S=$S+$_Q2\n",
}
LIMITS = (
    "[axes.X]\nmax_mm = 30.0\n[axes.Y]\n[axes.Z]\n[axes.A]\nkind = 'rotary'\n"
)
OTHERS = [
    *("M44", "M45", "HM46 0.5", "M3S100", "G62", "G4F0.1", "$C=$_Q1", "T0"),
    *("G41", "G40", "G60", "G61", "G30 R0.5 A20", "G31", "G50 X1 Y2 Z30"),
    *(
        "G51",
        "G94X3",
        "G98",
        "G99",
        "G69X20",
        "#CONTOUR LOOKAHEAD LOG [PARAM=2]",
    ),
    *("G1DX3", "G2X[$_Q0+2]R4", "G100X3", "G49 X", "G49", "G106 [0] X1 A0.5"),
]


def _program(seed: int, count: int) -> str:
    rng = np.random.default_rng(seed)
    lines = ["GLOBAL $S", "$S=0", "D1", "G60", "F6"]
    for _ in range(count):
        x, y = rng.uniform(0.0, 34.0), rng.uniform(-9.0, 9.0)
        lines.append(f"G1X{x:.3f}Y{y:.3f}")
        if rng.random() < 0.8:
            kinds = OTHERS[:8] if rng.random() < 0.8 else OTHERS
            lines.append(str(rng.choice(kinds)))
    return "\n".join([*lines, "G40"]) + "\n"


def _read(
    folder: Path, text: str, *, gathered: bool, collect: bool
) -> tuple[Any, ...]:
    (folder / "p.isons").write_text(text)
    for name, macro in MACROS.items():
        (folder / name).write_text(macro)
    program = Program(
        folder / "p.isons",
        exact_cell(LIMITS),
        "isons",
        collect=collect,
        programmed=True,
    )
    parts: list[Any] = []
    stopped = ""
    items = program.batches() if gathered else iter(program.read, None)
    try:
        for item in items:
            if isinstance(item, BlockBatch):
                parts.append(item.rows.copy())  # noqa: PERF401 - it may be refused
    except CncError as error:
        stopped = str(error)
    program.reader.close()
    rows = np.concatenate([np.empty(0, NC_BLOCK), *parts])
    told = [str(error) for error in program.errors]
    return rows.tobytes(), told, stopped, program.reader.store.common.values


@pytest.mark.parametrize("collect", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_gathered_or_not(tmp_path: Path, seed: int, collect: bool) -> None:
    """Rows, errors, and what macros read of the machine; limits refuse some rows."""
    text = _program(seed, 30)
    one_by_one = _read(tmp_path, text, gathered=False, collect=collect)
    together = _read(tmp_path, text, gathered=True, collect=collect)
    assert together[1:] == one_by_one[1:]
    assert together[0] == one_by_one[0]


def test_the_stages_see_few_batches(tmp_path: Path) -> None:
    """A macro behind each motion does not make a batch of each motion."""
    text = "G60\n" + "".join(f"G1X{i}F6\nM44\n" for i in range(1, 101))
    for name, macro in MACROS.items():
        (tmp_path / name).write_text(macro)
    (tmp_path / "p.isons").write_text("GLOBAL $S\n$S=0\n" + text)
    program = Program(
        tmp_path / "p.isons",
        exact_cell(CELL),
        "isons",
        collect=True,
        programmed=True,
    )
    sizes = [len(batch) for batch in program.batches() if len(batch)]
    assert sum(sizes) == 100
    assert len(sizes) < 10
