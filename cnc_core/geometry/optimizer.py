"""Smooth quintics within a tolerance of noisy points: stages 2 to 6 of the Path Optimizer (HSM specification 11).

A *section* reaches from one edge to the next.  Its points are cut into groups that overlap.  In a group the points that
a polyline within the linear share of the tolerance needs tell where the curve bends; knots of a quintic B-spline are
put there, its control points are the least squares fit to all points, and spans that miss a point by more than the
tolerance are halved until none does.  The next group begins with the value and two derivatives in which this one ends:
neighbours are merged into one C2 curve.  At edges the curves are joined by a piece, or meet there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..profile import BLEND, SMOOTH, STOP
from . import bspline
from . import profile_spline as spline
from .profile_blend import evaluated, joining, shifted, tangent_length

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
DEGREE = 5
USED = 0.97  # share of the tolerance that the fit uses
REFINEMENTS = 40
KNOTS_FROM = ((12, 3), (4, 3), (4, 1))  # every so manieth bend is a first knot; spans with so few points stay
STIFF = 1e-9  # weight of the fit's third differences: what no point decides
SHARP = np.radians(0.5)
JOIN_TRIES = 24
JUMP = 1e-7
END_POINTS = 7  # that say where a curve begins to go


@dataclass(frozen=True)
class Tolerances:
    """Of the linear axes, other axes and versors, and how the optimizer shares and uses them (SMT, SMS).

    ``linear``, ``other``, ``versor``: bands.  ``split``: share of the polyline.  ``reach``: mm from an edge at which a
    joining piece may begin, at 90 degrees.  ``condition``: 1 through the end points, 2 with their direction, 3 with
    their curvature.  ``longest``: of a polynomial, 0: any.  ``group``: points fitted together.
    """

    linear: float
    other: float = 0.01
    versor: float = 0.001
    split: float = 0.5
    split_other: float = 0.5
    split_versor: float = 0.5
    reach: float = 1.0
    reach_versor: float = 1.0
    condition: int = 2
    condition_other: int = 2
    condition_versor: int = 2
    longest: float = 0.0
    group: int = 1000


@dataclass
class Fit:
    """Polynomials (n, columns, 6) over ``span`` and which points (from, to) each covers; transitions at their ends.

    ``kind`` of the edge at the end: linear or versor (``Tolerances``).  ``feed``: mm/s, in place of the points'.
    """

    coef: FloatArray
    span: FloatArray
    first: IntArray
    after: IntArray
    kind: str = "linear"
    feed: float | None = None


@dataclass
class FitReport:
    """Largest deviation of a point from the curve (linear axes, mm), and what was done on the way."""

    deviation: float = 0.0
    polyline_points: int = 0
    groups: int = 0
    joints: int = 0
    jumps: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])


def polyline(points: FloatArray, tolerance: float) -> IntArray:
    """Numbers of the points that a polyline within ``tolerance`` of all points needs (Douglas and Peucker)."""
    keep, stack = np.zeros(len(points), np.bool_), [(0, len(points) - 1)]
    keep[[0, -1]] = True
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        chord, inside = points[b] - points[a], points[a + 1 : b] - points[a]
        share = np.clip(inside @ chord / max(float(chord @ chord), 1e-300), 0.0, 1.0)
        far = np.linalg.norm(inside - share[:, None] * chord, axis=1)
        worst = int(far.argmax())
        if far[worst] > tolerance:
            keep[a + 1 + worst] = True
            stack += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return np.flatnonzero(keep)


def graph_polyline(u: FloatArray, values: FloatArray, tolerance: float) -> IntArray:
    """The same for the graph of one column over the parameter; the deviation is that of the value."""
    keep, stack = np.zeros(len(u), np.bool_), [(0, len(u) - 1)]
    keep[[0, -1]] = True
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        share = (u[a + 1 : b] - u[a]) / max(u[b] - u[a], 1e-300)
        far = np.abs(values[a + 1 : b] - values[a] - share * (values[b] - values[a]))
        worst = int(far.argmax())
        if far[worst] > tolerance:
            keep[a + 1 + worst] = True
            stack += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return np.flatnonzero(keep)


def basis(u: FloatArray, knots: FloatArray, count: int) -> FloatArray:
    """(n, count) values of the quintic basis functions."""
    k = np.clip(np.searchsorted(knots, u, side="right") - 1, DEGREE, count - 1)
    local = np.zeros((len(u), DEGREE + 1))
    local[:, 0] = 1.0
    for d in range(1, DEGREE + 1):
        saved = np.zeros(len(u))
        for j in range(d):
            right, left = knots[k + j + 1], knots[k + 1 - d + j]
            part = local[:, j] / (right - left)
            local[:, j] = saved + (right - u) * part
            saved = (u - left) * part
        local[:, d] = saved
    out = np.zeros((len(u), count))
    out[np.arange(len(u))[:, None], k[:, None] - DEGREE + np.arange(DEGREE + 1)] = local
    return out


class SectionFitter:
    """Fits one section.  ``values`` (n, columns); ``linear``, ``versor``: columns of linear axes and of versors."""

    def __init__(self, values: FloatArray, linear: list[int], versor: list[int], tolerances: Tolerances) -> None:
        self.values, self.linear, self.tolerances = values, linear, tolerances
        kind = np.ones(values.shape[1], np.int64)  # 0 linear, 1 other, 2 versor
        kind[linear], kind[versor] = 0, 2
        t = tolerances
        self.limits = np.array([t.linear, t.other, t.versor])[kind]
        self.split = np.array([t.split, t.split_other, t.split_versor])[kind]
        self.condition = np.array([t.condition, t.condition_other, t.condition_versor])[kind]
        moved = np.diff(values, axis=0)
        chord = np.linalg.norm(moved[:, linear], axis=1)
        rest = np.linalg.norm(moved, axis=1)
        self.u = np.concatenate([[0.0], np.cumsum(np.where(chord > 0.0, chord, np.maximum(rest, 1e-9)))])

    def fit(
        self, report: FitReport, tick: Callable[[int], None], state: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """(coefficients, spans, number of the point at or ahead of each polynomial's beginning).

        ``state``: (2, columns) value and direction in which the curve begins (G62), if they are given.
        """
        n, size = len(self.values), self.tolerances.group
        coefs, spans, firsts = [], [], []
        a = 0
        while a < n - 1:
            b = min(a + size, n - 1)
            b = n - 1 if n - 1 - b < size // 4 else b
            beyond = min(b + max(size // 10, 20), n - 1)
            coef, knots = self._group(a, beyond, b, state, report)
            keep = knots[:-1] < self.u[b] - 1e-12 * self.u[-1]
            coefs.append(coef[keep])
            spans.append(np.diff(knots)[keep])
            firsts.append(np.maximum(np.searchsorted(self.u, knots[:-1][keep], side="right") - 1, 0))
            state = evaluated(coef[keep][-1], float(spans[-1][-1]))
            report.groups += 1
            tick(b - a)
            a = b
        return np.concatenate(coefs), np.concatenate(spans), np.concatenate(firsts)

    # one group

    def _group(
        self, a: int, end: int, cut: int, state: FloatArray | None, report: FitReport
    ) -> tuple[FloatArray, FloatArray]:
        """Polynomials of points a..end, a knot at point ``cut``; ``state`` (3, columns): given beginning."""
        values, u = self.values[a : end + 1], self.u[a : end + 1]
        bends = self._bends(values, u)
        report.polyline_points += len(bends)
        ends_here = end == len(self.values) - 1
        for every, least in KNOTS_FROM:
            inner = self._first_knots(u, bends[2 : -2 : every] if len(bends) > 6 else bends[:0], self.u[cut])
            found = self._refined(values, u, inner, state, ends_here, least)
            if found is not None:
                break
        coef, breaks = found if found is not None else self._through(values, u, state)
        report.deviation = max(report.deviation, self._deviation(values, u, coef, breaks))
        return coef, breaks

    def _refined(
        self,
        values: FloatArray,
        u: FloatArray,
        inner: FloatArray,
        state: FloatArray | None,
        ends_here: bool,
        least: int,
    ) -> tuple[FloatArray, FloatArray] | None:
        """Spans that miss a point halved until none does; None where they come to hold ``least`` points or fewer."""
        for _ in range(REFINEMENTS):
            knots = np.concatenate([np.full(DEGREE + 1, u[0]), inner, np.full(DEGREE + 1, u[-1])])
            control = self._control(values, u, knots, state, ends_here)
            coef, span, _ = bspline.spans(control, knots, DEGREE)
            breaks = np.concatenate([[u[0]], u[0] + np.cumsum(span)])
            missed = self._missed(values, u, coef, breaks)
            bad = np.unique(np.clip(np.searchsorted(breaks, u[missed > 1.0], side="right") - 1, 0, len(span) - 1))
            swings = self._swings(values, u, coef, breaks)
            if not len(bad) and not len(swings):
                return coef, breaks
            finer = self._halved(u, breaks, np.union1d(bad, swings), least)
            if not len(finer):
                return None
            inner = np.unique(np.concatenate([inner, finer]))
        return None

    def _bends(self, values: FloatArray, u: FloatArray) -> IntArray:
        """Points that polylines within the linear shares of the tolerances need, of all columns."""
        band, others = self.limits * self.split, np.setdiff1d(np.arange(values.shape[1]), self.linear)
        kept = [polyline(values[:, self.linear], self.tolerances.linear * self.tolerances.split)]
        kept += [graph_polyline(u, values[:, i], band[i]) for i in others if band[i] > 0.0]
        return np.unique(np.concatenate(kept))

    def _first_knots(self, u: FloatArray, bends: IntArray, cut: float) -> FloatArray:
        """Knots at ``bends``, points of the polyline, at the cut, and where a polynomial would be too long."""
        inner = u[bends]
        inner = np.union1d(inner, [cut]) if u[0] < cut < u[-1] else inner
        longest = 0.98 * self.tolerances.longest  # of chords; the arc is a little longer
        if longest > 0.0:
            inner = np.union1d(inner, np.linspace(u[0], u[-1], int(np.ceil((u[-1] - u[0]) / longest)) + 1)[1:-1])
        near = np.diff(np.concatenate([[u[0]], inner])) < 1e-6 * (u[-1] - u[0])
        return np.asarray(inner[~near & (inner < u[-1] - 1e-6 * (u[-1] - u[0]))])

    def _control(
        self, values: FloatArray, u: FloatArray, knots: FloatArray, state: FloatArray | None, ends_here: bool
    ) -> FloatArray:
        """Least squares control points, those at the ends given by the conditions there."""
        count = len(knots) - DEGREE - 1
        control = np.zeros((count, values.shape[1]))
        matrix = basis(u, knots, count)
        rough = np.diff(np.eye(count), n=3, axis=0) if count > 3 else np.zeros((0, count))
        left = matrix.T @ matrix + STIFF * len(u) * rough.T @ rough
        for condition in np.unique(self.condition):
            columns = self.condition == condition
            given = None if state is None else state[:, columns]
            part = values[:, columns]
            begin = self._begin(part, u, knots, given, int(condition))
            finish = self._begin(part[::-1], -u[::-1], -knots[::-1], None, int(condition)) if ends_here else part[:0]
            control[:, columns] = _fitted(left, matrix.T @ part, begin, finish[: max(count - len(begin), 1)])
        return control

    def _begin(
        self, values: FloatArray, u: FloatArray, knots: FloatArray, state: FloatArray | None, condition: int
    ) -> FloatArray:
        """The first control points that the end's value and derivatives give."""
        if state is None:
            state = _end_state(values, u)[: condition if len(values) > 3 else 1]
        h = [float(knots[DEGREE + i] - knots[i]) for i in range(1, DEGREE + 1)]  # of control points 1..5
        points = [state[0]]
        if len(state) > 1:
            points.append(points[0] + state[1] * h[0] / DEGREE)
        if len(state) > 2:
            slope = state[1] + state[2] * float(knots[DEGREE + 1] - knots[DEGREE]) / (DEGREE - 1)
            points.append(points[1] + slope * h[1] / DEGREE)
        return np.array(points)

    def _missed(self, values: FloatArray, u: FloatArray, coef: FloatArray, breaks: FloatArray) -> FloatArray:
        """(n,) deviation of each point over its tolerance."""
        off = self._off(values, u, coef, breaks)
        far = np.linalg.norm(off[:, self.linear], axis=1) / (USED * self.tolerances.linear)
        for i in range(values.shape[1]):
            if i not in self.linear:
                far = np.maximum(far, np.abs(off[:, i]) / (USED * max(self.limits[i], 1e-12)))
        return np.asarray(far)

    def _off(self, values: FloatArray, u: FloatArray, coef: FloatArray, breaks: FloatArray) -> FloatArray:
        """(n, columns) of each point from its foot on the curve; other columns from there or at its own parameter."""
        at, own = u.copy(), np.zeros_like(values)
        for turn in range(4):
            k = np.clip(np.searchsorted(breaks, at, side="right") - 1, 0, len(coef) - 1)
            s = at - breaks[k]
            jets = [np.zeros_like(values) for _ in range(3)]
            c = coef[k]
            for order in range(3):
                for i in range(c.shape[2] - 1, -1, -1):
                    jets[order] = jets[order] * s[:, None] + c[:, :, i]
                c = c[:, :, 1:] * np.arange(1, c.shape[2])
            d, d1, d2 = (j[:, self.linear] for j in (jets[0] - values, jets[1], jets[2]))
            slope = (d1 * d1).sum(axis=1)
            bend = np.maximum(slope + (d * d2).sum(axis=1), 0.25 * slope)
            step = (d * d1).sum(axis=1) / np.maximum(bend, 1e-300)
            best = jets[0] - values
            own = best if turn == 0 else own
            at = np.clip(at - np.clip(step, -1.0, 1.0), breaks[0], breaks[-1])
        out = np.where(np.abs(own) < np.abs(best), own, best)
        out[:, self.linear] = best[:, self.linear]
        return np.asarray(out)

    def _deviation(self, values: FloatArray, u: FloatArray, coef: FloatArray, breaks: FloatArray) -> float:
        off = self._off(values, u, coef, breaks)
        return float(np.linalg.norm(off[:, self.linear], axis=1).max())

    def _swings(self, values: FloatArray, u: FloatArray, coef: FloatArray, breaks: FloatArray) -> IntArray:
        """Spans on which the curve leaves the chord of two points by more than their own bends explain."""
        middle = 0.5 * (u[1:] + u[:-1])
        k = np.clip(np.searchsorted(breaks, middle, side="right") - 1, 0, len(coef) - 1)
        s = middle - breaks[k]
        at = np.einsum("nck,nk->nc", coef[k], s[:, None] ** np.arange(6))
        off = np.linalg.norm((at - 0.5 * (values[1:] + values[:-1]))[:, self.linear], axis=1)
        bend = np.zeros(len(values))
        bend[1:-1] = np.linalg.norm((values[2:] - 2.0 * values[1:-1] + values[:-2])[:, self.linear], axis=1)
        bend[0], bend[-1] = bend[1] if len(bend) > 2 else 0.0, bend[-2] if len(bend) > 2 else 0.0
        allowed = 2.0 * self.tolerances.linear + np.maximum(bend[1:], bend[:-1])
        return np.unique(k[off > allowed])

    def _through(self, values: FloatArray, u: FloatArray, state: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """The interpolating spline, where no fit of fewer knots holds the tolerance."""
        h = np.diff(u)
        window = spline.Window(values, h, slice(0, len(values)))
        states = spline.derivatives([window], DEGREE if len(values) > 2 else 3)[0]
        if state is not None:
            states[0, : len(state) - 1] = state[1:]
            values = values.copy()
            values[0] = state[0]
        return spline.hermite(values, states, h), u.copy()

    @staticmethod
    def _halved(u: FloatArray, breaks: FloatArray, bad: IntArray, least: int) -> FloatArray:
        """Knots in the middle of bad spans that hold more points than ``least``."""
        out = []
        for k in bad:
            inside = u[(u > breaks[k] + 1e-9) & (u < breaks[k + 1] - 1e-9)]
            if len(inside) > least:
                out.append(0.5 * (breaks[k] + breaks[k + 1]))
        return np.array(out)


def _fitted(left: FloatArray, right: FloatArray, begin: FloatArray, finish: FloatArray) -> FloatArray:
    """(count, columns) control points of the normal equations; the first and (backwards) the last ones are given."""
    count = len(left)
    control = np.zeros((count, right.shape[1]))
    control[: len(begin)] = begin
    if len(finish):
        control[count - len(finish) :] = finish[::-1]
    free = slice(len(begin), count - len(finish))
    if free.start < free.stop:
        rest = right - left @ control
        control[free] = np.linalg.solve(left[free, free] + 1e-13 * np.eye(free.stop - free.start), rest[free])
    return control


def _end_state(values: FloatArray, u: FloatArray) -> FloatArray:
    """(3, columns) value, direction and curvature at the first point.

    The manual takes them from the first two and three points; noise of a few micrometres on short chords turns such a
    direction by degrees, and on a bend it lies half a chord off.  So both come from a parabola through the first point
    that fits the next ones best.
    """
    n = min(END_POINTS, len(values))
    t, moved = u[1:n] - u[0], values[1:n] - values[0]
    powers = t[:, None] ** np.arange(1, min(n, 3))
    scale = t[-1] ** np.arange(1, min(n, 3))
    found = np.linalg.lstsq(powers / scale, moved, rcond=None)[0] / scale[:, None]
    bend = 2.0 * found[1] if len(found) > 1 else 0.0 * found[0]
    return np.array([values[0], found[0], bend])


def join_sections(
    parts: list[Fit], linear: list[int], versor: list[int], tolerances: Tolerances, report: FitReport
) -> Fit:
    """One row of polynomials; where a section ends in 63 a joining piece rounds its corner."""
    out: list[Fit] = []
    for part in parts:
        if out and out[-1].after[-1] == BLEND:
            limits = np.full(part.coef.shape[1], tolerances.other)
            limits[versor] = tolerances.versor
            _round(out, part, linear, limits, tolerances, report)
        out.append(part)
    coef, span = np.concatenate([p.coef for p in out]), np.concatenate([p.span for p in out])
    return Fit(coef, span, np.concatenate([p.first for p in out]), np.concatenate([p.after for p in out]))


def _round(
    out: list[Fit],
    behind: Fit,
    linear: list[int],
    limits: FloatArray,
    tolerances: Tolerances,
    report: FitReport,
) -> None:
    """Cut both curves at Racc |sin| of the turn, or nearer so that the corner is left by the tolerances at most."""
    ahead = out[-1]
    left, right = ahead.coef[-1], behind.coef[0]
    a, b = evaluated(left, float(ahead.span[-1]))[1], evaluated(right, 0.0)[1]
    turn = _angle(a[linear], b[linear])
    ahead.after[-1] = SMOOTH
    wanted = tolerances.reach_versor if ahead.kind == "versor" else tolerances.reach
    if turn > np.radians(179.0):
        ahead.after[-1] = STOP
        return
    if turn < SHARP and np.abs(a - b).max() < SHARP:
        return
    # an edge of directions alone: their turn is not that of the path, all of Racc may be used
    reach = wanted * (float(np.sin(turn)) if ahead.kind == "linear" else 1.0)
    reach = min(reach, tangent_length(max(turn, SHARP), USED * tolerances.linear))
    reach = min(reach, 0.45 * ahead.span[-1], 0.45 * behind.span[0])
    for _ in range(JOIN_TRIES):
        coef, u0, u1 = _joint(left, float(ahead.span[-1]), right, turn, reach, linear)
        deviation, others = _miss(coef, evaluated(left, float(ahead.span[-1]))[0], right, linear, limits)
        if deviation <= tolerances.linear and others <= 1.0:
            break
        reach *= 0.7
    size = float(np.linalg.norm((coef.sum(axis=1) - coef[:, 0])[linear]))
    ahead.span[-1] = u0
    behind.coef[0], behind.span[0] = shifted(right, u1), behind.span[0] - u1
    scaled = coef / size ** np.arange(6)
    report.deviation = max(report.deviation, deviation)
    report.joints += 1
    out.append(Fit(scaled[None], np.array([size]), behind.first[:1], np.array([SMOOTH])))


def _angle(x: FloatArray, y: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(x, y)), x @ y))


