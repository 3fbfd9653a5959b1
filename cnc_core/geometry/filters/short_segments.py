"""Short segments are left out: a vertex nearer than ``length`` mm (FILTER row)
to the vertex kept last goes.

``length`` 0: as far as the feed of the row gets in ``value`` s.  The end of a
run stays.  The override has no effect on what is driven here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cnc_core.blocks import NO_OVERRIDE
from cnc_core.blocks.pool import rows_joined
from cnc_core.units import FloatArray

from .run_filter import EMPTY, SHORT, Rows, RunFilter


class ShortSegments(RunFilter):
    """The last row of the run is held back: it stays, whatever its length."""

    code, name = SHORT, "RLS"
    length = seconds = 0.0

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        super().__init__(start, main)
        self._held: Rows = EMPTY
        self._kept = start.copy()
        self._left: list[FloatArray] = []

    def settings(self, row: Any) -> None:
        self.length = float(row["length"])
        self.seconds = float(row["value"])

    def extend(self, rows: Rows, start: FloatArray) -> Rows:
        if not len(self._held):
            self._kept, self._left = start.copy(), []
        rows["flags"] |= NO_OVERRIDE
        rows = rows_joined([self._held, rows])
        self._held = rows[-1:]
        rows = rows[:-1]
        return self._kept_of(rows)

    def finish(self) -> Rows:
        held, self._held = self._held, EMPTY
        if not len(held):
            return held
        end = held["end"][0, : self.count].copy()
        out = self.with_lengths(held, self._kept)
        self._note(end)
        return out

    def _kept_of(self, rows: Rows) -> Rows:
        before, used = self._kept, self.used
        limits = (
            rows["feed"] * self.seconds
            if self.length == 0.0
            else np.full(len(rows), self.length)
        )
        keep = np.zeros(len(rows), dtype=bool)
        ends = rows["end"][:, : self.count].copy()
        place = self._kept[used].tolist()
        for i, (end, limit) in enumerate(
            zip(ends[:, used].tolist(), limits.tolist(), strict=True)
        ):
            keep[i] = math.dist(end, place) >= limit
            if keep[i]:
                place = end
                self._note(ends[i])
            else:
                self._left.append(ends[i])
        return self.with_lengths(rows[keep], before)

    def _note(self, end: FloatArray) -> None:
        """A vertex stays: how far those left out before it lie beside the new
        segment.
        """
        if self._left:
            self.deviates(
                np.vstack([self._kept, *self._left, end]),
                np.vstack([self._kept, end]),
            )
        self._kept, self._left = end, []
