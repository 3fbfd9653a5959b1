"""Noise filter: vertices behind short segments whose edge is sharp are left
out.

FILTER row: ``angle`` smallest edge, rad; ``length`` mm, shorter segments are
looked at; ``value`` 1: only cusps, edges whose turn is opposite to that of both
neighbours.  The ends of a run stay.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cnc_core.blocks.pool import rows_joined
from cnc_core.units import FloatArray

from .run_filter import (
    EMPTY,
    FINE_NOISE,
    NOISE,
    Rows,
    RunFilter,
    turns_of,
)

REACH = 2  # rows whose fate needs the rows behind them


class Noise(RunFilter):
    """Drops vertices; what is looked at is the path as it comes in."""

    code, name = NOISE, "NOISE"
    angle = length = 0.0
    cusps = False

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        super().__init__(start, main)
        self._held: Rows = EMPTY
        # of the rows ahead of the held ones (one), and of those
        self._ways: FloatArray = np.zeros((0, self.count))
        self._kept = start.copy()  # end of the row given out last
        self._left: list[FloatArray] = []  # vertices dropped since

    def settings(self, row: Any) -> None:
        self.angle = float(row["angle"])
        self.length = float(row["length"])
        self.cusps = row["value"] == 1

    def extend(self, rows: Rows, start: FloatArray) -> Rows:
        if not len(self._held):
            self._kept = start.copy()
            self._ways = np.zeros((0, self.count))
            self._left = []
        ends = rows["end"][:, : self.count]
        self._ways = np.vstack(
            [self._ways, np.diff(np.vstack([start, ends]), axis=0)]
        )
        self._held = rows_joined([self._held, rows])
        return self._give(max(0, len(self._held) - REACH), last=False)

    def finish(self) -> Rows:
        out = self._give(len(self._held), last=True)
        self._ways = np.zeros((0, self.count))
        return out

    def _give(self, count: int, *, last: bool) -> Rows:
        """The first ``count`` rows held, without those that are dropped."""
        rows = self._held[:count].copy()
        self._held = self._held[count:]
        if not count:
            return rows
        drop = self._sharp(last)[
            -len(self._held) - count : None
            if not len(self._held)
            else -len(self._held)
        ]
        if last:
            drop[-1] = False
        self._ways = self._ways[-len(self._held) - 1 :]
        out = self.with_lengths(rows[~drop], self._kept)
        self._note(rows, drop)
        if len(out):
            self._kept = out["end"][-1, : self.count].copy()
        return out

    def _sharp(self, last: bool) -> Any:
        """Which ends of all known ways are to be dropped."""
        turn = np.concatenate([turns_of(self._ways, self.axes), [0.0]])
        short = (
            np.linalg.norm(
                self._ways[:, self.used],
                axis=1,
            )
            < self.length
        )
        sharp = short & (np.abs(turn) >= self.angle) & (turn != 0.0)
        if self.cusps:
            ahead = np.concatenate([[0.0], turn[:-1]])
            behind = np.concatenate([turn[1:], [0.0]])
            sharp &= (turn * ahead < 0) & (turn * behind < 0)
        return sharp

    def _note(self, rows: Rows, drop: Any) -> None:
        """Deviation between what came in and what stays, from one kept vertex
        to the next.
        """
        before = self._kept
        for row, dropped in zip(rows, drop, strict=True):
            end = row["end"][: self.count].copy()
            self._left.append(end)
            if dropped:
                continue
            if len(self._left) > 1:
                self.deviates(
                    np.vstack([before, *self._left]), np.vstack([before, end])
                )
            before, self._left = end, []


class FineNoise(Noise):
    """The same behind the spline."""

    code, name = FINE_NOISE, "FINE NOISE"
