"""Measure a sampled trajectory: limits, feed and deviation, without knowing how
it was planned.

Velocity, acceleration and jerk are finite differences at the cycle, as a drive
would see them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core.blocks.pool import coefficients

from .._engine import lib
from ..blocks import (
    CIRCULAR,
    DYNAMICS,
    ELEMENT,
    PIECE,
    POLYNOMIAL,
    RAPID,
    TANGENTS,
    motion_planes,
)
from ..config import CellConfig
from ..engine import Samples
from ..geometry.shapes.polynomial import ORDER, distance, normalised
from ..units import AnyArray, FloatArray

NEIGHBOURS = (
    6  # elements looked at on either side where a smooth piece covers several,
)
# ... and where these seem too far away: elements may be far shorter than the
# tolerance
WIDE = 256
AT_A_TIME = 64
NEAREST_STEPS = 6  # from the same angle to the nearest place of a helix


class ElementTable:
    """Geometry of the motion rows not yet left behind, by element number."""

    def __init__(self, cell: CellConfig) -> None:
        self.axes, self.main = len(cell.axes), cell.main_axes
        linear = [
            i
            for i, axis in enumerate(cell.axes.values())
            if axis.kind == "linear"
        ]
        # mm and degrees make no distance
        self.measured = linear or list(range(self.axes))
        self.first = 0
        self.rows: AnyArray | None = None
        self.starts: FloatArray = np.empty((0, self.axes))
        # of the polynomials among the rows, over 0..1
        self.curves: FloatArray = np.empty((0, self.axes, ORDER))
        # element -> row of ``curves``, -1 if none
        self.curve_of: npt.NDArray[np.int64] = np.empty(0, np.int64)
        self.position = cell.axis_values("start_mm")
        self.driven, self.away = self.position.copy(), False
        # shares above 1 that the jerk may have; all 1 where empty
        self.lifted: FloatArray = np.empty((0, self.axes))
        self._lift = np.ones(
            (2, self.axes)
        )  # of feed and rapid motions from here on

    def add(self, rows: AnyArray, pool: FloatArray | None = None) -> None:
        """Append the motion rows of a batch; ``pool`` holds the coefficients of
        its polynomials.
        """
        seen = (rows["type"] <= POLYNOMIAL) & ((rows["flags"] & PIECE) == 0)
        motion = rows[seen]
        starts = self._starts_of(rows, seen)
        self._add_lifted(rows, seen)
        if not len(motion):
            return
        self.rows = (
            motion.copy()
            if self.rows is None
            else np.concatenate([self.rows, motion])
        )
        self.starts = np.vstack([self.starts, starts])
        self._add_curves(motion, pool)

    def _add_lifted(self, rows: AnyArray, seen: npt.NDArray[np.bool_]) -> None:
        """The jerk limits that S ramps lift (DYNAMICS rows) of the elements
        behind them.
        """
        set_here = np.flatnonzero(
            (rows["type"] == DYNAMICS) & (rows["code"] == lib.NC_DYNAMICS_JERK)
        )
        if not (
            len(self.lifted)
            or (self._lift > 1.0).any()
            or (rows["end"][set_here] > 1.0).any()
        ):
            return
        known = 0 if self.rows is None else len(self.rows)
        plain = np.ones((known - len(self.lifted), self.axes))
        parts = [self.lifted, plain]
        first = 0
        for at in [*set_here, len(rows)]:
            rapid = (
                rows["flags"][first:at][seen[first:at]] & RAPID != 0
            ).astype(np.int64)
            parts.append(self._lift[rapid])
            if at < len(rows):
                self._lift[int(rows["value"][at] > 0)] = np.maximum(
                    rows["end"][at, : self.axes], 1.0
                )
            first = at
        self.lifted = np.concatenate(parts)

    def jerk_shares(self, element: npt.NDArray[np.int64]) -> FloatArray | None:
        """(n, axes) by how much the jerk may exceed the axes' own; None: nowhere."""
        if not (len(self.lifted) and (self.lifted > 1.0).any()):
            return None
        return self.lifted[
            np.clip(element - self.first, 0, len(self.lifted) - 1)
        ]

    def _starts_of(
        self, rows: AnyArray, seen: npt.NDArray[np.bool_]
    ) -> FloatArray:
        """(n, axes) where elements begin: behind the element before, or where
        the axes stand if that is elsewhere.
        """
        driven = np.flatnonzero(
            (rows["type"] <= POLYNOMIAL) & (rows["flags"] & ELEMENT == 0)
        )
        stood = np.vstack([self.driven, rows["end"][driven, : self.axes]])
        motion = rows[seen]
        stands = stood[np.searchsorted(driven, np.flatnonzero(seen))]
        ends = motion["end"][:, : self.axes]
        away = _elsewhere(motion)
        behind = ends
        if len(motion):
            behind = np.vstack([self.position, ends[:-1]])
        follows = (motion["flags"] & ELEMENT != 0) & ~np.append(
            [self.away], away[:-1]
        )[: len(motion)]
        self.driven = stood[-1].copy()
        if len(motion):
            self.position = ends[-1].copy()
            self.away = bool(away[-1])
        return np.where(follows[:, None], behind, stands)

    def _add_curves(self, motion: AnyArray, pool: FloatArray | None) -> None:
        is_curve = (motion["type"] == POLYNOMIAL) & ~_elsewhere(motion)
        number = np.where(
            is_curve, len(self.curves) + np.cumsum(is_curve) - 1, -1
        )
        self.curve_of = np.concatenate([self.curve_of, number])
        if is_curve.any() and pool is not None:
            new = normalised(
                coefficients(motion[is_curve], pool, self.axes),
                motion["angle"][is_curve],
            )
            self.curves = np.concatenate([self.curves, new])

    def drop_before(self, element: int) -> None:
        """Forget elements below this number."""
        n = element - self.first
        if n > 0 and self.rows is not None:
            self.rows, self.starts, self.first = (
                self.rows[n:],
                self.starts[n:],
                element,
            )
            self.lifted = self.lifted[n:]
            gone = int((self.curve_of[:n] >= 0).sum())
            self.curve_of, self.curves = self.curve_of[n:], self.curves[gone:]
            self.curve_of[self.curve_of >= 0] -= gone

    def feed(self, element: npt.NDArray[np.int64]) -> FloatArray:
        """Programmed feed, infinite for rapid, mm/s."""
        assert self.rows is not None
        rows = self.rows[element - self.first]
        rapid = rows["flags"] & RAPID
        return np.asarray(np.where(rapid, np.inf, rows["feed"]))

    def distance(
        self,
        element: npt.NDArray[np.int64],
        pos: FloatArray,
        known: float = 0.0,
    ) -> FloatArray:
        """Distance of each position from the geometry of its element, over the
        linear axes, mm.

        The largest is exact, and so are those that count: ``known`` is what has
        been found already.
        """
        if self.rows is None:
            return np.zeros(len(element))
        index = element - self.first
        out = self._element_distance(index, pos)
        elsewhere = _elsewhere(self.rows[index])
        smoothed = np.flatnonzero(
            (self.rows["flags"][index] & ELEMENT != 0) & ~elsewhere
        )
        # which element is under the tool is known roughly there
        for k in range(1, NEIGHBOURS + 1):
            for side in (index[smoothed] + k, index[smoothed] - k):
                near = np.clip(side, 0, len(self.rows) - 1)
                out[smoothed] = np.minimum(
                    out[smoothed], self._element_distance(near, pos[smoothed])
                )
        out[elsewhere] = 0.0
        self._look_wider(index, pos, out, smoothed[out[smoothed] > known])
        return out

    def _look_wider(
        self,
        index: npt.NDArray[np.int64],
        pos: FloatArray,
        out: FloatArray,
        some: npt.NDArray[np.int64],
    ) -> None:
        """Correct the largest of ``out`` by looking at more elements, until it
        stays the largest.
        """
        assert self.rows is not None
        some = some[np.argsort(-out[some])]
        reach = np.arange(-WIDE, WIDE + 1)
        for first in range(0, len(some), AT_A_TIME):
            here, rest = (
                some[first : first + AT_A_TIME],
                some[first + AT_A_TIME :],
            )
            last = len(self.rows) - 1
            near = np.clip(index[here, None] + reach, 0, last)
            found = self._element_distance(
                near.ravel(), np.repeat(pos[here], len(reach), axis=0)
            )
            out[here] = np.minimum(
                out[here], found.reshape(near.shape).min(axis=1)
            )
            if not len(rest) or out[here].max() >= out[rest[0]]:
                return

    def elsewhere(
        self, element: npt.NDArray[np.int64]
    ) -> npt.NDArray[np.bool_]:
        """Elements in other coordinates than the axes': the stage that made
        their pieces vouches for the deviation.
        """
        assert self.rows is not None
        return _elsewhere(self.rows[element - self.first])

    def _element_distance(
        self, index: npt.NDArray[np.int64], pos: FloatArray
    ) -> FloatArray:
        assert self.rows is not None
        here = self.measured
        starts, ends = self.starts[:, here], self.rows["end"][:, here]
        out = _line_distance(starts[index], ends[index], pos[:, here])
        is_arc = (self.rows["type"] == CIRCULAR)[index]
        planes = self.rows["plane"][index]
        for plane in (17, 18, 19):
            arcs = is_arc & (planes == plane)
            if arcs.any():
                out[arcs] = self._arc_distance(index[arcs], pos[arcs], plane)
        curves = self.curve_of[index] >= 0
        if curves.any():
            out[curves] = distance(
                self.curves[self.curve_of[index[curves]]][:, here],
                pos[curves][:, here],
            )
        return out

    def _arc_distance(
        self,
        index: npt.NDArray[np.int64],
        pos: FloatArray,
        plane: int,
    ) -> FloatArray:
        assert self.rows is not None
        first, second, _ = motion_planes(plane)
        columns = [self.main[first], self.main[second]]
        center, angle = self.rows["center"][index], self.rows["angle"][index]
        starts, ends = self.starts[index], self.rows["end"][index]
        d0 = starts[:, columns] - center
        d = pos[:, columns] - center
        turned = np.arctan2(d[:, 1], d[:, 0]) - np.arctan2(d0[:, 1], d0[:, 0])
        at = np.mod(turned * np.sign(angle), 2 * np.pi)
        # rounding at the start
        at = np.where(at > 2 * np.pi - 1e-6, at - 2 * np.pi, at)
        polar = np.column_stack([np.hypot(d[:, 0], d[:, 1]), at])
        radius = np.hypot(d0[:, 0], d0[:, 1])
        whole = np.abs(angle)
        others = [i for i in self.measured if i not in columns]
        climb = ends[:, others] - starts[:, others]
        beside = pos[:, others] - starts[:, others]
        out = np.hypot(
            _flat_arc_distance(polar, radius, whole),
            np.linalg.norm(beside, axis=1),
        )
        some = climb.any(axis=1)
        if some.any():
            out[some] = _helix_distance(
                polar[some],
                radius[some],
                whole[some],
                beside[some],
                climb[some],
            )
        return np.asarray(out)


