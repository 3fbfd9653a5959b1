"""Motions as functions of their path length, with exact derivatives.

Used where a motion is taken into other coordinates: tilted planes
(``frames``), machine axes (``kinematics``).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import BY_LENGTH, CIRCULAR, POLYNOMIAL, motion_planes
from cnc_core.blocks.pool import coefficients
from cnc_core.units import AnyArray, FloatArray

from ..shapes.polynomial import ORDER, derivative, normalised, value

IntArray = npt.NDArray[np.int64]
STANDS = 1e-9  # as in c_ext/curve/curve.c
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


class Paths:
    """Motion rows (n,) with their starts (n, axes); the parameter u of each
    runs 0..1.
    """

    def __init__(
        self,
        rows: AnyArray,
        starts: FloatArray,
        pool: FloatArray,
        main: tuple[int, int, int],
    ) -> None:
        self.rows, self.starts, self.main = rows, starts, main
        self.axes = starts.shape[1]
        self.ends = rows["end"][:, : self.axes]
        self.type = rows["type"]
        is_curve = self.type == POLYNOMIAL
        self.curve = np.where(is_curve, np.cumsum(is_curve) - 1, -1)
        self.coef = np.empty((0, self.axes, ORDER))
        if is_curve.any():
            self.coef = normalised(
                coefficients(rows[is_curve], pool, self.axes),
                rows["angle"][is_curve],
            )
            self._set_metric(rows[is_curve])

    def _set_metric(self, rows: AnyArray) -> None:
        """Axes that the length of each polynomial is measured over; none where
        its parameter runs with the length.
        """
        size = np.abs(self.coef[:, :, 1:])
        moving = size.sum(axis=2) > STANDS
        main = np.zeros(self.axes, dtype=bool)
        main[[i for i in self.main if i >= 0]] = True
        over_main = moving & main
        self.metric = np.where(
            over_main.any(axis=1)[:, None], over_main, moving
        )
        self.metric[(rows["flags"] & BY_LENGTH) != 0] = False

    def jets(self, index: IntArray, u: FloatArray) -> FloatArray:
        """(m, 3, axes): position and its derivatives by path length at u (m,)
        of the motions ``index`` (m,).
        """
        rows = self.rows[index]
        length = self.rows["length"][index][:, None]
        along = self.ends[index] - self.starts[index]
        out = np.zeros((len(index), 3, self.axes))
        out[:, 0] = self.starts[index] + u[:, None] * along
        at_end = u >= 1.0
        out[at_end, 0] = self.ends[index[at_end]]
        out[:, 1] = along / length
        for plane in (17, 18, 19):
            arcs = (rows["type"] == CIRCULAR) & (rows["plane"] == plane)
            if arcs.any():
                self._arc_jets(out, arcs, index, u, plane)
        curves = rows["type"] == POLYNOMIAL
        if curves.any():
            out[curves] = self._curve_jets(index[curves], u[curves])
        return out

    def _arc_jets(
        self,
        out: FloatArray,
        arcs: npt.NDArray[np.bool_],
        index: IntArray,
        u: FloatArray,
        plane: int,
    ) -> None:
        """Fill in the two axes of the plane; the radius runs from that of the
        start to that of the end.
        """
        first, second, _ = motion_planes(plane)
        axes = [self.main[first], self.main[second]]
        which, w = index[arcs], u[arcs]
        rows = self.rows[which]
        d = self.starts[which][:, axes] - rows["center"]
        last = self.ends[which][:, axes] - rows["center"]
        radius0 = np.hypot(d[:, 0], d[:, 1])
        angle0 = plain.directions(d[:, 1], d[:, 0])
        grown = np.hypot(last[:, 0], last[:, 1]) - radius0
        angle = angle0 + w * rows["angle"]
        rate = rows["angle"] / rows["length"]
        grows = grown / rows["length"]
        radius = radius0 + w * grown
        cos = plain.cosines(angle)
        sin = plain.sines(angle)
        at_end = w >= 1.0
        for column, (axis, centre) in enumerate(
            zip(axes, rows["center"].T, strict=True)
        ):
            unit, normal = (cos, -sin) if column == 0 else (sin, cos)
            out[arcs, 0, axis] = np.where(
                at_end, self.ends[which, axis], centre + radius * unit
            )
            out[arcs, 1, axis] = grows * unit + rate * radius * normal
            out[arcs, 2, axis] = (
                2.0 * grows * rate * normal - rate * rate * radius * unit
            )

    def _curve_jets(self, index: IntArray, u: FloatArray) -> FloatArray:
        coef = self.coef[self.curve[index]]
        first = derivative(coef)
        second = derivative(first)
        metric = self.metric[self.curve[index]]
        by_length = ~metric.any(axis=1)
        d1, d2 = value(first, u), value(second, u)
        speed2 = np.where(
            by_length,
            self.rows["length"][index] ** 2,
            (d1 * d1 * metric).sum(axis=1),
        )
        along = np.where(by_length, 0.0, (d1 * d2 * metric).sum(axis=1))
        out = np.empty((len(index), 3, self.axes))
        out[:, 0] = value(coef, u)
        out[:, 1] = d1 / np.sqrt(speed2)[:, None]
        across = d2 - d1 * (along / speed2)[:, None]
        out[:, 2] = across / speed2[:, None]
        return out

    def lengths(
        self, index: IntArray, u0: FloatArray, u1: FloatArray
    ) -> FloatArray:
        """(m,) path length from u0 to u1 of each motion."""
        out = self.rows["length"][index] * (u1 - u0)
        curves = np.flatnonzero(self.type[index] == POLYNOMIAL)
        if len(curves):
            which = self.curve[index[curves]]
            metric = self.metric[which]
            measured = metric.any(axis=1)
            curves = curves[measured]
            which = which[measured]
            metric = metric[measured]
            first = derivative(self.coef[which])
            half = 0.5 * (u1[curves] - u0[curves])
            total = np.zeros(len(curves))
            for node, weight in zip(NODES, WEIGHTS, strict=True):
                d1 = value(first, u0[curves] + half * (1.0 + node))
                total += weight * np.sqrt((d1 * d1 * metric).sum(axis=1))
            out[curves] = total * half
        return np.asarray(out)
