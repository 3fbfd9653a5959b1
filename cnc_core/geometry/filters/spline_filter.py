"""Spline filter: the vertices of a run are control points of a clamped uniform
B-spline, driven in short segments.

FILTER row: ``code`` ``NURBS``; ``length`` mm, a longer segment ends the run;
``value`` order (degree + 1), 1: as programmed, 2: the same path without stops
inside; ``radius`` mm, length of the segments that come out.  Unit weights, ends
exact.

Interior knots are uniform, so a span depends on ``degree + 1`` control points
and on the clamped ends only: it is evaluated as soon as no knot of it can
belong to the end any more.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cnc_core.blocks import BENT, BENT_FIRST, EXACT_STOP
from cnc_core.blocks.pool import rows_joined
from cnc_core.units import FloatArray

from .run_filter import (
    EMPTY,
    NURBS,
    SAME_MM,
    Rows,
    RunFilter,
    distances,
    farthest,
)

SPANS_AT_ONCE = 64
ROWS_AT_ONCE = 65536
TABLE_MIN, TABLE_MAX = 8, 64  # arc length table of a span
AROUND = 1e-4  # of a span, on both sides: what a direction is taken over
# that come out for one that went in, on average over the spans made together:
# a thousandth of a segment is finer than any machine follows
SEGMENTS_MAX = 1000


def basis(knots: FloatArray, u: FloatArray, degree: int) -> FloatArray:
    """(n, degree + 1) values at ``u`` (n,) of the functions that act in a span.

    ``knots`` (n, 2 * degree): those around it, the span lies between the two in
    the middle.  Cox and de Boor.
    """
    values = np.zeros((len(u), degree + 1))
    values[:, 0] = 1.0
    for j in range(1, degree + 1):
        saved = np.zeros(len(u))
        for r in range(j):
            right = knots[:, degree + r]
            left = knots[:, degree + r - j]
            share = values[:, r] / (right - left)
            values[:, r] = saved + (right - u) * share
            saved = (u - left) * share
        values[:, j] = saved
    return values


class SplineFilter(RunFilter):
    """Holds the control points that spans to come depend on."""

    code, name = NURBS, "NURBS"
    length = step = 0.0
    order = 3

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        super().__init__(start, main)
        self._begin(start)

    def settings(self, row: Any) -> None:
        self.length = float(row["length"])
        self.order = int(row["value"])
        self.step = float(row["radius"])

    def _begin(self, start: FloatArray) -> None:
        """A new run."""
        self._points = start[
            None, :
        ].copy()  # control points from number ``_first`` on
        # row ``_first`` + i ends at control point ``_first`` + i + 1
        self._rows: Rows = EMPTY
        self._first = self._span = 0  # the next span to evaluate
        self._carry = 0.0  # driven since the last point that came out
        self._last_out = start.copy()
        self._begins = True  # nothing has come out
        self._out_span = 0  # where the last point that came out lies
        self._measured = 0  # control points compared with the curve
        self._trace = start[
            None, :
        ].copy()  # points that came out of the last spans
        self._trace_spans = np.zeros(1, np.int64)

    def extend(self, rows: Rows, start: FloatArray) -> Rows:
        if self.order <= 1:
            return rows
        out, begin = [], 0
        starts = np.vstack([start, rows["end"][:-1, : self.count]])
        for i in [
            *np.flatnonzero(rows["length"] > self.length + 1e-12),
            len(rows),
        ]:
            if i > begin:
                out.append(self._taken(rows[begin:i], starts[begin]))
            if i < len(rows):
                out += [self.finish(), rows[i : i + 1]]
            begin = int(i) + 1
        return np.concatenate(out)

    def _taken(self, rows: Rows, start: FloatArray) -> Rows:
        if not len(self._rows):
            self._begin(start)
        if self._degree == 1:
            return self._polygon(rows)
        self._points = np.vstack(
            [
                self._points,
                rows["end"][:, : self.count],
            ]
        )
        self._rows = rows_joined([self._rows, rows])
        return self._evaluated(
            self._number - max(self._degree, 2 * self._degree - 2), None
        )

    def _polygon(self, rows: Rows) -> Rows:
        """Order 2: the curve is the control polygon, its corners stay; all but
        the last row, which may be the end.
        """
        rows = rows_joined([self._rows, rows])
        out = rows[:-1].copy()
        self._rows = rows[-1:]
        out["flags"] &= ~np.uint16(EXACT_STOP)
        return out

    def finish(self) -> Rows:
        if not len(self._rows):
            return self._rows
        # a run of one segment stays as it is
        if self._degree == 1 or self._number == 1:
            out, self._rows = self._rows, EMPTY
            return out
        degree = min(self._degree, self._number)
        spans = self._number - degree + 1
        out = self._evaluated(spans, spans)
        self._rows = EMPTY
        return out

    @property
    def _degree(self) -> int:
        return self.order - 1

    @property
    def _number(self) -> int:
        """Number of the last control point."""
        return self._first + len(self._points) - 1

    def _evaluated(self, behind: int, top: int | None) -> Rows:
        """Spans up to ``behind``; ``top``: value of the clamped knots at the
        end, once that is known.
        """
        out = []
        degree = (
            self._degree if top is None else min(self._degree, self._number)
        )
        while self._span < behind:
            until = min(behind, self._span + self._at_once)
            out.append(self._spans(until, degree, top))
            self._forget(degree)
        return np.concatenate(out) if out else EMPTY

    @property
    def _at_once(self) -> int:
        """Spans whose rows are made together: their number stays bounded."""
        return int(
            np.clip(
                ROWS_AT_ONCE * self.step / max(self.length, self.step),
                1,
                SPANS_AT_ONCE,
            )
        )

    def _at(
        self, u: FloatArray, spans: Any, degree: int, top: int | None
    ) -> FloatArray:
        """(n, axes) points of the curve."""
        index = spans[:, None] + np.arange(1, 2 * degree + 1)
        knots = np.clip(
            index - degree, 0, np.inf if top is None else top
        ).astype(np.float64)
        weights = basis(knots, u, degree)
        points = self._points[
            spans[:, None] - self._first + np.arange(degree + 1)
        ]
        return np.asarray(np.einsum("nj,nja->na", weights, points))

    def _spans(self, until: int, degree: int, top: int | None) -> Rows:
        """Rows of the spans from the next one on up to ``until``."""
        spans = np.arange(self._span, until)
        per_span = int(
            np.clip(
                np.ceil(2.0 * self.length / self.step), TABLE_MIN, TABLE_MAX
            )
        )
        share = (np.arange(per_span) + 1.0) / per_span
        u_table = (spans[:, None] + share).ravel()
        table = self._at(u_table, np.repeat(spans, per_span), degree, top)
        begin = self._at(
            np.array([float(self._span)]),
            spans[:1],
            degree,
            top,
        )
        way = np.linalg.norm(
            np.diff(
                np.vstack([begin, table]),
                axis=0,
            )[:, self.used],
            axis=1,
        )
        length = np.concatenate([[0.0], np.cumsum(way)])
        final = top is not None and until == top
        step = max(self.step, length[-1] / (SEGMENTS_MAX * len(spans)))
        marks = np.arange(max(step - self._carry, 0.0), length[-1], step)
        last = marks[-1] if len(marks) else -self._carry
        self._carry = length[-1] - last
        if final and len(marks) and length[-1] - marks[-1] < SAME_MM:
            marks = marks[:-1]
        u = np.interp(
            marks, length, np.concatenate([[float(self._span)], u_table])
        )
        at = np.clip(u.astype(np.int64), self._span, until - 1)
        points = self._at(u, at, degree, top)
        if final:
            u, at = np.append(u, float(until)), np.append(at, until - 1)
        along = self._directions(u, at, degree, top)
        sources = np.clip(
            at - self._first + (degree + 1) // 2, 0, len(self._rows) - 1
        )
        if final:
            points = np.vstack([points, self._points[-1]])
            sources[-1] = len(self._rows) - 1
        driven = np.vstack([self._last_out, points])
        out = self._bent(self._made(points, sources, final), along)
        begin_span = min(self._span, self._out_span)
        self._out_span = int(at[-1]) if len(at) else self._out_span
        self._measure(driven, (begin_span, until), at, degree, final)
        self._span = until
        return out

    def _made(self, points: FloatArray, sources: Any, final: bool) -> Rows:
        """Rows to the points; ``sources``: their feed and place.  Only a run's
        end may be a stop.
        """
        rows = self._rows[sources].copy()
        rows["flags"][: -1 if final else None] &= ~np.uint16(EXACT_STOP)
        rows["end"][:, : self.count] = points
        before = self._last_out
        self._last_out = points[-1].copy() if len(points) else self._last_out
        return self.with_lengths(rows, before)

    def _directions(
        self, u: FloatArray, at: Any, degree: int, top: int | None
    ) -> FloatArray:
        """(n, 3) of the curve over the main axes."""
        way = self._at(u + AROUND, at, degree, top) - self._at(
            u - AROUND, at, degree, top
        )
        out = np.zeros((len(u), 3))
        for i, axis in enumerate(self.main):
            if axis >= 0:
                out[:, i] = way[:, axis]
        size = np.linalg.norm(out, axis=1)[:, None]
        return np.asarray(out / np.maximum(size, SAME_MM * AROUND))

    def _bent(self, rows: Rows, along: FloatArray) -> Rows:
        """The rows are chords of the curve, whose directions at their ends go
        with them.
        """
        if not len(rows) or not set(self.used) <= set(self.main):
            return rows
        rows["degree"] = BENT
        if self._begins:
            rows["degree"][0], self._begins = BENT_FIRST, False
        rows["center"], rows["radius"] = along[:, :2], along[:, 2]
        return rows

    def _measure(
        self,
        driven: FloatArray,
        spans: tuple[int, int],
        at: Any,
        degree: int,
        final: bool,
    ) -> None:
        """Deviation of what is driven, and how far the control points around
        these spans lie beside it.

        ``at``: spans of the points driven to.
        """
        used, (first, until) = self.used, spans
        line = self._points[
            max(0, first - 1 - self._first) : until + degree + 1 - self._first,
            used,
        ]
        if len(driven) > 1:
            self.note(
                farthest(
                    driven[:, used], line, self.report.segments_deviation_mm
                ),
                0.0,
            )
        self._trace = np.vstack([self._trace, driven[1:]])
        self._trace_spans = np.concatenate([self._trace_spans, at])
        # control points whose part of the curve has come out
        reached = self._out_span - degree // 2 - 1
        begin = max(self._measured, self._first)
        end = self._number + 1 if final else min(reached, self._number)
        if end > begin:
            vertices = self._points[
                begin - self._first : end - self._first, used
            ]
            self.note(
                0.0, float(distances(vertices, self._trace[:, used]).max())
            )
            self._measured = end
        kept = max(
            0,
            int(np.searchsorted(self._trace_spans, self._measured - degree - 2))
            - 1,
        )
        self._trace, self._trace_spans = (
            self._trace[kept:],
            self._trace_spans[kept:],
        )

    def _forget(self, degree: int) -> None:
        """Control points and rows that no span to come, and no measurement, needs."""
        keep = (
            max(0, min(self._span, self._measured, self._out_span) - degree - 1)
            - self._first
        )
        if keep > SPANS_AT_ONCE:
            self._points = self._points[keep:]
            self._rows = self._rows[keep:]
            self._first += keep
