"""Die sinking: lengths on the contour that orbiting shrinks to
(FCT_EXTENSION_EQUIDIST).

A contour is programmed for the largest orbit radius.  Down to R_MAX_SCALE the
orbit runs on parallels of it, to the inside, below that on the parallel at
R_MAX_SCALE scaled about the origin.  ``length_min`` of an element is its length
on that parallel, ``MAX_EQUID - MAX_SCALE`` inside the programmed contour.  The
motion itself stays as programmed: the radius would come from another channel.

The contour is convex around the origin of the first two main axes, of lines and
arcs that join without a corner; lines may meet in corners.  Outside real-time
loops one motion is held back until the next is known, inside the whole loop is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from cnc_core import plain
from cnc_core.blocks import (
    CIRCULAR,
    EXTENSION,
    LINEAR,
    POLYNOMIAL,
    RAPID,
    RT_LOOP_BEGIN,
    RT_LOOP_END,
    BlockBatch,
)
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.units import AnyArray, FloatArray

from .stage import RefusedRow

TANGENTIAL = 1e-6  # rad
SAME_MM = 1e-9
CONCAVE, CORNER_OF_ARC, NOTHING_LEFT = 50918, 907121, 907122


class _Element:
    """A motion of the contour: where it begins and ends, its directions, what
    its corners cut off.
    """

    def __init__(self, row: Any, start: FloatArray, end: FloatArray) -> None:
        self.row = row
        self.arc = int(row["type"]) == CIRCULAR
        self.start, self.end = start, end
        self.cut = 0.0
        if not self.arc:
            self.first = self.last = plain.atan2(
                end[1] - start[1], end[0] - start[0]
            )
            return
        quarter = math.copysign(math.pi / 2, float(row["angle"]))
        centre = row["center"]
        self.first = (
            plain.atan2(
                start[1] - centre[1],
                start[0] - centre[0],
            )
            + quarter
        )
        self.last = (
            plain.atan2(
                end[1] - centre[1],
                end[0] - centre[0],
            )
            + quarter
        )

    @property
    def side(self) -> float:
        """Counter-clockwise about the origin: positive."""
        if self.arc:
            return float(self.row["angle"])
        begin, end = self.start, self.end
        return float(begin[0] * end[1] - begin[1] * end[0])


class Orbit:
    """A stage.  ``main``: channel index of X, Y, Z.  ``place``: where a line of
    a file stands.
    """

    def __init__(
        self,
        start: FloatArray,
        main: tuple[int, int, int],
        place: Callable[[int, int], Place],
    ) -> None:
        self._main, self._place = main, place
        self._axes = len(start)
        self._position = np.array(start, dtype=np.float64)
        self._distance = 0.0
        self._held: list[Any] = []
        self._open: list[_Element] = []
        self._in_loop = False

    @property
    def idle(self) -> bool:
        return not self._distance and not self._held

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        if (
            not self._distance
            and not self._held
            and not (rows["type"] == EXTENSION).any()
        ):
            self._follow(rows)
            return batch
        out: list[Any] = []
        for row in rows:
            try:
                self._take(row.copy(), out)
            except CncError as error:
                raise RefusedRow(
                    error, _batch(out, batch.pool), int(row["count"])
                ) from None
        return _batch(out, batch.pool)

    def drain(self) -> BlockBatch:
        out: list[Any] = []
        self._finish(out)
        return _batch(out, np.empty(0))

    def resync(self, position: FloatArray) -> None:
        self._position[:] = position
        self._open.clear()

    def _follow(self, rows: AnyArray) -> None:
        motions = rows["end"][rows["type"] <= POLYNOMIAL]
        if len(motions):
            self._position[:] = motions[-1, : self._axes]

    def _take(self, row: Any, out: list[Any]) -> None:
        kind = int(row["type"])
        if kind == EXTENSION:
            self._finish(out)
            self._distance = (
                max(0.0, float(row["radius"]) - float(row["value"]))
                if row["code"]
                else 0.0
            )
            return
        if kind in (RT_LOOP_BEGIN, RT_LOOP_END):
            self._finish(out, closed=kind == RT_LOOP_END)
            self._in_loop = kind == RT_LOOP_BEGIN
        start = self._position.copy()
        if kind <= POLYNOMIAL:
            self._position[:] = row["end"][: self._axes]
        if kind > POLYNOMIAL or not self._distance:
            self._held.append(row)
        elif not self._flat(row, start):
            self._finish(out)
            self._held.append(row)
        else:
            self._element(row, start)
        if not self._open:
            self._finish(out)
        elif not self._in_loop and len(self._open) > 1:
            self._release(out)

    def _flat(self, row: Any, start: FloatArray) -> bool:
        """The motion belongs to a contour in the plane of the first two main axes."""
        x, y, _ = self._main
        others = [a for a in range(self._axes) if a not in (x, y)]
        way = row["end"][others] - start[others]
        moved = np.abs(way).max(initial=0.0)
        if row["flags"] & RAPID or moved > SAME_MM or x < 0 or y < 0:
            return False
        if int(row["type"]) == POLYNOMIAL:
            raise CncError(
                900003, "only lines and arcs can be orbited", self._where(row)
            )
        return int(row["type"]) == LINEAR or int(row["plane"]) == 17

    def _element(self, row: Any, start: FloatArray) -> None:
        axes = list(self._main[:2])
        made = _Element(row, start[axes], row["end"][axes].copy())
        if self._open:
            self._join(self._open[-1], made)
        self._open.append(made)
        self._held.append(row)

    def _sense(self) -> float:
        """1 counter-clockwise, -1 clockwise: of the first element that tells."""
        side = next(
            (e.side for e in self._open if abs(e.side) > SAME_MM),
            1.0,
        )
        return math.copysign(1.0, side)

    def _join(self, before: _Element, behind: _Element) -> None:
        """What the corner between two elements cuts off both."""
        elements = self._open or [before]
        sense = math.copysign(
            1.0,
            next(
                (e.side for e in elements if abs(e.side) > SAME_MM),
                behind.side or 1.0,
            ),
        )
        turn = sense * math.remainder(behind.first - before.last, 2 * math.pi)
        if abs(turn) <= TANGENTIAL:
            return
        if turn < 0 or turn > math.pi - TANGENTIAL:
            raise CncError(CONCAVE, ERRORS[CONCAVE], self._where(behind.row))
        if before.arc or behind.arc:
            raise CncError(
                CORNER_OF_ARC, ERRORS[CORNER_OF_ARC], self._where(behind.row)
            )
        cut = self._distance * plain.tan(turn / 2)
        before.cut += cut
        behind.cut += cut

    def _measure(self, element: _Element) -> None:
        """``length_min`` of an element whose corners are known."""
        row = element.row
        length = float(row["length"]) - element.cut
        if element.arc:
            if self._sense() * float(row["angle"]) < 0:
                raise CncError(CONCAVE, ERRORS[CONCAVE], self._where(row))
            length = (float(row["radius"]) - self._distance) * abs(
                float(row["angle"])
            )
        if length < -SAME_MM:
            raise CncError(NOTHING_LEFT, ERRORS[NOTHING_LEFT], self._where(row))
        row["length_min"] = max(length, 0.0)

    def _release(self, out: list[Any]) -> None:
        """All but the last element are final; what stands behind the others
        goes with them.
        """
        last = self._open[-1]
        for element in self._open[:-1]:
            self._measure(element)
        place = next(i for i, row in enumerate(self._held) if row is last.row)
        out += self._held[:place]
        del self._held[:place]
        self._open = [last]

    def _finish(self, out: list[Any], *, closed: bool = False) -> None:
        """The contour ends here; ``closed``: its last element leads to its
        first one.
        """
        elements, held = self._open, self._held
        self._held = []
        if (
            closed
            and len(elements) > 1
            and np.abs(
                elements[-1].end - elements[0].start,
            ).max()
            < 1e-6
        ):
            self._join(elements[-1], elements[0])
        for element in elements:
            self._measure(element)
        self._open = []
        out += held

    def _where(self, row: Any) -> Place:
        return self._place(int(row["file"]), int(row["line"]))


def _batch(rows: list[Any], pool: FloatArray) -> BlockBatch:
    return (
        BlockBatch(np.array(rows, dtype=rows[0].dtype), pool)
        if rows
        else BlockBatch.empty()
    )