def _joint(
    left: FloatArray, span: float, right: FloatArray, turn: float, reach: float, linear: list[int]
) -> tuple[FloatArray, float, float]:
    """The piece over 0..1, and where it leaves the left and meets the right curve."""
    a, b = evaluated(left, span)[1], evaluated(right, 0.0)[1]
    u0, u1 = span - reach / float(np.linalg.norm(a[linear])), reach / float(np.linalg.norm(b[linear]))
    handle = 3.2 * (1.0 - np.tan(turn / 4.0) / np.sin(turn / 2.0)) if turn > 1e-6 else 1.6
    return joining(evaluated(left, u0), evaluated(right, u1), linear, handle * reach), u0, u1


def _miss(
    coef: FloatArray, corner: FloatArray, right: FloatArray, linear: list[int], limits: FloatArray
) -> tuple[float, float]:
    """How far the piece passes the corner: mm, and other columns in their limits, but for those that jump there."""
    off = np.array([evaluated(coef, s)[0] for s in np.linspace(0.0, 1.0, 33)]) - corner
    share = np.abs(off).min(axis=0) / np.maximum(limits, 1e-12)
    share[linear] = 0.0
    share[np.abs(right[:, 0] - corner) > JUMP] = 0.0
    return float(np.linalg.norm(off[:, linear], axis=1).min()), float(share.max())
