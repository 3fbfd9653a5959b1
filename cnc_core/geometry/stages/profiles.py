"""The stage for profiles: columns of points, polynomials or B-splines become
rows (``cnc_core.blocks.profile_columns``).

Order: null moves, automatic transitions, curves, connecting pieces,
compensation of the tool, rows.
"""

from __future__ import annotations

from collections.abc import Callable, MutableMapping
from dataclasses import dataclass
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
from cnc_core.blocks.pool import joined
from cnc_core.blocks.profile_columns import (
    CONTROL_POINTS,
    PASSED,
    POINTS,
    STOP,
    ProfileChunk,
    ProfileSpec,
)
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.kinematics.machine import Kinematics
from cnc_core.units import AnyArray, FloatArray

from ..profiles.curves import Intervals
from ..profiles.given import of_bspline, of_polynomials
from ..profiles.limits import AxisDynamics, ProfileLimits
from ..profiles.machine import machine_of
from ..profiles.points import Points
from ..profiles.reading import OpenProfile
from ..profiles.rows import line_row, rows_of
from ..profiles.time_filter import TimeFilter
from ..profiles.to_axes import AxisCurves, NotReached
from ..profiles.tool import NoNormal
from ..shapes.polynomial import bernstein, normalised
from .stage import RefusedRow

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
CHAIN = 909211
VERSOR = 909250
NORMAL = 909253
UNREACHABLE = 909260
LIMIT = 909261
ROUGH = 909262


