"""Adaptive feed control: the feed falls where axes would have to change their
speed too fast (straight motions).

FILTER row: ``end`` largest change of speed per axis, mm/s or degrees/s (0: the
axis is not looked at); ``value`` samples of the moving average; ``radius``
inertia, over 1 it lengthens decelerations; ``length`` mm/s, changes up to it
keep the feed before; ``angle`` mm/s, the feed does not fall below it;
``length_min`` mm/s2, what decelerations are computed with; ``pool`` rows that
are looked ahead.

Corners get ``end_speed`` besides, so that the limits of the axes hold whatever
average and dead band make of the feeds.
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from cnc_core.blocks.pool import rows_joined
from cnc_core.units import FloatArray

from .run_filter import EMPTY, FEED_CONTROL, Rows, RunFilter

FAR = 1e9
AHEAD_MAX = 65536  # rows held at the most


class FeedControl(RunFilter):
    """Holds back what the look-ahead needs, at least one row."""

    code, name = FEED_CONTROL, "AFC"

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        super().__init__(start, main)
        self.limits = np.zeros(self.count)
        self.samples = 1
        self.inertia = 1.0
        self.dead = 0.0
        self.floor = 0.0
        self.accel = 0.0
        self.ahead = 1
        self._held: Rows = EMPTY
        self._starts = np.zeros((0, self.count))
        self._corner = FAR  # speed at the start of the first row held
        self._recent: deque[float] = deque(maxlen=1)
        self._feed: float | None = None  # of the row given out last

    def settings(self, row: Any) -> None:
        self.limits = np.array(row["end"][: self.count])
        self.samples = max(1, int(row["value"]))
        self.inertia = float(row["radius"])
        self.dead = float(row["length"])
        self.floor = float(row["angle"])
        self.accel = float(row["length_min"])
        self.ahead = min(max(1, int(row["pool"])), AHEAD_MAX)
        self._forget()

    def _forget(self) -> None:
        self._held = EMPTY
        self._starts = np.zeros((0, self.count))
        self._corner = FAR
        self._recent, self._feed = deque(maxlen=self.samples), None

    def extend(self, rows: Rows, start: FloatArray) -> Rows:
        starts = np.vstack([start, rows["end"][:-1, : self.count]])
        self._held = rows_joined([self._held, rows])
        self._starts = np.vstack([self._starts, starts])
        keep = self.ahead if self.inertia > 1.0 else 1
        return (
            self._give(len(self._held) - keep)
            if len(self._held) >= 2 * keep
            else EMPTY
        )

    def finish(self) -> Rows:
        out = self._give(len(self._held))
        self._forget()
        return out

    def _give(self, count: int) -> Rows:
        rows = self._held
        if not count:
            return EMPTY
        # (n + 1,) at the starts of the rows, and behind the last one
        corners = self._corners()
        feeds = np.minimum(
            rows["feed"],
            np.minimum(
                corners[:-1],
                corners[1:],
            ),
        )
        if self.inertia > 1.0 and self.accel > 0.0:
            feeds = self._decelerating(feeds)
        out = rows[:count].copy()
        out["feed"] = [
            self._adapted(float(f), float(most))
            for f, most in zip(feeds[:count], out["feed"], strict=True)
        ]
        ends = corners[1 : count + 1]
        out["end_speed"] = np.where(
            ends < out["feed"], np.maximum(ends, 1e-3), out["end_speed"]
        )
        self._corner = float(corners[count])
        self._held = rows[count:].copy()
        self._starts = self._starts[count:]
        return out

    def _corners(self) -> FloatArray:
        """Speeds at which the axes' changes of speed stay inside their limits."""
        slope = (
            self._held["end"][:, : self.count] - self._starts
        ) / self._held["length"][:, None]
        change = np.abs(np.diff(slope, axis=0))
        allowed = np.where(self.limits > 0, self.limits, np.inf)
        with np.errstate(divide="ignore"):
            speed = np.where(
                change > 1e-12, allowed / np.maximum(change, 1e-300), np.inf
            ).min(axis=1)
        return np.concatenate(
            [
                [self._corner],
                np.minimum(speed, FAR),
                [FAR],
            ]
        )

    def _decelerating(self, feeds: FloatArray) -> FloatArray:
        """Feeds from which those behind can be met with the deceleration
        divided by the inertia.
        """
        out, accel = feeds.copy(), self.accel / self.inertia
        length = self._held["length"]
        for i in range(len(out) - 2, -1, -1):
            out[i] = min(
                out[i],
                float(
                    np.sqrt(
                        out[i + 1] ** 2 + 2.0 * accel * length[i],
                    )
                ),
            )
        return out

    def _adapted(self, feed: float, most: float) -> float:
        """Average, floor and dead band of one feed; ``most``: as programmed."""
        self._recent.append(feed)
        feed = max(
            sum(self._recent) / len(self._recent),
            min(self.floor, most),
        )
        if self._feed is not None and abs(feed - self._feed) <= self.dead * (
            1.0 + 1e-9
        ):
            feed = min(self._feed, most)
        self._feed = feed
        return feed
