"""The recording of a CNC process."""

from __future__ import annotations

from typing import Any

from ..config import CellConfig
from ..engine import Engine
from ..recording.account import account, as_bytes
from ..recording.recorder import Recorder
from .options import CncOptions


def recorder_for(
    engine: Engine, cell: CellConfig, options: CncOptions
) -> Recorder | None:
    """Who records this process, if anything is to be recorded."""
    if options.samples is None:
        return None
    about = account(options.file, cell, options.run.clock, options.config)
    return Recorder(
        engine,
        options.samples,
        cell,
        as_bytes(about),
        options.run.record_only,
    )


def missing_rows(recorder: Recorder | None) -> dict[str, Any]:
    """What is missing in the recording, and why."""
    if recorder is None:
        return {}
    return {"lost": recorder.lost, "problem": recorder.problem}