@dataclass
class ProfileReport:
    """What was done with the profiles so far."""

    profiles: int = 0
    points: int = 0
    dropped: int = 0
    marked: int = 0
    polynomials: int = 0
    blends: int = 0


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
        self._dynamics = dynamics
        self._cycle_s = cycle_s
        self._described = described
        self._main = [i for i in main if i >= 0]
        self._place = place
        self._machines, self._limits = machines, limits
        self._open: OpenProfile | None = None
        self.filters: dict[int, TimeFilter] = {}
        self.report = ProfileReport()

    @property
    def idle(self) -> bool:
        return self._open is None

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
        profile = self._open
        if profile is None:
            return BlockBatch.empty()
        rest = BlockBatch.empty()
        if profile.curves is not None and profile.first is not None:
            rest = self._finished(
                profile,
                self._points(
                    profile, Points.none(len(profile.spec.columns)), True
                ),
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
        self._open = OpenProfile(
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
        row["type"] = COORDINATES
        row["count"] = self._open.spec.count
        row["file"] = self._open.spec.file
        row["line"] = (
            int(chunk.line[0]) if chunk is not None and len(chunk) else 0
        )
        return BlockBatch(row)

    def _end(self) -> BlockBatch:
        """The axes are programmed as they are again."""
        profile = self._open
        if profile is None:
            return BlockBatch.empty()
        out = BlockBatch.empty()
        if profile.switched:
            assert profile.kinematics is not None
            axes = profile.kinematics.driven(
                profile.position, profile.spec.tool.length
            )[0]
            out = self._switch(Coordinates(), axes, None)
        self._open = None
        return joined([out, profile.limits.end()])

    # curves

    def _rows(self, profile: OpenProfile, chunk: ProfileChunk) -> BlockBatch:
        spec = chunk.spec
        self.report.points += len(chunk)
        if profile.first is None and len(chunk):
            profile.first = profile.approach = chunk
        if spec.kind == POINTS:
            intervals = self._points(profile, Points.of(chunk), chunk.last)
        else:
            given = (
                of_bspline(chunk)
                if spec.kind == CONTROL_POINTS
                else of_polynomials(chunk)
            )
            intervals = self._blended(profile, given, chunk.last)
        rows = self._finished(profile, intervals, chunk.last)
        if chunk.last and profile.approach is not None:  # a single point
            return joined([self._approach(profile, profile.approach), rows])
        return rows

    def _points(
        self, profile: OpenProfile, points: Points, final: bool
    ) -> Intervals:
        curves, report = profile.curves, self.report
        assert curves is not None
        dropped, marked = curves.filter.dropped, curves.marked
        out = self._blended(profile, curves.push(points, final), final)
        report.dropped += curves.filter.dropped - dropped
        report.marked += curves.marked - marked
        return out

    def _blended(
        self, profile: OpenProfile, intervals: Intervals, final: bool
    ) -> Intervals:
        before = profile.blends.count
        out = profile.blends.push(intervals, final)
        self.report.blends += profile.blends.count - before
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
        self, profile: OpenProfile, intervals: Intervals, final: bool
    ) -> BlockBatch:
        """Rows of intervals in the profile's columns."""
        spec = profile.spec
        if not len(intervals):
            return BlockBatch.empty()
        if final:
            intervals.after[-1] = STOP
        made = self._in_axes(profile, intervals)
        self._check_limits(spec, made, intervals)
        index = made.index
        batch = rows_of(
            made.coef,
            made.span,
            self._degrees(profile, intervals, made),
            self._main,
            line=intervals.line[index],
            n=intervals.number[index],
            count=spec.count,
            file=spec.file,
        )
        self._set_feed(profile, intervals, made, batch.rows)
        rows = batch.rows
        last = np.append(np.diff(index) != 0, True)
        rows["flags"][last & (intervals.after[index] == STOP)] |= EXACT_STOP
        rows["code"][intervals.after[index] == PASSED] = PASSED
        straight = intervals.rapid[index]
        rows["flags"][straight] = RAPID | EXACT_STOP
        rows["type"][straight] = LINEAR
        for name in ("feed", "angle", "degree"):
            rows[name][straight] = 0
        rows["pool"][straight] = 0
        self.report.polynomials += int((~straight).sum())
        return self._with_turns(profile, made, batch)

    def _in_axes(
        self, profile: OpenProfile, intervals: Intervals
    ) -> AxisCurves:
        try:
            return profile.to_axes(intervals)
        except NotReached as reason:
            number = {
                "direction": UNREACHABLE,
                "rough": ROUGH,
                "versor": VERSOR,
            }[reason.reason]
            line = int(intervals.line[reason.interval])
        except NoNormal:
            number, line = NORMAL, int(intervals.line[0])
        error = CncError(
            number, ERRORS[number], self._place(profile.spec.file, line)
        )
        raise RefusedRow(error, BlockBatch.empty(), profile.spec.count)

    def _degrees(
        self, profile: OpenProfile, intervals: Intervals, made: AxisCurves
    ) -> npt.NDArray[np.int64]:
        spec = profile.spec
        if not profile.to_axes.exact:
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
        profile: OpenProfile,
        intervals: Intervals,
        made: AxisCurves,
        rows: AnyArray,
    ) -> None:
        """Along the curve that the feed refers to; of programmed polynomials
        that of the parameter.
        """
        spec, feed = profile.spec, intervals.feed[made.index]
        if spec.kind != POINTS and not spec.feed_by_length:
            if profile.stretch is None:
                profile.stretch = 2.0 ** np.round(
                    np.log2(
                        max(rows["length"].sum(), 1e-9) / made.span.sum(),
                    )
                )
            rows["feed"], rows["value"] = feed, profile.stretch
            rows["flags"] |= BY_PARAMETER
            # parts of one polynomial of the tip
            if spec.point != "CCP" and not profile.to_axes.exact:
                rows["code"] = profile.polynomials + made.index + 1
                profile.polynomials += len(intervals)
            return
        lengths = profile.to_axes.reference_lengths(intervals, made)
        if lengths is not None:
            feed = feed * np.divide(
                rows["length"],
                lengths,
                out=np.ones_like(feed),
                where=lengths > 1e-9,
            )
        rows["feed"] = feed
        if not profile.switched:
            standing = (
                _slows_down(made, self._main) & ~intervals.rapid[made.index]
            )
            rows["feed"][standing] *= made.span[standing] / np.maximum(
                rows["length"][standing], 1e-12
            )
            rows["flags"][standing] |= BY_PARAMETER

    def _with_turns(
        self, profile: OpenProfile, made: AxisCurves, batch: BlockBatch
    ) -> BlockBatch:
        """Where an axis has to turn before the next curve begins (tangential
        axis, singular pose), it does so alone.
        """
        rows, axes = batch.rows, len(profile.position)
        starts = np.vstack([profile.position, rows["end"][:-1, :axes]])
        begins = made.coef[:, :, 0]
        jumps = np.abs(begins - starts).max(axis=1) > JUMP
        if profile.approach is not None:
            jumps[0] = np.abs(begins[0] - starts[0]).max() > SAME
        turns = np.flatnonzero(jumps)
        profile.position = rows["end"][-1][:axes].copy()
        inserted = [
            self._turn(profile, rows[i], starts[i], begins[i]) for i in turns
        ]
        profile.approach = None
        rows["flags"][turns[turns > 0] - 1] |= EXACT_STOP
        places = turns.tolist()
        if (
            profile.switched and not profile.arrived
        ):  # from here on the tip is driven
            chosen = Coordinates(
                kinematics=profile.number, length=profile.spec.tool.length
            )
            switch = self._switch(chosen, begins[0], None).rows
            switch["line"] = rows["line"][0]
            inserted.insert(places.count(0), switch)
            places.insert(places.count(0), 0)
            profile.arrived = True
        if not places:
            return batch
        return BlockBatch(
            np.insert(rows, places, np.concatenate(inserted)), batch.pool
        )

    def _turn(
        self, profile: OpenProfile, row: Any, start: FloatArray, end: FloatArray
    ) -> AnyArray:
        """A line to where the curve of ``row`` begins, F in mm or degrees a
        minute; the first leads to the profile.
        """
        first, spec = profile.approach, profile.spec
        if first is not None:
            rapid = bool(len(first.rapid) and first.rapid[0])
            feed = float(first.feed[0])
            line = int(first.line[0])
            n = int(first.number[0])
            profile.approach = None
        else:
            rapid = False
            feed = float(row["feed"])
            line = int(row["line"])
            n = int(row["n"])
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

    def _approach(
        self, profile: OpenProfile, chunk: ProfileChunk
    ) -> BlockBatch:
        """A line to a profile of one point."""
        end = self._axis_start(profile, chunk)
        if np.abs(end - profile.position).max() <= SAME:
            return BlockBatch.empty()
        row = self._turn(profile, None, profile.position, end)
        profile.position = end
        return BlockBatch(row)

    def _axis_start(
        self, profile: OpenProfile, chunk: ProfileChunk
    ) -> FloatArray:
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
                profile.to_axes.axis_jets(
                    coef, np.zeros(1), np.ones(1, np.bool_)
                )[0, 0]
            )
        except NotReached as reason:
            number = VERSOR if reason.reason == "versor" else UNREACHABLE
        except NoNormal:
            number = NORMAL
        place = self._place(profile.spec.file, int(chunk.line[0]))
        raise RefusedRow(
            CncError(number, ERRORS[number], place),
            BlockBatch.empty(),
            profile.spec.count,
        )

    def _check_limits(
        self, spec: ProfileSpec, made: AxisCurves, intervals: Intervals
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
                    text = (
                        f"axis {axis.name} would reach {worst:g}, the setup "
                        f"allows {low:g} to {high:g}"
                    )
                    place = self._place(
                        spec.file, int(intervals.line[made.index[i]])
                    )
                    raise RefusedRow(
                        CncError(LIMIT, text, place),
                        BlockBatch.empty(),
                        spec.count,
                    )


def _slows_down(made: AxisCurves, main: list[int]) -> npt.NDArray[np.bool_]:
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
