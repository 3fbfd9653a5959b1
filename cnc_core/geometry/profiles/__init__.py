"""The stage for profiles: columns of points, polynomials or B-splines become
rows (``cnc_core.blocks.profile_columns``).

Order: null moves, automatic transitions, curves, connecting pieces,
compensation of the tool, rows.
"""

from __future__ import annotations

from collections.abc import Callable, MutableMapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import (
    BY_PARAMETER,
    COORDINATES,
    EXACT_STOP,
    LINEAR,
    NC_BLOCK,
    RAPID,
    BlockBatch,
)
from cnc_core.blocks.coordinates import Coordinates
from cnc_core.blocks.profile_columns import (
    CONTROL_POINTS,
    POINTS,
    STOP,
    ProfileChunk,
    ProfileSpec,
)
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.kinematics.chain import Step
from cnc_core.kinematics.machine import Kinematics
from cnc_core.kinematics.osai import Element, machine_chain

from ..shapes import bspline
from ..shapes.polynomial import bernstein, joined, normalised
from ..stages.stage import RefusedRow
from .blend import Blends
from .curves import Curves, Intervals
from .limits import AxisDynamics, ProfileLimits
from .points import FloatArray, Points
from .rows import line_row, rows_of
from .time_filter import TimeFilter
from .to_axes import Carried, Carry, NotCarried
from .tool import NoNormal

SAME = (
    1e-9  # mm by which the machine may stand beside the profile's first point
)
JUMP = (
    1e-6  # mm or degrees that an axis may stand off the next curve's beginning
)
PROFILES_KEPT = 64  # whose filters rows on their way may still need
SPEED_GRID = np.linspace(0.0, 1.0, 25)
SLOWDOWN = 0.03  # of the largest speed over the parameter
SLOWEST = 1e-3  # mm/s, of an edge that is passed
TURNING = 10.0  # mm/s, degrees/s: where no feed is programmed yet
CHAIN, VERSOR, NORMAL, UNREACHABLE, LIMIT, ROUGH = (
    909211,
    909250,
    909253,
    909260,
    909261,
    909262,
)


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
    """The profile that is being read.  ``switched``: its kinematics are in force."""

    def __init__(
        self,
        spec: ProfileSpec,
        kinematics: Kinematics | None,
        number: int,
        edge_speed: Callable[[ProfileSpec, FloatArray, FloatArray], float],
        limits: ProfileLimits,
        exact: bool,
    ) -> None:
        self.spec, self.kinematics, self.number, self.limits = (
            spec,
            kinematics,
            number,
            limits,
        )
        self.curves = (
            Curves(spec, tool_directions(spec, kinematics))
            if spec.kind == POINTS
            else None
        )
        self.blends = Blends(
            spec, partial(edge_speed, spec), limits.weakest, exact=exact
        )
        self.first: ProfileChunk | None = None
        # the same until the machine stands where the profile begins
        self.approach: ProfileChunk | None = None
        self.switched = kinematics is not None and spec.point != "AXI"
        self.position = spec.start.copy()  # in programmed coordinates
        if self.switched:
            assert kinematics is not None
            self.position = kinematics.programmed(spec.start, spec.tool.length)[
                0
            ]
        self.arrived = (
            False  # at the beginning: the axes went there, not the tip
        )
        self.polynomials = 0  # that have become rows
        # mm that a unit of the parameter counts for the planner
        self.stretch: float | None = None
        self.carry = Carry(spec, kinematics, self.position.copy())


