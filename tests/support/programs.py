"""Programs of any dialect in tests: from text to rows, to a plan, to an error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cnc_core.blocks import NC_BLOCK, POLYNOMIAL, BlockBatch
from cnc_core.config import CellConfig, parse_config
from cnc_core.errors import CncError
from cnc_core.frontend.offline import read_all
from cnc_core.planning import PlanResult, plan_program
from cnc_core.program import Program

Rows = npt.NDArray[Any]


def program_of(
    folder: Path,
    text: str,
    cell: str | CellConfig = "",
    dialect: str = "isg",
    **options: Any,
) -> Program:
    """Write a program into a folder and open it on a cell (TOML text or read)."""
    path = folder / ("part.nc" if dialect == "isg" else f"part.{dialect}")
    path.write_text(text)
    machine = parse_config(cell) if isinstance(cell, str) else cell
    return Program(path, machine, dialect, **options)


def ended_program(
    folder: Path, text: str, cell: str | CellConfig = "", **options: Any
) -> Program:
    """An ISG program with M30 behind its text."""
    return program_of(folder, f"{text}\nM30\n", cell, **options)


def rows_of(source: Any, size: int = 4096) -> Rows:
    """All rows of a program or front end, read in batches of a size; waits are passed."""
    found = [
        item.rows.copy()
        for item in read_all(source, size)
        if isinstance(item, BlockBatch)
    ]
    return np.concatenate(found) if found else np.empty(0, NC_BLOCK)


def motions_of(rows: Rows) -> Rows:
    """The rows that move."""
    return rows[rows["type"] <= POLYNOMIAL]


def planned(program: Program, **options: Any) -> PlanResult:
    """The plan of a program, with samples."""
    return plan_program(program, **{"keep_samples": True} | options)


def error_of(
    read: Callable[..., object], *arguments: Any, **options: Any
) -> CncError:
    """The error with which a call ends."""
    with pytest.raises(CncError) as caught:
        read(*arguments, **options)
    return caught.value