def _off_circle(
    polar: FloatArray, radius: FloatArray, angle: FloatArray
) -> FloatArray:
    """From the points of the circle at these angles (n, 2): outwards and along."""
    away = polar[:, 1] - angle
    outwards = polar[:, 0] * np.cos(away) - radius
    return np.column_stack([outwards, polar[:, 0] * np.sin(away)])


def _flat_arc_distance(
    polar: FloatArray, radius: FloatArray, whole: FloatArray
) -> FloatArray:
    """Distance of positions (n, 2) from arcs in their plane. The arcs go from the
    angle 0 to ``whole``; radius and angle of a position are as seen from there.
    """
    to_start = np.linalg.norm(_off_circle(polar, radius, 0.0 * whole), axis=1)
    to_end = np.linalg.norm(_off_circle(polar, radius, whole), axis=1)
    across = np.abs(polar[:, 0] - radius)
    beyond = polar[:, 1] > whole
    return np.where(beyond, np.minimum(to_start, to_end), across)


def _helix_distance(
    polar: FloatArray,
    radius: FloatArray,
    whole: FloatArray,
    beside: FloatArray,
    climb: FloatArray,
) -> FloatArray:
    """The same for arcs that climb in other axes; ``beside``: positions in these
    axes, less those at the start.

    From the same height, from the same angle in the turns next to it and from the
    start to the nearest place, of all the nearest.
    """
    best = np.full(len(polar), np.inf)
    climb2 = (climb**2).sum(axis=1)
    length2 = (radius * whole) ** 2 + climb2
    height = (beside * climb).sum(axis=1) / np.maximum(climb2, 1e-300)
    turn = np.round((height * whole - polar[:, 1]) / (2 * np.pi))
    last = np.floor((whole - polar[:, 1]) / (2 * np.pi))
    turn = np.clip(turn, 0.0, np.maximum(last, 0.0))
    same_angle = [
        (polar[:, 1] + (turn + away) * 2 * np.pi) / whole for away in (-1, 0, 1)
    ]
    for begin in (height, *same_angle, 0.0 * whole):
        t = np.clip(begin, 0.0, 1.0)
        for _ in range(NEAREST_STEPS):
            flat = _off_circle(polar, radius, whole * t)
            rise = beside - t[:, None] * climb
            off2 = (flat**2).sum(axis=1) + (rise**2).sum(axis=1)
            best = np.minimum(best, np.sqrt(off2))
            along = flat[:, 1] * radius * whole + (rise * climb).sum(axis=1)
            t = np.clip(t + along / np.maximum(length2, 1e-300), 0.0, 1.0)
    return best