class Profiles:
    """``main``: channel index of the main axes, -1 where there is none.

    ``place``: of (file, line).

    ``machines``: kinematics by number; those of profiles are added.
    ``limits``: lowest and highest position, (axes,) each.  ``dynamics``: what
    the axes can do.  ``cycle_s``: period of the interpolator. ``filters``: of
    the profiles' speeds, by their rows' block count. ``described``: rows for
    reading: polynomials stay as they are programmed, edges of G67 between them
    exact.
    """

    def __init__(
        self,
        main: tuple[int, int, int],
        place: Callable[[int, int], Place],
        machines: MutableMapping[int, Kinematics],
        limits: tuple[FloatArray, FloatArray],
        dynamics: AxisDynamics,
        cycle_s: float,
        *,
        described: bool = False,
    ) -> None:
        self._dynamics, self._cycle_s, self._described = (
            dynamics,
            cycle_s,
            described,
        )
        self._main, self._place = [i for i in main if i >= 0], place
        self._machines, self._limits = machines, limits
        self._open: _Open | None = None
        self.filters: dict[int, TimeFilter] = {}
        self.report = ProfileReport()

    def push(self, batch: BlockBatch) -> BlockBatch:
        """The rows that come before a profile's columns, and those that its
        columns settle.
        """
        chunk = batch.profile
        if chunk is None:
            return batch
        out = [BlockBatch(batch.rows, batch.pool)]
        try:
            if self._open is None or self._open.spec is not chunk.spec:
                out.append(self._begin(chunk))
            assert self._open is not None
            out.append(self._rows(self._open, chunk))
            if chunk.last:
                out.append(self._end())
        except RefusedRow as refused:
            ahead = joined([*out, refused.ahead, self._end()])
            raise RefusedRow(refused.error, ahead, refused.count) from None
        return joined(out)

    def drain(self) -> BlockBatch:
        """A profile that was not read to its end (an error in it) ends where
        its last point stands.
        """
        open_ = self._open
        if open_ is None:
            return BlockBatch.empty()
        rest = BlockBatch.empty()
        if open_.curves is not None and open_.first is not None:
            rest = self._finished(
                open_,
                self._points(open_, Points.none(len(open_.spec.columns)), True),
                True,
            )
        return joined([rest, self._end()])

    def resync(self, position: FloatArray) -> None:
        self._open = None

    # beginning and end

    def _begin(self, chunk: ProfileChunk) -> BlockBatch:
        spec, number = chunk.spec, 0
        kinematics = None
        if spec.chain is not None:
            number = 1 + max(self._machines, default=0)
            kinematics = self._machine(spec, number, chunk)
            self._machines[number] = kinematics
        limits = ProfileLimits(
            spec, self._dynamics, self._cycle_s, described=self._described
        )
        exact = self._described and spec.kind != POINTS
        self._open = _Open(
            spec, kinematics, number, self._edge_speed, limits, exact
        )
        self.report.profiles += 1
        if found := limits.time_filter(tuple(self._main)):
            while len(self.filters) >= PROFILES_KEPT:
                del self.filters[next(iter(self.filters))]
            self.filters[spec.count] = found
        if not self._open.switched:
            return limits.begin()
        # until the profile's beginning
        chosen = Coordinates(
            kinematics=number, length=spec.tool.length, ptp=True
        )
        return joined(
            [limits.begin(), self._switch(chosen, self._open.position, chunk)]
        )

    def _machine(
        self, spec: ProfileSpec, number: int, chunk: ProfileChunk
    ) -> Kinematics:
        try:
            return machine_of(spec, number, self._limits)
        except ValueError as error:
            place = self._place(spec.file, int(chunk.line[0]))
            raise RefusedRow(
                CncError(CHAIN, f"MAC and CIN: {error}", place),
                BlockBatch.empty(),
                spec.count,
            ) from None

    def _switch(
        self,
        chosen: Coordinates,
        position: FloatArray,
        chunk: ProfileChunk | None,
    ) -> BlockBatch:
        assert self._open is not None
        row = np.zeros(1, NC_BLOCK)
        chosen.fill(row, position)
        row["type"], row["count"], row["file"] = (
            COORDINATES,
            self._open.spec.count,
            self._open.spec.file,
        )
        row["line"] = (
            int(chunk.line[0]) if chunk is not None and len(chunk) else 0
        )
        return BlockBatch(row)

    def _end(self) -> BlockBatch:
        """The axes are programmed as they are again."""
        open_ = self._open
        if open_ is None:
            return BlockBatch.empty()
        out = BlockBatch.empty()
        if open_.switched:
            assert open_.kinematics is not None
            axes = open_.kinematics.driven(
                open_.position, open_.spec.tool.length
            )[0]
            out = self._switch(Coordinates(), axes, None)
        self._open = None
        return joined([out, open_.limits.end()])

    # curves

    def _rows(self, open_: _Open, chunk: ProfileChunk) -> BlockBatch:
        spec = chunk.spec
        self.report.points += len(chunk)
        if open_.first is None and len(chunk):
            open_.first = open_.approach = chunk
        if spec.kind == POINTS:
            intervals = self._points(open_, Points.of(chunk), chunk.last)
        else:
            given = (
                _of_bspline(chunk)
                if spec.kind == CONTROL_POINTS
                else _of_polynomials(chunk)
            )
            intervals = self._blended(open_, given, chunk.last)
        rows = self._finished(open_, intervals, chunk.last)
        if chunk.last and open_.approach is not None:  # a single point
            return joined([self._approach(open_, open_.approach), rows])
        return rows

    def _points(self, open_: _Open, points: Points, final: bool) -> Intervals:
        curves, report = open_.curves, self.report
        assert curves is not None
        dropped, marked = curves.filter.dropped, curves.marked
        out = self._blended(open_, curves.push(points, final), final)
        report.dropped += curves.filter.dropped - dropped
        report.marked += curves.marked - marked
        return out

    def _blended(
        self, open_: _Open, intervals: Intervals, final: bool
    ) -> Intervals:
        before = open_.blends.count
        out = open_.blends.push(intervals, final)
        self.report.blends += open_.blends.count - before
        return out

    def _edge_speed(
        self, spec: ProfileSpec, a: FloatArray, b: FloatArray
    ) -> float:
        """vs = Acc Amax Tc / |t2 - t1| of every axis (specification 4.3), mm/s."""
        linear = list(spec.linear)
        jump = np.abs(
            b / np.linalg.norm(b[linear]) - a / np.linalg.norm(a[linear])
        )
        axes = (
            spec.axes if spec.point == "AXI" else [spec.axes[i] for i in linear]
        )
        columns = range(len(axes)) if spec.point == "AXI" else linear
        speed = np.inf
        for axis, i in zip(axes, columns, strict=True):
            own = axis.cutting.acceleration
            most = self._dynamics.acceleration[axis.channel]
            most = most if own is None else min(own, most)
            if jump[i] > 1e-9:
                speed = min(
                    speed,
                    spec.marks.edge_share
                    * float(most)
                    * self._cycle_s
                    / float(jump[i]),
                )
        return max(speed, SLOWEST)

    # rows

    def _finished(
        self, open_: _Open, intervals: Intervals, final: bool
    ) -> BlockBatch:
        """Rows of intervals in the profile's columns."""
        spec = open_.spec
        if not len(intervals):
            return BlockBatch.empty()
        if final:
            intervals.after[-1] = STOP
        made = self._carried(open_, intervals)
        self._check_limits(spec, made, intervals)
        index = made.index
        batch = rows_of(
            made.coef, made.span, self._degrees(open_, intervals, made), self._main, line=intervals.line[index],
            n=intervals.number[index], count=spec.count, file=spec.file,
        )  # fmt: skip
        self._set_feed(open_, intervals, made, batch.rows)
        rows = batch.rows
        last = np.append(np.diff(index) != 0, True)
        rows["flags"][last & (intervals.after[index] == STOP)] |= EXACT_STOP
        straight = intervals.rapid[index]
        rows["flags"][straight] = RAPID | EXACT_STOP
        rows["type"][straight] = LINEAR
        for name in ("feed", "angle", "degree"):
            rows[name][straight] = 0
        rows["pool"][straight] = 0
        self.report.polynomials += int((~straight).sum())
        return self._with_turns(open_, made, batch)

    def _carried(self, open_: _Open, intervals: Intervals) -> Carried:
        try:
            return open_.carry(intervals)
        except NotCarried as reason:
            number = {
                "direction": UNREACHABLE,
                "rough": ROUGH,
                "versor": VERSOR,
            }[reason.reason]
            line = int(intervals.line[reason.interval])
        except NoNormal:
            number, line = NORMAL, int(intervals.line[0])
        error = CncError(
            number, ERRORS[number], self._place(open_.spec.file, line)
        )
        raise RefusedRow(error, BlockBatch.empty(), open_.spec.count)

    def _degrees(
        self, open_: _Open, intervals: Intervals, made: Carried
    ) -> npt.NDArray[np.int64]:
        spec = open_.spec
        if not open_.carry.exact:
            return np.full(len(made.span), 5, np.int64)
        degree = np.full(len(made.span), spec.degree, np.int64)
        if spec.degree < 5:  # joining pieces, and lines in cubic curves
            degree[
                np.abs(intervals.coef[:, :, spec.degree + 1 :]).max(axis=(1, 2))
                > 0.0
            ] = 5
        return degree

    def _set_feed(
        self,
        open_: _Open,
        intervals: Intervals,
        made: Carried,
        rows: npt.NDArray[Any],
    ) -> None:
        """Along the curve that the feed refers to; of programmed polynomials
        that of the parameter.
        """
        spec, feed = open_.spec, intervals.feed[made.index]
        if spec.kind != POINTS and not spec.feed_by_length:
            if open_.stretch is None:
                open_.stretch = 2.0 ** np.round(
                    np.log2(max(rows["length"].sum(), 1e-9) / made.span.sum())
                )
            rows["feed"], rows["value"] = feed, open_.stretch
            rows["flags"] |= BY_PARAMETER
            # parts of one polynomial of the tip
            if spec.point != "CCP" and not open_.carry.exact:
                rows["code"] = open_.polynomials + made.index + 1
                open_.polynomials += len(intervals)
            return
        lengths = open_.carry.reference_lengths(intervals, made)
        if lengths is not None:
            feed = feed * np.divide(
                rows["length"],
                lengths,
                out=np.ones_like(feed),
                where=lengths > 1e-9,
            )
        rows["feed"] = feed
        if not open_.switched:
            standing = (
                _slows_down(made, self._main) & ~intervals.rapid[made.index]
            )
            rows["feed"][standing] *= made.span[standing] / np.maximum(
                rows["length"][standing], 1e-12
            )
            rows["flags"][standing] |= BY_PARAMETER

    def _with_turns(
        self, open_: _Open, made: Carried, batch: BlockBatch
    ) -> BlockBatch:
        """Where an axis has to turn before the next curve begins (tangential
        axis, singular pose), it does so alone.
        """
        rows, axes = batch.rows, len(open_.position)
        starts = np.vstack([open_.position, rows["end"][:-1, :axes]])
        begins = made.coef[:, :, 0]
        jumps = np.abs(begins - starts).max(axis=1) > JUMP
        if open_.approach is not None:
            jumps[0] = np.abs(begins[0] - starts[0]).max() > SAME
        turns = np.flatnonzero(jumps)
        open_.position = rows["end"][-1][:axes].copy()
        inserted = [
            self._turn(open_, rows[i], starts[i], begins[i]) for i in turns
        ]
        open_.approach = None
        rows["flags"][turns[turns > 0] - 1] |= EXACT_STOP
        places = turns.tolist()
        if (
            open_.switched and not open_.arrived
        ):  # from here on the tip is driven
            chosen = Coordinates(
                kinematics=open_.number, length=open_.spec.tool.length
            )
            switch = self._switch(chosen, begins[0], None).rows
            switch["line"] = rows["line"][0]
            inserted.insert(places.count(0), switch)
            places.insert(places.count(0), 0)
            open_.arrived = True
        if not places:
            return batch
        return BlockBatch(
            np.insert(rows, places, np.concatenate(inserted)), batch.pool
        )

    def _turn(
        self, open_: _Open, row: Any, start: FloatArray, end: FloatArray
    ) -> npt.NDArray[Any]:
        """A line to where the curve of ``row`` begins, F in mm or degrees a
        minute; the first leads to the profile.
        """
        first, spec = open_.approach, open_.spec
        if first is not None:
            rapid = bool(len(first.rapid) and first.rapid[0])
            feed, line, n = (
                float(first.feed[0]),
                int(first.line[0]),
                int(first.number[0]),
            )
            open_.approach = None
        else:
            rapid, feed, line, n = (
                False,
                float(row["feed"]),
                int(row["line"]),
                int(row["n"]),
            )
        return line_row(
            start,
            end,
            self._main,
            rapid,
            feed=feed or TURNING,
            line=line,
            n=n,
            count=spec.count,
            file=spec.file,
        )

    def _approach(self, open_: _Open, chunk: ProfileChunk) -> BlockBatch:
        """A line to a profile of one point."""
        end = self._carried_start(open_, chunk)
        if np.abs(end - open_.position).max() <= SAME:
            return BlockBatch.empty()
        row = self._turn(open_, None, open_.position, end)
        open_.position = end
        return BlockBatch(row)

    def _carried_start(self, open_: _Open, chunk: ProfileChunk) -> FloatArray:
        """Channel axes at the profile's beginning, its first direction taken
        from its first points.
        """
        coef = np.zeros((1, len(chunk.spec.columns), 6))
        if len(chunk.coef):
            coef[0, :, : chunk.coef.shape[2]] = chunk.coef[0]
        else:
            coef[0, :, 0] = chunk.values[0]
            moved = np.flatnonzero(
                np.abs(chunk.values - chunk.values[0]).max(axis=1) > 0.0
            )
            if len(moved):
                coef[0, :, 1] = chunk.values[moved[0]] - chunk.values[0]
        one = Intervals.none(coef.shape[1])
        one.line = chunk.line[:1]
        try:
            return np.asarray(
                open_.carry.carried(coef, np.zeros(1), np.ones(1, np.bool_))[
                    0, 0
                ]
            )
        except NotCarried as reason:
            number = VERSOR if reason.reason == "versor" else UNREACHABLE
        except NoNormal:
            number = NORMAL
        place = self._place(open_.spec.file, int(chunk.line[0]))
        raise RefusedRow(
            CncError(number, ERRORS[number], place),
            BlockBatch.empty(),
            open_.spec.count,
        )

    def _check_limits(
        self, spec: ProfileSpec, made: Carried, intervals: Intervals
    ) -> None:
        """Operating limits of the setup (AXP)."""
        for axis in spec.axes:
            if (axis.low is None and axis.high is None) or (
                axis.linear and spec.chain and spec.point != "AXI"
            ):
                continue
            coef = made.coef[:, axis.channel : axis.channel + 1]
            points = bernstein(normalised(coef, made.span))[:, 0]
            low = -np.inf if axis.low is None else axis.low
            high = np.inf if axis.high is None else axis.high
            for i in np.flatnonzero(
                (points.min(axis=1) < low - 1e-9)
                | (points.max(axis=1) > high + 1e-9)
            ):
                reach = _reach(coef[i, 0], float(made.span[i]))
                if reach[0] < low - 1e-9 or reach[1] > high + 1e-9:
                    worst = reach[0] if reach[0] < low - 1e-9 else reach[1]
                    text = f"axis {axis.name} would reach {worst:g}, the setup allows {low:g} to {high:g}"
                    place = self._place(
                        spec.file, int(intervals.line[made.index[i]])
                    )
                    raise RefusedRow(
                        CncError(LIMIT, text, place),
                        BlockBatch.empty(),
                        spec.count,
                    )


