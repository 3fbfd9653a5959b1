"""Curves through the points of a profile, as a stream: any number of points in
bounded memory.

A curve reaches from one transition (or G00 line) to the next.  Its parameter is
centripetal: a chord of length L takes sqrt(L).  At a transition 62 the next
curve begins with the direction in which the one before ends; everywhere else
curves have free ends.  What lies between two transitions is one spline however
it is cut into batches.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks.profile_columns import SMOOTH, STOP, TANGENT, ProfileSpec
from cnc_core.units import FloatArray

from . import spline
from .points import (
    REVERSAL,
    IntArray,
    PointFilter,
    Points,
    automatic_codes,
    turn_angles,
)
from .spline import CORE, HALO, Window

STANDS = 1e-9  # mm


@dataclass
class Intervals:
    """Polynomials one behind the other: ``coef`` (n, columns, 6) over
    0..``span``; ``after``: transition at the end.
    """

    coef: FloatArray
    span: FloatArray
    feed: FloatArray
    after: IntArray
    rapid: npt.NDArray[np.bool_]
    line: IntArray
    number: IntArray

    @classmethod
    def none(cls, columns: int) -> Intervals:
        whole = np.empty(0, np.int64)
        return cls(
            np.empty((0, columns, 6)),
            np.empty(0),
            np.empty(0),
            whole,
            np.empty(0, np.bool_),
            whole,
            whole,
        )

    def __len__(self) -> int:
        return len(self.span)

    def __getitem__(
        self, which: slice | npt.NDArray[np.bool_] | IntArray
    ) -> Intervals:
        return Intervals(*(getattr(self, name)[which] for name in NAMES))

    @staticmethod
    def joined(parts: list[Intervals], columns: int) -> Intervals:
        parts = [p for p in parts if len(p)] or [Intervals.none(columns)]
        return Intervals(
            *(
                np.concatenate([getattr(p, name) for p in parts])
                for name in NAMES
            )
        )

    @property
    def ends(self) -> FloatArray:
        """(n, columns) values at the end."""
        return np.asarray(
            plain.summed(
                "nck,nk->nc",
                self.coef,
                plain.powers(self.span[:, None], np.arange(self.coef.shape[2])),
            )
        )


NAMES = ("coef", "span", "feed", "after", "rapid", "line", "number")


def steps_of(values: FloatArray, linear: list[int]) -> FloatArray:
    """(n - 1,) centripetal parameter steps; where the linear axes rest, of what
    else moves.
    """
    moved = np.diff(values, axis=0)
    far = np.linalg.norm(moved[:, linear], axis=1)
    others = (
        np.linalg.norm(np.delete(moved, linear, axis=1), axis=1)
        if values.shape[1] > 3
        else far
    )
    return np.asarray(
        np.sqrt(np.where(far > 0.0, far, np.maximum(others, 1e-12)))
    )


class Curves:
    """Points in, intervals out.

    ``directions``: (n, 3) tool directions of points, where VAngle needs them.

    The buffer begins with the open curve's first knot or, of a long curve,
    ``HALO`` knots ahead of the first one that is not solved yet.
    """

    def __init__(
        self,
        spec: ProfileSpec,
        directions: Callable[[FloatArray], FloatArray] | None = None,
    ) -> None:
        self.spec, self._directions = spec, directions
        self.filter = PointFilter(spec)
        self.marked = self.kept = 0
        self._columns = len(spec.columns)
        self._linear = list(spec.linear)
        self._buffer = Points.none(self._columns)
        self._known = 1  # points of the buffer whose transition is final
        self._gone = 0  # knots of the open curve that have left the buffer
        self._solved = 0  # first knot of the buffer that is not solved
        self._state: FloatArray | None = (
            None  # derivatives of the knot before it
        )
        # direction in which the open curve begins
        self._clamp: FloatArray | None = None

    def push(self, points: Points, final: bool) -> Intervals:
        """The intervals that are final now."""
        new = self.filter.push(points, final)
        self.kept += len(new)
        self._buffer = self._buffer + new
        self._mark(final)
        parts: list[Intervals] = []
        while (end := self._end(final)) is not None:
            parts.append(self._whole(end))
        parts.append(self._windows())
        return Intervals.joined(parts, self._columns)

    # transitions

    def _mark(self, final: bool) -> None:
        """Automatic transitions of the points whose neighbours are both known;
        programmed ones stay.
        """
        buffer = self._buffer
        first = self._known
        stop = len(self._buffer) - 1
        if stop > first:
            part = slice(first - 1, stop + 1)
            wanted = (
                self._directions is not None
                and self.spec.marks.versor_deg > 0.0
            )
            versors = (
                self._directions(buffer.values[part])
                if self._directions and wanted
                else None
            )
            found = automatic_codes(
                buffer.values[part][:, self._linear], versors, self.spec.marks
            )
            free = (
                (buffer.after[first:stop] == SMOOTH)
                & ~buffer.rapid[first:stop]
                & ~buffer.rapid[first + 1 : stop + 1]
            )
            self.marked += int((free & (found != SMOOTH)).sum())
            buffer.after[first:stop] = np.where(
                free, found, buffer.after[first:stop]
            )
            # no curve turns back or stands, whatever is programmed: where only
            # directions change, the tool waits
            chords = np.diff(buffer.values[part][:, self._linear], axis=0)
            rests = np.linalg.norm(chords, axis=1) < STANDS
            buffer.after[first:stop][
                (turn_angles(chords) > REVERSAL) | rests[:-1] | rests[1:]
            ] = STOP
            self._known = stop
        if final:
            self._known = len(buffer)

    def _end(self, final: bool) -> int | None:
        """Last point of the open curve, if it is known."""
        buffer, first = self._buffer, max(self._solved, 1)
        stops = (buffer.after != SMOOTH) | buffer.rapid
        stops[:-1] |= buffer.rapid[1:]
        found = np.flatnonzero(stops[first : self._known])
        if len(found):
            return first + int(found[0])
        return len(buffer) - 1 if final and len(buffer) > first else None

    # curves

    def _whole(self, end: int) -> Intervals:
        """The open curve up to its last point; the next curve begins there."""
        buffer = self._buffer
        out = (
            self._straight()
            if buffer.rapid[end]
            else self._curve(end + 1, end + 1)
        )
        out.after[-1] = self._transition(end)
        state, self._clamp = self._state, None
        if out.after[-1] == TANGENT and state is not None:
            self._clamp = state[0] / max(
                float(np.linalg.norm(state[0][self._linear])), 1e-300
            )
        self._buffer, self._state = buffer[end:], None
        self._known = max(self._known - end, 1)
        self._gone = self._solved = 0
        return out

    def _transition(self, end: int) -> int:
        """What happens at the end of a curve: G00 lines and the profile begin
        and end at standstill.
        """
        buffer = self._buffer
        last = end + 1 >= len(buffer)
        return (
            STOP
            if last or buffer.rapid[end] or buffer.rapid[end + 1]
            else int(buffer.after[end])
        )

    def _straight(self) -> Intervals:
        """A G00 line."""
        buffer, one = self._buffer, slice(1, 2)
        a, b = buffer.values[0], buffer.values[1]
        far = float(np.linalg.norm((b - a)[self._linear]))
        far = far if far >= STANDS else float(np.linalg.norm(b - a))
        coef = np.zeros((1, self._columns, 6))
        coef[0, :, 0] = a
        coef[0, :, 1] = (b - a) / far
        self._state = None
        marks = (
            np.array([STOP]),
            np.array([True]),
            buffer.line[one],
            buffer.number[one],
        )
        return Intervals(coef, np.array([far]), buffer.feed[one], *marks)

    def _windows(self) -> Intervals:
        """What the points so far settle of the open curve, in whole windows."""
        cores = (self._known - HALO - self._solved) // CORE
        if cores < 1:
            return Intervals.none(self._columns)
        stop = self._solved + cores * CORE
        out = self._curve(stop, len(self._buffer))
        drop = stop - HALO
        self._buffer = self._buffer[drop:]
        self._gone = self._gone + drop
        self._known = self._known - drop
        self._solved = HALO
        return out

    def _curve(self, stop: int, length: int) -> Intervals:
        """Intervals up to knot ``stop - 1``; the curve has ``length`` knots as
        far as they are known.
        """
        buffer, first = self._buffer, self._solved
        steps = steps_of(buffer.values[:length], self._linear)
        line = length == 2 and not self._gone
        degree = 3 if line else self.spec.degree
        windows = [
            self._window(at, min(at + CORE, stop), length, steps)
            for at in range(first, stop, CORE)
        ]
        states = spline.derivatives(windows, degree)
        if self._state is not None:
            states.insert(0, self._state[None])
            first -= 1
        whole = np.concatenate(states)
        self._state = whole[-1]
        values = buffer.values[first:stop]
        h = steps[first : stop - 1]
        coef = (spline.cubic if degree == 3 else spline.hermite)(
            values, whole, h
        )
        to = slice(first + 1, stop)
        after = np.zeros(len(h), np.int64)
        rapid = np.zeros(len(h), np.bool_)
        return Intervals(
            coef,
            h,
            buffer.feed[to],
            after,
            rapid,
            buffer.line[to],
            buffer.number[to],
        )

    def _window(
        self, at: int, to: int, length: int, steps: FloatArray
    ) -> Window:
        low = max(0, at - HALO)
        high = min(length, at + CORE + HALO)
        values = self._buffer.values
        clamp = None
        if low == 0 and not self._gone and self._clamp is not None:
            clamp = (
                self._clamp
                * float(
                    np.linalg.norm(
                        (values[1] - values[0])[self._linear],
                    )
                )
                / steps[0]
            )
        return Window(
            values[low:high],
            steps[low : high - 1],
            slice(at - low, to - low),
            clamp,
        )


__all__ = ["Curves", "Intervals", "steps_of"]
