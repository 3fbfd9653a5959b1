"""Filters of runs of straight feed motions: what they have in common.

A ``FILTER`` row (``code``: which filter) switches and sets one from there on:
``flags`` ``HAS_VALUE`` on; ``degree``, ``fill_1``, ``plane``: channel indices
of the plane's two axes and of the depth axis (255: none); ``center``: first
number a mask of axes that follow (rotary, tangential): they may move in a run,
and their ways are filtered like those of the others; the meaning of
``value``, ``length``, ``radius``, ``angle``, ``length_min`` and ``end``
stands in the filter's module.  A run ends with anything but a straight feed
motion of these axes along the programmed path.  FILTER rows pass on to
``PathMode``, which takes them out.

Memory is bounded by a filter's reach, whatever the length of the run.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core._engine import ffi, lib
from cnc_core.blocks import (
    ELEMENT,
    FILTER,
    HAS_VALUE,
    LINEAR,
    PATH_FEED,
    PIECE,
    POLYNOMIAL,
    RAPID,
    BlockBatch,
)
from cnc_core.blocks.pool import joined
from cnc_core.units import AnyArray, FloatArray

Rows = AnyArray
NOISE = 1
NURBS = 2
FINE_NOISE = 3
SHORT = 4
LOW_PASS = 5
FEED_CONTROL = 6
NO_AXIS = 255
SAME_MM = 1e-9
CLOSE_MM = 1e-6  # of a largest distance


@dataclass
class FilterReport:
    """What a filter has done so far: rows that entered it, rows that came out
    of it.

    ``segments_deviation_mm``: how far the segments that come out leave the path
    that came in; ``segments_cut_mm``: how far what came in lies beside them
    (corners that are cut off).  ``deviation_mm``, ``cut_mm``: the same of the
    path that is driven in the end, behind all filters (``stages/deviation.py``).
    """

    name: str
    blocks_in: int = 0
    blocks_out: int = 0
    deviation_mm: float = 0.0
    cut_mm: float = 0.0
    segments_deviation_mm: float = 0.0
    segments_cut_mm: float = 0.0

    def __str__(self) -> str:
        return (
            f"filter {self.name}: {self.blocks_in} blocks in, {self.blocks_out} out,"
            f" deviation {self.deviation_mm:.6f} mm, cut off {self.cut_mm:.6f} mm"
        )


def lengths_of(delta: FloatArray, main: tuple[int, int, int]) -> FloatArray:
    """(n,) row lengths of straight motions: over the main axes, over all where
    those rest.
    """
    present = [axis for axis in main if axis >= 0]
    length = np.asarray(
        np.sqrt(
            (delta[:, present] ** 2).sum(axis=1),
        )
    )
    whole = np.sqrt((delta**2).sum(axis=1))
    return np.where(length < SAME_MM, whole, length)


def turns_of(delta: FloatArray, axes: tuple[int, int]) -> FloatArray:
    """(n - 1,) signed turns in a plane between consecutive ways (n, axes), rad;
    0 where one of them is no way there.
    """
    a = delta[:-1][:, list(axes)]
    b = delta[1:][:, list(axes)]
    turn = np.arctan2(
        a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)
    )
    before, behind = np.hypot(*a.T), np.hypot(*b.T)
    moves = (before > SAME_MM) & (behind > SAME_MM)
    return np.where(moves, turn, 0.0)


def distances(points: FloatArray, line: FloatArray) -> FloatArray:
    """(n,) of points (n, k) to a polyline (m, k)."""
    out = np.empty(len(points))
    if (
        lib.nc_distances(
            _doubles(points),
            len(points),
            _doubles(line),
            *line.shape,
            _doubles(out),
        )
        < 0
    ):
        raise MemoryError("distances")
    return out


def farthest(mine: FloatArray, other: FloatArray, known: float = 0.0) -> float:
    """Largest distance of any point of the polyline ``mine`` from ``other``, to
    ``CLOSE_MM``.

    ``known``: smaller values are of no interest.
    """
    most = float(
        lib.nc_farthest(
            _doubles(mine),
            len(mine),
            _doubles(other),
            *other.shape,
            known,
            CLOSE_MM,
        )
    )
    if most < 0.0:
        raise MemoryError("farthest")
    return most


def _doubles(array: FloatArray) -> Any:
    """For C; the array lives as long as the pointer."""
    return ffi.from_buffer(
        "double[]", np.ascontiguousarray(array, dtype=np.float64)
    )


class RunFilter(ABC):
    """A stage over runs of straight feed motions.

    ``start``: (axes,); ``main``: channel index of X, Y, Z.
    """

    code = 0
    name = ""

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        self.main, self.count = main, len(start)
        self.on = False
        self.axes = (0, 1)
        self.depth = NO_AXIS
        self.following = 0
        self.report = FilterReport(self.name)
        self._last = start.copy()

    @abstractmethod
    def settings(self, row: Any) -> None:
        """Take over the values of a FILTER row."""

    @abstractmethod
    def extend(self, rows: Rows, start: FloatArray) -> Rows:
        """The run goes on with rows from ``start`` (axes,): what is final now."""

    @abstractmethod
    def finish(self) -> Rows:
        """The run ends: what is left of it."""

    # the stage

    @property
    def idle(self) -> bool:
        return not self.on

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        mine = (rows["type"] == FILTER) & (rows["code"] == self.code)
        if not self.on and not mine.any():
            self._follow(rows)
            return batch
        out, begin = [], 0
        for place in [*np.flatnonzero(mine), len(rows)]:
            out.append(self._part(rows[begin:place]))
            if place < len(rows):
                out.append(self._finished())
                self._set(rows[place])
                out.append(rows[place : place + 1])
            begin = int(place) + 1
        return self._joined(out, batch)

    def drain(self) -> BlockBatch:
        return BlockBatch(self._finished())

    def _finished(self) -> Rows:
        rows = self.finish()
        self.report.blocks_out += len(rows)
        return rows

    def resync(self, position: FloatArray) -> None:
        self.finish()
        self._last = position[: self.count].copy()

    def _joined(self, out: list[Rows], batch: BlockBatch) -> BlockBatch:
        parts = [BlockBatch(part) for part in out if len(part)]
        found = joined(parts)
        return BlockBatch(found.rows, batch.pool)

    def _set(self, row: Any) -> None:
        self.on = bool(row["flags"] & HAS_VALUE)
        self.axes = (int(row["degree"]), int(row["fill_1"]))
        self.depth = int(row["plane"])
        self.following = int(row["center"][0])
        self.settings(row)

    def _follow(self, rows: Rows) -> None:
        moving = np.flatnonzero(
            (rows["type"] <= POLYNOMIAL) & ((rows["flags"] & ELEMENT) == 0)
        )
        if len(moving):
            self._last = rows["end"][moving[-1], : self.count].copy()

    def _part(self, rows: Rows) -> Rows:
        """Rows under one setting."""
        if not self.on or not len(rows):
            self._follow(rows)
            return rows
        usable, start = self._usable(rows)
        edges = np.flatnonzero(np.diff(usable.astype(np.int8))) + 1
        out = []
        for begin, end in zip(
            [0, *edges],
            [*edges, len(rows)],
            strict=True,
        ):
            if usable[begin]:
                self.report.blocks_in += int(end - begin)
                made = self.extend(rows[begin:end].copy(), start[begin])
                self.report.blocks_out += len(made)
                out.append(made)
            else:
                out += [self._finished(), rows[begin:end]]
        self._follow(rows)
        return np.concatenate(out)

    def _usable(self, rows: Rows) -> tuple[npt.NDArray[np.bool_], FloatArray]:
        """(n,) straight feed motions of the filter's axes; (n, axes) where rows
        begin.
        """
        moving = (rows["type"] <= POLYNOMIAL) & ((rows["flags"] & ELEMENT) == 0)
        places = np.where(moving, np.arange(len(rows)), -1)
        before = np.concatenate(
            [
                [-1],
                np.maximum.accumulate(places)[:-1],
            ]
        )
        ends = rows["end"][:, : self.count]
        start = np.where(
            (before >= 0)[:, None], ends[np.maximum(before, 0)], self._last
        )
        mine = (*self.axes, self.depth)
        others = [
            i
            for i in range(self.count)
            if i not in mine and not self.following >> i & 1
        ]
        way = np.abs(ends - start)[:, others]
        rests = (way < SAME_MM).all(axis=1)
        plain = (rows["type"] == LINEAR) & (
            (rows["flags"] & (RAPID | ELEMENT | PIECE | PATH_FEED)) == 0
        )
        return plain & rests, start

    # for the filters

    @property
    def used(self) -> list[int]:
        """Channel indices of the filter's axes."""
        return [axis for axis in (*self.axes, self.depth) if axis != NO_AXIS]

    def with_lengths(self, rows: Rows, start: FloatArray) -> Rows:
        """Lengths anew, of rows one behind the other; they are straight."""
        ends = rows["end"][:, : self.count]
        length = lengths_of(
            np.diff(np.vstack([start, ends]), axis=0), self.main
        )
        rows["length"] = rows["length_min"] = length
        rows["degree"] = 0
        return rows

    def deviates(
        self,
        before: FloatArray,
        after: FloatArray,
        ahead: int = 0,
        behind: int = 0,
    ) -> None:
        """Note how far two polylines with common ends lie apart.

        ``ahead``: so many vertices at the end of ``before`` are not judged,
        ``after`` has not got there yet; nor are the first ``behind`` of
        ``after``.
        """
        report = self.report
        before = before[:, self.used]
        after = after[:, self.used]
        report.segments_deviation_mm = farthest(
            after[behind:], before, report.segments_deviation_mm
        )
        report.segments_cut_mm = farthest(
            before[: len(before) - ahead], after, report.segments_cut_mm
        )

    def note(self, deviation_mm: float, cut_mm: float) -> None:
        """A deviation, and what was cut off."""
        report = self.report
        report.segments_deviation_mm = max(
            report.segments_deviation_mm, deviation_mm
        )
        report.segments_cut_mm = max(report.segments_cut_mm, cut_mm)


EMPTY: Rows = BlockBatch.empty().rows
