"""How far what is driven lies from the path that came into a filter.

A ``Tap`` stands in front of a filter, or of all of them.  It takes down the
path that comes in while the filter is on.  ``Driven`` stands behind everything
that changes the path of the tip.  It hands each tap the driven path.  Both
paths are compared as polylines.  Straight motions stay as they are.  Chords of
a curve leave it by no more than ``SAGITTA_MM``, which counts.

Only the path around the place that has been reached is kept.  Where a path of
more than ``KEPT`` vertices comes back to itself, a distance can come out too
large.  A distance never comes out too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    CIRCULAR,
    ELEMENT,
    FILTER,
    HAS_VALUE,
    POLYNOMIAL,
    BlockBatch,
    motion_planes,
)
from cnc_core.blocks.pool import coefficients
from cnc_core.units import FloatArray

from ..filters.run_filter import Rows, farthest
from ..shapes.polynomial import normalised

SAGITTA_MM = 2e-5
CHORDS_MAX, ARC_CHORDS_MAX = 512, 4096
KEPT = 2048  # vertices behind what has been reached
JUDGED_AT_ONCE = 512
# vertices by which what is driven has to be ahead of those that are judged,
DELAY = 256
# unless so many driven points lie there already; how many are kept
DELAY_DRIVEN, KEPT_DRIVEN = 8192, 16384
Counts = npt.NDArray[np.int64]


def _moving(rows: Rows) -> npt.NDArray[np.intp]:
    """Motions that are driven."""
    return np.flatnonzero(
        (rows["type"] <= POLYNOMIAL) & ((rows["flags"] & ELEMENT) == 0)
    )


class Chords:
    """Motions as polylines.  ``main``: channel index of X, Y, Z."""

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        self.last, self._main = start.copy(), main

    def of(self, rows: Rows, pool: FloatArray) -> tuple[FloatArray, Counts]:
        """(n, axes) points behind the last one so far, and the counts of their
        blocks.
        """
        ends = rows["end"][:, : len(self.last)]
        start = np.vstack([self.last, ends[:-1]])
        if len(rows):
            self.last = ends[-1].copy()
        bent = rows["type"] == POLYNOMIAL
        arcs = np.flatnonzero(rows["type"] == CIRCULAR)
        if not bent.any() and not len(arcs):
            return ends.copy(), rows["count"].astype(np.int64)
        chords = np.ones(len(rows), dtype=np.int64)
        coef = normalised(
            coefficients(rows[bent], pool, len(self.last)), rows["angle"][bent]
        )
        chords[bent] = _polynomial_chords(coef)
        for i in arcs:
            step = np.sqrt(
                8.0 * SAGITTA_MM / max(float(rows["radius"][i]), SAGITTA_MM)
            )
            chords[i] = min(
                max(
                    1.0,
                    np.ceil(
                        abs(float(rows["angle"][i])) / step,
                    ),
                ),
                ARC_CHORDS_MAX,
            )
        owner = np.repeat(np.arange(len(rows)), chords)
        share = (
            np.arange(len(owner))
            - np.repeat(np.cumsum(chords) - chords, chords)
            + 1.0
        ) / chords[owner]
        points = ends[owner].copy()
        curved = np.flatnonzero(bent[owner])
        number = np.cumsum(bent) - 1
        own = coef[number[owner[curved]]]
        points[curved] = (
            own
            * plain.powers(share[curved, None, None], np.arange(own.shape[2]))
        ).sum(axis=2)
        for i in arcs:
            points[owner == i] = self._arc(
                rows[i],
                start[i],
                share[owner == i],
            )
        return points, rows["count"].astype(np.int64)[owner]

    def _arc(
        self, row: Any, start: FloatArray, share: FloatArray
    ) -> FloatArray:
        first, second, _ = motion_planes(int(row["plane"]))
        axes = [self._main[first], self._main[second]]
        way = row["end"][: len(start)] - start
        points = start + share[:, None] * way
        from_centre = start[axes] - row["center"]
        turn = float(row["angle"]) * share
        points[:, axes[0]] = (
            row["center"][0]
            + plain.cosines(turn) * from_centre[0]
            - plain.sines(turn) * from_centre[1]
        )
        points[:, axes[1]] = (
            row["center"][1]
            + plain.sines(turn) * from_centre[0]
            + plain.cosines(turn) * from_centre[1]
        )
        return np.asarray(points)


def _polynomial_chords(coef: FloatArray) -> Counts:
    """(n,) chords of polynomials over 0..1, from a bound of their second
    derivatives.
    """
    order = np.arange(coef.shape[2])
    size = np.linalg.norm(coef, axis=1)
    bend = (size * order * (order - 1)).sum(axis=1)
    return np.asarray(
        np.clip(
            np.ceil(np.sqrt(bend / (8.0 * SAGITTA_MM))),
            1,
            CHORDS_MAX,
        ),
        dtype=np.int64,
    )


class _Polyline:
    """Points with the counts of their blocks; parts are put together when they
    are looked at.
    """

    def __init__(self, points: FloatArray, count: int) -> None:
        self._points = [points]
        self._counts = [np.full(len(points), count, np.int64)]

    def add(self, points: FloatArray, counts: Counts) -> None:
        self._points.append(points)
        self._counts.append(counts)

    @property
    def points(self) -> FloatArray:
        self._points = [np.concatenate(self._points)]
        return self._points[0]

    @property
    def counts(self) -> Counts:
        self._counts = [np.concatenate(self._counts)]
        return self._counts[0]

    def forget(self, first: int) -> None:
        """The points up to number ``first``."""
        self._points = [self.points[first:].copy()]
        self._counts = [self.counts[first:].copy()]


class Tap:
    """A stage that changes nothing.  ``code``: the filter behind it, None: any."""

    def __init__(
        self,
        start: FloatArray,
        main: tuple[int, int, int],
        code: int | None = None,
    ) -> None:
        self._code = code
        self._on: set[int] = set()
        self._chords = Chords(start, main)
        self._before = start.copy()  # where the last motion has begun
        self._mask = np.ones(len(start))
        self._deviation = self._cut = self._slack = 0.0
        self._forget()

    @property
    def deviation_mm(self) -> float:
        """How far the driven path leaves the one that came in."""
        return self._deviation + self._slack

    @property
    def cut_mm(self) -> float:
        """How far what came in lies beside the driven path."""
        return self._cut + self._slack

    def _forget(self) -> None:
        """Nothing is compared."""
        ends = np.vstack([self._before, self._chords.last])
        self._programmed = _Polyline(ends, -1)
        self._driven = _Polyline(ends[1:], -1)
        self._first, self._until = (
            0,
            -1,
        )  # counts of the blocks that are compared
        # vertices judged or ahead of it all; driven points that are not judged
        self._judged, self._new = 2, 0

    @property
    def active(self) -> bool:
        """Something is being compared."""
        return self._until >= 0

    # what comes in

    @property
    def idle(self) -> bool:
        return not self._on and not self.active

    def push(self, batch: BlockBatch) -> BlockBatch:
        begin = 0
        for place in [
            *np.flatnonzero(batch.rows["type"] == FILTER),
            len(batch),
        ]:
            self._record(batch.rows[begin:place], batch.pool)
            if place < len(batch):
                self._switch(batch.rows[place])
            begin = int(place) + 1
        return batch

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self._chords.last = self._before = position[: len(self._before)].copy()
        self._forget()

    def _switch(self, row: Any) -> None:
        code = int(row["code"])
        if self._code is not None and code != self._code:
            return
        if not row["flags"] & HAS_VALUE:
            self._on.discard(code)
            return
        self._on.add(code)
        self._mask = np.ones(len(self._before))
        # axes that follow are none of the path
        following = int(row["center"][0])
        bits = following >> np.arange(len(self._mask)) & 1
        self._mask[bits == 1] = 0.0

    def _record(self, rows: Rows, pool: FloatArray) -> None:
        """Motions; behind the filter's end too, until they are driven."""
        at = _moving(rows)
        if not len(at):
            return
        if not self._on and not self.active:  # plain reading: no row is copied
            ends = rows["end"][at[-2:], : len(self._before)]
            self._before = self._chords.last if len(at) == 1 else ends[0].copy()
            self._chords.last = ends[-1].copy()
            return
        moves = rows[at]
        ends = np.vstack(
            [self._chords.last, moves["end"][:, : len(self._before)]]
        )
        if self._on and not self.active:
            self._forget()
            self._first = int(moves["count"][0])
        if self._on or self.active:
            self._programmed.add(*self._chords.of(moves, pool))
        if self._on:
            self._until = int(moves["count"][-1])
        self._before = ends[-2].copy()
        self._chords.last = ends[-1].copy()

    # what is driven

    def drive(self, points: FloatArray, counts: Counts, curved: bool) -> None:
        """Points of the driven path in order.

        ``curved``: chords of curves are among them.
        """
        if not self.active:
            return
        last = np.iinfo(np.int64).max if self._on else self._until
        mine = (counts >= self._first) & (counts <= last)
        if mine.any():
            self._driven.add(points[mine], counts[mine])
            self._new += int(mine.sum())
            self._slack = SAGITTA_MM if curved else self._slack
        if counts[-1] > last:
            self._finish()
        elif self._new >= JUDGED_AT_ONCE:
            self._compare(self._passed(int(counts[-1])))

    def _passed(self, reached: int) -> int:
        """Number of vertices that lie far enough behind the block ``reached``."""
        known, driven = self._programmed.counts, self._driven.counts
        enough = (
            int(driven[-DELAY_DRIVEN]) if len(driven) > DELAY_DRIVEN else -1
        )
        return max(
            int(np.searchsorted(known, reached, "right")) - DELAY,
            int(np.searchsorted(known, enough)),
        )

    def settle(self) -> None:
        """Everything that has come in has been driven."""
        if self.active and self._on:
            self._compare(len(self._programmed.counts))
        elif self.active:
            self._finish()

    def _finish(self) -> None:
        self._compare(
            int(np.searchsorted(self._programmed.counts, self._until, "right"))
        )
        self._forget()

    def _compare(self, until: int) -> None:
        """Judge what is driven and not judged yet, and vertices up to number
        ``until``.
        """
        programmed = self._programmed.points * self._mask
        driven = self._driven.points * self._mask
        if self._new:
            self._deviation = farthest(
                driven[-self._new - 1 :], programmed, self._deviation
            )
        if until > self._judged:
            self._cut = farthest(
                programmed[self._judged - 1 : until], driven, self._cut
            )
            self._judged = until
        self._new = 0
        left = self._judged - KEPT
        if left > KEPT:
            self._programmed.forget(left)
            self._judged -= left
        if len(driven) > 2 * KEPT_DRIVEN:
            self._driven.forget(len(driven) - KEPT_DRIVEN)


class Driven:
    """The stage behind everything: gives the taps what is driven."""

    def __init__(
        self, start: FloatArray, main: tuple[int, int, int], taps: Sequence[Tap]
    ) -> None:
        self._chords, self._taps = Chords(start, main), taps

    @property
    def idle(self) -> bool:
        return not any(tap.active for tap in self._taps)

    def push(self, batch: BlockBatch) -> BlockBatch:
        at = _moving(batch.rows)
        if len(at):
            if any(tap.active for tap in self._taps):
                points, counts = self._chords.of(batch.rows[at], batch.pool)
                curved = len(points) > len(at)
                for tap in self._taps:
                    tap.drive(points, counts, curved)
            else:
                self._chords.last = batch.rows["end"][
                    at[-1], : len(self._chords.last)
                ].copy()
        return batch

    def drain(self) -> BlockBatch:
        for tap in self._taps:
            tap.settle()
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self._chords.last = position[: len(self._chords.last)].copy()
