"""The stage for profiles: columns of points, polynomials or B-splines become rows (``cnc_core.profile``).

Order: null moves, automatic transitions, curves, connecting pieces, compensation of the tool, rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..blocks import EXACT_STOP, LINEAR, RAPID, BlockBatch
from ..errors import CncError, Place
from ..profile import CONTROL_POINTS, POINTS, STOP, ProfileChunk, ProfileSpec
from . import bspline
from .polynomial import bernstein, joined, normalised
from .profile_blend import Blends
from .profile_curves import Curves, Intervals
from .profile_points import FloatArray, Points
from .profile_rows import line_row, rows_of
from .stage import RefusedRow

SAME = 1e-9  # mm by which the machine may stand beside the profile's first point
LIMIT = 909261


@dataclass
class ProfileReport:
    """What was done with the profiles so far."""

    profiles: int = 0
    points: int = 0
    dropped: int = 0
    marked: int = 0
    polynomials: int = 0
    blends: int = 0


class _Open:
    """The profile that is being read."""

    def __init__(self, spec: ProfileSpec) -> None:
        self.spec = spec
        self.curves = Curves(spec) if spec.kind == POINTS else None
        self.blends = Blends(spec)
        self.first: FloatArray | None = None  # columns of the first point


class Profiles:
    """``main``: channel index of the main axes, -1 where there is none.  ``place``: of (file, line)."""

    def __init__(self, main: tuple[int, int, int], place: Callable[[int, int], Place]) -> None:
        self._main, self._place = [i for i in main if i >= 0], place
        self._open: _Open | None = None
        self._position = np.empty(0)
        self.report = ProfileReport()

    def push(self, batch: BlockBatch) -> BlockBatch:
        """The rows that come before a profile's columns, and those that its columns settle."""
        chunk = batch.profile
        if chunk is None:
            return batch
        out = [BlockBatch(batch.rows, batch.pool)]
        if self._open is None or self._open.spec is not chunk.spec:
            self._open = _Open(chunk.spec)
            self._position = chunk.spec.start.copy()
            self.report.profiles += 1
        try:
            out.append(self._rows(self._open, chunk))
        except RefusedRow as refused:
            raise RefusedRow(refused.error, joined([*out, refused.ahead]), refused.count) from None
        if chunk.last:
            self._open = None
        return joined(out)

    def drain(self) -> BlockBatch:
        """A profile that was not read to its end (an error in it) ends where its last point stands."""
        if self._open is None or self._open.curves is None:
            self._open = None
            return BlockBatch.empty()
        open_, self._open = self._open, None
        return self._finished(open_, self._points(open_, Points.none(len(open_.spec.columns)), True), True)

    def resync(self, position: FloatArray) -> None:
        self._open = None

    def _rows(self, open_: _Open, chunk: ProfileChunk) -> BlockBatch:
        spec = chunk.spec
        self.report.points += len(chunk)
        first = None
        if open_.first is None and len(chunk):
            first = open_.first = chunk.values[0] if len(chunk.values) else chunk.coef[0, :, 0]
        if spec.kind == POINTS:
            intervals = self._points(open_, Points.of(chunk), chunk.last)
        elif spec.kind == CONTROL_POINTS:
            intervals = _of_bspline(chunk)
        else:
            intervals = _of_polynomials(chunk)
        rows = self._finished(open_, intervals, chunk.last)
        if first is not None:
            rapid = bool(len(chunk.rapid) and chunk.rapid[0])
            rows = joined([self._approach(open_, first, chunk, rapid), rows])
        return rows

    def _points(self, open_: _Open, points: Points, final: bool) -> Intervals:
        curves, report = open_.curves, self.report
        assert curves is not None
        dropped, marked, blended = curves.filter.dropped, curves.marked, open_.blends.count
        out = open_.blends.push(curves.push(points, final), final)
        report.dropped += curves.filter.dropped - dropped
        report.marked += curves.marked - marked
        report.blends += open_.blends.count - blended
        return out

    # rows

    def _finished(self, open_: _Open, intervals: Intervals, final: bool) -> BlockBatch:
        """Rows of intervals in the profile's columns."""
        spec = open_.spec
        if not len(intervals):
            return BlockBatch.empty()
        if final:
            intervals.after[-1] = STOP
        coef = self._channel_axes(spec, intervals)
        degree = np.full(len(intervals), spec.degree, np.int64)
        if spec.kind == POINTS:
            degree[np.abs(intervals.coef[:, :, 4:]).max(axis=(1, 2)) > 0.0] = 5
        self._check_limits(spec, coef, intervals)
        batch = rows_of(
            coef, intervals.span, degree, self._main, line=intervals.line, n=intervals.number, count=spec.count,
            file=spec.file,
        )  # fmt: skip
        rows = batch.rows
        rows["feed"] = intervals.feed
        if spec.kind != POINTS and not spec.feed_by_length:
            rows["feed"] = intervals.feed * rows["length"] / intervals.span
        rows["flags"][intervals.after == STOP] |= EXACT_STOP
        straight = intervals.rapid
        rows["flags"][straight] |= RAPID
        rows["type"][straight] = LINEAR
        rows["feed"][straight] = rows["angle"][straight] = 0.0
        rows["degree"][straight] = 0
        self._position = rows["end"][-1][: len(spec.start)].copy()
        self.report.polynomials += int((~straight).sum())
        return batch

    def _channel_axes(self, spec: ProfileSpec, intervals: Intervals) -> FloatArray:
        """(n, channel axes, 6) of all channel axes."""
        n, order = len(intervals), intervals.coef.shape[2]
        coef = np.zeros((n, len(spec.start), 6))
        coef[:, :, 0] = spec.start
        for i, axis in enumerate(spec.axes):
            coef[:, axis.channel] = 0.0
            coef[:, axis.channel, :order] = intervals.coef[:, i]
        if spec.point != "AXI":
            for i, component in zip(spec.linear, spec.tool.direction, strict=True):
                coef[:, spec.axes[i].channel, 0] += spec.tool.length * component
        return coef

    def _approach(self, open_: _Open, first: FloatArray, chunk: ProfileChunk, rapid: bool) -> BlockBatch:
        """A line to where the profile begins, if the machine stands elsewhere."""
        spec = open_.spec
        one = np.zeros((1, len(first), 1))
        one[0, :, 0] = first
        still = Intervals.none(len(first))
        still.coef, still.span = one, np.array([1.0])
        end = self._channel_axes(spec, still)[0, :, 0]
        if np.abs(end - spec.start).max() <= SAME:
            return BlockBatch.empty()
        row = line_row(
            spec.start, end, self._main, rapid, feed=float(chunk.feed[0]), line=int(chunk.line[0]),
            n=int(chunk.number[0]), count=spec.count, file=spec.file,
        )  # fmt: skip
        return BlockBatch(row)

    def _check_limits(self, spec: ProfileSpec, coef: FloatArray, intervals: Intervals) -> None:
        """Operating limits of the setup (AXP)."""
        for axis in spec.axes:
            if axis.low is None and axis.high is None:
                continue
            points = bernstein(normalised(coef[:, axis.channel : axis.channel + 1], intervals.span))[:, 0]
            low = -np.inf if axis.low is None else axis.low
            high = np.inf if axis.high is None else axis.high
            beyond = np.flatnonzero((points.min(axis=1) < low - 1e-9) | (points.max(axis=1) > high + 1e-9))
            for i in beyond:
                reach = _reach(coef[i, axis.channel], float(intervals.span[i]))
                if reach[0] < low - 1e-9 or reach[1] > high + 1e-9:
                    worst = reach[0] if reach[0] < low - 1e-9 else reach[1]
                    text = f"axis {axis.name} would reach {worst:g}, the setup allows {low:g} to {high:g}"
                    place = self._place(spec.file, int(intervals.line[i]))
                    raise RefusedRow(CncError(LIMIT, text, place), BlockBatch.empty(), spec.count)


def _reach(coef: FloatArray, span: float) -> tuple[float, float]:
    values = np.polynomial.polynomial.polyval(np.linspace(0.0, span, 257), coef)
    return float(values.min()), float(values.max())


def _of_polynomials(chunk: ProfileChunk) -> Intervals:
    rapid = np.zeros(len(chunk), np.bool_)
    return Intervals(chunk.coef, chunk.span, chunk.feed, chunk.after.copy(), rapid, chunk.line, chunk.number)


def _of_bspline(chunk: ProfileChunk) -> Intervals:
    """Spans take feed and line of the control point in their middle."""
    degree = chunk.spec.degree
    coef, length, number = bspline.spans(chunk.values, chunk.knots, degree)
    at = number - degree + (degree + 1) // 2
    after = np.zeros(len(length), np.int64)
    after[-1] = chunk.after[-1]
    rapid = np.zeros(len(length), np.bool_)
    return Intervals(coef, length, chunk.feed[at], after, rapid, chunk.line[at], chunk.number[at])
