"""Chamfers and roundings (G301, G302, #CHF, #CHR, #RND): an edge or a
tangential arc between two blocks of the plane.

A ``CORNER`` row stands behind the block that the corner ends: ``code`` CHAMFER
(``value``: mm from the corner along both blocks, the chord on arcs), EDGE
(``value``: length of the new edge) or ROUND (``value``: radius), ``plane``,
``feed`` of the new element (0: of the block before).  The last motion is held
until the next one is known, and the rows behind it; both blocks are shortened.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from cnc_core import plain
from cnc_core.blocks import (
    CIRCULAR,
    CORNER,
    EDGE,
    LINEAR,
    POLYNOMIAL,
    ROUND,
    BlockBatch,
    motion_planes,
)
from cnc_core.blocks.pool import joined
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.units import FloatArray

from .stage import RefusedRow

TINY_MM = 1e-9
TANGENTIAL = 1e-7  # rad
DOES_NOT_FIT, WRONG_BLOCKS = 911004, 911005


class _Leg:
    """One block in the plane: a line, or an arc about ``centre``."""

    def __init__(self, row: Any, start: FloatArray, axes: list[int]) -> None:
        self.row, self.axes = row, axes
        self.start = start[axes]
        self.end = np.asarray(row["end"][axes])
        self.arc = bool(row["type"] == CIRCULAR)
        self.sense = float(np.sign(row["angle"])) if self.arc else 0.0
        self.centre = np.array(row["center"]) if self.arc else np.zeros(2)
        self.radius = (
            float(np.hypot(*(self.start - self.centre))) if self.arc else 0.0
        )
        way = self.end - self.start
        self.direction = way / max(float(np.hypot(*way)), 1e-300)

    def tangent(self, point: FloatArray) -> FloatArray:
        """Unit direction at a point of the block."""
        if not self.arc:
            return self.direction
        d = (point - self.centre) / self.radius
        return self.sense * np.array([-d[1], d[0]])

    def offset(self, distance: float) -> tuple[FloatArray, FloatArray, float]:
        """(point, direction, 0) of the line or (centre, -, radius) of the arc,
        ``distance`` to the left.
        """
        if self.arc:
            return (
                self.centre,
                self.direction,
                self.radius - self.sense * distance,
            )
        normal = np.array([-self.direction[1], self.direction[0]])
        return self.start + distance * normal, self.direction, 0.0

    def foot(self, point: FloatArray) -> FloatArray:
        """Where the block comes nearest."""
        if self.arc:
            d = point - self.centre
            return np.asarray(self.centre + self.radius * d / np.hypot(*d))
        return np.asarray(
            self.start
            + self.direction * plain.dot(point - self.start, self.direction)
        )

    def at_chord(
        self, corner: FloatArray, chord: float, back: float
    ) -> FloatArray | None:
        """The point a chord away from the corner, backward or forward along the
        block.
        """
        if not self.arc:
            return np.asarray(corner + back * chord * self.direction)
        if chord >= 2.0 * self.radius:
            return None
        turn = back * self.sense * 2.0 * plain.asin(0.5 * chord / self.radius)
        d = corner - self.centre
        c = plain.cos(turn)
        s = plain.sin(turn)
        return np.asarray(
            self.centre
            + np.array(
                [
                    c * d[0] - s * d[1],
                    s * d[0] + c * d[1],
                ]
            )
        )

    def share(self, point: FloatArray) -> float:
        """How far along the block a point of it lies, 0 at the start, 1 at the end."""
        if not self.arc:
            return plain.dot(point - self.start, self.direction) / float(
                np.hypot(*(self.end - self.start))
            )
        a, b = self.start - self.centre, point - self.centre
        turn = (
            self.sense
            * plain.atan2(
                a[0] * b[1] - a[1] * b[0],
                plain.dot(a, b),
            )
            % (2.0 * math.pi)
        )
        whole = abs(float(self.row["angle"]))
        if turn > whole and turn - whole > 2.0 * math.pi - turn:
            turn -= 2.0 * math.pi
        return turn / whole


class Corners:
    """Rows in, rows with chamfered and rounded corners out."""

    def __init__(
        self,
        start: FloatArray,
        main: tuple[int, int, int],
        place: Callable[[int, int], Place],
    ) -> None:
        self._main, self._place = main, place
        self._start = (
            start.copy()
        )  # of the motion held, or where the path stands
        self._held = BlockBatch.empty()

    @property
    def idle(self) -> bool:
        return not len(self._held)

    def push(self, batch: BlockBatch) -> BlockBatch:
        """Rows that are final now; RefusedRow where an element does not fit."""
        batch = joined([self._held, batch]) if len(self._held) else batch
        self._held = BlockBatch.empty()
        if (batch.rows["type"] == CORNER).any():
            try:
                batch = self._cornered(batch)
            except RefusedRow:
                moved = np.flatnonzero(batch.rows["type"] <= POLYNOMIAL)
                if len(moved):
                    self._start = batch.rows["end"][
                        moved[-1], : len(self._start)
                    ].copy()
                raise
        motions = np.flatnonzero(batch.rows["type"] <= POLYNOMIAL)
        if not len(motions):
            return batch
        last = int(motions[-1])
        if len(motions) > 1:
            self._start = batch.rows["end"][
                motions[-2], : len(self._start)
            ].copy()
        count, first = batch.rows["count"][last], last
        while (
            first
            and batch.rows["count"][first - 1] == count
            and batch.rows["type"][first - 1] > POLYNOMIAL
        ):
            first -= 1  # of a block that is refused later nothing is handed out
        self._held = self._part(batch, first, last)
        return BlockBatch(batch.rows[:first], batch.pool)

    def _part(self, batch: BlockBatch, first: int, motion: int) -> BlockBatch:
        """The rows from a block on, with the coefficients of its last motion alone."""
        rows = batch.rows[first:].copy()
        if batch.rows["type"][motion] != POLYNOMIAL:
            return BlockBatch(rows)
        row = rows[motion - first : motion - first + 1]
        begin = int(row["pool"][0])
        size = len(self._start) * (int(row["degree"][0]) + 1)
        row["pool"] = 0
        return BlockBatch(rows, batch.pool[begin : begin + size].copy())

    def drain(self) -> BlockBatch:
        """The motion held; a corner behind it has no second block."""
        held, self._held = self._held, BlockBatch.empty()
        motions = np.flatnonzero(held.rows["type"] <= POLYNOMIAL)
        if len(motions):
            self._start = held.rows["end"][
                motions[-1], : len(self._start)
            ].copy()
        open_corner = np.flatnonzero(held.rows["type"] == CORNER)
        if len(open_corner):
            row = held.rows[open_corner[0]]
            keep = held.rows[held.rows["type"] != CORNER]
            raise self._refused(WRONG_BLOCKS, row, BlockBatch(keep, held.pool))
        return held

    def resync(self, position: FloatArray) -> None:
        self._start = position[: len(self._start)].copy()
        self._held = BlockBatch.empty()

    def _refused(self, code: int, row: Any, ahead: BlockBatch) -> RefusedRow:
        error = CncError(
            code,
            ERRORS[code],
            self._place(
                int(row["file"]),
                int(row["line"]),
            ),
        )
        return RefusedRow(error, ahead, int(row["count"]))

    def _cornered(self, batch: BlockBatch) -> BlockBatch:
        """Serve all corners whose second block is known; one without stays at
        the end.
        """
        rows = [row.copy() for row in batch.rows]
        at = 0
        out: list[Any] = []
        position = self._start.copy()  # where the motion `before` begins
        before: int | None = None  # place in `out`
        while at < len(rows):
            row = rows[at]
            at += 1
            if row["type"] > POLYNOMIAL:
                if row["type"] == CORNER and before is None:
                    raise self._refused(20351, row, self._batch(out, batch))
                out.append(row)
                continue
            corners = (
                []
                if before is None
                else [
                    i
                    for i in range(before + 1, len(out))
                    if out[i]["type"] == CORNER
                ]
            )
            if before is not None:
                begin = position
                position = out[before]["end"][: len(position)].copy()
                if corners:
                    element = self._element(
                        out[before], row, begin, out[corners[-1]], out, batch
                    )
                    out = [item for item in out if item["type"] != CORNER]
                    if element is not None:
                        out.insert(before + 1, element)
                        position = element["end"][: len(position)].copy()
            before = len(out)
            out.append(row)
        return self._batch(out, batch)

    @staticmethod
    def _batch(rows: list[Any], batch: BlockBatch) -> BlockBatch:
        made = (
            np.array(rows, dtype=batch.rows.dtype) if rows else batch.rows[:0]
        )
        return BlockBatch(made, batch.pool)

    def _element(
        self,
        a: Any,
        b: Any,
        start: FloatArray,
        corner: Any,
        out: list[Any],
        batch: BlockBatch,
    ) -> Any:
        """The new element between two blocks, which are shortened; None where
        they are tangential.
        """
        first, second, _ = (
            self._main[i] for i in motion_planes(int(corner["plane"]))
        )
        axes, count = [first, second], len(self._start)
        junction = a["end"][:count].copy()
        others = [i for i in range(count) if i not in axes]
        plane = all(
            r["type"] == LINEAR
            or (r["type"] == CIRCULAR and r["plane"] == corner["plane"])
            for r in (a, b)
        )
        ways = (junction - start, b["end"][:count] - junction)
        ahead = self._batch(
            [row for row in out if row["type"] != CORNER], batch
        )
        if not plane or any(
            np.abs(way[others]).max(initial=0.0) > TINY_MM for way in ways
        ):
            raise self._refused(WRONG_BLOCKS, corner, ahead)
        legs = _Leg(a, start, axes), _Leg(b, junction, axes)
        turn = _turn(
            legs[0].tangent(legs[0].end), legs[1].tangent(legs[1].start)
        )
        if abs(turn) < TANGENTIAL:
            return None
        points = _points(
            legs, int(corner["code"]), float(corner["value"]), turn
        )
        if points is None or not _fit(legs, points):
            raise self._refused(DOES_NOT_FIT, corner, ahead)
        return self._made(legs, points, corner, junction, turn)

    @staticmethod
    def _made(
        legs: tuple[_Leg, _Leg],
        points: tuple[FloatArray, FloatArray],
        corner: Any,
        junction: FloatArray,
        turn: float,
    ) -> Any:
        a, b = legs[0].row, legs[1].row
        axes = legs[0].axes
        element = a.copy()
        element["n"] = corner["n"]
        element["line"] = corner["line"]
        element["count"] = corner["count"]
        element["file"] = corner["file"]
        if corner["feed"] > 0.0:
            element["feed"], element["flags"] = corner["feed"], 0
        element["end"][: len(junction)] = junction
        element["end"][axes] = points[1]
        _shorten(legs[0], legs[0].share(points[0]))
        _shorten(legs[1], 1.0 - legs[1].share(points[1]))
        a["end"][axes] = points[0]
        # an exact stop stays at the end of the first block
        element["flags"] &= ~np.uint16(2)
        way = points[1] - points[0]
        element["type"] = LINEAR
        element["angle"] = 0.0
        element["center"] = 0.0
        element["radius"] = element["programmed_radius"] = 0.0
        element["length"] = float(np.hypot(*way))
        if corner["code"] == ROUND:
            _bend(element, points, legs[0].tangent(points[0]), corner, turn)
        element["length_min"] = element["length"]
        b["length_min"] = b["length"]
        return element


def _bend(
    element: Any,
    points: tuple[FloatArray, FloatArray],
    tangent: FloatArray,
    corner: Any,
    turn: float,
) -> None:
    """The element becomes the arc that begins along ``tangent``."""
    radius = float(corner["value"])
    side = math.copysign(1.0, turn)
    normal = np.array([-tangent[1], tangent[0]])
    centre = points[0] + side * radius * normal
    a, b = points[0] - centre, points[1] - centre
    sweep = side * (
        side
        * plain.atan2(
            a[0] * b[1] - a[1] * b[0],
            plain.dot(a, b),
        )
        % (2.0 * math.pi)
    )
    element["type"] = CIRCULAR
    element["plane"] = corner["plane"]
    element["center"] = centre
    element["angle"] = sweep
    element["radius"] = element["programmed_radius"] = radius
    element["length"] = abs(sweep) * radius


def _shorten(leg: _Leg, share: float) -> None:
    leg.row["length"] = leg.row["length_min"] = float(leg.row["length"]) * max(
        share, 0.0
    )
    leg.row["angle"] *= share


def _turn(u: FloatArray, v: FloatArray) -> float:
    return plain.atan2(
        float(u[0] * v[1] - u[1] * v[0]),
        plain.dot(u, v),
    )


def _fit(
    legs: tuple[_Leg, _Leg], points: tuple[FloatArray, FloatArray]
) -> bool:
    shares = legs[0].share(points[0]), legs[1].share(points[1])
    return -1e-9 <= shares[0] <= 1.0 + 1e-9 and -1e-9 <= shares[1] <= 1.0 + 1e-9


def _points(
    legs: tuple[_Leg, _Leg], code: int, size: float, turn: float
) -> tuple[FloatArray, FloatArray] | None:
    """Where the element begins and ends; None: there is none of this size."""
    corner = legs[0].end
    if code == ROUND:
        return _tangential(legs, size, math.copysign(1.0, turn), corner)
    if code == EDGE:
        half = plain.cos(0.5 * turn)
        size = 0.5 * size / half if half > 1e-9 else math.inf
    first = legs[0].at_chord(corner, size, -1.0)
    second = legs[1].at_chord(corner, size, 1.0)
    return None if first is None or second is None else (first, second)


def _tangential(
    legs: tuple[_Leg, _Leg], radius: float, side: float, corner: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """The arc's centre lies ``radius`` beside both blocks; of several centres
    the one nearest to the corner.
    """
    centres = _meet(
        legs[0].offset(side * radius), legs[1].offset(side * radius)
    )
    best: tuple[FloatArray, FloatArray] | None = None
    nearest = math.inf
    for centre in centres:
        points = legs[0].foot(centre), legs[1].foot(centre)
        away = float(np.hypot(*(centre - corner)))
        if _fit(legs, points) and away < nearest:
            best, nearest = points, away
    return best


# (point, direction, 0) of a line or (centre, -, radius) of a circle
Curve = tuple[FloatArray, FloatArray, float]


def _meet(a: Curve, b: Curve) -> list[FloatArray]:
    """Intersections of two lines or circles; a radius below 0: there is no such
    circle.
    """
    if a[2] < 0.0 or b[2] < 0.0:
        return []
    if a[2] == 0.0 and b[2] == 0.0:
        return _line_line(a, b)
    if a[2] == 0.0 or b[2] == 0.0:
        return _circle_line(a, b) if b[2] == 0.0 else _circle_line(b, a)
    return _circle_circle(a, b)


def _line_line(a: Curve, b: Curve) -> list[FloatArray]:
    across = a[1][1] * b[1][0]
    d = a[1][0] * b[1][1] - across
    w = b[0] - a[0]
    return (
        []
        if abs(d) < 1e-12
        else [np.asarray(a[0] + a[1] * (w[0] * b[1][1] - w[1] * b[1][0]) / d)]
    )


def _circle_line(a: Curve, b: Curve) -> list[FloatArray]:
    along = plain.dot(a[0] - b[0], b[1])
    foot = b[0] + along * b[1]
    off = foot - a[0]
    room = a[2] ** 2 - float((off**2).sum())
    return (
        []
        if room < 0.0
        else [
            np.asarray(foot + s * math.sqrt(room) * b[1]) for s in (-1.0, 1.0)
        ]
    )


def _circle_circle(a: Curve, b: Curve) -> list[FloatArray]:
    w = b[0] - a[0]
    d = float(np.hypot(*w))
    product = d * d + a[2] ** 2 - b[2] ** 2
    x = product / (2.0 * d) if d > TINY_MM else math.inf
    room = a[2] ** 2 - x * x
    if room < 0.0:
        return []
    u = w / d
    normal = np.array([-u[1], u[0]])
    return [
        np.asarray(a[0] + x * u + s * math.sqrt(room) * normal)
        for s in (-1.0, 1.0)
    ]
