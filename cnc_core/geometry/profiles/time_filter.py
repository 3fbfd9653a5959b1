"""Smoothing of a profile's speed over time (JRK Tstab, Ttop, Tintgr), and what
is queued before it starts (Entities).

Each driven row is looked at in ``PARTS`` parts, so that it does not matter how
a curve is cut into polynomials: every part has the share of its feed that
limits in its bends leave on average.  The shares are opened over a window of
time: a rise goes as high as lasts for a whole window, or is not begun. What
changes of speed are left are spread into the constant stretches beside them: a
low share goes on for half of Tintgr on either side, and the mean over Tintgr of
that is nowhere above the share itself. Times are those that are driven then.
Sections end where the axes stand and on both sides of an edge that is passed;
its piece is not filtered.  Programmed feeds are not filtered, only what
limits make of them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    BY_LENGTH,
    ELEMENT,
    EXACT_STOP,
    PIECE,
    POLYNOMIAL,
    RAPID,
    BlockBatch,
)
from cnc_core.blocks.pool import coefficients, joined
from cnc_core.blocks.profile_columns import PASSED
from cnc_core.units import AnyArray, FloatArray

from ..shapes.polynomial import derivative, normalised

BoolArray = npt.NDArray[np.bool_]
PARTS = 8
GRID = np.linspace(0.0, 1.0, PARTS + 1)
ENTITIES_MAX = 10000
# of the window: rows that last longer are not lowered, their one share says too
# little of them
LONG = 0.5
# in which the times over a spread change settle within 1 per mille
ROUNDS = 4


@dataclass(frozen=True)
class TimeFilter:
    """``window_s``: of the opening; ``merge_s``: over which changes are spread;
    0: off.  ``entities``: start together.

    (axes,) limits of cutting, mm/s, mm/s2 and mm/s3.  ``main``: axes that the
    path length counts.
    """

    window_s: float
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    main: tuple[int, ...]
    merge_s: float = 0.0
    entities: int = 0

    @property
    def reach_s(self) -> float:
        """How far a row's speed depends on what is beside it."""
        return self.window_s + self.merge_s


@dataclass
class _Caps:
    """Parts of driven rows in their order: share of the feed, nominal time s,
    whether a section ends behind it.
    """

    share: FloatArray
    time: FloatArray
    ends: BoolArray

    @classmethod
    def none(cls) -> _Caps:
        return cls(
            np.empty(0),
            np.empty(0),
            np.empty(0, np.bool_),
        )

    def __len__(self) -> int:
        return len(self.share)

    def __add__(self, other: _Caps) -> _Caps:
        names = ("share", "time", "ends")
        return _Caps(
            *(
                np.concatenate([getattr(self, name), getattr(other, name)])
                for name in names
            )
        )

    def recent(self, window: float) -> _Caps:
        """The last rows that a window can reach back to."""
        after = np.cumsum((self.time * self.share)[::-1])
        keep = len(self) - min(
            len(self), int(np.searchsorted(after, window)) + 1
        )
        if self.ends.any():
            keep = max(keep, int(np.flatnonzero(self.ends)[-1]) + 1)
        return _Caps(
            self.share[keep:],
            self.time[keep:],
            self.ends[keep:],
        )


