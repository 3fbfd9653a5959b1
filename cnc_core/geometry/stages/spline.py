"""Splines through programmed points (#SPLINE, G151): every line becomes one
cubic polynomial.

AKIMA: the curve passes the points; per axis an Akima interpolation over chord
length, so that a point acts on the two segments before it and behind it only.
H. Akima, "A new method of interpolation and smooth curve fitting based on local
procedures", J. ACM 17 (1970).  BSPLINE: a uniform cubic B-spline whose control
points are the programmed points; it meets the first and the last one.

Off until a ``SPLINE`` row says otherwise; its ``code``: 0 off, 1 AKIMA, 2
BSPLINE; ``plane`` and ``degree``: how the curve begins and ends (AUTO,
TANGENTIAL, USER); ``end``: the direction of a USER start, NaN for axes without
one.  The row that switches off carries the direction of the end.  ``drain``
ends the curve where it stands.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cnc_core import plain
from cnc_core.blocks import (
    BY_LENGTH,
    CIRCULAR,
    EXACT_STOP,
    LINEAR,
    POLYNOMIAL,
    SPLINE,
    BlockBatch,
    motion_planes,
)
from cnc_core.blocks.pool import coefficients
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.units import FloatArray

from ..profiles.rows import lengths
from ..shapes import outrun, sharp_turns
from ..shapes.polynomial import derivative, point, points, shifted
from .stage import RefusedRow

OFF, AKIMA, BSPLINE = 0, 1, 2
AUTO, TANGENTIAL, USER = 0, 1, 2
HELD_SEGMENTS = 3  # a segment is final when two more points are known
# mm per mm of the chords: slower main axes are outrun by others (R)
OUTRUN = 0.02


def akima_slopes(slopes: FloatArray) -> FloatArray:
    """(n + 1, axes) derivatives at the points from the n slopes of the chords,
    n >= 1; ends extrapolated.
    """
    if len(slopes) == 1:
        return np.vstack([slopes, slopes])
    first = 2 * slopes[0] - slopes[1]
    last = 2 * slopes[-1] - slopes[-2]
    m = np.vstack(
        [
            2 * first - slopes[0],
            first,
            slopes,
            last,
            2 * last - slopes[-1],
        ]
    )
    change = np.abs(np.diff(m, axis=0))
    before, behind = change[:-2], change[2:]
    total = before + behind
    even = total < 1e-9 * (1e-300 + change.max())
    weighted = (behind * m[1:-2] + before * m[2:-1]) / np.where(
        even, 1.0, total
    )
    return np.asarray(
        np.where(
            even,
            0.5 * (m[1:-2] + m[2:-1]),
            weighted,
        )
    )


def calmed(
    slopes: FloatArray, chords: FloatArray, axes: list[int]
) -> FloatArray:
    """The same derivatives, but where a segment that acts on a point outruns the
    main axes, these ``axes`` (the others) do not swing beyond the points.

    There a derivative has the sign of both chords beside it and is at most three
    times the smaller one.  F. N. Fritsch, R. E. Carlson, "Monotone piecewise
    cubic interpolation", SIAM J. Numer. Anal. 17 (1980).
    """
    steep = np.linalg.norm(chords[:, axes], axis=1) * OUTRUN > 1.0
    if not steep.any():
        return slopes
    two = np.concatenate([[False] * 2, steep, [False] * 2])
    near = two[:-3] | two[1:-2] | two[2:-1] | two[3:]
    sides = np.vstack([chords[:1], chords, chords[-1:]])[:, axes]
    left, right = sides[:-1], sides[1:]
    most = 3.0 * np.minimum(np.abs(left), np.abs(right)) * (left * right > 0)
    found = slopes[:, axes]
    ahead = np.abs(found) * (found * left > 0)
    out = slopes.copy()
    out[:, axes] = np.where(
        near[:, None], np.sign(left) * np.minimum(ahead, most), found
    )
    return out


def hermite(
    p0: FloatArray, p1: FloatArray, d0: FloatArray, d1: FloatArray, h: float
) -> FloatArray:
    """(axes, 4) ascending coefficients over 0..h."""
    chord = (p1 - p0) / h
    return np.stack(
        [
            p0,
            d0,
            (3 * chord - 2 * d0 - d1) / h,
            (d0 + d1 - 2 * chord) / h**2,
        ],
        axis=1,
    )


class _Curve:
    """The curve being read: its last points, the rows that led to them, the
    rows between.

    ``begins``: AUTO, TANGENTIAL (``direction`` is the one of the block before)
    or USER (NaN: not programmed). ``first``: number of the first point kept.
    ``done``: segments written.
    """

    def __init__(
        self,
        kind: int,
        begins: int,
        direction: FloatArray | None,
        start: FloatArray,
    ) -> None:
        self.kind, self.begins, self.direction = kind, begins, direction
        self.points = [start.copy()]
        self.items: list[tuple[bool, Any]] = []  # (motion, row)
        self.first = self.done = 0
        self.goes_on = False  # with the tangent of a part that is written

    @property
    def segments(self) -> int:
        return self.first + len(self.points) - 1

    def forget(self) -> None:
        """Points that no later segment needs."""
        spare = self.done - 2 - self.first
        if spare > 0:
            del self.points[:spare]
            self.first += spare


class Spline:
    """Rows in, rows with cubic polynomials out.

    ``main``: channel index of the main axes, -1 where absent.
    """

    def __init__(
        self,
        start: FloatArray,
        main: tuple[int, int, int],
        place: Callable[[int, int], Place],
    ) -> None:
        self._at = start.copy()
        self._main = main
        self._place = place
        self._curve: _Curve | None = None
        # its end waits for the direction of the next motion
        self._ending: _Curve | None = None
        # derivative by length where the last motion ended
        self._tangent: FloatArray | None = None
        self._rows: list[Any] = []
        self._made: list[int] = []  # which of these are curves without length
        self._pool: list[float] = []

    @property
    def idle(self) -> bool:
        return self._curve is None and self._ending is None

    def push(self, batch: BlockBatch) -> BlockBatch:
        """Rows that are final now; RefusedRow for a circle inside a spline or
        too few points.
        """
        if (
            self._curve is None
            and self._ending is None
            and not (batch.rows["type"] == SPLINE).any()
        ):
            self._follow(batch)
            return batch
        for row in batch.rows:
            self._take(row, batch.pool)
        return self._taken()

    def drain(self) -> BlockBatch:
        """The curve ends here and goes on behind with a new one."""
        self._end_open(None)
        curve = self._curve
        if curve is not None and curve.segments:
            self._finish(curve, AUTO, None)
            self._curve = _Curve(
                curve.kind, TANGENTIAL, self._tangent, self._at
            )
            self._curve.goes_on = True
        elif curve is not None:
            self._rows += [row for _, row in curve.items]
            curve.items = []
        return self._taken()

    def resync(self, position: FloatArray) -> None:
        self._at = position[: len(self._at)].copy()
        self._tangent = self._ending = None
        if self._curve is not None:
            self._curve = _Curve(self._curve.kind, AUTO, None, self._at)

    # rows

    def _follow(self, batch: BlockBatch) -> None:
        moving = np.flatnonzero(batch.rows["type"] <= POLYNOMIAL)
        if not len(moving):
            return
        before = (
            self._at
            if len(moving) == 1
            else batch.rows[moving[-2]]["end"][: len(self._at)]
        )
        self._note(batch.rows[moving[-1]], before)

    def _note(self, row: Any, before: FloatArray) -> None:
        """Where a motion that passes ends, and in which direction."""
        self._tangent = self._direction(row, before, at_end=True)
        self._at = row["end"][: len(self._at)].copy()

    def _direction(
        self, row: Any, before: FloatArray, *, at_end: bool
    ) -> FloatArray | None:
        """Derivative by length at one end of a line or a circle."""
        if row["type"] == POLYNOMIAL:
            return None
        end = row["end"][: len(self._at)]
        way = np.asarray((end - before) / float(row["length"]))
        if row["type"] == CIRCULAR:
            first, second, _ = motion_planes(int(row["plane"]))
            a, b = self._main[first], self._main[second]
            point = end if at_end else before
            rate = float(row["angle"]) / float(row["length"])
            way[a] = -rate * (point[b] - row["center"][1])
            way[b] = rate * (point[a] - row["center"][0])
        return way

    def _take(self, row: Any, pool: FloatArray) -> None:
        if self._ending is not None:
            if row["type"] > POLYNOMIAL and row["type"] != SPLINE:
                self._ending.items.append((False, row.copy()))
                return
            self._end_open(
                self._direction(row, self._ending.points[-1], at_end=False)
                if row["type"] != SPLINE
                else None
            )
        curve = self._curve
        if row["type"] == SPLINE:
            self._switch(row)
        elif curve is None:
            if row["type"] <= POLYNOMIAL:
                self._note(row, self._at)
            self._pass(row, pool)
        elif row["type"] == LINEAR:
            curve.points.append(row["end"][: len(self._at)].copy())
            curve.items.append((True, row.copy()))
            self._advance(curve)
        elif row["type"] <= POLYNOMIAL:
            raise self._refused(911002, row)
        else:
            curve.items.append((False, row.copy()))

    def _pass(self, row: Any, pool: FloatArray) -> None:
        row = row.copy()
        if row["type"] == POLYNOMIAL:
            size = len(self._at) * (int(row["degree"]) + 1)
            first = int(row["pool"])
            row["pool"] = len(self._pool)
            self._pool += pool[first : first + size].tolist()
        self._rows.append(row)

    def _refused(self, code: int, row: Any) -> RefusedRow:
        error = CncError(
            code,
            ERRORS[code],
            self._place(
                int(row["file"]),
                int(row["line"]),
            ),
        )
        self._curve = None
        return RefusedRow(error, self._taken(), int(row["count"]))

    def _switch(self, row: Any) -> None:
        curve, self._curve = self._curve, None
        if curve is not None:
            ends = int(row["degree"])
            given = curve.goes_on or AUTO not in (curve.begins, ends)
            fewest = 1 if curve.done or given else 2
            if curve.kind == AKIMA and 0 < curve.segments < fewest:
                raise self._refused(911001, row)
            if not curve.segments:
                self._rows += [held for _, held in curve.items]
            elif ends == TANGENTIAL:
                self._ending = curve
            else:
                self._finish(curve, ends, row["end"][: len(self._at)])
        if row["code"]:
            self._end_open(None)
            begins = int(row["plane"])
            direction = (
                self._tangent
                if begins == TANGENTIAL
                else row["end"][: len(self._at)].copy()
            )
            self._curve = _Curve(int(row["code"]), begins, direction, self._at)

    def _end_open(self, direction: FloatArray | None) -> None:
        """The end that waits for the next motion."""
        curve, self._ending = self._ending, None
        if curve is not None:
            self._finish(curve, TANGENTIAL, direction)

    # curves

    def _advance(self, curve: _Curve) -> None:
        """Write segments that nothing behind can change."""
        while curve.segments - curve.done >= HELD_SEGMENTS:
            self._write(
                curve, self._coefficients(curve, AUTO, None), curve.done + 1
            )
            curve.forget()

    def _finish(
        self, curve: _Curve, ends: int, direction: FloatArray | None
    ) -> None:
        self._write(
            curve, self._coefficients(curve, ends, direction), curve.segments
        )

    def _coefficients(
        self, curve: _Curve, ends: int, direction: FloatArray | None
    ) -> list[tuple[FloatArray, float]]:
        """(coefficients, parameter's end) of every segment between the points kept."""
        points = np.array(curve.points)
        if curve.kind == BSPLINE:
            return _bspline(points)
        ways = np.diff(points, axis=0)
        chords = np.array([self._chord(way) for way in ways])
        each = ways / chords[:, None]
        others = [a for a in range(len(self._at)) if a not in self._main]
        slopes = calmed(akima_slopes(each), each, others)
        if curve.first == 0:
            slopes[0] = self._given(curve.begins, curve.direction, slopes[0])
        slopes[-1] = self._given(ends, direction, slopes[-1])
        return [
            (
                hermite(
                    points[i],
                    points[i + 1],
                    slopes[i],
                    slopes[i + 1],
                    chords[i],
                ),
                float(chords[i]),
            )
            for i in range(len(chords))
        ]

    def _given(
        self, how: int, direction: FloatArray | None, found: FloatArray
    ) -> FloatArray:
        """The derivative at an end: as found, of the block beside it, or as
        programmed where it is.
        """
        if how == AUTO or direction is None:
            return found
        if how == TANGENTIAL:
            return direction
        norm = self._chord(np.nan_to_num(direction))
        return (
            found
            if norm == 0.0
            else np.asarray(
                np.where(np.isnan(direction), found, direction / norm)
            )
        )

    def _chord(self, way: FloatArray) -> float:
        main = way[[a for a in self._main if a >= 0]]
        norm = float(np.linalg.norm(main))
        return norm if norm > 1e-9 else float(np.linalg.norm(way))

    def _write(
        self, curve: _Curve, found: list[tuple[FloatArray, float]], upto: int
    ) -> None:
        """The segments up to one of them, and the rows between."""
        while curve.items and (not curve.items[0][0] or curve.done < upto):
            motion, row = curve.items.pop(0)
            if motion:
                self._segment(
                    row,
                    *found[curve.done - curve.first],
                    through=curve.kind == AKIMA,
                )
                curve.done += 1
            else:
                self._rows.append(row)

    def _segment(
        self, row: Any, coef: FloatArray, end: float, *, through: bool
    ) -> None:
        """``through``: the segment ends in the row's own end."""
        if not through:
            row["end"][: len(coef)] = point(coef, end)
        main = [a for a in self._main if a >= 0]
        for begin, to, straight in sharp_turns.parts(coef, end):
            if straight:
                self._line(row, coef, (begin, to), to == end)
                continue
            rate = OUTRUN * (1.0 if through else _fastest(coef, end, main))
            for a, b, slow in outrun.parts(coef, (begin, to), main, rate):
                self._curve_part(
                    row, coef, (a, b), b == end, rate if slow else 0.0
                )
        way = point(derivative(coef), end)
        norm = self._chord(way)
        self._at = row["end"][: len(coef)].copy()
        self._tangent = way / norm if norm > 0 else None

    def _line(
        self,
        row: Any,
        coef: FloatArray,
        between: tuple[float, float],
        last: bool,
    ) -> None:
        """A line takes the place of the segment between two parameters."""
        row = self._ended(row, coef, between[1], last)
        way = row["end"][: len(coef)] - point(coef, between[0])
        row["length"] = row["length_min"] = self._chord(way)
        self._rows.append(row)

    def _curve_part(
        self,
        row: Any,
        coef: FloatArray,
        between: tuple[float, float],
        last: bool,
        rate: float,
    ) -> None:
        """The segment between two parameters.  ``rate``, if any: mm per parameter
        that its length counts, instead of the way of the main axes.
        """
        begin, to = between
        row = self._ended(row, coef, to, last)
        row["type"] = POLYNOMIAL
        row["degree"] = coef.shape[1] - 1
        row["angle"] = to - begin
        row["pool"] = len(self._pool)
        part = shifted(coef, begin) if begin else coef
        if rate > 0.0:
            row["angle"] = row["length"] = row["length_min"] = rate * (
                to - begin
            )
            row["flags"] = int(row["flags"]) | BY_LENGTH
            part = part / plain.powers(rate, np.arange(coef.shape[1]))
        else:
            self._made.append(len(self._rows))
        self._pool += part.ravel().tolist()
        self._rows.append(row)

    @staticmethod
    def _ended(row: Any, coef: FloatArray, to: float, last: bool) -> Any:
        """The row that ends there: only the last one of a segment as programmed."""
        row = row.copy()
        if not last:
            row["end"][: len(coef)] = point(coef, to)
            row["flags"] = int(row["flags"]) & ~EXACT_STOP
            row["end_speed"] = 0.0
        return row

    def _taken(self) -> BlockBatch:
        items, made, values = self._rows, self._made, self._pool
        self._rows, self._made, self._pool = [], [], []
        if not items:
            return BlockBatch.empty()
        rows, pool = np.array(items, dtype=items[0].dtype), np.array(values)
        curves = rows[made]
        rows["length"][made] = rows["length_min"][made] = lengths(
            coefficients(curves, pool, len(self._at)),
            curves["angle"],
            [a for a in self._main if a >= 0],
        )
        return BlockBatch(rows, pool)


def _fastest(coef: FloatArray, end: float, axes: list[int]) -> float:
    """Largest derivative of these axes at the ends and in the middle."""
    way = points(derivative(coef[axes]), np.linspace(0.0, end, 3))
    return float(np.linalg.norm(way, axis=1).max())


def _bspline(control: FloatArray) -> list[tuple[FloatArray, float]]:
    """One span for each pair of neighbouring control points; the outer ones are
    mirrored.
    """
    p = np.vstack(
        [
            2 * control[0] - control[1],
            control,
            2 * control[-1] - control[-2],
        ]
    )
    basis = (
        np.array(
            [
                [1, 4, 1, 0],
                [-3, 0, 3, 0],
                [3, -6, 3, 0],
                [-1, 3, -3, 1],
            ]
        )
        / 6.0
    )
    return [
        (
            plain.product(basis, p[i : i + 4]).T.copy(),
            1.0,
        )
        for i in range(len(control) - 1)
    ]
