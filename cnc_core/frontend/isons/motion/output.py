"""Rows on their way out of the front end: corners, radius compensation, feed
bounds, limits in force.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cnc_core import plain
from cnc_core.blocks import (
    CIRCULAR,
    COMPENSATION,
    LINEAR,
    POLYNOMIAL,
    RAPID,
    motion_planes,
)
from cnc_core.blocks.arcs import arc_extremes
from cnc_core.errors import CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import AnyArray, FloatArray

from ..base.parameters import Parameters
from .arcs_at_corners import Corners
from .limits import Limits
from .path_modes import PathModes

OFF = 40
PERPENDICULAR = 138
MITRE, ARC = 25, 26
MITRE_DEGREES = 45.0
SAME_MM = TOLERANCE_MM = SAME_DIRECTION = 1e-9


@dataclass(frozen=True)
class Bounds:
    """What rows have to keep: feeds in mm/s, ends of the axes (None: the cell's
    own limits are enough).
    """

    slowest: float
    fastest: float
    low: FloatArray | None = None
    high: FloatArray | None = None

    def check(
        self,
        rows: AnyArray,
        names: Sequence[str],
        start: FloatArray,
        main: tuple[int, int, int],
    ) -> tuple[int, str] | None:
        """Bound the feeds; the first row beyond a limit in force, and what is
        wrong with it.

        ``start``: (axes,) where the first row begins.  ``main``: channel index
        of X, Y, Z.
        """
        if self.slowest > 0.0 or self.fastest < math.inf:
            driven = (rows["type"] <= POLYNOMIAL) & (
                (rows["flags"] & RAPID) == 0
            )
            rows["feed"][driven] = np.clip(
                rows["feed"][driven],
                min(self.slowest, self.fastest),
                self.fastest,
            )
        if self.low is None or self.high is None:
            return None
        moving = np.flatnonzero(rows["type"] <= POLYNOMIAL)
        if not len(moving):
            return None
        low, high = _reach(rows[moving], start[: len(names)], main)
        beyond = (low < self.low - TOLERANCE_MM) | (
            high > self.high + TOLERANCE_MM
        )
        if not beyond.any():
            return None
        row, axis = (int(i) for i in np.argwhere(beyond)[0])
        value = (
            low[row, axis]
            if low[row, axis] < self.low[axis]
            else high[row, axis]
        )
        text = f"axis {names[axis]} would reach {value:g}, in force is "
        return int(
            moving[row]
        ), f"{text}{self.low[axis]:g} to {self.high[axis]:g}"


def _reach(
    rows: AnyArray, start: FloatArray, main: tuple[int, int, int]
) -> tuple[FloatArray, FloatArray]:
    """(low, high), each (n, axes), of lines and arcs one behind the other."""
    ends = rows["end"][:, : len(start)]
    low, high = ends.copy(), ends.copy()
    if not (rows["type"] == CIRCULAR).any():
        return low, high
    starts = np.vstack([start, ends[:-1]])
    for plane in (17, 18, 19):
        arcs = np.flatnonzero(
            (rows["type"] == CIRCULAR) & (rows["plane"] == plane)
        )
        if len(arcs):
            first, second, _ = motion_planes(plane)
            at = (
                arcs[:, None],
                np.array([main[first], main[second]]),
            )
            low[at], high[at] = arc_extremes(rows[arcs], starts[arcs], main)
    return low, high


class Edges:
    """The edge smoothing (G49) leaves a corner exact in which none of its axes
    changes its direction.
    """

    def __init__(self, modes: PathModes) -> None:
        self._modes = modes
        self._heading: FloatArray | None = None

    def before(
        self, row: Row, way: Callable[[Row], tuple[FloatArray, FloatArray]]
    ) -> list[Row]:
        """Rows in front of a motion; ``way``: its directions at both ends."""
        rounded = self._modes.rounded_axes()
        before, self._heading = self._heading, None
        if not rounded or row["flags"][0] & RAPID:
            return []
        first, last = way(row)
        if not first.any():
            self._heading = before
            return []
        self._heading = last
        if before is None:
            return []
        turned = np.flatnonzero(np.abs(first - before) > SAME_DIRECTION)
        if not len(turned) or rounded.intersection(turned.tolist()):
            return []
        return self._modes.exact_corner(int(row["n"][0]))


class Output:
    """``side``: 40, 41, 42 as programmed; compensation begins with the first
    feed motion in the plane behind it.
    """

    def __init__(
        self,
        machine: ProgramMachine,
        modal: Modal,
        parameters: Parameters,
        modes: PathModes,
    ) -> None:
        self._modal, self._parameters = modal, parameters
        self._axes = len(machine.axes)
        self.names = [name.upper() for name in machine.axes]
        self.main = machine.main
        self.corners = Corners(self._axes, modal.position)
        self.edges = Edges(modes)
        self.limits = Limits(machine, parameters)
        self.side = OFF
        self._armed = False
        # compensation is off, the motion that leaves the contour has not come
        self.leaving = False
        # what the stage has been told last, 0: compensation is off there
        self._corner = 0
        self._radius = 0.0
        self._code = 17
        self._n = 0
        self._last = modal.position
        self._heading: float | None = None
        self.refresh()

    def refresh(self, *, limits: bool = True) -> None:
        """Take over the parameters; ``limits``: rows are positions of the axes."""
        p = self._parameters
        self.limits.refresh()
        slowest = p.speed("FEEDMIN") / 60.0
        fastest = p.speed("FEEDMAX") / 60.0 or math.inf
        ends = (self.limits.stricter() if limits else None) or (None, None)
        self.bounds = Bounds(slowest, fastest, *ends)

    @property
    def plain(self) -> bool:
        """Rows may pass by: ``bounds`` is all they need."""
        return self.side == OFF and not self.corners.active

    def follow(self, modal: Modal) -> None:
        """Where the axes stand before the next block."""
        if self.plain:
            self._last = modal.position
            self.corners.follow(self._last)

    def moved_to(self, position: FloatArray) -> None:
        """The axes stand elsewhere."""
        self._last = position.copy()
        self.corners.follow(position)

    def stopped(self, position: FloatArray) -> None:
        """The axes have been stopped: nothing is held, compensated or rounded
        any more.
        """
        self.corners.flush()
        self.side = OFF
        self._armed = False
        self._corner = 0
        self.leaving = False
        self.moved_to(position)

    # rows

    def push(self, row: Row) -> list[Row]:
        """Final rows."""
        return [
            out for part in self.corners.push(row) for out in self._final(part)
        ]

    def flush(self) -> list[Row]:
        """What the corners hold."""
        return [
            out for part in self.corners.flush() for out in self._final(part)
        ]

    def _final(self, row: Row) -> list[Row]:
        wrong = self.bounds.check(row, self.names, self._last, self.main)
        if wrong is not None:
            raise CncError(903001, wrong[1])
        if row["type"][0] > POLYNOMIAL:
            return [row]
        rows = self.edges.before(row, self._way)
        rows += self._compensated(row) if self.side != OFF else [row]
        self.leaving = (
            self.leaving and self.side == OFF and self._headings(row)[0] is None
        )
        self._last = row["end"][0][: self._axes].copy()
        return rows

    # radius compensation

    def compensate(
        self, side: int, radius: float, code: int, n: int, offset: int
    ) -> list[Row]:
        """G40, G41, G42."""
        rows = self.flush()
        if side == OFF:
            if self.side != OFF and not self._armed:
                rows.append(self._row(OFF, ARC))
                self.leaving = True
            self.side, self._armed, self._corner = OFF, False, 0
            self._modal.set_compensated(False)
            return rows
        if not code:
            raise fail(
                900003,
                "radius compensation in this plane is not supported",
                offset,
            )
        self._armed = self._armed or side != self.side
        self.side = side
        self._radius = radius
        self._code = code
        self._n = n
        self._modal.set_compensated(True)
        self._heading = None
        return rows

    def _row(self, side: int, corner: int) -> Row:
        row = self._modal.row(
            COMPENSATION, self._n, code=side, value=self._value()
        )
        row["plane"] = self._code
        row["degree"] = corner
        row["pool"] = PERPENDICULAR
        return row

    def _value(self) -> float:
        """Radius; negative swaps the side where the plane's axes are named the
        other way round.
        """
        return -self._radius if self.corners.reversed else self._radius

    def _compensated(self, row: Row) -> list[Row]:
        """The row, behind what the stage has to know first."""
        first, second = self._headings(row)
        if first is None:
            return [row]
        rapid = row["type"][0] == LINEAR and row["flags"][0] & RAPID
        if self._armed:
            if rapid:
                return [row]
            self._armed = False
            told = [self._row(self.side, ARC)]
            self._corner = ARC
            self._heading = second
            return [*told, row]
        corner = self._corner
        if self._heading is not None:
            turn = abs(math.remainder(first - self._heading, 2 * math.pi))
            corner = ARC if math.degrees(turn) > MITRE_DEGREES else MITRE
        self._heading = second
        if corner == self._corner:
            return [row]
        self._corner = corner
        return [self._row(self.side, corner), row]

    def _way(self, row: Row) -> tuple[FloatArray, FloatArray]:
        """(axes,) unit directions at start and end; 0 without a motion."""
        way = row["end"][0][: self._axes] - self._last
        first, last = way.copy(), way.copy()
        if row["type"][0] == CIRCULAR:
            plane = list(self.corners.plane)
            if self.corners.reversed:
                plane.reverse()
            arc = abs(float(row["angle"][0] * row["radius"][0]))
            for out, heading in zip(
                (first, last), self._headings(row), strict=True
            ):
                assert heading is not None
                out[plane] = arc * plain.cos(heading), arc * plain.sin(heading)
        return _unit(first), _unit(last)

    def _headings(self, row: Row) -> tuple[float | None, float]:
        """Directions at start and end in the plane, rad; None if it does not
        move there.
        """
        a, b = self.corners.plane
        if self.corners.reversed:
            a, b = b, a
        start = self._last[[a, b]]
        end = row["end"][0][[a, b]]
        if row["type"][0] == CIRCULAR:
            centre = row["center"][0]
            sign = math.copysign(1.0, float(row["angle"][0]))
            from_centre, to = start - centre, end - centre
            return (
                plain.atan2(sign * from_centre[0], -sign * from_centre[1]),
                plain.atan2(sign * to[0], -sign * to[1]),
            )
        way = end - start
        if np.hypot(*way) < SAME_MM:
            return None, 0.0
        heading = plain.atan2(way[1], way[0])
        return heading, heading


def _unit(way: FloatArray) -> FloatArray:
    """The direction of a way; 0 without one."""
    size = float(np.sqrt(way @ way))
    return way / size if size > SAME_MM else np.zeros_like(way)