class ProfileFilter:
    """Stage behind the kinematics; ``filters``: by the block count of the
    profiles' rows.
    """

    def __init__(self, filters: Mapping[int, TimeFilter]) -> None:
        self._filters = filters
        self._now: TimeFilter | None = None
        self._past = _Caps.none()
        self._held: deque[tuple[BlockBatch, BoolArray, _Caps]] = deque()
        self._queue = _Queue(0)

    @property
    def idle(self) -> bool:
        return self._now is None

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        if not len(rows) or (self._now is None and not self._filters):
            return batch
        filtered = np.where(
            np.isin(rows["count"], list(self._filters)), rows["count"], 0
        )
        out = []
        for part in np.split(
            np.arange(len(rows)),
            np.flatnonzero(np.diff(filtered.astype(np.int64))) + 1,
        ):
            found = self._filters.get(int(filtered[part[0]]))
            if found is not self._now:
                out.append(self.drain())
                self._now = found
                self._queue = _Queue(found.entities if found else 0)
            mine = BlockBatch(rows[part], batch.pool)
            out.append(
                mine
                if found is None
                else self._queue.push(self._take(mine, found))
            )
        return joined(out)

    def _take(self, batch: BlockBatch, filter_: TimeFilter) -> BlockBatch:
        rows = batch.rows
        driven = (rows["type"] <= POLYNOMIAL) & (rows["flags"] & ELEMENT == 0)
        self._held.append(
            (batch, driven, _caps(rows[driven], batch.pool, filter_))
        )
        return self._settled(filter_, False)

    def _settled(self, filter_: TimeFilter, final: bool) -> BlockBatch:
        """The held batches whose windows are known."""
        known = self._past
        for _, _, caps in self._held:
            known = known + caps
        until = np.cumsum(known.time * known.share)  # at the feed
        share = _spread(
            known, _opened(known, filter_.window_s), filter_.merge_s
        )
        first, out = len(self._past), []
        while self._held:
            batch, driven, caps = self._held[0]
            last = first + len(caps)
            nothing = len(known) == 0 or last == 0
            ended = nothing or known.ends[last - 1 :].any()
            if not (
                final or ended or until[-1] - until[last - 1] >= filter_.reach_s
            ):
                break
            rows = batch.rows.copy()
            part = rows[driven]
            time = caps.time.reshape(-1, PARTS).sum(axis=1)
            feed = (
                (part["flags"] & RAPID == 0)
                & (part["code"] != PASSED)
                & (time <= LONG * max(filter_.window_s, filter_.merge_s))
            )
            part["feed"][feed] *= _mean(share[first:last].reshape(-1, PARTS))[
                feed
            ]
            rows[driven] = part
            out.append(BlockBatch(rows, batch.pool))
            self._past = (self._past + caps).recent(filter_.reach_s)
            self._held.popleft()
            first = last
        return joined(out)

    def drain(self) -> BlockBatch:
        rest = (
            self._settled(self._now, True)
            if self._now is not None
            else BlockBatch.empty()
        )
        out = joined([self._queue.drain(), rest])
        self._now = None
        self._past = _Caps.none()
        self._queue = _Queue(0)
        return out

    def resync(self, position: FloatArray) -> None:
        self._now = None
        self._past = _Caps.none()
        self._queue = _Queue(0)
        self._held.clear()


class _Queue:
    """Keeps the beginning of a profile until so many of its elements are there:
    then they go on together.
    """

    def __init__(self, entities: int) -> None:
        self._missing = min(entities, ENTITIES_MAX)
        self._held: list[BlockBatch] = []

    def push(self, batch: BlockBatch) -> BlockBatch:
        if self._missing <= 0:
            return batch
        rows = batch.rows
        self._missing -= int(
            ((rows["type"] <= POLYNOMIAL) & (rows["flags"] & PIECE == 0)).sum()
        )
        self._held.append(batch)
        return BlockBatch.empty() if self._missing > 0 else self.drain()

    def drain(self) -> BlockBatch:
        held, self._held = self._held, []
        return joined(held)


def _caps(rows: AnyArray, pool: FloatArray, filter_: TimeFilter) -> _Caps:
    if not len(rows):
        return _Caps.none()
    share = np.ones((len(rows), PARTS))
    rapid = rows["flags"] & RAPID != 0
    curves = rows["type"] == POLYNOMIAL
    if curves.any():
        feed = np.maximum(rows["feed"][curves], 1e-9)[:, None]
        speed, between = _curve_speed(rows[curves], pool, filter_)
        speed = np.minimum(1.0, speed / feed)
        ends = np.stack([speed[:, :-1], speed[:, 1:]], axis=2)
        share[curves] = np.minimum(_mean(ends), between / feed)
    time = (rows["length"] / PARTS)[:, None] / np.maximum(
        rows["feed"][:, None] * share, 1e-6
    )
    time[rapid] = 0.0
    ends = np.zeros((len(rows), PARTS), np.bool_)
    edge = rows["code"] == PASSED
    ends[:, -1] = rapid | (rows["flags"] & EXACT_STOP != 0) | edge
    ends[:-1, -1] |= edge[1:]
    return _Caps(share.ravel(), time.ravel(), ends.ravel())


