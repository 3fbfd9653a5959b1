"""Low-pass filter of the vertices, per axis: y += level * (x - y), beginning at
the start of the run; its end is exact.

FILTER row: ``end`` the level per axis, 0 to 1 (0: the axis is not filtered);
``length`` mm, longer segments end the run (0: as far as the feed of the row
gets in ``value`` s).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cnc_core.blocks.pool import rows_joined
from cnc_core.units import FloatArray

from .run_filter import EMPTY, LOW_PASS, Rows, RunFilter

NOTED = 96  # vertices compared at a time


class LowPass(RunFilter):
    """The last row is held back: its end may be the end of the run."""

    code, name = LOW_PASS, "SMOOTHING"
    length = seconds = 0.0

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        super().__init__(start, main)
        self.level = np.ones(self.count)
        self._held: Rows = EMPTY
        self._state = start.copy()  # y
        self._end = start.copy()  # of the row given out last
        self._before = [start.copy()]
        self._after = [start.copy()]
        self._judged = 0

    def settings(self, row: Any) -> None:
        level = np.array(row["end"][: self.count])
        self.level = np.where(level > 0, level, 1.0)
        self.length = float(row["length"])
        self.seconds = float(row["value"])

    def extend(self, rows: Rows, start: FloatArray) -> Rows:
        longest = (
            rows["feed"] * self.seconds
            if self.length == 0.0
            else np.full(len(rows), self.length)
        )
        short = rows["length"] <= longest + 1e-12
        out = []
        begin = 0
        starts = np.vstack([start, rows["end"][:-1, : self.count]])
        for i in [*np.flatnonzero(~short), len(rows)]:
            if i > begin:
                out.append(self._filtered(rows[begin:i], starts[begin]))
            if i < len(rows):
                out += [self.finish(), rows[i : i + 1]]
            begin = int(i) + 1
        return np.concatenate(out)

    def finish(self) -> Rows:
        held, self._held = self._held, EMPTY
        if not len(held):
            return held
        out = self.with_lengths(held, self._end)
        self._note(
            held["end"][0, : self.count].copy(),
            held["end"][0, : self.count].copy(),
        )
        self._compare()
        return out

    def _filtered(self, rows: Rows, start: FloatArray) -> Rows:
        if not len(self._held):
            self._state = start.copy()
            self._end = start.copy()
            self._before = [start.copy()]
            self._after = [start.copy()]
            self._judged = 0
        rows = rows_joined([self._held, rows])
        self._held = rows[-1:].copy()
        rows = rows[:-1].copy()
        first = self._end
        vertices = rows["end"][:, : self.count].copy()
        made = vertices.copy()
        for axis in np.flatnonzero(self.level < 1.0):
            made[:, axis] = _low_passed(
                vertices[:, axis].tolist(),
                float(self._state[axis]),
                float(self.level[axis]),
            )
        rows["end"][:, : self.count] = made
        if len(rows):
            self._state = made[-1].copy()
            self._end = made[-1].copy()
        for vertex, place in zip(vertices, made, strict=True):
            self._note(vertex, place)
        return self.with_lengths(rows, first)

    def _note(self, vertex: FloatArray, made: FloatArray) -> None:
        self._before.append(vertex)
        self._after.append(made)
        if len(self._before) > NOTED:
            self._compare(NOTED // 3)

    def _compare(self, ahead: int = 0) -> None:
        """Deviation of the stretch noted so far; its last third begins the next one."""
        self.deviates(
            np.array(self._before), np.array(self._after), ahead, self._judged
        )
        self._judged = NOTED // 3
        self._before = self._before[-NOTED // 3 :]
        self._after = self._after[-NOTED // 3 :]


def _low_passed(values: list[float], state: float, level: float) -> list[float]:
    out = []
    for value in values:
        state += level * (value - state)
        out.append(state)
    return out
