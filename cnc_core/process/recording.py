"""Recording of a run: raw samples while it lasts, a finished file at the end.

While the cell runs, the CNC process appends raw rows to a part file, so that
nothing recorded is lost when it dies; the launcher turns the part file into
``.npz`` (arrays as ``plan --samples``), ``.csv`` or, with the extra ``record``,
``.parquet``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..config import CellConfig
from ..engine import Samples
from ..errors import CncError

SUFFIXES = (".npz", ".csv", ".parquet")


def check_target(path: Path) -> None:
    """CncError if a recording cannot be written as this kind of file."""
    if path.suffix not in SUFFIXES:
        raise CncError(
            902001,
            f"recording {path}: the name must end in {', '.join(SUFFIXES)}",
        )
    if path.suffix == ".parquet":
        _pyarrow()
    check_writable(path)


def check_writable(path: Path) -> None:
    """CncError if a file of this name cannot be written; leaves no file behind."""
    there = path.exists()
    try:
        path.open("ab").close()
    except OSError as error:
        raise CncError(
            901004, f"{path}: cannot be written: {error.strerror}"
        ) from None
    if not there:
        path.unlink()


def _pyarrow() -> Any:
    try:
        import pyarrow  # noqa: PLC0415
        import pyarrow.parquet  # noqa: PLC0415
    except ImportError:
        raise CncError(
            902001,
            "parquet recordings need the extra: pip install 'hli-cosim[record]'",
        ) from None
    return pyarrow


class PartWriter:
    """Appends samples to the part file, unbuffered."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("ab", buffering=0)

    def add(self, samples: Samples) -> None:
        columns = [
            samples.cycle,
            *samples.pos.T,
            samples.path,
            samples.speed,
            samples.element.astype(np.float64),
        ]
        self._file.write(
            np.ascontiguousarray(np.column_stack(columns)).tobytes()
        )

    def close(self) -> None:
        self._file.close()


def _columns(part: Path, cell: CellConfig) -> dict[str, Any]:
    width = len(cell.axes) + 4
    count = part.stat().st_size // (8 * width) if part.exists() else 0
    shape = (count, width)
    rows: npt.NDArray[np.float64] = (
        np.memmap(part, np.float64, "r", shape=shape)
        if count
        else np.empty(shape)
    )
    a = len(cell.axes)
    # the start, as `plan --samples` has it
    start = cell.axis_values("start_mm")
    first = np.concatenate([[0.0], start, np.zeros(3)])
    rows = np.concatenate([first[None, :], rows])
    return {
        "t": rows[:, 0] * cell.cycle_s,
        "pos": rows[:, 1 : a + 1],
        "axes": np.array(cell.axis_names),
        "s": rows[:, a + 1],
        "v": rows[:, a + 2],
        "block": rows[:, a + 3],
    }


def finish(part: Path, target: Path, cell: CellConfig) -> int:
    """Write the recording; returns the number of samples."""
    columns = _columns(part, cell)
    if target.suffix == ".npz":
        with target.open("wb") as file:
            np.savez(file, **columns)
    else:
        _write_table(columns, target)
    return len(columns["t"])


def _write_table(columns: dict[str, Any], target: Path) -> None:
    names = ["t", *columns["axes"], "s", "v", "block"]
    table = np.column_stack(
        [
            columns["t"],
            columns["pos"],
            columns["s"],
            columns["v"],
            columns["block"],
        ]
    )
    if target.suffix == ".csv":
        np.savetxt(
            target,
            table,
            delimiter=",",
            header=",".join(names),
            comments="",
            fmt="%.9g",
        )
        return
    arrow = _pyarrow()
    by_name = dict(zip(names, table.T, strict=True))
    arrow.parquet.write_table(arrow.table(by_name), target)
