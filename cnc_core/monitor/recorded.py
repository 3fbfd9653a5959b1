"""Recordings as the page shows them: thinned columns, the program, events."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CncError
from ..observing.plc import RefusedError
from ..observing.sight import MM
from ..recording.reading import Recording, Table

ROWS = 20_000
LINES = 20_000
EVENTS = 500
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
)


class Recorded:
    """The recordings that a server may show, by file name."""

    def __init__(self, paths: list[Path]) -> None:
        self._paths = {path.name: path for path in paths}
        self._channels: dict[Path, tuple[int, tuple[str, ...]]] = {}

    def names(self) -> list[str]:
        """What may be opened now: a run may still be writing its own.

        Of a cell with several channels: each of them, ``FILE CHANNEL``.
        """
        return [
            name
            for file, path in self._paths.items()
            if path.exists()
            for name in self._names_in(file, path)
        ]

    def _names_in(self, file: str, path: Path) -> list[str]:
        """Looked up again when the file has changed."""
        changed = path.stat().st_mtime_ns
        known = self._channels.get(path)
        if known is None or known[0] != changed:
            try:
                found = Recording(path).channels
            except (CncError, OSError, ValueError, KeyError):
                found = ()  # whoever opens it is told
            known = self._channels[path] = changed, found
        return [f"{file} {name}" for name in known[1]] or [file]

    def shown(self, name: str) -> dict[str, Any]:
        """One recording.  RefusedError: not served, or not readable."""
        path, channel = self._paths.get(name), ""
        if path is None:
            file, _, channel = name.rpartition(" ")
            path = self._paths.get(file)
        if path is None:
            raise RefusedError(f"recording {name[:64]!r} is not served here")
        try:
            recording = Recording(path)
            if channel or recording.channels:
                recording = recording.channel(channel or recording.channels[0])
            return shown(recording)
        except (CncError, OSError, ValueError, KeyError) as error:
            raise RefusedError(str(error)) from None


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
        "name": " ".join(
            filter(None, (recording.path.name, recording.meta.get("channel")))
        ),
        "complete": recording.complete,
        "rows": n,
        "axes": axes,
        "units": {name: cycles.units.get(name, "") for name in columns},
        "columns": columns,
        "symbols": _symbols(recording, cycles["t"][keep] if n else None),
        "functions": _rows(recording, "functions"),
        "events": _rows(recording, "events"),
        "program": str(program.get("name", "")),
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
