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

from ..profile import BLEND, SMOOTH
from . import bspline
from . import profile_spline as spline
from .profile_blend import evaluated, joining, shifted, tangent_length

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
DEGREE = 5
USED = 0.97  # share of the tolerance that the fit uses
REFINEMENTS = 40
STIFF = 1e-9  # weight of the fit's third differences: what no point decides
SHARP = np.radians(0.5)
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
    reach: float = 1.0
    condition: int = 2
    longest: float = 0.0
    group: int = 1000


@dataclass
class Fit:
    """Polynomials (n, columns, 6) over ``span`` and which points (from, to) each covers; transitions at their ends."""

    coef: FloatArray
    span: FloatArray
    first: IntArray
    after: IntArray


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
        self.limits = np.full(values.shape[1], tolerances.other)
        self.limits[versor] = tolerances.versor
        moved = np.diff(values, axis=0)
        chord = np.linalg.norm(moved[:, linear], axis=1)
        rest = np.linalg.norm(moved, axis=1)
        self.u = np.concatenate([[0.0], np.cumsum(np.where(chord > 0.0, chord, np.maximum(rest, 1e-9)))])
        self.scale = np.ones(values.shape[1])
        for i in range(values.shape[1]):
            if i not in linear and self.limits[i] > 0.0:
                self.scale[i] = tolerances.linear / self.limits[i]

    def fit(self, report: FitReport, tick: Callable[[int], None]) -> tuple[FloatArray, FloatArray, IntArray]:
        """(coefficients, spans, number of the point at or ahead of each polynomial's beginning)."""
        n, size = len(self.values), self.tolerances.group
        coefs, spans, firsts = [], [], []
        state: FloatArray | None = None
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
        bends = polyline(values[:, self.linear], self.tolerances.linear * self.tolerances.split)
        report.polyline_points += len(bends)
        inner = self._first_knots(u, bends, self.u[cut])
        ends_here = end == len(self.values) - 1
        for _ in range(REFINEMENTS):
            knots = np.concatenate([np.full(DEGREE + 1, u[0]), inner, np.full(DEGREE + 1, u[-1])])
            control = self._control(values, u, knots, state, ends_here)
            coef, span, _ = bspline.spans(control, knots, DEGREE)
            breaks = np.concatenate([[u[0]], u[0] + np.cumsum(span)])
            missed = self._missed(values, u, coef, breaks)
            bad = np.unique(np.clip(np.searchsorted(breaks, u[missed > 1.0], side="right") - 1, 0, len(span) - 1))
            if not len(bad) and not self._swings(values, u, coef, breaks):
                break
            finer = self._halved(u, breaks, bad)
            if not len(finer):
                coef, breaks = self._through(values, u, state)
                break
            inner = np.unique(np.concatenate([inner, finer]))
        else:
            coef, breaks = self._through(values, u, state)
        report.deviation = max(report.deviation, self._deviation(values, u, coef, breaks))
        return coef, breaks

    def _first_knots(self, u: FloatArray, bends: IntArray, cut: float) -> FloatArray:
        """A knot for every fourth point of the polyline, at the cut, and where a polynomial would be too long."""
        inner = u[bends[2:-2:4]] if len(bends) > 6 else np.empty(0)
        inner = np.union1d(inner, [cut]) if u[0] < cut < u[-1] else inner
        longest = self.tolerances.longest
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
        begin = self._begin(values, u, knots, state)
        finish = self._begin(values[::-1], -u[::-1], -knots[::-1], None) if ends_here else values[:0]
        room = count - len(begin)
        finish = finish[: max(room, 1)]
        control[: len(begin)] = begin
        if len(finish):
            control[count - len(finish) :] = finish[::-1]
        free = slice(len(begin), count - len(finish))
        if free.start >= free.stop:
            return control
        matrix = basis(u, knots, count)
        rough = np.diff(np.eye(count), n=3, axis=0) if count > 3 else np.zeros((0, count))
        left = matrix.T @ matrix + STIFF * len(u) * rough.T @ rough
        right = matrix.T @ values - left @ control
        control[free] = np.linalg.solve(left[free, free] + 1e-13 * np.eye(free.stop - free.start), right[free])
        return control

    def _begin(self, values: FloatArray, u: FloatArray, knots: FloatArray, state: FloatArray | None) -> FloatArray:
        """The first control points that the end's value and derivatives give."""
        if state is None:
            condition = self.tolerances.condition if len(values) > 3 else 1
            state = _end_state(values, u)[:condition]
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
        """(n, columns) of each point from its foot on the curve."""
        at = u.copy()
        for _ in range(4):
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
            at = np.clip(at - np.clip(step, -1.0, 1.0), breaks[0], breaks[-1])
        return np.asarray(best)

    def _deviation(self, values: FloatArray, u: FloatArray, coef: FloatArray, breaks: FloatArray) -> float:
        off = self._off(values, u, coef, breaks)
        return float(np.linalg.norm(off[:, self.linear], axis=1).max())

    def _swings(self, values: FloatArray, u: FloatArray, coef: FloatArray, breaks: FloatArray) -> bool:
        """Between two points the curve is longer than the points' own bends explain: it oscillates."""
        middle = 0.5 * (u[1:] + u[:-1])
        k = np.clip(np.searchsorted(breaks, middle, side="right") - 1, 0, len(coef) - 1)
        s = middle - breaks[k]
        at = np.einsum("nck,nk->nc", coef[k], s[:, None] ** np.arange(6))
        off = np.linalg.norm((at - 0.5 * (values[1:] + values[:-1]))[:, self.linear], axis=1)
        bend = np.zeros(len(values))
        bend[1:-1] = np.linalg.norm((values[2:] - 2.0 * values[1:-1] + values[:-2])[:, self.linear], axis=1)
        bend[0], bend[-1] = bend[1] if len(bend) > 2 else 0.0, bend[-2] if len(bend) > 2 else 0.0
        allowed = 2.0 * self.tolerances.linear + np.maximum(bend[1:], bend[:-1])
        return bool((off > allowed).any())

    def _through(self, values: FloatArray, u: FloatArray, state: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """The interpolating spline, where no fit of fewer knots holds the tolerance."""
        h = np.diff(u)
        window = spline.Window(values, h, slice(0, len(values)))
        states = spline.derivatives([window], DEGREE if len(values) > 2 else 3)[0]
        if state is not None:
            states[0] = state[1:]
            values = values.copy()
            values[0] = state[0]
        return spline.hermite(values, states, h), u.copy()

    @staticmethod
    def _halved(u: FloatArray, breaks: FloatArray, bad: IntArray) -> FloatArray:
        """Knots in the middle of bad spans that hold points enough."""
        out = []
        for k in bad:
            inside = u[(u > breaks[k] + 1e-9) & (u < breaks[k + 1] - 1e-9)]
            if len(inside) > 3:
                out.append(0.5 * (breaks[k] + breaks[k + 1]))
        return np.array(out)


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


def join_sections(parts: list[Fit], linear: list[int], tolerances: Tolerances, report: FitReport) -> Fit:
    """One row of polynomials; where a section ends in 63 a joining piece rounds its corner."""
    out: list[Fit] = []
    for part in parts:
        if out and out[-1].after[-1] == BLEND:
            _round(out, part, linear, tolerances, report)
        out.append(part)
    return Fit(*(np.concatenate([getattr(p, name) for p in out]) for name in ("coef", "span", "first", "after")))


def _round(out: list[Fit], behind: Fit, linear: list[int], tolerances: Tolerances, report: FitReport) -> None:
    """Cut both curves at Racc |sin| of the turn, or nearer so that the corner is left by the tolerance at most."""
    ahead = out[-1]
    left, right = ahead.coef[-1], behind.coef[0]
    a, b = evaluated(left, float(ahead.span[-1]))[1], evaluated(right, 0.0)[1]
    x, y = a[linear], b[linear]
    turn = float(np.arctan2(np.linalg.norm(np.cross(x, y)), x @ y))
    ahead.after[-1] = SMOOTH
    if turn < SHARP or turn > np.radians(179.0):
        return
    reach = min(tolerances.reach * np.sin(turn), tangent_length(turn, USED * tolerances.linear))
    reach = min(reach, 0.45 * ahead.span[-1], 0.45 * behind.span[0])
    u0, u1 = float(ahead.span[-1]) - reach / float(np.linalg.norm(x)), reach / float(np.linalg.norm(y))
    start, end = evaluated(left, u0), evaluated(right, u1)
    handle = 3.2 * (1.0 - np.tan(turn / 4.0) / np.sin(turn / 2.0))
    coef = joining(start, end, linear, handle * reach)
    size = float(np.linalg.norm((end[0] - start[0])[linear]))
    ahead.span[-1] = u0
    behind.coef[0], behind.span[0] = shifted(right, u1), behind.span[0] - u1
    scaled = coef / size ** np.arange(6)
    corner = right[:, 0]
    points = np.array([evaluated(coef, s)[0] for s in np.linspace(0.0, 1.0, 33)])
    report.deviation = max(report.deviation, float(np.linalg.norm((points - corner)[:, linear], axis=1).min()))
    report.joints += 1
    out.append(Fit(scaled[None], np.array([size]), behind.first[:1], np.array([SMOOTH])))
