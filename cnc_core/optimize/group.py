"""Curves through one group of points within the tolerance: least squares,
deviations, knots, smoothness.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cnc_core.units import FloatArray

from ..geometry.profiles import jets, spline
from ..geometry.shapes import bspline
from . import band
from .least_squares import (
    DEGREE,
    ORDER,
    Normal,
    derivative_rows,
    knot_vector,
    local_basis,
)
from .reference import Reference
from .types import Demands, IntArray, Pace

USED = 0.97  # share of the tolerance that the fit uses
REFINEMENTS = 30
STIFF = 1e-5  # of the penalty to begin with: what no point decides
RELAXATIONS = 24
# weight of the curvature to begin with, times the length of a polynomial to the
# fourth
START = 1e-4
REACH = 3  # polynomials on either side over which weights change evenly
AIM = 0.93  # share of the tolerance that smoothing is to use
FASTER, SLOWER = 2.0, -4.0  # largest changes of a weight's logarithm
END_VERTICES = 14  # that say where a curve begins to go
SAMPLES = 8  # of each polynomial, for the time
GAIN = 2e-5  # share of the time that counts as a gain
AT_FEED = 1e-6  # share of the time that something else costs
PATIENCE = 8  # turns without one
SLOW = 0.5  # of the length: the linear axes rest there


@dataclass
class Curve:
    """Polynomials (n, columns, 6) between ``breaks`` (n + 1,); ``u``: parameter
    of the reference's vertices.

    ``at``: parameter of the input's points.
    """

    coef: FloatArray
    breaks: FloatArray
    u: FloatArray
    at: FloatArray


class Group:
    """Least squares, deviations and smoothing of one group of vertices.

    ``hurried``: smooth enough where the feed alone limits the curve.
    """

    def __init__(
        self,
        demands: Demands,
        reference: Reference,
        state: FloatArray | None,
        ends: bool,
        hurried: bool = True,
    ) -> None:
        self.demands, self.reference = demands, reference
        self.hurried = hurried
        self.state, self.ends = state, ends
        self.linear = demands.linear

    # least squares

    def curve(
        self,
        breaks: FloatArray,
        u: FloatArray,
        stiff: list[FloatArray] | None = None,
    ) -> Curve:
        """The fit over ``breaks``; ``stiff``: weight of the curvature, (count -
        2,) of each kind of column.
        """
        knots = knot_vector(breaks)
        count = len(knots) - DEGREE - 1
        first, basis = local_basis(u, knots)
        rows, share = derivative_rows(knots)
        at = np.arange(count - ORDER)
        control = np.zeros((count, self.reference.values.shape[1]))
        stiff = stiff or [self.softest(breaks)] * len(self.demands.kinds)
        for (kind, columns), weight in zip(
            self.demands.kinds, stiff, strict=True
        ):
            values = self.reference.values[:, columns]
            normal = Normal(count)
            normal.add(first, basis, self.reference.weight)
            normal.add(at, rows, weight * share)
            right = np.zeros((count, len(columns)))
            for i in range(DEGREE + 1):
                np.add.at(
                    right,
                    first + i,
                    (self.reference.weight * basis[:, i])[:, None] * values,
                )
            condition = int(self.demands.condition[kind])
            given = None if self.state is None else self.state[:, columns]
            begin = _begin(values, u, knots, given, condition, kind == 0)
            back = (
                values[::-1],
                -u[::-1],
                -knots[::-1],
            )
            finish = (
                _begin(*back, None, condition, kind == 0)
                if self.ends
                else values[:0]
            )
            control[:, columns] = normal.solved(
                right, begin, finish[: max(count - len(begin), 1)]
            )
        return Curve(
            bspline.spans(control, knots, DEGREE)[0],
            breaks,
            u,
            u[self.reference.given],
        )

    @staticmethod
    def softest(breaks: FloatArray) -> FloatArray:
        """(count - 2,) weights that decide only what the vertices leave open."""
        h, beyond = np.diff(breaks), DEGREE - ORDER
        wide = np.pad(h, beyond, mode="edge")
        least = np.min(
            [wide[i : i + len(h) + beyond] for i in range(beyond + 1)], axis=0
        )
        return np.asarray(STIFF * least ** (2 * ORDER))

    # deviations

    def ratios(self, curve: Curve) -> tuple[list[FloatArray], FloatArray]:
        """For each kind of column the (n,) largest deviation of each polynomial
        over its tolerance; (v,) feet.
        """
        demands, reference = self.demands, self.reference
        off, feet = band.off_points(
            reference.values, curve.u, curve.coef, curve.breaks, self.linear
        )
        k = np.clip(
            np.searchsorted(curve.breaks, curve.u, side="right") - 1,
            0,
            len(curve.coef) - 1,
        )
        out = []
        for kind, columns in demands.kinds:
            worst = np.zeros(len(curve.coef))
            if kind == 0:
                far = np.linalg.norm(off[:, columns], axis=1) / (
                    USED * demands.tolerances.linear
                )
                bound, piece = self._path(curve)
                np.maximum.at(worst, piece, bound / (demands.tolerances.linear))
            else:
                far = np.abs(off[:, columns]).max(axis=1) / (
                    USED * max(demands.limits[columns[0]], 1e-12)
                )
            np.maximum.at(worst, k, far)
            # a vertex at a knot: of both
            np.maximum.at(
                worst, np.maximum(k - (curve.u == curve.breaks[k]), 0), far
            )
            out.append(worst)
        return out, feet

    def _path(self, curve: Curve) -> tuple[FloatArray, IntArray]:
        return band.off_path(
            self.reference.values[:, self.linear],
            curve.u,
            curve.coef[:, self.linear],
            curve.breaks,
        )

    def deviation(self, curve: Curve) -> float:
        """Largest distance of a point of the input from the curve, mm."""
        points = self.reference.values[self.reference.given]
        off, _ = band.off_points(
            points, curve.at, curve.coef, curve.breaks, self.linear
        )
        return float(
            np.linalg.norm(
                off[:, self.linear],
                axis=1,
            ).max()
        )

    def band(self, curve: Curve) -> float:
        """Upper bound of the distance of the curve from the input's path, mm."""
        given = self.reference.given
        u = np.interp(self.reference.u, self.reference.u[given], curve.at)
        return float(self._path(replace(curve, u=u))[0].max())

    # knots

    def refined(self, breaks: FloatArray) -> Curve | None:
        """Polynomials that leave the tolerance halved until none does; None
        where none can be halved any more.
        """
        u = self.reference.u
        for _ in range(REFINEMENTS):
            curve = self.curve(breaks, u)
            ratios, _ = self.ratios(curve)
            bad = np.flatnonzero(np.max(ratios, axis=0) > 1.0)
            if not len(bad):
                return curve
            held = np.searchsorted(u, breaks[1:] - 1e-9) - np.searchsorted(
                u, breaks[:-1] + 1e-9
            )
            bad = bad[held[bad] > 0]
            if not len(bad):
                return None
            breaks = np.unique(
                np.concatenate([breaks, 0.5 * (breaks[bad] + breaks[bad + 1])])
            )
        return None

    # smoothness

    def relaxed(
        self, breaks: FloatArray, u: FloatArray, even: bool
    ) -> tuple[Curve | None, float]:
        """As smooth as the tolerance allows, and its cost: curvature weighs
        more wherever there is room.

        ``even``: it weighs the same everywhere; on smooth points nothing
        disturbs their curve then.
        """
        best, cost, idle = None, np.inf, 0
        kinds = len(self.demands.kinds)
        weight = [
            np.full(
                len(breaks) - 1,
                np.log(START * np.median(np.diff(breaks)) ** (2 * ORDER)),
            )
        ] * kinds
        for _ in range(RELAXATIONS):
            curve = self.curve(
                breaks,
                u,
                [_rows_of(np.exp(w)) for w in weight],
            )
            ratios, feet = self.ratios(curve)
            idle += best is not None
            if np.max(ratios) <= 1.0 and (found := self.cost(curve)) < cost:
                idle = 0 if found < cost * (1.0 - GAIN) else idle
                best, cost = curve, found
            if idle > PATIENCE or self.at_feed(best, cost):
                break
            weight = [
                w + _change(ratio / AIM, even)
                for w, ratio in zip(weight, ratios, strict=True)
            ]
            breaks, u = self._by_length(curve, feet)
        return best, cost

    def at_feed(self, curve: Curve | None, cost: float) -> bool:
        """The feed alone limits the curve."""
        if curve is None or not self.hurried:
            return False
        length = float(curve.breaks[-1] - curve.breaks[0])
        return cost * self.demands.pace.feed <= length * (1.0 + AT_FEED)

    def cost(self, curve: Curve) -> float:
        return duration(
            curve.coef, np.diff(curve.breaks), self.linear, self.demands.pace
        )

    def _by_length(
        self, curve: Curve, feet: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The same breaks and vertices over a parameter that is closer to the
        length along the curve.
        """
        ends = np.maximum.accumulate(
            np.concatenate([curve.breaks, np.maximum.accumulate(feet)])
        )
        grid = np.unique(
            np.concatenate(
                [
                    ends,
                    np.linspace(
                        curve.breaks[0], curve.breaks[-1], 8 * len(curve.coef)
                    ),
                ]
            )
        )
        k = np.clip(
            np.searchsorted(curve.breaks, grid, side="right") - 1,
            0,
            len(curve.coef) - 1,
        )
        place = jets.of_columns(
            curve.coef[k][:, self.linear], grid - curve.breaks[k]
        )[:, 0]
        moved = np.linalg.norm(np.diff(place, axis=0), axis=1)
        # where the linear axes rest
        moved = np.where(moved > 1e-9, moved, np.diff(grid))
        length = np.concatenate([[0.0], np.cumsum(moved)])
        feet = np.maximum.accumulate(feet)
        u = np.interp(feet, grid, length)
        u += np.arange(len(u)) * 1e-12 * length[-1]
        u[0] = 0.0
        breaks = np.interp(curve.breaks, grid, length)
        breaks[-1] = u[-1]
        if (np.diff(u) <= 0).any() or (
            np.diff(breaks) <= 1e-9 * breaks[-1]
        ).any():
            return curve.breaks, curve.u
        return breaks, u

    def through(self) -> Curve:
        """Through every vertex, where no fit of fewer knots holds the tolerance."""
        values, u = self.reference.values, self.reference.u
        h = np.diff(u)
        states = spline.derivatives(
            [spline.Window(values, h, slice(0, len(values)))], DEGREE
        )[0]
        if self.state is not None:
            states[0, : len(self.state) - 1] = self.state[1:]
            values = values.copy()
            values[0] = self.state[0]
        return Curve(
            spline.hermite(values, states, h),
            u.copy(),
            u,
            u[self.reference.given],
        )


def _change(ratio: FloatArray, even: bool) -> FloatArray:
    """(polynomials,) what is added to the logarithms of the weights: changes
    slowly along the curve.
    """
    step = np.clip(
        -2.0 * np.log(np.maximum(ratio, 1e-9)),
        SLOWER,
        FASTER,
    )
    if even:
        return np.full(len(step), step.min())
    wide = np.pad(step, 2 * REACH, mode="edge")
    low = np.min(
        [wide[i : i + len(step) + 2 * REACH] for i in range(2 * REACH + 1)],
        axis=0,
    )
    return np.asarray(
        np.convolve(
            low,
            np.full(
                2 * REACH + 1,
                1.0 / (2 * REACH + 1),
            ),
            mode="valid",
        )
    )


def _rows_of(weight: FloatArray) -> FloatArray:
    """(count - 2,) weights of the rows of the penalty from those of the
    polynomials: geometric means.
    """
    beyond = DEGREE - ORDER
    wide = np.pad(weight, beyond, mode="edge")
    return np.asarray(
        np.exp(
            np.mean(
                [
                    np.log(wide[i : i + len(weight) + beyond])
                    for i in range(beyond + 1)
                ],
                axis=0,
            )
        )
    )


def duration(
    coef: FloatArray,
    span: FloatArray,
    linear: list[int],
    pace: Pace,
    by_length: bool = False,
) -> float:
    """Seconds that polynomials take where the feed, curvature and the change of
    that alone limit the speed.

    ``by_length``: the feed is that along the path, not that of the parameter.
    """
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    j = jets.of_columns(
        np.repeat(coef[:, linear], SAMPLES, axis=0),
        (span[:, None] * share).ravel(),
        1,
    )
    speed = np.maximum(
        np.linalg.norm(j[:, 0], axis=1),
        1e-9,
    )
    along = j[:, 0] / speed[:, None]
    second = j[:, 1]
    bend = second - (second * along).sum(axis=1)[:, None] * along
    third = j[:, 2]
    third = third - (third * along).sum(axis=1)[:, None] * along
    gains = (j[:, 1] * along).sum(axis=1) / speed
    # of the curvature over the length, times speed^3
    across = third - 3.0 * gains[:, None] * bend
    change = np.hypot(
        np.linalg.norm(across, axis=1), (bend * bend).sum(axis=1) / speed
    )
    share_of_feed = speed if by_length else np.ones(len(speed))
    slow = share_of_feed / max(pace.feed, 1e-9)
    if pace.acceleration > 0.0:
        slow = np.maximum(
            slow, np.sqrt(np.linalg.norm(bend, axis=1) / pace.acceleration)
        )
    if pace.jerk > 0.0:
        slow = np.maximum(slow, np.cbrt(change / pace.jerk))
    return float((np.repeat(span / SAMPLES, SAMPLES) * slow).sum())


def _begin(
    values: FloatArray,
    u: FloatArray,
    knots: FloatArray,
    state: FloatArray | None,
    condition: int,
    path: bool,
) -> FloatArray:
    """The first control points that the end's value and derivatives give; of a
    ``path`` by its length.
    """
    if state is None:
        state = _end_state(values, u)[: condition if len(values) > 3 else 1]
        if (
            path
            and len(state) > 1
            and (speed := float(np.linalg.norm(state[1]))) > SLOW
        ):
            state[1:2] /= speed
            along = state[2:] @ state[1]
            state[2:] -= along[:, None] * state[1]
    # of control points 1..5
    numbers = range(1, DEGREE + 1)
    h = [float(knots[DEGREE + i] - knots[i]) for i in numbers]
    points = [state[0]]
    if len(state) > 1:
        points.append(points[0] + state[1] * h[0] / DEGREE)
    if len(state) > 2:
        slope = state[1] + state[2] * float(
            knots[DEGREE + 1] - knots[DEGREE]
        ) / (DEGREE - 1)
        points.append(points[1] + slope * h[1] / DEGREE)
    return np.array(points)


def _end_state(values: FloatArray, u: FloatArray) -> FloatArray:
    """(3, columns) value, direction and curvature at the first vertex.

    The manual takes them from the first two and three points; noise of a few
    micrometres on short chords turns such a direction by degrees, and on a bend
    it lies half a chord off.  So both come from a parabola through the first
    point that fits the next ones best.
    """
    n = min(END_VERTICES, len(values))
    t = u[1:n] - u[0]
    moved = values[1:n] - values[0]
    powers = t[:, None] ** np.arange(1, min(n, 3))
    scale = t[-1] ** np.arange(1, min(n, 3))
    found = (
        np.linalg.lstsq(
            powers / scale,
            moved,
            rcond=None,
        )[0]
        / scale[:, None]
    )
    bend = 2.0 * found[1] if len(found) > 1 else 0.0 * found[0]
    return np.array([values[0], found[0], bend])