def machine_of(
    spec: ProfileSpec, number: int, limits: tuple[FloatArray, FloatArray]
) -> Kinematics:
    """The machine of a profile with rotary axes; ValueError if its chain does
    not make one.
    """
    assert spec.chain is not None
    steps = {s.name: Step(s.offset, s.rotation) for s in spec.chain.steps}
    low, high = (limit.copy() for limit in limits)
    elements: dict[str, Element] = {}
    for axis in spec.axes:
        if axis.place != "OTH":
            elements[axis.place] = Element(axis.channel, steps[axis.name])
        low[axis.channel] = max(
            low[axis.channel], -np.inf if axis.low is None else axis.low
        )
        high[axis.channel] = min(
            high[axis.channel], np.inf if axis.high is None else axis.high
        )
    chain = machine_chain(
        spec.chain.kind, spec.chain.bed, elements, steps["w"], steps["t"]
    )
    x, y, z = (spec.axes[i].channel for i in spec.linear)
    return Kinematics(chain, (x, y, z), low, high, number)


def tool_directions(
    spec: ProfileSpec, kinematics: Kinematics | None
) -> Callable[[FloatArray], FloatArray] | None:
    """Tool directions of points (n, columns): as programmed, or as the rotary
    axes point; None on three axes.
    """
    part = spec.versor_columns("ijk")
    if part is not None:
        return lambda values: values[:, part]
    if kinematics is None:
        return None

    def pointed(values: FloatArray) -> FloatArray:
        q = np.tile(spec.start, (len(values), 1))
        for i, axis in enumerate(spec.axes):
            q[:, axis.channel] = values[:, i]
        return kinematics.directions(q)

    return pointed


