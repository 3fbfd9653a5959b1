"""One run of a study: its figures, as a row of the table."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..cell import Cell, RunResult
from ..cell.scratch import scratch_prefix
from ..config import CellConfig
from ..config.reading import config_of
from ..config.toml import toml_of
from ..errors import CncError
from ..planning import PlanResult, plan_program
from ..program import Program
from .points import Point, plc_of
from .study import Figure, Study

Row = dict[str, Any]
REDUCE: dict[str, Callable[[Any], Any]] = {
    "last": lambda values: values[-1],
    "max": np.max,
    "min": np.min,
    "mean": np.mean,
    "max_abs": lambda values: np.max(np.abs(values)),
}
RECORDINGS = "recordings"
TRIES, PAUSE_S = 3, 0.5
DIED, NOT_WRITTEN = 905001, 901004
NO_SPACE = os.strerror(errno.ENOSPC)
# of a result: what is the same whatever the machine
OF_RUN = ("sim_time_s", "cycles", "blocks", "recorded", "overruns")


def make(study: Study, folder: Path, point: Point, record: Path | None) -> Row:
    """Figures of one run; what fails is a row with ``end`` and ``error``.

    What lies in the machine and not in the run is tried again: a process that
    was killed, a file that cannot be written.

    ``folder``: of the study's file.  ``record``: where its recording goes.
    OSError: a file cannot be written, the disk is full.
    """
    started = time.monotonic()
    for left in reversed(range(TRIES)):
        try:
            row = {"end": "completed", "error": ""}
            row |= _measured(study, folder, point, record)
            break
        except CncError as error:
            row = {"end": "error", "error": str(error).splitlines()[0]}
            is_full = error.code == NOT_WRITTEN or NO_SPACE in str(error)
            if not is_full and error.code != DIED:
                break
            if record is not None:  # what the disk had no room for
                shutil.rmtree(f"{record}.parts", ignore_errors=True)
            if is_full and not left:
                raise OSError(str(error)) from None
            time.sleep(PAUSE_S)
        except OSError:
            raise
        except Exception as error:
            text = f"{type(error).__name__}: {error}"
            row = {"end": "error", "error": text}
            break
    return row | {"seconds": time.monotonic() - started}


def _measured(
    study: Study, folder: Path, point: Point, record: Path | None
) -> Row:
    row: Row = {}
    cell = cell_of(folder, point)
    if "plan" in study.measure:
        row |= _planned(cell, folder, point)
    if "run" in study.measure:
        row |= _run(study, cell, folder, point, record)
    return row


def recording_of(study: Study, folder: Path, number: int) -> Path | None:
    """Where a run of the sweep's folder is recorded."""
    if not study.recordings:
        return None
    (folder / RECORDINGS).mkdir(exist_ok=True)
    return folder / RECORDINGS / f"{number:07d}.parquet"


def cell_of(folder: Path, point: Point) -> CellConfig:
    """The cell with the point's members; CncError names a wrong one."""
    table: dict[str, Any] = (
        toml_of((folder / point.cell).read_text(), point.cell)
        if point.cell
        else {"axes": {name: {} for name in CellConfig().axes}}
    )
    for name, value in of_family(point, "cell").items():
        _set(table, name.split("."), value)
    cell = config_of(table)
    cell.of_one_channel()
    return cell


def of_family(point: Point, family: str) -> dict[str, Any]:
    """Parameters of one family without its name."""
    begin = f"{family}."
    return {
        name.removeprefix(begin): value
        for name, value in point.parameters.items()
        if name.startswith(begin)
    }


def _set(table: dict[str, Any], path: list[str], value: Any) -> None:
    for part in path[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            name = ".".join(path)
            raise CncError(902001, f"cell.{name}: {part} is no table")
    table[path[-1]] = value


def _planned(cell: CellConfig, folder: Path, point: Point) -> Row:
    tolerance = of_family(point, "run").get("tolerance")
    program = Program(folder / point.program, cell, tolerance=tolerance)
    result: PlanResult = plan_program(program)
    return {
        "plan.motion_time_s": result.motion_time_s,
        "plan.blocks": result.blocks,
        "plan.path_deviation_mm": result.path_deviation_mm,
        **{f"plan.max_ratio.{k}": v for k, v in result.max_ratio.items()},
        **{f"plan.time.{k}_s": v for k, v in result.time_by_cause.items()},
    }


def _run(
    study: Study,
    cell: CellConfig,
    folder: Path,
    point: Point,
    record: Path | None,
) -> Row:
    with tempfile.TemporaryDirectory(prefix=scratch_prefix()) as aside:
        options: dict[str, Any] = {
            **of_family(point, "run"),
            "clock": study.clock,
            "out": Path(aside) / "out",
            "force": of_family(point, "force"),
            "watch": _watched(study),
            "record": record or (_needs_record(study) or None),
        }
        result = Cell(cell).run(
            folder / point.program, plc_of(point.plc, folder), **options
        )
        for error in result.errors:
            if error["code"] in (DIED, NOT_WRITTEN):
                raise CncError(error["code"], error["text"])
        return dict(_figures(study, result))


def _watched(study: Study) -> tuple[str, ...]:
    return tuple(
        figure.symbol
        for figure in study.figures.values()
        if not _is_column(figure)
    )


def _is_column(figure: Figure) -> bool:
    """A column of the table ``cycles`` has no place of a symbol in its name."""
    return not any(sign in figure.symbol for sign in ".[")


def _needs_record(study: Study) -> bool:
    return any(_is_column(figure) for figure in study.figures.values())


def _figures(study: Study, result: RunResult) -> Iterator[tuple[str, Any]]:
    for name in OF_RUN:
        yield name, getattr(result, name)
    for mode, count in result.requests.items():
        yield f"requests.{mode}", count
    for cause, seconds in result.time_by_cause.items():
        yield f"time.{cause}_s", seconds
    for name, figure in study.figures.items():
        yield name, _reduced(figure, result)
    yield "end", result.end
    yield "error", "; ".join(_text(error) for error in result.errors)


def _reduced(figure: Figure, result: RunResult) -> float | None:
    values = np.asarray(result.columns[figure.symbol], float)
    values = values[~np.isnan(values)]
    return float(REDUCE[figure.of](values)) if len(values) else None


def _text(error: dict[str, Any]) -> str:
    return f"{error['code']}: {error['text']}"
