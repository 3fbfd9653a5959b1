"""Points of a profile made ready for curves: null moves dropped, versors
normalised, edges and curvature marked.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks.profile_columns import (
    PASS,
    SMOOTH,
    STOP,
    Marks,
    ProfileChunk,
    ProfileSpec,
)
from cnc_core.units import FloatArray

IntArray = npt.NDArray[np.int64]
STILL = 1e-9  # mm: whatever NullMov says, nothing moves
# a curve cannot turn like this: such a point is an edge whatever EDG says
REVERSAL = np.radians(170.0)


@dataclass
class Points:
    """Columns of points one behind the other; ``after``: transition at each."""

    values: FloatArray
    feed: FloatArray
    after: IntArray
    rapid: npt.NDArray[np.bool_]
    line: IntArray
    number: IntArray

    @classmethod
    def none(cls, columns: int) -> Points:
        whole = np.empty(0, np.int64)
        return cls(
            np.empty((0, columns)),
            np.empty(0),
            whole,
            np.empty(0, np.bool_),
            whole,
            whole,
        )

    @classmethod
    def of(cls, chunk: ProfileChunk) -> Points:
        return cls(
            chunk.values,
            chunk.feed,
            chunk.after,
            chunk.rapid,
            chunk.line,
            chunk.number,
        )

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(
        self, which: slice | npt.NDArray[np.bool_] | IntArray
    ) -> Points:
        return Points(*(getattr(self, name)[which] for name in NAMES))

    def __add__(self, more: Points) -> Points:
        return Points(
            *(
                np.concatenate([getattr(self, n), getattr(more, n)])
                for n in NAMES
            )
        )


NAMES = ("values", "feed", "after", "rapid", "line", "number")


@dataclass
class PointFilter:
    """Drops points that do not move; keeps the last point back, because a code
    behind a dropped one belongs to it.
    """

    spec: ProfileSpec
    dropped: int = 0
    _held: Points | None = None
    _last: FloatArray | None = field(default=None)
    _begun: bool = False  # points have been given out

    def push(self, points: Points, final: bool) -> Points:
        points = self._normalised(self._axis_null_moves(self._rolled(points)))
        held = self._held if self._held is not None else points[:0]
        whole = held + points
        keep = self._moving(whole)
        if final and len(whole):
            self._keep_end(whole, keep)
        # the transition belongs to the point that stays
        for i in np.flatnonzero(~keep & (whole.after != SMOOTH)):
            before = np.flatnonzero(keep[:i])[-1]
            whole.after[before] = whole.after[i]
        self.dropped += int((~keep).sum())
        whole = whole[keep]
        if final or not len(whole):
            self._held = None
            return whole
        self._held = whole[-1:]
        self._begun = self._begun or len(whole) > 1
        return whole[:-1]

    def _keep_end(self, points: Points, keep: npt.NDArray[np.bool_]) -> None:
        """The profile ends at its last point: where that is a null move, it
        takes the place of the point before, unless that is the first one, has a
        transition, or the two are driven in different ways.
        """
        before = int(np.flatnonzero(keep)[-1])
        if (
            keep[-1]
            or self._near(points.values[-1:], points.values[[before]], 0.0)[0]
        ):
            return
        keep[-1] = True
        plain = (points.after[before:-1] == SMOOTH).all()
        alike = points.rapid[before] == points.rapid[-1]
        keep[before] = not (plain and alike and (before or self._begun))

    def _rolled(self, points: Points) -> Points:
        """Positions of rollover axes (AXP Pitch), each the equivalent that is
        nearest to the one before.
        """
        axes = enumerate(self.spec.axes)
        rolling = [
            (i, axis)
            for i, axis in axes
            if axis.pitch and not (axis.linear or axis.tangential)
        ]
        if not rolling or not len(points):
            return points
        points = points[:]
        points.values = points.values.copy()
        for i, axis in rolling:
            last = (
                float(self.spec.start[axis.channel])
                if self._last is None
                else float(self._last[i])
            )
            column = np.concatenate([[last], points.values[:, i]])
            points.values[:, i] = np.unwrap(column, period=axis.pitch or 360.0)[
                1:
            ]
        return points

    def _normalised(self, points: Points) -> Points:
        for group in self.spec.versors:
            columns = self.spec.versor_columns(group)
            assert columns is not None
            v = points.values[:, columns]
            size = np.linalg.norm(v, axis=1)
            points.values[:, columns] = v / size[:, None]
        return points

    def _axis_null_moves(self, points: Points) -> Points:
        """Changes of an axis below its own threshold are ignored (AXP)."""
        points = points[:]
        points.values = points.values.copy()
        points.after = points.after.copy()
        for i, axis in enumerate(self.spec.axes):
            if axis.null_move > 0.0 and len(points):
                last = (
                    self._last[i]
                    if self._last is not None
                    else points.values[0, i]
                )
                for k, value in enumerate(points.values[:, i]):
                    last = (
                        value if abs(value - last) >= axis.null_move else last
                    )
                    points.values[k, i] = last
        if len(points):
            self._last = points.values[-1].copy()
        return points

    def _moving(self, points: Points) -> npt.NDArray[np.bool_]:
        """Which points stay; the first always does."""
        keep = np.ones(len(points), np.bool_)
        if len(points) < 2:
            return keep
        limit = self.spec.null_move
        near = self._near(points.values[1:], points.values[:-1], limit)
        if limit == 0.0:
            keep[1:] = ~near
        elif near.any():
            last = 0
            for i in range(1, len(points)):
                keep[i] = not self._near(
                    points.values[i : i + 1],
                    points.values[last : last + 1],
                    limit,
                )[0]
                last = i if keep[i] else last
        return keep

    def _near(
        self, a: FloatArray, b: FloatArray, limit: float
    ) -> npt.NDArray[np.bool_]:
        """Which points are null moves: nothing moves, or less than ``limit``
        and nothing else than the linear axes.
        """
        moved = np.abs(a - b)
        linear = list(self.spec.linear)
        others = [i for i in range(moved.shape[1]) if i not in linear]
        far = np.linalg.norm(moved[:, linear], axis=1)
        still = far < max(limit, STILL)
        if others:
            still &= moved[:, others].max(axis=1) <= min(
                max(limit, STILL), 1e-3
            )
        return np.asarray(still)


def turn_angles(v: FloatArray) -> FloatArray:
    """(n - 1,) rad between vectors (n, 3) one behind the other; 0 beside a
    vector of length 0.
    """
    a, b = v[:-1], v[1:]
    cross = np.linalg.norm(np.cross(a, b), axis=1)
    return np.asarray(plain.directions(cross, (a * b).sum(axis=1)))


def automatic_codes(
    xyz: FloatArray, versor: FloatArray | None, marks: Marks
) -> IntArray:
    """(n - 2,) transition that each inner point of (n, 3) gets by itself; EDG
    is tested before CRV.
    """
    v = np.diff(xyz, axis=0)
    length = np.linalg.norm(v, axis=1)
    first, second = length[:-1], length[1:]
    out = np.zeros(len(first), np.int64)
    if marks.ratio > 0.0:
        sparser = (second >= marks.long_mm) & (second > marks.ratio * first)
        denser = (first >= marks.long_mm) & (first > marks.ratio * second)
        out[(sparser | denser) & (first > 0.0) & (second > 0.0)] = (
            marks.ratio_code
        )
    turn = turn_angles(v)
    edge = np.zeros(len(out), np.bool_)
    if marks.edge_deg > 0.0:
        edge |= turn > np.radians(marks.edge_deg)
    if marks.versor_deg > 0.0 and versor is not None:
        edge |= turn_angles(versor)[1:] > np.radians(marks.versor_deg)
    out[edge] = marks.edge_code
    out[(turn > REVERSAL) & ~edge] = STOP
    return out


__all__ = ["PASS", "PointFilter", "Points", "automatic_codes", "turn_angles"]
