"""Smooth quintics within a tolerance of noisy points: stages 2 to 4 of the Path
Optimizer (HSM specification 11).

A *section* reaches from one edge to the next.  Its points are cut into groups
that overlap.  A polyline within the linear share of the tolerance tells where
the curve of a group bends.  The quintic B-spline gets its knots there.  Its
control points are the least squares fit to the input's path (``reference``).
Spans that leave the path by more than the tolerance are halved until none does.

Then the curve is made as smooth as the tolerance allows.  The weight of its
second derivative grows wherever there is room.  Of several such curves the
fastest one is taken.  The next group begins with the value and two derivatives
in which this one ends.  So neighbours are merged into one C2 curve.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from cnc_core.units import FloatArray

from ..geometry.profiles import jets, spline
from ..geometry.profiles.blend import evaluated
from .group import Curve, Group, duration
from .least_squares import DEGREE
from .reference import (
    Driven,
    by_length,
    driven,
    graph_polyline,
    parameter,
    polyline,
    reference_of,
)
from .types import Demands, FitReport, IntArray, Pace, Tolerances

KNOTS_FROM = (12, 4)  # every so manieth bend is a first knot
WORTH = 0.0005  # share of the time that more polynomials must save
SPARSE = (
    4.0  # points per polynomial below which knots at every point are tried too
)
FEW = 8  # points of a group that is fitted over one set of knots
KEPT = 0.1  # share of the tolerance within which the driven curve is kept
SHORTEST = 1e-6  # mm, of a polynomial at the end of a group
KEPT_PIECES = (1, 2, 4)

# few polynomials, two for every point, or the driven curve as it is
Style = Literal["free", "fine", "keep"]


class SectionFitter:
    """Fits one section.

    ``values`` (n, columns); ``linear``, ``versor``: columns of linear axes and
    of versors.

    ``degree``: of the curve that the NC would put through the points (3 or 5).
    ``begin``: (2, columns) value and direction in which the section begins
    (G62), if they are given.
    """

    def __init__(
        self,
        values: FloatArray,
        linear: list[int],
        versor: list[int],
        tolerances: Tolerances,
        degree: int = DEGREE,
        begin: FloatArray | None = None,
        pace: Pace | None = None,
        style: Style = "free",
    ) -> None:
        self.pace, self.style = pace or Pace(), style
        self.values = values
        self.linear = linear
        self.tolerances = tolerances
        self.begin = begin
        kind = np.ones(values.shape[1], np.int64)
        kind[linear], kind[versor] = 0, 2
        t = tolerances
        self.limits = np.array([t.linear, t.other, t.versor])[kind]
        self.split = np.array([t.split, t.split_other, t.split_versor])[kind]
        self.condition = np.array(
            [t.condition, t.condition_other, t.condition_versor]
        )
        self.kinds = [
            (k, np.flatnonzero(kind == k))
            for k in range(3)
            if (kind == k).any()
        ]
        self.demands = Demands(
            linear, self.kinds, self.limits, self.condition, t, self.pace
        )
        # parameter of each point, along the whole section
        self.at = np.zeros(len(values))
        far = np.linalg.norm((values[-1] - values[0])[linear])
        self.line = len(values) == 2 and begin is None and bool(far > SHORTEST)
        if self.line:
            self.at[1] = far
            return
        self.driven = driven(values, linear, degree, begin)
        self.reference = reference_of(values, linear, t.linear, self.driven)
        self.vertex = np.flatnonzero(self.reference.given)  # of each point

    def fit(
        self, report: FitReport, tick: Callable[[int], None]
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """(coefficients, spans, number of the point at or ahead of each
        polynomial's beginning).

        Where a group that keeps the driven curve does not meet the one before
        within the tolerance, all keep it.
        """
        if self.line:
            return self._straight(report, tick)
        own = FitReport()
        made = self._groups(own, tick)
        if (
            own.kept
            and own.band > self.tolerances.linear
            and self.style != "keep"
        ):
            self.style, own = "keep", FitReport()
            made = self._groups(own, lambda n: None)
        report.deviation = max(report.deviation, own.deviation)
        report.band = max(report.band, own.band)
        for name in ("polyline_points", "groups", "kept"):
            setattr(report, name, getattr(report, name) + getattr(own, name))
        return made

    def _straight(
        self, report: FitReport, tick: Callable[[int], None]
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Two points between edges, as ``fit``."""
        coef = np.zeros((1, self.values.shape[1], DEGREE + 1))
        coef[0, :, 0] = self.values[0]
        coef[0, :, 1] = (self.values[1] - self.values[0]) / self.at[1]
        cuts = 1
        if self.tolerances.longest > 0.0:
            cuts = int(np.ceil(self.at[1] / self.tolerances.longest))
        report.polyline_points += 2
        report.groups += 1
        tick(1)
        spans = np.full(cuts, self.at[1] / cuts)
        coef = np.repeat(coef, cuts, axis=0)
        coef[:, :, 0] += coef[:, :, 1] * (np.arange(cuts) * spans)[:, None]
        return coef, spans, np.zeros(cuts, np.int64)

    def _groups(
        self, report: FitReport, tick: Callable[[int], None]
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        n, size = len(self.values), self.tolerances.group
        coefs, spans, firsts = [], [], []
        state, a, done = self.begin, 0, 0.0
        while a < n - 1:
            b = min(a + size, n - 1)
            b = n - 1 if n - 1 - b < size // 4 else b
            beyond = min(b + max(size // 10, 20), n - 1)
            curve = self._group(a, beyond, b, state, report)
            at = curve.at[: b - a + 1]
            # in the middle of a polynomial as a rule
            cut = curve.breaks[-1] if b == n - 1 else at[-1]
            keep = curve.breaks[:-1] < cut - SHORTEST
            coefs.append(curve.coef[keep])
            spans.append(
                np.minimum(
                    np.diff(curve.breaks)[keep], cut - curve.breaks[:-1][keep]
                )
            )
            begins = curve.breaks[:-1][keep]
            firsts.append(
                np.clip(
                    np.searchsorted(at, begins + 1e-12, side="right") - 1,
                    0,
                    b - a,
                )
                + a
            )
            self.at[a : b + 1] = at - at[0] + done
            done += float(spans[-1].sum())
            state = evaluated(
                coefs[-1][-1],
                float(spans[-1][-1]),
            )
            report.groups += 1
            tick(b - a)
            a = b
        return (
            np.concatenate(coefs),
            np.concatenate(spans),
            np.concatenate(firsts),
        )

    # one group

    def _group(
        self,
        a: int,
        end: int,
        cut: int,
        state: FloatArray | None,
        report: FitReport,
    ) -> Curve:
        """Polynomials of points a..end, a knot at point ``cut``; ``state`` (2
        or 3, columns): given beginning.
        """
        reference = self.reference[self.vertex[a] : self.vertex[end] + 1]
        reference.u = reference.u - reference.u[0]
        bends = self._bends(self.values[a : end + 1])
        report.polyline_points += len(bends)
        fit = Group(
            self.demands,
            reference,
            state,
            end == len(self.values) - 1,
            hurried=self.style == "free",
        )
        at_cut = reference.u[self.vertex[cut] - self.vertex[a]]
        bent = reference.u[self.vertex[a:][bends] - self.vertex[a]]
        curve = None
        for every in KNOTS_FROM:
            if self.style == "keep":
                break
            inner = bent[2:-2:every] if len(bent) > 6 else bent[:0]
            curve = fit.refined(
                self._first_breaks(reference.u, inner, float(at_cut))
            )
            if curve is not None:
                curve = self._smooth(fit, curve, a, end)
                break
        free = self.style == "free"
        if curve is None or (
            free
            and end - a > 1
            and fit.cost(curve) >= self._driven_cost(a, end) * (1.0 + WORTH)
        ):
            report.kept += 1
            curve = self._kept(a, end, state)
        report.deviation = max(report.deviation, fit.deviation(curve))
        report.band = max(report.band, fit.band(curve))
        return curve

    def _driven_cost(self, a: int, end: int) -> float:
        return duration(
            self.driven.coef[a:end],
            self.driven.steps[a:end],
            self.linear,
            self.pace,
            by_length=True,
        )

    def _kept(self, a: int, end: int, state: FloatArray | None) -> Curve:
        """The curve that the NC would drive through the points, over its length."""
        part = Driven(
            self.driven.coef[a:end],
            self.driven.steps[a:end],
        )
        for pieces in KEPT_PIECES:
            coef, span = by_length(part, self.linear, pieces)
            middle = _middles(coef, span)
            wanted = _middles(
                *by_length(part, self.linear, 2 * pieces), ends=True
            )
            if np.abs(middle - wanted).max() <= KEPT * self.tolerances.linear:
                break
        if state is not None:
            begin = evaluated(coef[0], 0.0)
            target = evaluated(coef[0], float(span[0]))
            begin[: len(state)] = state
            one = begin[None, 1:], target[None, 1:], span[:1]
            coef[0] = spline.quintic(
                begin[None, 0],
                target[None, 0],
                *one,
            )[0]
        breaks = np.concatenate([[0.0], np.cumsum(span)])
        at = breaks[::pieces]
        return Curve(coef, breaks, at, at)

    def _smooth(self, fit: Group, curve: Curve, a: int, end: int) -> Curve:
        """The fastest of curves over more and more polynomials."""
        if end - a < 2:
            return curve
        u = fit.reference.u
        points = u[self.vertex[a : end + 1] - self.vertex[a]]
        finer = _apart(np.union1d(curve.breaks, points))
        tried = [(curve.breaks, False), (_halved(curve.breaks), False)]
        if len(points) < SPARSE * len(curve.breaks):
            tried += [(points, True), (finer, True), (finer, False)]
        best, cost = curve, fit.cost(curve)
        if len(points) <= FEW:
            tried = [(points, True)]
        if self.style != "free":
            tried, cost = [(_halved(points), True)], np.inf
        for breaks, even in tried:
            if fit.at_feed(best, cost):
                break
            found, its = fit.relaxed(breaks, u, even)
            if found is not None and its < cost * (1.0 - WORTH):
                best, cost = found, its
        return best

    def _bends(self, values: FloatArray) -> IntArray:
        """Points that polylines within the linear shares of the tolerances
        need, of all columns.
        """
        share = self.limits * self.split
        others = np.setdiff1d(np.arange(values.shape[1]), self.linear)
        kept = [
            polyline(
                values[:, self.linear],
                self.tolerances.linear * self.tolerances.split,
            )
        ]
        u = parameter(values, self.linear)
        kept += [
            graph_polyline(u, values[:, i], share[i])
            for i in others
            if share[i] > 0.0
        ]
        return np.unique(np.concatenate(kept))

    def _first_breaks(
        self, u: FloatArray, inner: FloatArray, cut: float
    ) -> FloatArray:
        """Breaks at ``inner``, at the cut, and where a polynomial would be too long."""
        inside = u[0] < cut < u[-1]
        inner = np.union1d(inner, [cut]) if inside else inner
        # of chords; the arc is a little longer
        longest = 0.98 * self.tolerances.longest
        if longest > 0.0:
            inner = np.union1d(
                inner,
                np.linspace(
                    u[0], u[-1], int(np.ceil((u[-1] - u[0]) / longest)) + 1
                )[1:-1],
            )
        close = 1e-6 * (u[-1] - u[0])
        near = np.diff(np.concatenate([[u[0]], inner])) < close
        inner = inner[~near & (inner < u[-1] - close)]
        return np.concatenate([[u[0]], inner, [u[-1]]])


def _middles(
    coef: FloatArray, span: FloatArray, ends: bool = False
) -> FloatArray:
    """(n, columns) values in the middle of polynomials; ``ends``: at the end of
    every other one.
    """
    if ends:
        coef = coef[::2]
        span = 2.0 * span[::2]
    return jets.of_columns(coef, 0.5 * span)[:, 0]


def _halved(breaks: FloatArray) -> FloatArray:
    return np.sort(
        np.concatenate(
            [
                breaks,
                0.5 * (breaks[1:] + breaks[:-1]),
            ]
        )
    )


def _apart(breaks: FloatArray) -> FloatArray:
    """Without those that stand close to the one before, measured by the gaps around."""
    gap = np.diff(breaks)
    beside = np.maximum(
        np.concatenate([gap[1:], [0.0]]), np.concatenate([[0.0], gap[:-1]])
    )
    keep = np.concatenate([[True], gap > 0.2 * beside])
    keep[-1] = True
    out = breaks[keep]
    last = out[-1] - out[-2]
    return out if last > 0.0 else np.delete(out, -2)
