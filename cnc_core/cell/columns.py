"""Columns of a run by name, as arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from cnc_core.units import AnyArray

from ..recording.reading import Recording

Array = AnyArray


class Columns(Mapping[str, Array]):
    """Arrays of one length by name, read when they are asked for.

    With a recording: the columns of its table ``cycles``, a row a cycle, and the
    symbols that were watched, each with its value of the last scan up to then.
    Without: the watched symbols and ``t`` (s), a row a scan.
    NaN where a symbol has no value.
    """

    def __init__(
        self, watched: Mapping[str, Any], recording: Recording | None = None
    ) -> None:
        self._watched = watched
        self._recording = recording
        cycles = recording.cycles.columns if recording else ()
        self._names = tuple(dict.fromkeys([*cycles, *watched]))

    def __getitem__(self, name: str) -> Array:
        recording = self._recording
        if name not in self._names:
            raise KeyError(self._unknown(name))
        if recording is None:
            return np.array(self._watched[name], float)
        if name in recording.cycles.columns:
            return recording.cycles[name]
        return self._held(recording, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"Columns({', '.join(self._names)})"

    def _held(self, recording: Recording, name: str) -> Array:
        """A watched symbol at each cycle."""
        scans: Mapping[str, Any] = self._watched
        if "plc" in recording.tables and name in recording.plc.columns:
            scans = {key: recording.plc[key] for key in ("t", name)}
        t, values = (np.array(scans[key], float) for key in ("t", name))
        cycles = recording.cycles["t"]
        # times of a scan and of its cycle are the same number but for rounding
        at = np.searchsorted(t, cycles + 1e-9, side="right")
        return np.concatenate([[np.nan], values])[at]

    def _unknown(self, name: str) -> str:
        there = ", ".join(self._names) or "none"
        more = (
            ""
            if self._recording
            else "; record=True of Cell.run has every cycle: t, s, v, the axes"
        )
        return f"no column {name!r}; there are: {there}{more}"
