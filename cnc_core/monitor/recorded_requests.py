"""The requests of the contour look-ahead in a recording, and their answers."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.units import AnyArray
from hli import layout

from ..observing.sight import elements_told, request_told
from ..recording.reading import Recording
from ..recording.recorded_answers import RecordedContour

LOG = "the recording does not hold what the marked log answered"
REFUSED = "the CNC refused this request"
SHORT = "the recording holds {} of the {} elements of this answer"
NO_TABLE = "the recording has no table {}: it was recorded with --record-only"
BLOCK = layout.HLI_CONTOUR_LOOKAHEAD_BLOCK
DISTANCE = 2  # mode of a request
COLUMNS = ("t", "cycle", "mode", "start", "length", "elements")


class RecordedRequests:
    """``at`` tells the last request up to a time as a live page has it."""

    def __init__(self, recording: Recording) -> None:
        self._problem = _missing(recording)
        if self._problem:
            return
        self._contour = RecordedContour(recording)
        table = recording.requests
        self._rows = {name: table[name] for name in COLUMNS}
        self._epochs = _epochs_of(recording, self._rows["cycle"])

    def at(self, time_s: float) -> dict[str, Any]:
        """The request and its elements; ``problem``: why there are none."""
        if self._problem:
            return {"elements": [], "problem": self._problem}
        row = int(np.searchsorted(self._rows["t"], time_s, side="right")) - 1
        if row < 0:
            return {"elements": []}
        mode, count, start, length = (
            self._rows[name][row].item()
            for name in ("mode", "elements", "start", "length")
        )
        found = {"answer": row + 1} | request_told(start, length)
        if mode != DISTANCE:
            problem = LOG if mode else REFUSED
            return found | {"elements": [], "problem": problem}
        epoch = int(self._epochs[row]) + 1
        blocks = self._contour.answer(start, length, epoch, np.inf)[:count]
        found["elements"] = elements_told(
            BLOCK.from_buffer_copy(row.tobytes()) for row in blocks
        )
        if len(blocks) < count:
            found["problem"] = SHORT.format(len(blocks), count)
        return found


def _missing(recording: Recording) -> str:
    """Why there is nothing to show; empty: there is."""
    for name in ("requests", "elements"):
        if name not in recording.tables:
            return NO_TABLE.format(name)
    return ""


def _epochs_of(recording: Recording, cycles: AnyArray) -> npt.NDArray[np.int64]:
    """How often the distance was reset ahead of the block of these cycles."""
    elements, driven = recording.elements, recording.cycles
    known = "block" in driven.columns and len(driven) and len(elements)
    if not known or "epoch" not in elements.columns:
        return np.zeros(len(cycles), np.int64)
    at = np.searchsorted(driven["cycle"], cycles).clip(0, len(driven) - 1)
    blocks = driven["block"][at]
    rows = np.searchsorted(elements["element"], blocks, side="right") - 1
    epochs: npt.NDArray[np.int64] = elements["epoch"][rows.clip(0)]
    return epochs.astype(np.int64)