def _mean(share: FloatArray) -> FloatArray:
    """Share of the speed over equal lengths (last axis) in which the same time
    passes.
    """
    return np.asarray(
        1.0 / (1.0 / np.maximum(share, 1e-6)).mean(axis=-1),
    )


def _curve_speed(
    rows: AnyArray, pool: FloatArray, filter_: TimeFilter
) -> tuple[FloatArray, FloatArray]:
    """mm/s at which the axes keep velocity and acceleration in the bends of a
    row, (n, grid), and jerk where the bends change, (n, parts).
    """
    first = derivative(
        normalised(
            coefficients(rows, pool, len(filter_.velocity)), rows["angle"]
        )
    )
    d1, d2 = (
        plain.summed(
            "nak,kg->nga",
            c,
            plain.powers(GRID, np.arange(c.shape[2])[:, None]),
        )
        for c in (first, derivative(first))
    )
    by_length = (rows["flags"] & BY_LENGTH != 0)[:, None]
    speed = np.sqrt(
        (d1[:, :, list(filter_.main)] ** 2).sum(axis=2),
    )
    rate = np.where(
        by_length,
        rows["length"][:, None],
        np.maximum(speed, 1e-9),
    )
    along = (
        np.where(
            by_length, 0.0, (d1 * d2)[:, :, list(filter_.main)].sum(axis=2)
        )
        / rate**2
    )
    slope = np.abs(d1) / rate[:, :, None]
    bend = (d2 - d1 * along[:, :, None]) / rate[:, :, None] ** 2
    # per mm: by what the bend changes over a part
    twist = (
        np.abs(np.diff(bend, axis=1)) / (rows["length"] / PARTS)[:, None, None]
    )
    with np.errstate(divide="ignore"):
        v = (filter_.velocity / slope).min(axis=2)
        a = np.sqrt((filter_.acceleration / np.abs(bend)).min(axis=2))
        j = plain.cube_roots((filter_.jerk / twist).min(axis=2))
    return np.minimum(v, a), j


def _changing(caps: _Caps, share: FloatArray) -> Iterator[slice]:
    """The sections in which the share changes; the others stay as they are."""
    first = np.concatenate([[0], np.flatnonzero(caps.ends[:-1]) + 1])
    if not len(caps):
        return
    low = np.minimum.reduceat(share, first)
    high = np.maximum.reduceat(share, first)
    last = np.append(first[1:], len(caps))
    for i in np.flatnonzero(low < high):
        yield slice(int(first[i]), int(last[i]))


def _opened(caps: _Caps, window: float) -> FloatArray:
    """(n,) largest share that holds over a whole window around each row,
    section by section.
    """
    out = caps.share.copy()
    if not window > 0.0:
        return out
    for part in _changing(caps, caps.share):
        out[part] = _opened_section(caps.share[part], caps.time[part], window)
    return out


def _opened_section(
    share: FloatArray, time: FloatArray, window: float
) -> FloatArray:
    """Around each row the share falls on both sides: the stretch over which it
    is no less lasts a window at the share that comes out. A stretch at the
    section's least share is as long as it is.
    """
    first, last = _stretches(share)
    until = np.concatenate([[0.0], np.cumsum(time * share)])  # at the feed
    lasts = (until[last + 1] - until[first]) / window
    out = _painted(first, last, np.minimum(share, lasts))
    return np.asarray(np.maximum(out, share.min()))


