"""Recordings as the page shows them: thinned columns, the program, events."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CncError
from ..observing.plc import RefusedError
from ..observing.sight import MM
from ..recording.reading import Recording, Table
from .recorded_requests import RecordedRequests

ROWS = 20_000
LINES = 20_000
EVENTS = 500
NOT_READABLE = CncError, OSError, ValueError, KeyError
NUMBERS = (
    "t",
    "s",
    "v",
    "feed",
    "override",
    "acceleration",
    "dist_prog_start",
    "max_dist_prog_start",
    "n",
    "count",
    "line",
    "overruns",
    "planner_us_per_ms",
)


class Recorded:
    """The recordings that a server may show, by file name."""

    def __init__(self, paths: list[Path]) -> None:
        self._paths = {path.name: path for path in paths}
        self._asking = threading.Lock()
        self._requests: tuple[tuple[str, str, int], RecordedRequests] | None
        self._requests = None  # of the recording that was asked for last

    def names(self) -> list[str]:
        """What may be opened now: a run may still be writing its own."""
        return [name for name, path in self._paths.items() if path.exists()]

    def shown(self, name: str, channel: str = "") -> dict[str, Any]:
        """One recording; of several channels the named one, else the first.

        RefusedError: not served, or not readable.
        """
        try:
            whole, recording = self._open(name, channel)
            return shown(recording) | {"channels": list(whole.channels)}
        except NOT_READABLE as error:
            raise RefusedError(str(error)) from None

    def contour(self, name: str, channel: str, time_s: float) -> dict[str, Any]:
        """The last request up to this time and its answer.  RefusedError."""
        path = self._paths.get(name)
        try:
            changed = path.stat().st_mtime_ns if path else 0
            key = name, channel, changed
            with self._asking:
                if self._requests is None or self._requests[0] != key:
                    _, recording = self._open(name, channel)
                    self._requests = key, RecordedRequests(recording)
                return self._requests[1].at(time_s)
        except NOT_READABLE as error:
            raise RefusedError(str(error)) from None

    def _open(self, name: str, channel: str) -> tuple[Recording, Recording]:
        """A recording, and the channel that is meant."""
        if name not in self._paths and not channel:  # FILE CHANNEL
            name, _, channel = name.rpartition(" ")
        path = self._paths.get(name)
        if path is None:
            raise RefusedError(f"recording {name[:64]!r} is not served here")
        whole = Recording(path)
        if not (channel or whole.channels):
            return whole, whole
        return whole, whole.channel(channel or whole.channels[0])


def shown(recording: Recording) -> dict[str, Any]:
    """Columns of cycles at the same instants, events, functions, program."""
    cycles = recording.cycles
    n = len(cycles)
    keep = np.unique(np.linspace(0, max(n - 1, 0), min(n, ROWS)).astype(int))
    axes = [a for a in recording.meta.get("axes", {}) if a in cycles.columns]
    columns = {
        name: _numbers(cycles, name, keep)
        for name in (*NUMBERS, *axes)
        if name in cycles.columns
    }
    for name in ("dist_prog_start", "max_dist_prog_start"):
        if name in columns:
            columns[name] = [value * MM for value in columns[name]]
    program = recording.meta.get("program", {})
    return {
        "name": recording.path.name,
        "channel": recording.meta.get("channel", ""),
        "complete": recording.complete,
        "rows": n,
        "axes": axes,
        "units": {name: cycles.units.get(name, "") for name in columns},
        "columns": columns,
        "symbols": _symbols(recording, cycles["t"][keep] if n else None),
        "functions": _rows(recording, "functions"),
        "events": _rows(recording, "events"),
        "program": str(program.get("file", "")),
        "lines": program.get("text", "").splitlines()[:LINES],
    }


def _numbers(table: Table, name: str, keep: Any) -> list[float]:
    values = table[name][keep].astype(float)
    return [round(value, 5) for value in values.tolist()]


def _symbols(recording: Recording, times: Any) -> dict[str, list[float]]:
    """Watched symbols of the PLC, as they were at these times."""
    if "plc" not in recording.tables or times is None:
        return {}
    table = recording.plc
    t = table["t"]
    if not len(t):
        return {}
    at = np.clip(np.searchsorted(t, times, "right") - 1, 0, len(t) - 1)
    return {
        name: _numbers(table, name, at)
        for name in table.columns
        if name not in ("cycle", "t", "scan")
    }


def _rows(recording: Recording, name: str) -> list[dict[str, Any]]:
    """The first rows of a small table."""
    if name not in recording.tables:
        return []
    found: list[dict[str, Any]] = []
    for chunk in recording.table(name).chunks():
        found += chunk.slice(0, EVENTS - len(found)).to_pylist()
        if len(found) >= EVENTS:
            break
    return found
