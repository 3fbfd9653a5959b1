"""Machining time of the program before and after."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cnc_core.units import FloatArray

from ..config import CellConfig
from ..errors import CncError
from ..planning import Feeder, plan_program
from ..program import Program
from .program_text import BEGIN, SETUP_LINE, expanded, middle
from .progress import Tick


@dataclass(frozen=True)
class Planned:
    """Machining time, s, and where the axes (mm, degrees) stand behind it."""

    time_s: float
    end: FloatArray


def runnable(lines: list[str], setup: str) -> list[str]:
    """The lines of the input as a program that runs with the setup file
    ``setup``.
    """
    if any(BEGIN.match(line) for line in lines):
        return [
            f"(HSM,{setup})",
            *(line for line in lines if not SETUP_LINE.match(line)),
        ]
    first, last = middle(lines)
    return [
        *lines[: first or 0],
        f"(HSM,{setup})",
        "G61",
        *lines[first or 0 : last],
        "G60",
        *lines[last:],
    ]


def program_before(source: Path, setup: Path, folder: Path) -> Path:
    """The input with this setup as a program that runs."""
    path = folder / "before.osai"
    shutil.copyfile(setup, folder / "setup")
    lines = runnable(expanded(source), "setup")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def planned(path: Path, cell: CellConfig, tick: Tick) -> Planned | None:
    """A program as it is driven; None where it cannot be planned."""
    end = np.zeros(0)
    size = max(path.stat().st_size, 1)

    def look(feeder: Feeder) -> None:
        nonlocal end
        moved = feeder.batch.rows[feeder.batch.motion]
        end = moved["end"][-1].copy() if len(moved) else end
        tick(feeder.program.bytes_read / size, feeder.n)

    try:
        result = plan_program(Program(path, cell, "osai"), look=look)
    except CncError:
        return None
    return Planned(result.motion_time_s, end)


def compare(
    source: Path, out: Path, setup: Path, cell: CellConfig
) -> dict[str, Any]:
    """Machining time, s, and root mean square of the jerk of both programs on a
    cell.
    """

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        before = program_before(source, setup, Path(folder))
        for name, path in (("before", before), ("after", out)):
            result = plan_program(
                Program(path, cell, "osai"), keep_samples=True
            )
            assert result.samples is not None
            jerk = (
                np.diff(
                    result.samples["pos"],
                    n=3,
                    axis=0,
                )
                / cell.cycle_s**3
            )
            rms = (
                float(np.sqrt((jerk**2).sum(axis=1).mean()))
                if len(jerk)
                else 0.0
            )
            found[name] = {"time_s": result.motion_time_s, "jerk_rms": rms}
    return found
