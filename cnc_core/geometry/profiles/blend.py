"""Connecting pieces at transitions 63 and 67: both curves are cut a tangent
length from their corner and joined C2.

A circle that leaves the corner by e at a turn of t has the radius e / (1 /
cos(t/2) - 1) and the tangent length r tan(t/2).  The piece between the cuts is
a quintic with the curves' derivatives at its ends.  Its speed at the ends is
chosen for straight lines: its middle is e from the corner, as the circle's is.

Polynomials that run with their parameter are joined C2 in it, so that the path
goes on without a jump of speed.

An edge of transition 67 is passed at the speed that the axes can stand.  A jump
of velocity keeps no jerk limit.  So the edge gets a quintic that leaves it by no
more than the fit tolerance (Tol), driven at that speed at most.  The quintic
begins where it has the least curvature that this deviation allows.  A path that
slows down under a jerk limit gets an overlapped stop instead: the second curve
starts while the first one still brakes, as each would at a standstill.  Without
a tolerance the edge stays exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cnc_core import plain
from cnc_core.blocks.profile_columns import (
    BLEND,
    PASS,
    PASSED,
    POINTS,
    SMOOTH,
    STOP,
    ProfileSpec,
)
from cnc_core.units import FloatArray

from . import spline
from .curves import Intervals

SHARP = np.radians(0.05)  # smaller turns need no piece
BACK = np.radians(179.0)  # beyond that nothing connects
SHRINKS = 24
BEND_SAMPLES = 129
ENOUGH = 1.5  # times the deviation that a speed needs
LEAST = 1e-5  # mm that an edge is left by at least
GRID = np.linspace(0.0, 1.0, 17)


def radius_of(turn: float, deviation: float) -> float:
    """Radius of the circle that leaves a corner with this turn (rad) by
    ``deviation``.
    """
    return float(deviation / (1.0 / plain.cosines(turn / 2.0) - 1.0))


def tangent_length(turn: float, deviation: float) -> float:
    """Distance from the corner at which that circle begins."""
    return float(radius_of(turn, deviation) * plain.tan(turn / 2.0))


def gentle_handle(turn: float) -> float:
    """Speed at the ends of the joining quintic, over its reach, at which
    curvature and its change limit a motion least.

    Found by minimising the larger of both over the deviation from the corner,
    for turns of 30 to 150 degrees; the piece begins farther from the corner
    than a circle of the same deviation.
    """
    return float(2.2 - 0.17 * turn * turn)


def gentle_reach(turn: float, deviation: float) -> float:
    """Distance from the corner at which that quintic begins on straight lines:
    its middle is ``deviation`` off.
    """
    return float(
        16.0
        * deviation
        / ((16.0 - 5.0 * gentle_handle(turn)) * plain.sines(turn / 2.0))
    )


@lru_cache(maxsize=4096)
def gentle_bend(turn: float) -> tuple[float, float]:
    """Largest curvature and change of curvature of that piece on straight
    lines, for a deviation of 1.
    """
    handle, reach = gentle_handle(turn), gentle_reach(turn, 1.0)
    a = np.array([1.0, 0.0])
    b = np.array([plain.cosines(turn), plain.sines(turn)])
    start = np.array([-a * reach, a, 0.0 * a])
    end = np.array([b * reach, b, 0.0 * b])
    coef = joining(start, end, [0, 1], handle * reach)
    u = np.linspace(0.0, 1.0, BEND_SAMPLES)
    d1, d2, d3 = (
        np.array([evaluated(coef, float(x), 4)[k] for x in u])
        for k in (1, 2, 3)
    )
    speed = np.linalg.norm(d1, axis=1)[:, None]
    t = d1 / speed
    gain = (d2 * t).sum(axis=1)[:, None]
    across = d2 - gain * t
    third = d3 - (d3 * t).sum(axis=1)[:, None] * t
    bend = np.linalg.norm(across, axis=1) / speed[:, 0] ** 2
    change = np.linalg.norm(
        third / plain.powers(speed, 3)
        - 3.0 * gain * across / plain.powers(speed, 4),
        axis=1,
    )
    size = np.hypot(change, bend**2)
    return float(bend.max()), float(size.max())


def needed_deviation(
    turn: float, speed: float, acceleration: float, jerk: float
) -> float:
    """Deviation from the corner at which the limits (0: none) let the piece be
    driven at ``speed``.
    """
    bend, change = gentle_bend(round(turn, 3))
    for_bend = bend * speed**2 / acceleration if acceleration > 0.0 else 0.0
    for_change = (
        float(np.sqrt(change * speed * speed * speed / jerk))
        if jerk > 0.0
        else 0.0
    )
    return max(for_bend, for_change, LEAST)


def overlapped_deviation(turn: float, speed: float, jerk: float) -> float:
    """Deviation from the corner of an overlapped stop that begins and ends at
    ``speed`` under ``jerk``.

    One axis stops with x = -reach (1 - u)^3, the other starts with y = reach
    u^3, u = t / T.  The curve is the sum of both.  At its ends the speed is
    3 reach / T.  Its jerk is 6 reach / T^3 of either side, in turns below 120
    degrees more of both together.
    """
    both = max(1.0, 2.0 * float(plain.cosines(turn / 2.0)))
    reach = float(speed / 3.0 * np.sqrt(2.0 * speed * both / jerk))
    return max(0.25 * reach * float(plain.sines(turn / 2.0)), LEAST)


def overlapped_reach(turn: float, deviation: float) -> float:
    """Distance from the corner at which an overlapped stop begins."""
    return float(4.0 * deviation / plain.sines(turn / 2.0))


def round_handle(turn: float) -> float:
    """The same for a piece whose middle is as far off as that of the circle
    with the same tangent length.
    """
    return (
        float(
            3.2 * (1.0 - plain.tan(turn / 4.0) / plain.sines(turn / 2.0)),
        )
        if turn > 1e-6
        else 1.6
    )


def evaluated(coef: FloatArray, u: float, orders: int = 3) -> FloatArray:
    """(orders, columns) value, first and second derivative ..

    of one polynomial (columns, order).
    """
    out, c = [], coef
    for _ in range(orders):
        out.append(
            plain.product(c, plain.powers(u, np.arange(c.shape[1])))
            if c.shape[1]
            else np.zeros(len(coef))
        )
        c = c[:, 1:] * np.arange(1, c.shape[1])
    return np.array(out)


@dataclass(frozen=True)
class Piece:
    """What joins two curves: by how much it may leave the corner and how far
    off it begins (mm), its speed at the ends over that reach, the share of it
    that it loses there (a brake) and gains again.
    """

    deviation: float
    reach: float
    handle: float
    brake: float = 0.0


class Blends:
    """Intervals in, intervals out; the last one of a curve waits for the curve
    behind its transition.

    ``edge_speed``: mm/s from the derivatives (columns,) on both sides of an
    edge.  ``limits``: acceleration and jerk of the weakest linear axis, 0:
    none.  ``exact``: edges of 67 stay as they are.
    """

    def __init__(
        self,
        spec: ProfileSpec,
        edge_speed: Callable[[FloatArray, FloatArray], float],
        limits: tuple[float, float] = (0.0, 0.0),
        *,
        exact: bool = False,
    ) -> None:
        self.spec = spec
        self._linear = list(spec.linear)
        self._edge_speed = edge_speed
        self._limits = limits
        self._held: Intervals | None = None
        self.count = 0
        self._by_parameter = spec.kind != POINTS and not spec.feed_by_length
        self._codes = (
            (BLEND, PASS) if spec.tolerance > 0.0 and not exact else (BLEND,)
        )

    def push(self, intervals: Intervals, final: bool) -> Intervals:
        columns = len(self.spec.columns)
        whole = (
            intervals
            if self._held is None
            else Intervals.joined([self._held, intervals], columns)
        )
        self._held = None
        joints = np.isin(whole.after, self._codes)
        if not joints.any():
            return whole
        parts, first = [], 0
        for at in np.flatnonzero(joints):
            if at + 1 == len(whole):
                break
            parts += [whole[first : at + 1], self._blend(whole, int(at))]
            first = int(at) + 1
        rest = whole[first:]
        if not final and len(rest) and rest.after[-1] in self._codes:
            self._held = rest[-1:]
            rest = rest[:-1]
        return Intervals.joined([*parts, rest], columns)

    def _blend(self, whole: Intervals, at: int) -> Intervals:
        """Cut both neighbours in place; the piece between them."""
        left = whole.coef[at]
        right = whole.coef[at + 1]
        a = evaluated(left, whole.span[at])[1]
        b = evaluated(right, 0.0)[1]
        turn = self._turn(a, b)
        passed = whole.after[at] == PASS
        rate = self._rate(a, b) if self._by_parameter else 1.0
        piece = (
            self._passing(
                turn,
                self._edge_speed(a, b),
                float(whole.feed[at : at + 2].min()) * rate,
            )
            if passed
            else self._rounding(turn)
        )
        if self._goes_on(left, float(whole.span[at]), right):
            whole.after[at] = SMOOTH
            return whole[:0]
        if turn > BACK or not piece.deviation > 0.0:
            whole.after[at] = STOP
            return whole[:0]
        shorter = min(
            self._chord(left, whole.span[at]),
            self._chord(right, whole.span[at + 1]),
        )
        reach = min(piece.reach, 0.5 * shorter)
        for _ in range(SHRINKS):
            made = self._made(left, float(whole.span[at]), right, piece, reach)
            if made is not None:
                break
            reach *= 0.7
        else:
            whole.after[at] = STOP
            return whole[:0]
        coef, span, u0, u1 = made
        self.count += 1
        whole.span[at], whole.after[at] = u0, SMOOTH
        whole.coef[at + 1] = shifted(right, u1)
        whole.span[at + 1] -= u1
        feed = np.minimum(
            whole.feed[at : at + 1],
            whole.feed[at + 1 : at + 2],
        )
        if passed:
            feed = np.minimum(feed, self._edge_speed(a, b) / rate)
        after = np.array([PASSED if passed else SMOOTH])
        return Intervals(
            coef[None],
            np.array([span]),
            feed,
            after,
            whole.rapid[at : at + 1].copy(),
            whole.line[at : at + 1],
            whole.number[at : at + 1],
        )

    def _rounding(self, turn: float) -> Piece:
        """The connecting piece of 63."""
        deviation = self.spec.chord
        return Piece(
            deviation,
            tangent_length(max(turn, SHARP), deviation),
            round_handle(turn),
        )

    def _passing(self, turn: float, edge: float, feed: float) -> Piece:
        """The piece of 67: at an even speed if the feed (mm/s) needs no braking."""
        turn, tolerance = max(turn, SHARP), self.spec.tolerance
        speed = min(edge, feed)
        acceleration, jerk = self._limits
        enough = (
            needed_deviation(turn, speed, acceleration, jerk)
            if any(self._limits)
            else np.inf
        )
        if jerk > 0.0 and (edge < feed or enough > tolerance):
            deviation = min(tolerance, overlapped_deviation(turn, speed, jerk))
            reach = overlapped_reach(turn, deviation)
            if self._by_parameter:  # C2 in it: no brake, the middle as far off
                return Piece(deviation, reach, 2.4)
            return Piece(deviation, reach, 3.0, brake=2.0)
        deviation = min(tolerance, ENOUGH * enough)
        return Piece(
            deviation, gentle_reach(turn, deviation), gentle_handle(turn)
        )

    def _rate(self, a: FloatArray, b: FloatArray) -> float:
        """Mean speed of the linear axes over that of the parameter on both sides."""
        return 0.5 * float(
            np.linalg.norm(a[self._linear]) + np.linalg.norm(b[self._linear])
        )

    def _goes_on(
        self, left: FloatArray, span: float, right: FloatArray
    ) -> bool:
        """Direction and curvature are the same on both sides already."""
        sides = []
        for jet in (evaluated(left, span), evaluated(right, 0.0)):
            d1 = jet[1][self._linear]
            d2 = jet[2][self._linear]
            speed = float(np.linalg.norm(d1))
            t = d1 / max(speed, 1e-300)
            sides.append(
                (
                    t,
                    (d2 - plain.dot(d2, t) * t) / max(speed, 1e-300) ** 2,
                )
            )
        (t1, k1), (t2, k2) = sides
        return bool(
            np.abs(t1 - t2).max() < 1e-9 and np.abs(k1 - k2).max() < 1e-9
        )

    def _turn(self, a: FloatArray, b: FloatArray) -> float:
        x, y = a[self._linear], b[self._linear]
        return float(
            plain.directions(
                np.linalg.norm(np.cross(x, y)),
                plain.dot(x, y),
            )
        )

    def _chord(self, coef: FloatArray, span: float) -> float:
        moved = evaluated(coef, span)[0] - coef[:, 0]
        return float(np.linalg.norm(moved[self._linear]))

    def _made(
        self,
        left: FloatArray,
        span: float,
        right: FloatArray,
        piece: Piece,
        reach: float,
    ) -> tuple[FloatArray, float, float, float] | None:
        """(coefficients, span, cut of the left curve, cut of the right one);
        None if it is too far off the corner.
        """
        corner = right[:, 0]
        u0 = self._at_distance(left, span, corner, reach, backward=True)
        u1 = self._at_distance(
            right, self._end_of(right, reach), corner, reach, backward=False
        )
        if u0 is None or u1 is None:
            return None
        start, end = evaluated(left, u0), evaluated(right, u1)
        if self._by_parameter:
            rate = max(self._rate(start[1], end[1]), 1e-300)
            length = piece.handle * reach / rate
            coef = spline.quintic(
                start[:1],
                end[:1],
                start[None, 1:],
                end[None, 1:],
                np.array([length]),
            )[0]
        else:
            length = 1.0
            coef = joining(
                start, end, self._linear, piece.handle * reach, piece.brake
            )
        points = plain.summed(
            "ck,kg->gc",
            coef,
            plain.powers(length * GRID, np.arange(6)[:, None]),
        )
        most = piece.deviation * (1.0 + 1e-6)
        near = np.linalg.norm(
            (points - corner)[:, self._linear],
            axis=1,
        ).min()
        return (coef, length, u0, u1) if near <= most else None

    def _end_of(self, coef: FloatArray, reach: float) -> float:
        speed = float(np.linalg.norm(coef[self._linear, 1]))
        return 4.0 * reach / max(speed, 1e-12)

    def _at_distance(
        self,
        coef: FloatArray,
        span: float,
        corner: FloatArray,
        reach: float,
        backward: bool,
    ) -> float | None:
        """Parameter at which the curve is ``reach`` from the corner, by
        bisection from the corner outwards.
        """

        def far(u: float) -> float:
            return float(
                np.linalg.norm((evaluated(coef, u)[0] - corner)[self._linear])
            )

        near, away = (span, 0.0) if backward else (0.0, span)
        if far(away) < reach:
            return None
        for _ in range(60):
            middle = 0.5 * (near + away)
            near, away = (
                (middle, away) if far(middle) < reach else (near, middle)
            )
        return 0.5 * (near + away)


def joining(
    start: FloatArray,
    end: FloatArray,
    linear: list[int],
    speed: float,
    brake: float = 0.0,
) -> FloatArray:
    """(columns, 6) quintic over 0..1 between two states (3, columns) of other
    parameters, C2 by arc length.

    ``speed``: of the linear axes at both ends.  ``brake``: what it loses behind
    the start and gains ahead of the end, as a share of it.
    """
    states = []
    for state, gain in ((start, -brake), (end, brake)):
        rate = speed / max(
            float(np.linalg.norm(state[1][linear])),
            1e-300,
        )
        slope = state[1] * rate
        states.append(np.stack([slope, state[2] * rate * rate + gain * slope]))
    one = np.array([1.0])
    return np.asarray(
        spline.quintic(
            start[:1], end[:1], states[0][None], states[1][None], one
        )[0]
    )


def shifted(coef: FloatArray, by: float) -> FloatArray:
    """The same polynomial with its parameter beginning at ``by``."""
    out = coef.copy()
    order = coef.shape[1]
    for i in range(order - 1):
        for k in range(order - 2, i - 1, -1):
            out[:, k] += by * out[:, k + 1]
    return out
