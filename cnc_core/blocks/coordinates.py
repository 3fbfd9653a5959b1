"""What lies between programmed and axis positions: a frame over the three main
axes, and a kinematic transformation.

A front end tells the stages with one ``COORDINATES`` row whenever it changes;
its layout: ``c_ext/rows/nc_block.h``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from . import LENGTH_ONLY, PTP

FloatArray = npt.NDArray[np.float64]
EXACT = 1e-14


def _clean(matrix: FloatArray) -> FloatArray:
    """Entries that are 0, 1 or -1 but for rounding are so exactly."""
    near = np.round(matrix)
    return np.where(np.abs(matrix - near) < EXACT, near, matrix)


def to_quaternion(r: FloatArray) -> FloatArray:
    """(w, x, y, z) of a rotation (3, 3)."""
    squares = np.array([1 + r[0, 0] + r[1, 1] + r[2, 2], 1 + r[0, 0] - r[1, 1] - r[2, 2],
                        1 - r[0, 0] + r[1, 1] - r[2, 2], 1 - r[0, 0] - r[1, 1] + r[2, 2]])  # fmt: skip
    outer = np.array([
        [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], squares[1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
        [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[2], r[1, 2] + r[2, 1]],
        [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[3]],
    ])  # fmt: skip
    # four times one component times the quaternion
    best = outer[int(np.argmax(squares))]
    return np.asarray(best / np.linalg.norm(best))


def from_quaternion(q: FloatArray) -> FloatArray:
    """(3, 3) rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q / np.linalg.norm(q)
    return _clean(np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]))  # fmt: skip


@dataclass(frozen=True)
class Frame:
    """p_outer = origin + rotation p; over the main axes, mm."""

    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, inner: Frame) -> Frame:
        """This frame with ``inner`` in it."""
        return Frame(
            _clean(self.rotation @ inner.rotation),
            self.origin + self.rotation @ inner.origin,
        )

    def outer(self, p: FloatArray) -> FloatArray:
        """(.., 3) points of the frame in the coordinates around it."""
        return np.asarray(p @ self.rotation.T + self.origin)

    def inner(self, p: FloatArray) -> FloatArray:
        """The opposite."""
        return np.asarray((p - self.origin) @ self.rotation)

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
    """``kinematics``: number of the transformation, None: the axes are driven
    as they are.  ``length``: tool, mm.

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
        row["center"], row["radius"], row["programmed_radius"] = (
            quaternion[:2],
            quaternion[2],
            quaternion[3],
        )
        row["angle"], row["value"], row["length_min"] = self.frame.origin
        row["code"] = 0 if self.kinematics is None else self.kinematics + 1
        row["feed"] = self.length
        row["flags"] = (PTP if self.ptp else 0) | (
            LENGTH_ONLY if self.length_only else 0
        )

    @classmethod
    def of(cls, row: Any) -> Coordinates:
        """What a row says."""
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
