"""Machining time of the program before and after."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..config import CellConfig
from ..errors import CncError
from ..planning import plan_program
from ..program import Program
from .program_text import BEGIN, SETUP_LINE, expanded, middle


def program_before(source: Path, setup: Path, folder: Path) -> Path:
    """The input with this setup as a program that runs."""
    path = folder / "before.osai"
    lines = expanded(source)
    (folder / "setup").write_text(
        setup.read_text(encoding="utf-8"), encoding="utf-8"
    )
    if any(BEGIN.match(line) for line in lines):
        lines = [
            "(HSM,setup)",
            *(line for line in lines if not SETUP_LINE.match(line)),
        ]
    else:
        first, last = middle(lines)
        lines = [
            *lines[: first or 0],
            "(HSM,setup)",
            "G61",
            *lines[first or 0 : last],
            "G60",
            *lines[last:],
        ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def planned_time(
    program: Callable[[Path], Path], cell: CellConfig
) -> float | None:
    """Machining time, s, of the program that ``program`` puts into a folder;
    None where it cannot be planned.
    """

    with tempfile.TemporaryDirectory() as folder:
        try:
            return plan_program(
                Program(program(Path(folder)), cell, "osai")
            ).motion_time_s
        except CncError:
            return None


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
