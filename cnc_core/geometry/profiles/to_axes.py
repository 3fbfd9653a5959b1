"""From the columns of a profile to channel axes: exactly where nothing is
computed, else by quintics in a tolerance.

What a profile programs becomes channel axes by compensation, versors, a
tangential axis (``tool``).  The result is no polynomial.  Quintics that meet its
values and two derivatives take its place.  They are halved until they miss it by
no more than the tolerance.  Where two quintics meet and the exact curves meet
too, they share their derivatives (C2).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks.profile_columns import PASSED, POINTS, SMOOTH, ProfileSpec
from cnc_core.kinematics.machine import Kinematics
from cnc_core.units import FloatArray

from . import jets, spline
from .curves import Intervals
from .rows import NODES, WEIGHTS
from .tool import LastVersors, NoVersor, Rotaries, Versors

IntArray = npt.NDArray[np.int64]
SAMPLES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
HALVINGS = 14
FINEST_MM, COARSEST_MM = 1e-6, 1e-3
ANGLE_DEG = 0.002
# of a part whose feed counts along another curve: by how much the speed there
# may change against that of the axes, and how often parts are halved for it
EVEN = 1.004
EVEN_HALVINGS = 7
EVEN_GRID = np.linspace(0.0, 1.0, 9)
TOGETHER = 1e-6  # relative difference of first derivatives that are the same


class NotReached(Exception):  # noqa: N818 - a reason, the stage makes the error
    """``reason``: "direction" not reached, "rough" (not smooth), "versor"
    without length.  ``interval``: where.
    """

    def __init__(self, reason: str, interval: int) -> None:
        super().__init__(reason)
        self.reason, self.interval = reason, interval


@dataclass
class AxisCurves:
    """Polynomials (n, channel axes, 6) over ``span``; each is the part
    ``u0``..``u1`` of interval ``index``.
    """

    coef: FloatArray
    span: FloatArray
    index: IntArray
    u0: FloatArray
    u1: FloatArray


@dataclass(frozen=True)
class _Position:
    """What counts from the end of the part before, to begin a part again."""

    versors: LastVersors
    near: FloatArray | None
    angle: float


class ToAxes:
    """State along one profile.

    ``start``: (channel axes,) in programmed coordinates.
    """

    def __init__(
        self,
        spec: ProfileSpec,
        kinematics: Kinematics | None,
        start: FloatArray,
    ) -> None:
        self.spec, self.start = spec, start
        self.versors = Versors(spec, kinematics)
        tip = spec.point != "AXI"
        self.programmed = (
            tip and "ijk" in spec.versors
        )  # rotary axes follow from ijk
        self.rotaries = (
            Rotaries(kinematics, start)
            if self.programmed and kinematics is not None
            else None
        )
        column = spec.tangential
        self._following = (
            None
            if column is None
            or (self.programmed and spec.axes[column].kinematic)
            else column
        )
        self.exact = (
            spec.point != "CCP"
            and self._following is None
            and self.rotaries is None
        )
        self._angle = (
            0.0
            if self._following is None
            else float(start[spec.axes[self._following].channel])
        )
        self._shift = np.zeros(len(start))
        if tip and not spec.five_axes:
            for i, component in zip(
                spec.linear, spec.tool.direction, strict=True
            ):
                self._shift[spec.axes[i].channel] = spec.tool.length * component
        turning = [spec.axes[i].rotary for i in range(len(spec.axes))]
        self._limits = np.full(
            len(start), min(max(0.1 * spec.chord, FINEST_MM), COARSEST_MM)
        )
        angle = (
            min(max(np.degrees(spec.versor_tolerance), 1e-4), 0.1)
            if spec.versor_tolerance
            else ANGLE_DEG
        )
        for axis, rotary in zip(spec.axes, turning, strict=True):
            if rotary:
                self._limits[axis.channel] = angle

    def __call__(self, intervals: Intervals) -> AxisCurves:
        """The intervals in channel axes; NotReached."""
        n = len(intervals)
        if self.exact:
            index, u0, u1 = self._evenly(intervals)
            return AxisCurves(
                _from(self.copied(intervals.coef)[index], u0),
                u1 - u0,
                index,
                u0,
                u1,
            )
        index = np.arange(n)
        u0 = np.zeros(n)
        u1 = intervals.span.copy()
        state = self._state()
        for _ in range(HALVINGS):
            self._restore(state)
            values, ends = self._evaluated(intervals, index, u0, u1)
            coef = self._joined(intervals, index, u0, u1, ends)
            bad = self._missed(coef, u1 - u0, values) & ~intervals.rapid[index]
            if not bad.any():
                return AxisCurves(coef, u1 - u0, index, u0, u1)
            times = np.where(bad, 2, 1)
            middle = 0.5 * (u0 + u1)
            first = np.cumsum(times) - times
            index = np.repeat(index, times)
            u0 = np.repeat(u0, times)
            u1 = np.repeat(u1, times)
            u1[first[bad]] = middle[bad]
            u0[first[bad] + 1] = middle[bad]
        raise NotReached(
            "rough", int(index[np.flatnonzero(np.repeat(bad, times))[0]])
        )

    # exact

    def _evenly(
        self, intervals: Intervals
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Parts (interval, u0, u1) over which a feed along the tip is one of
        the axes; whole intervals where it is theirs anyway.
        """
        n = len(intervals)
        index, u0, u1 = np.arange(n), np.zeros(n), intervals.span.copy()
        for _ in range(EVEN_HALVINGS if self._through and n else 0):
            ratio = self._tip_over_axes(intervals, index, u0, u1)
            bad = ratio.max(axis=1) > EVEN * ratio.min(axis=1)
            bad &= ~intervals.rapid[index]
            if not bad.any():
                break
            times = np.where(bad, 2, 1)
            middle = 0.5 * (u0 + u1)
            first = np.cumsum(times) - times
            index = np.repeat(index, times)
            u0 = np.repeat(u0, times)
            u1 = np.repeat(u1, times)
            u1[first[bad]] = middle[bad]
            u0[first[bad] + 1] = middle[bad]
        return index, u0, u1

    @property
    def _through(self) -> bool:
        """Axes are programmed, the feed is that of the tip, and no parameter's."""
        spec = self.spec
        by_length = spec.kind == POINTS or spec.feed_by_length
        tip = spec.point == "AXI" and spec.feed_on == "CLP" and spec.five_axes
        return tip and by_length

    def _tip_over_axes(
        self,
        intervals: Intervals,
        index: IntArray,
        u0: FloatArray,
        u1: FloatArray,
    ) -> FloatArray:
        """(n, grid) speed of the tip over that of the linear axes; 1 where both
        rest.
        """
        u = (u0[:, None] + (u1 - u0)[:, None] * EVEN_GRID).ravel()
        at = np.repeat(index, len(EVEN_GRID))
        tip = self._tip_speed(intervals.coef[at], u)
        linear = intervals.coef[at][:, list(self.spec.linear)]
        axes = np.linalg.norm(jets.of_columns(linear, u)[:, 1], axis=1)
        rests = np.maximum(tip, axes) < 1e-9
        ratio = np.where(rests, 1.0, tip / np.maximum(axes, 1e-9))
        return np.asarray(ratio.reshape(len(index), -1))

    def _tip_speed(self, coef: FloatArray, u: FloatArray) -> FloatArray:
        """(m,) of the tip by the parameter, from positions of the axes."""
        assert self.versors.kinematics is not None
        out = jets.still(self.start, len(u))
        columns = jets.of_columns(coef[:, : len(self.spec.axes)], u)
        for i, axis in enumerate(self.spec.axes):
            out[:, :, axis.channel] = columns[:, :, i]
        chain = self.versors.kinematics.chain
        speed = chain.forward_jets(out, self.spec.tool.origin_length)[0][:, 1]
        return np.asarray(np.linalg.norm(speed, axis=1))

    def copied(self, coef: FloatArray) -> FloatArray:
        out = np.zeros((len(coef), len(self.start), 6))
        out[:, :, 0] = self.start
        for i, axis in enumerate(self.spec.axes):
            out[:, axis.channel] = 0.0
            out[:, axis.channel, : coef.shape[2]] = coef[:, i]
        out[:, :, 0] += self._shift
        return out

    # by quintics

    def _state(self) -> _Position:
        near = None if self.rotaries is None else self.rotaries.near
        return _Position(self.versors.last, near, self._angle)

    def _restore(self, state: _Position) -> None:
        self.versors.last = state.versors
        if self.rotaries is not None and state.near is not None:
            self.rotaries.near = state.near
        self._angle = state.angle

    def _evaluated(
        self,
        intervals: Intervals,
        index: IntArray,
        u0: FloatArray,
        u1: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """(n, 5, axes) values at the samples and (n, 2, 3, axes) jets at both
        ends of the parts.
        """
        along = (u1 - u0)[:, None] * SAMPLES
        u = (u0[:, None] + along).ravel()
        at = np.repeat(index, len(SAMPLES))
        forward = np.tile(SAMPLES < 1.0, len(index))
        all_jets = self.axis_jets(intervals.coef[at], u, forward, at)
        shaped = all_jets.reshape(len(index), len(SAMPLES), 3, -1)
        return shaped[:, :, 0], shaped[:, [0, -1]]

    def axis_jets(
        self,
        coef: FloatArray,
        u: FloatArray,
        forward: npt.NDArray[np.bool_],
        at: IntArray | None = None,
    ) -> FloatArray:
        """(m, 3, channel axes) jets of polynomials (m, columns, order) at u
        (m,), in the order of the path.
        """
        spec = self.spec
        out = jets.still(self.start, len(u))
        columns = jets.of_columns(coef[:, : len(spec.axes)], u)
        for i, axis in enumerate(spec.axes):
            out[:, :, axis.channel] = columns[:, :, i]
        if self._following is not None:
            self._follow(out, coef, u)
        try:
            d = self.versors.direction(coef, u, out)
        except NoVersor as reason:
            raise NotReached(
                "versor", int(at[reason.at]) if at is not None else 0
            ) from None
        if self.rotaries is not None:
            try:
                angles = self.rotaries.angles(d, forward)
            except ValueError as error:
                raise NotReached(
                    "direction", int(at[error.args[0]]) if at is not None else 0
                ) from None
            out[:, :, self.rotaries.axes] = angles
        try:
            tip = self.versors.tip(coef, u, d, forward)
        except NoVersor as reason:
            raise NotReached(
                "versor", int(at[reason.at]) if at is not None else 0
            ) from None
        for k, i in enumerate(spec.linear):
            out[:, :, spec.axes[i].channel] = tip[:, :, k]
        out[:, 0] += self._shift
        return out

    def _follow(self, out: FloatArray, coef: FloatArray, u: FloatArray) -> None:
        """The tangential axis, whole turns added so that it never turns by more
        than half of one at once.
        """
        assert self._following is not None
        angle = self.versors.following(coef, u, self._following)
        steps = np.diff(
            np.concatenate(
                [[self._angle], angle[:, 0]],
            )
        )
        angle[:, 0] = self._angle + np.cumsum((steps + 180.0) % 360.0 - 180.0)
        self._angle = float(angle[-1, 0])
        out[:, :, self.spec.axes[self._following].channel] = angle

    def _joined(
        self,
        intervals: Intervals,
        index: IntArray,
        u0: FloatArray,
        u1: FloatArray,
        ends: FloatArray,
    ) -> FloatArray:
        """Quintics; neighbours whose curves go on share value and derivatives."""
        a = ends[:-1, 1]
        b = ends[1:, 0]
        gap = np.abs(a[:, 0] - b[:, 0])
        near = gap.max(axis=1) < 1e-7
        change = np.abs(a[:, 1] - b[:, 1])
        slope = change.max(axis=1)
        most = TOGETHER * (np.abs(a[:, 1]).max(axis=1) + 1e-9)
        same = near & (slope <= most)
        same &= (index[1:] == index[:-1]) | np.isin(
            intervals.after[index[:-1]], (SMOOTH, PASSED)
        )
        middle = 0.5 * (a[same] + b[same])
        ends[:-1, 1][same] = middle
        ends[1:, 0][same] = middle
        keep = near & ~same
        ends[:-1, 1][keep, 0] = b[keep, 0]
        h = u1 - u0
        coef = spline.quintic(
            ends[:, 0, 0],
            ends[:, 1, 0],
            ends[:, 0, 1:],
            ends[:, 1, 1:],
            h,
        )
        straight = intervals.rapid[index]
        coef[straight, :, 2:] = 0.0
        coef[straight, :, 1] = (
            ends[straight, 1, 0] - ends[straight, 0, 0]
        ) / h[straight, None]
        return coef

    def _missed(
        self, coef: FloatArray, span: FloatArray, values: FloatArray
    ) -> npt.NDArray[np.bool_]:
        out = np.zeros(len(span), np.bool_)
        for k, share in enumerate(SAMPLES[1:-1], 1):
            at = plain.summed(
                "nak,nk->na",
                coef,
                plain.powers((share * span)[:, None], np.arange(6)),
            )
            far = np.abs(at - values[:, k]) > self._limits
            out |= far.any(axis=1)
        return out

    # feed

    def reference_lengths(
        self, intervals: Intervals, made: AxisCurves
    ) -> FloatArray | None:
        """(n,) lengths of the curve that the feed refers to; None: of the
        driven tip itself.
        """
        spec = self.spec
        contact = spec.point == "CCP" and spec.feed_on == "CCP"
        if not contact and not self._through:
            return None
        h = made.u1 - made.u0
        along = h[:, None] * 0.5 * (NODES + 1.0)
        u = (made.u0[:, None] + along).ravel()
        coef = intervals.coef[np.repeat(made.index, len(NODES))]
        if contact:
            jet = jets.of_columns(coef[:, list(spec.linear)], u, 1)[:, 0]
            speed = np.linalg.norm(jet, axis=1)
        else:
            speed = self._tip_speed(coef, u)
        return np.asarray(
            plain.product(speed.reshape(len(h), len(NODES)), 0.5 * WEIGHTS) * h
        )


def _from(coef: FloatArray, u: FloatArray) -> FloatArray:
    """(n, axes, order) polynomials whose parameter begins at u (n,)."""
    out = coef.copy()
    order = coef.shape[2]
    for k in range(order):
        for m in range(k + 1, order):
            out[:, :, k] += (
                comb(m, k) * coef[:, :, m] * plain.powers(u[:, None], m - k)
            )
    return out