def _line_distance(
    starts: FloatArray, ends: FloatArray, pos: FloatArray
) -> FloatArray:
    along = ends - starts
    length2 = np.maximum((along**2).sum(axis=1), 1e-300)
    share = ((pos - starts) * along).sum(axis=1) / length2
    t = np.clip(share, 0.0, 1.0)[:, None]
    nearest = starts + t * along
    return np.asarray(np.linalg.norm(pos - nearest, axis=1))


def _elsewhere(rows: AnyArray) -> npt.NDArray[np.bool_]:
    return np.asarray(
        (rows["flags"] & ELEMENT != 0) & (rows["degree"] == TANGENTS)
    )


class TrajectoryCheck:
    """Largest ratios of what was measured to what is allowed, over samples that
    come in pieces.
    """

    def __init__(self, cell: CellConfig) -> None:
        self.cell, self.dt = cell, cell.cycle_s
        self.table = ElementTable(cell)
        start = cell.axis_values("start_mm")
        self.tail: FloatArray = np.vstack([start] * 3)
        self.elements = np.zeros(3, np.int64)  # of the positions of ``tail``
        self.ratio = {
            "velocity": 0.0,
            "acceleration": 0.0,
            "jerk": 0.0,
            "feed": 0.0,
        }
        self.deviation = 0.0

    def add(self, samples: Samples) -> None:
        """Take the next samples; the elements they name must be in ``table``."""
        if not len(samples.cycle):
            return
        q = np.vstack([self.tail, samples.pos])
        elements = np.concatenate([self.elements, samples.element])
        self._limits(q, elements)
        self._feed(q[2:], samples)
        distance = self.table.distance(
            samples.element, samples.pos, self.deviation
        )
        self.deviation = max(self.deviation, float(distance.max()))
        self.tail = q[-3:].copy()
        self.elements = elements[-3:].copy()
        self.table.drop_before(int(self.elements.min()) - WIDE)

    def finish(self) -> None:
        """The axes stand from the last sample on."""
        last = np.append(self.elements, [self.elements[-1]] * 3)
        stands = [self.tail[-1]] * 3
        self._limits(np.vstack([self.tail, *stands]), last)

    def _limits(self, q: FloatArray, element: npt.NDArray[np.int64]) -> None:
        """``element``: of each position (n, axes)."""
        for order, (name, key) in enumerate(
            (
                ("velocity", "v_max_mm_s"),
                ("acceleration", "a_max_mm_s2"),
                ("jerk", "j_max_mm_s3"),
            ),
            1,
        ):
            limit = self.cell.axis_values(key)
            found = np.abs(np.diff(q, n=order, axis=0))
            if (
                order == 3
                and (shares := self.table.jerk_shares(element)) is not None
            ):
                found /= np.maximum.reduce(
                    [shares[k : len(shares) - 3 + k] for k in range(4)]
                )
            d = found.max(axis=0) / self.dt**order
            ratios = np.divide(d, limit, out=np.zeros_like(d), where=limit > 0)
            self.ratio[name] = max(self.ratio[name], float(ratios.max()))

    def _feed(self, q: FloatArray, samples: Samples) -> None:
        table, element = self.table, samples.element
        if table.rows is None:
            return
        before = np.concatenate([self.elements[-1:], element[:-1]])
        feeds = np.append(
            table.feed(np.arange(table.first, table.first + len(table.rows))),
            0.0,
        )
        pairs = np.column_stack([before, element + 1]).ravel() - table.first
        allowed = np.maximum.reduceat(feeds, np.maximum(pairs, 0))[::2]
        main = [i for i in table.main if i >= 0] or list(range(table.axes))
        moved = np.diff(q, axis=0)
        speed = np.linalg.norm(moved[:, main], axis=1) / self.dt
        main_moves = np.abs(moved[:, main]).max(axis=1) > 0
        only_others = ~np.asarray(main_moves)
        speed = np.where(
            only_others, np.linalg.norm(moved, axis=1) / self.dt, speed
        )
        speed = np.where(table.elsewhere(element), samples.speed, speed)
        with np.errstate(invalid="ignore"):
            ratios = np.where(
                np.isfinite(allowed) & (allowed > 0), speed / allowed, 0.0
            )
        self.ratio["feed"] = max(
            self.ratio["feed"], float(ratios.max(initial=0.0))
        )