def _slows_down(made: Carried, main: list[int]) -> npt.NDArray[np.bool_]:
    """(n,) polynomials that nearly stand somewhere, measured by their
    parameter: they are driven by it.
    """
    d = made.coef[:, :, 1:] * np.arange(1, 6)
    t = made.span[:, None] * SPEED_GRID
    speed = np.zeros_like(t)
    for axis in main:
        value = np.zeros_like(t)
        for k in range(4, -1, -1):
            value = value * t + d[:, axis, k, None]
        speed += value * value
    speed = np.sqrt(speed)
    return np.asarray(speed.min(axis=1) < SLOWDOWN * speed.max(axis=1))


def _reach(coef: FloatArray, span: float) -> tuple[float, float]:
    values = np.polynomial.polynomial.polyval(np.linspace(0.0, span, 257), coef)
    return float(values.min()), float(values.max())


def _padded(coef: FloatArray) -> FloatArray:
    """A copy of the order that joining pieces have."""
    return np.concatenate(
        [coef, np.zeros((*coef.shape[:2], 6 - coef.shape[2]))], axis=2
    )


def _of_polynomials(chunk: ProfileChunk) -> Intervals:
    rapid = np.zeros(len(chunk), np.bool_)
    return Intervals(
        _padded(chunk.coef),
        chunk.span,
        chunk.feed,
        chunk.after.copy(),
        rapid,
        chunk.line,
        chunk.number,
    )


def _of_bspline(chunk: ProfileChunk) -> Intervals:
    """Spans take feed and line of the control point in their middle."""
    degree = chunk.spec.degree
    coef, length, number = bspline.spans(chunk.values, chunk.knots, degree)
    at = number - degree + (degree + 1) // 2
    after = np.zeros(len(length), np.int64)
    after[-1] = chunk.after[-1]
    rapid = np.zeros(len(length), np.bool_)
    return Intervals(
        _padded(coef),
        length,
        chunk.feed[at],
        after,
        rapid,
        chunk.line[at],
        chunk.number[at],
    )
