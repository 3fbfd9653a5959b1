"""The recording of a run that has ended, and what is told of it."""

from __future__ import annotations

from typing import Any

from ..errors import CncError
from ..process.recording import losses
from ..recording.parts import Parts
from .result import RunResult


def keep_recording(
    result: RunResult, parts: Parts, told: dict[str, Any], end: str
) -> None:
    """Write the file that the user named.

    ``told``: what the CNC's report says of losses; ``end``: how the run ended.
    """
    lost: dict[str, int] = told.get("lost", {})
    result.record_lost = sum(lost.values())
    result.warnings += losses(lost, told.get("problem", ""))
    if parts.recovered:
        result.warnings.append(
            f"recording: what a dead run left is now {parts.recovered}"
        )
    try:
        result.recorded = parts.finish(end=end, lost=lost)
    except CncError as error:
        result.end = "error"
        result.errors.append(error.as_json())
