"""The way from programmed to axis positions: a frame over the three main axes,
and a kinematic transformation.

A front end hands out one ``COORDINATES`` row whenever they change.  The row's
layout stands in ``c_ext/rows/nc_block.h``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cnc_core import plain

from ..units import FloatArray
from . import LENGTH_ONLY, PTP

EXACT = 1e-14


def _clean(matrix: FloatArray) -> FloatArray:
    """Entries that are 0, 1 or -1 but for rounding are so exactly."""
    near = np.round(matrix)
    return np.where(np.abs(matrix - near) < EXACT, near, matrix)


def to_quaternion(r: FloatArray) -> FloatArray:
    """(w, x, y, z) of a rotation (3, 3)."""
    xx, yy, zz = np.diagonal(r)
    squares = np.array([
        1 + xx + yy + zz,
        1 + xx - yy - zz,
        1 - xx + yy - zz,
        1 - xx - yy + zz,
    ])  # fmt: skip
    odd, even = r - r.T, r + r.T
    wx, wy, wz = odd[[2, 0, 1], [1, 2, 0]]
    xy, xz, yz = even[[0, 0, 1], [1, 2, 2]]
    outer = np.array([
        [squares[0], wx, wy, wz],
        [wx, squares[1], xy, xz],
        [wy, xy, squares[2], yz],
        [wz, xz, yz, squares[3]],
    ])  # fmt: skip
    # four times one component times the quaternion
    best = outer[int(np.argmax(squares))]
    return np.asarray(best / np.linalg.norm(best))


def from_quaternion(q: FloatArray) -> FloatArray:
    """(3, 3) rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q / np.linalg.norm(q)
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return _clean(np.array([
        [1 - 2 * (yy + zz), 2 * (xy - wz),
         2 * (xz + wy)],
        [2 * (xy + wz), 1 - 2 * (xx + zz),
         2 * (yz - wx)],
        [2 * (xz - wy), 2 * (yz + wx),
         1 - 2 * (xx + yy)],
    ]))  # fmt: skip


@dataclass(frozen=True)
class Frame:
    """A frame over the main axes, mm: p_outer = origin + rotation p."""

    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, inner: Frame) -> Frame:
        """This frame with ``inner`` in it."""
        return Frame(
            _clean(plain.product(self.rotation, inner.rotation)),
            self.origin + plain.product(self.rotation, inner.origin),
        )

    def outer(self, p: FloatArray) -> FloatArray:
        """(.., 3) points of the frame in the coordinates around it."""
        return np.asarray(plain.product(p, self.rotation.T) + self.origin)

    def inner(self, p: FloatArray) -> FloatArray:
        """The opposite."""
        return np.asarray(plain.product(p - self.origin, self.rotation))

    @property
    def turned(self) -> bool:
        """It is more than a shift."""
        return not np.array_equal(self.rotation, np.eye(3))

    @property
    def identity(self) -> bool:
        """It changes nothing."""
        return not self.turned and not self.origin.any()


@dataclass(frozen=True)
class Coordinates:
    """The frame and the transformation in force.

    ``kinematics``: number of the transformation.  None: the programmed axes
    are the machine's.
    ``length``: of the tool, mm.
    ``ptp``: blocks are straight lines of the axes to the programmed end.
    ``length_only``: the axes are programmed, and shifted by ``length`` along
    the tool.
    """

    frame: Frame = field(default_factory=Frame)
    kinematics: int | None = None
    length: float = 0.0
    ptp: bool = False
    length_only: bool = False

    def fill(self, row: Any, position: FloatArray) -> None:
        """Write into a row (1,); ``position`` (axes,) in the new programmed
        coordinates.
        """
        quaternion = to_quaternion(self.frame.rotation)
        row["end"][0, : len(position)] = position
        row["center"] = quaternion[:2]
        row["radius"] = quaternion[2]
        row["programmed_radius"] = quaternion[3]
        row["angle"], row["value"], row["length_min"] = self.frame.origin
        row["code"] = 0 if self.kinematics is None else self.kinematics + 1
        row["feed"] = self.length
        row["flags"] = (PTP if self.ptp else 0) | (
            LENGTH_ONLY if self.length_only else 0
        )

    @classmethod
    def of(cls, row: Any) -> Coordinates:
        """The coordinates of a row."""
        quaternion = np.array(
            [*row["center"], row["radius"], row["programmed_radius"]],
            dtype=np.float64,
        )
        origin = np.array(
            [row["angle"], row["value"], row["length_min"]], dtype=np.float64
        )
        code = int(row["code"])
        return cls(
            Frame(from_quaternion(quaternion), origin),
            code - 1 if code else None,
            float(row["feed"]),
            bool(row["flags"] & PTP),
            bool(row["flags"] & LENGTH_ONLY),
        )