def _stretches(
    share: FloatArray,
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """(n,) first and last row of the stretch around each in which no share is
    less than its own.
    """
    table = _table(-share)
    n = len(share)
    rows = np.arange(n)
    first, last = rows.copy(), rows.copy()
    for k in range(len(table) - 1, -1, -1):
        width = 1 << k
        begin = np.minimum(last + 1, n - width)
        on = (last + width < n) & (-table[k][begin] >= share)
        last = np.where(on, last + width, last)
        begin = np.maximum(first - width, 0)
        on = (first >= width) & (-table[k][begin] >= share)
        first = np.where(on, first - width, first)
    return first, last


def _painted(
    first: npt.NDArray[np.intp], last: npt.NDArray[np.intp], value: FloatArray
) -> FloatArray:
    """(n,) largest of the values whose stretch first..last holds a row."""
    level = np.floor(np.log2(last - first + 1)).astype(np.intp)
    top = int(level.max())
    out = np.full(
        len(value), -np.inf
    )  # of stretches of 2**k rows that begin here
    for k in range(top, -1, -1):
        width = 1 << k
        if k < top:
            out[width:] = np.maximum(out[width:], out[:-width])
        at = level == k
        np.maximum.at(out, first[at], value[at])
        np.maximum.at(out, last[at] + 1 - width, value[at])
    return out


def _spread(caps: _Caps, share: FloatArray, merge: float) -> FloatArray:
    """(n,) shares whose changes take ``merge`` s, section by section."""
    if not merge > 0.0:
        return share
    out = share.copy()
    time = caps.time * caps.share / np.maximum(share, 1e-6)
    for part in _changing(caps, share):
        out[part] = _spread_section(share[part], time[part], merge)
    return out


def _spread_section(
    share: FloatArray, time: FloatArray, merge: float
) -> FloatArray:
    """The mean at the middle of each row; beyond the section's ends the shares
    there go on.

    Times depend on what comes out. They begin with those where each share goes
    on for half of ``merge`` at its own speed.
    """
    half = 0.5 * merge
    at_feed = time * share
    end = np.cumsum(at_feed)
    begin = end - at_feed
    rows = np.arange(len(share))
    first = np.searchsorted(end, begin - half * share, side="right")
    last = np.searchsorted(begin, end + half * share) - 1
    out = -_painted(np.minimum(first, rows), np.maximum(last, rows), -share)
    table = _table(-share)
    for _ in range(ROUNDS):
        out = np.minimum(_mean_of_least(table, at_feed / out, half), share)
    return np.asarray(out)


def _mean_of_least(
    table: list[FloatArray], time: FloatArray, half: float
) -> FloatArray:
    """(n,) mean, over ``half`` on either side, of the least share within
    ``half`` on either side.  ``table``: of the shares' negatives.

    The least share changes where a row comes into reach or leaves it, in the
    middle of rows, too: so the mean goes on steadily with the times.
    """
    end = np.cumsum(time)
    begin = np.concatenate([[0.0], end[:-1]])
    into, out_of = begin - half, end + half
    comes = np.zeros(2 * len(time), np.bool_)
    comes[np.arange(len(time)) + np.searchsorted(out_of, into)] = True
    edges = np.empty(len(comes))
    edges[comes], edges[~comes] = into, out_of
    came = np.cumsum(comes[:-1])
    last = came - 1
    first = np.minimum(np.arange(1, len(comes)) - came, last)
    least = -_largest(table, first, last)
    total = np.concatenate([[0.0], np.cumsum(least * np.diff(edges))])
    middle = 0.5 * (begin + end)
    mean = np.interp(middle + half, edges, total) - np.interp(
        middle - half, edges, total
    )
    return np.asarray(mean / (2.0 * half))


def _table(values: FloatArray) -> list[FloatArray]:
    """Of each power of two the largest of so many values from each place on."""
    table = [values]
    while 1 << len(table) <= len(values):
        half = 1 << (len(table) - 1)
        table.append(
            np.maximum(
                table[-1][:-half],
                table[-1][half:],
            )
        )
    return table


def _largest(
    table: list[FloatArray],
    low: npt.NDArray[np.intp],
    high: npt.NDArray[np.intp],
) -> FloatArray:
    """Largest value from low to high, both inclusive; ``table``: ``_table``."""
    level = np.frexp(high - low + 1)[1] - 1
    out = np.empty(len(low))
    for k in range(int(level.min()), int(level.max()) + 1):
        at = np.flatnonzero(level == k)
        out[at] = np.maximum(
            table[k][low[at]], table[k][high[at] + 1 - (1 << k)]
        )
    return out
