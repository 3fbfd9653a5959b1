"""The recording of a run that has ended, and what is told of it."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable
from pathlib import Path

from ..errors import CncError
from ..process.recording import Missing
from ..recording.parts import Parts
from ..recording.reading import SOURCES, Recording
from ..recording.schema import PLC_TABLES
from .result import RunInterrupted, RunResult
from .scratch import scratch_folder


def plc_part(
    parts: Parts | None, only: tuple[str, ...]
) -> tuple[Path, list[str]] | None:
    """File and tables of the PLC's part; None if there is nothing of a PLC.

    ``only``: tables and columns that are recorded; none: all.
    """
    tables = [name for name in PLC_TABLES if not only or name in only]
    return (parts.plc, tables) if parts and tables else None


def keep_recording(
    result: RunResult, parts: Parts, missing: Missing, end: str
) -> None:
    """Write the file that the user named.

    The run's own end stays as it was where that fails; ``end``: how it ended.
    """
    result.record_lost = sum(missing.lost.values())
    result.warnings += missing.told()
    if parts.recovered:
        result.warnings.append(
            f"recording: what a dead run left is now {parts.recovered}"
        )
    try:
        result.recorded = parts.finish(end=end, lost=missing.lost)
        if parts.target.suffix in SOURCES:
            result.recording = Recording(parts.target)
    except CncError as error:
        result.unwritten = True
        result.errors.append(error.as_json())


def recorded_aside(run: Callable[[Path], RunResult]) -> RunResult:
    """A run whose recording has no name: it goes with the last who reads it.

    ``run``: runs and records to this file.
    """
    folder = scratch_folder()
    try:
        result = run(folder / "run.arrow")
    except RunInterrupted as stop:
        _drop_with(stop.result.recording, folder)
        raise RunInterrupted(stop.result) from None
    except BaseException:
        _drop_with(None, folder)
        raise
    _drop_with(result.recording, folder)
    return result


def _drop_with(recording: Recording | None, folder: Path) -> None:
    """Remove the folder when nobody has the recording any more."""
    if recording is None:
        shutil.rmtree(folder, ignore_errors=True)
    else:
        weakref.finalize(recording.source, shutil.rmtree, folder, True)
