"""Plane transformations: programmed -> swap -> mirror -> scale -> rotate, as
one affine map of all axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cnc_core import plain
from cnc_core.units import FloatArray

SAME = 1e-12


@dataclass
class Rotation:
    """About (``first``, ``second``) of the plane, degrees counter-clockwise
    from first to second axis.
    """

    first: float = 0.0
    second: float = 0.0
    degrees: float = 0.0
    on: bool = False


@dataclass
class Scaling:
    """Ratios and centre by axis."""

    ratio: dict[int, float] = field(default_factory=dict)
    centre: dict[int, float] = field(default_factory=dict)
    on: bool = False


class Transform:
    """State of the transformations.

    ``swaps``: pairs of axes by function; ``mirrored``: axes.

    ``matrix`` (axes, axes) and ``shift`` (axes,): place = matrix @ programmed +
    shift, before the offsets.
    """

    def __init__(self, axes: int) -> None:
        self._axes = axes
        self.plane_swap: tuple[int, int] | None = None
        self.named_swap: tuple[int, int] | None = None
        self.named_swap_on = False
        self.mirrored: set[int] = set()
        self.scaling, self.rotation = Scaling(), Rotation()
        self.plane = (0, 1)
        self.rebuild()

    @property
    def identity(self) -> bool:
        return self._identity

    def rebuild(self) -> None:
        """Compute the map again after a change."""
        before = self.before_scaling()
        scale: FloatArray = np.eye(self._axes)
        scale_shift: FloatArray = np.zeros(self._axes)
        if self.scaling.on:
            for axis, ratio in self.scaling.ratio.items():
                scale[axis, axis] = ratio
                scale_shift[axis] = self.scaling.centre.get(axis, 0.0) * (
                    1.0 - ratio
                )
        turn, turn_shift = self._turn()
        self.matrix: FloatArray = turn @ scale @ before
        self.shift: FloatArray = turn @ scale_shift + turn_shift
        unchanged = (self.matrix == np.eye(self._axes)).all()
        self._identity = bool(unchanged and not self.shift.any())
        self._inverse: FloatArray = np.asarray(
            np.linalg.inv(self.matrix), dtype=np.float64
        )

    def before_scaling(self) -> FloatArray:
        """Swaps, then mirrors."""
        swap: FloatArray = np.eye(self._axes)
        pairs = [
            self.named_swap if self.named_swap_on else None,
            self.plane_swap,
        ]
        for pair in pairs:
            if pair is not None:
                swap[list(pair)] = swap[list(pair)[::-1]]
        mirror: FloatArray = np.eye(self._axes)
        for axis in self.mirrored:
            mirror[axis, axis] = -1.0
        return np.asarray(mirror @ swap)

    def _turn(self) -> tuple[FloatArray, FloatArray]:
        turn: FloatArray = np.eye(self._axes)
        shift: FloatArray = np.zeros(self._axes)
        if not self.rotation.on or self.rotation.degrees % 360.0 == 0.0:
            return turn, shift
        first, second = self.plane
        cos, sin = cos_sin(self.rotation.degrees)
        turn[first, first] = turn[second, second] = cos
        turn[first, second], turn[second, first] = -sin, sin
        centre = np.zeros(self._axes)
        centre[first] = self.rotation.first
        centre[second] = self.rotation.second
        return turn, centre - turn @ centre

    def forward(self, point: FloatArray) -> FloatArray:
        return np.asarray(self.matrix @ point + self.shift)

    def backward(self, place: FloatArray) -> FloatArray:
        return np.asarray(self._inverse @ (place - self.shift))

    def similarity(self, first: int, second: int) -> tuple[float, bool] | None:
        """(scale, sense kept) of circles of this plane; None if they do not
        stay circles of it.
        """
        part = self.matrix[np.ix_((first, second), (first, second))]
        columns = np.abs(
            np.delete(
                self.matrix[:, [first, second]],
                [first, second],
                axis=0,
            )
        )
        product = part.T @ part
        scale2 = product[0, 0]
        round_ = (
            abs(product[1, 1] - scale2) <= SAME * scale2
            and abs(product[0, 1]) <= SAME * scale2
        )
        if columns.any() or not round_ or scale2 <= 0.0:
            return None
        return float(np.sqrt(scale2)), bool(np.linalg.det(part) > 0)


def cos_sin(degrees: float) -> tuple[float, float]:
    """Exact at multiples of a right angle."""
    turns = round(degrees / 90.0)
    rest = np.radians(degrees - 90.0 * turns)
    cos = float(plain.cosines(rest))
    sin = float(plain.sines(rest))
    return (
        (cos, sin),
        (-sin, cos),
        (-cos, -sin),
        (sin, -cos),
    )[turns % 4]
