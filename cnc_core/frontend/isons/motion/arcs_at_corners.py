"""Fillets (G30) and bevels (G33): a corner between two lines of the plane gets
an arc or an edge where it fits.

The last line is held back until the next motion is known; several corners on
one segment are served in program order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cnc_core import plain
from cnc_core.blocks import CIRCULAR, LINEAR, POLYNOMIAL, RAPID
from cnc_core.frontend.base.scanner import Row
from cnc_core.units import FloatArray

SAME_MM = 1e-9


@dataclass
class Corner:
    """``size``: radius of the fillet or length of the new edge, mm; ``angle``:
    smallest turn, degrees.
    """

    size: float = 0.0
    angle: float = 0.0
    on: bool = False

    @property
    def active(self) -> bool:
        return self.on and self.size > 0.0


class Corners:
    """Streaming; ``plane``: channel indices of its two axes, ``code``: 17, 18,
    19 (0: no arcs there), ``reversed``.
    """

    def __init__(self, axes: int, position: FloatArray) -> None:
        self._axes = axes
        self.fillet, self.bevel = Corner(), Corner()
        self.plane = (0, 1)
        self.code = 17
        self.reversed = False
        self.factor = 1.0  # of the plane transformations
        self._held: Row | None = None
        self._start = position.copy()  # of the row held back
        self._last = position.copy()  # end of the row seen last

    @property
    def active(self) -> bool:
        return self.fillet.active or self.bevel.active or self._held is not None

    def follow(self, position: FloatArray) -> None:
        """Motions went by elsewhere."""
        if self._held is None:
            self._last = position.copy()

    def flush(self) -> list[Row]:
        """What is held back."""
        held, self._held = self._held, None
        return [] if held is None or held["length"][0] < SAME_MM else [held]

    def push(self, row: Row) -> list[Row]:
        """Rows that are final now."""
        if row["type"][0] > POLYNOMIAL:
            return [*self.flush(), row]
        start = self._last
        end = row["end"][0][: self._axes].copy()
        self._last = end
        if not self.active:
            return [row]
        usable = self._usable(row, start)
        out: list[Row] = []
        if self._held is not None and usable:
            out, start = self._serve(row, start)
        else:
            out = self.flush()
        if usable and (self.fillet.active or self.bevel.active):
            self._held, self._start = row, start
            return out
        return [*out, row]

    def _usable(self, row: Row, start: FloatArray) -> bool:
        """A feed line that moves axes of the plane only."""
        rapid = row["flags"][0] & RAPID
        if not self.code or row["type"][0] != LINEAR or rapid:
            return False
        moved = np.abs(row["end"][0][: self._axes] - start) > SAME_MM
        others = [i for i in range(self._axes) if i not in self.plane]
        return bool(
            moved[list(self.plane)].any() and not moved[others].any(),
        )

    def _serve(
        self, row: Row, corner: FloatArray
    ) -> tuple[list[Row], FloatArray]:
        """The corner between the row held back and this one: rows, and where
        this one begins now.
        """
        assert self._held is not None
        axes = list(self.plane)
        before = corner[axes] - self._start[axes]
        after = row["end"][0][axes] - corner[axes]
        lengths = float(np.hypot(*before)), float(np.hypot(*after))
        u, v = before / lengths[0], after / lengths[1]
        turn = plain.atan2(
            float(u[0] * v[1] - u[1] * v[0]),
            float(u @ v),
        )
        shape = self.fillet if self.fillet.active else self.bevel
        size = shape.size * self.factor
        if (
            not shape.active
            or abs(math.degrees(turn)) <= shape.angle
            or math.pi - abs(turn) < 1e-9
        ):
            return self.flush(), corner
        setback = (
            size * plain.tan(abs(turn) / 2)
            if shape is self.fillet
            else size / (2 * plain.cos(turn / 2))
        )
        if setback > lengths[0] + SAME_MM or setback > lengths[1] + SAME_MM:
            return self.flush(), corner
        first, second = corner.copy(), corner.copy()
        first[axes] -= setback * u
        second[axes] += setback * v
        held = self._held
        held["end"][0][: self._axes] = first
        _set_length(held, lengths[0] - setback)
        element = held.copy()
        element["end"][0][: self._axes] = second
        if shape is self.fillet:
            self._make_arc(element, first[axes], u, turn, size)
        else:
            _set_length(element, size)
        _set_length(row, lengths[1] - setback)
        return [*self.flush(), element], second

    def _make_arc(
        self,
        row: Row,
        start: FloatArray,
        u: FloatArray,
        turn: float,
        radius: float,
    ) -> None:
        side = math.copysign(radius, turn)
        centre = start + side * np.array([-u[1], u[0]])
        row["type"], row["plane"] = CIRCULAR, self.code
        row["center"] = centre[::-1] if self.reversed else centre
        row["angle"] = -turn if self.reversed else turn
        row["radius"] = row["programmed_radius"] = radius
        _set_length(row, abs(turn) * radius)


def _set_length(row: Row, length: float) -> None:
    row["length"] = row["length_min"] = max(length, 0.0)
