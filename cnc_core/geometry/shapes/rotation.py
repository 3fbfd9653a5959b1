"""Rotated planes: rotation matrices from angles and from points, and the angles
back.

Columns of a matrix are the new axes in old coordinates: p_old = origin + R
p_new.  Angles are degrees about X, Y, Z.
"""

from __future__ import annotations

import itertools

import numpy as np

from cnc_core import plain
from cnc_core.units import FloatArray

SEQUENCES = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
VERTICAL = 1e-9
# sine and cosine
EXACT = {
    0.0: (0.0, 1.0),
    90.0: (1.0, 0.0),
    180.0: (0.0, -1.0),
    270.0: (-1.0, 0.0),
}


class CollinearError(ValueError):
    """Three points that lie on a line or coincide."""


def sine_cosine(degrees: float) -> tuple[float, float]:
    """Exact at multiples of 90 degrees."""
    turned = degrees % 360.0
    if turned in EXACT:
        return EXACT[turned]
    radians = float(np.deg2rad(degrees))
    return float(plain.sines(radians)), float(plain.cosines(radians))


def elementary(axis: str, degrees: float) -> FloatArray:
    """Right-handed rotation about X, Y or Z."""
    s, c = sine_cosine(degrees)
    i, j = {
        "X": (1, 2),
        "Y": (2, 0),
        "Z": (0, 1),
    }[axis]
    out = np.eye(3)
    out[i, i] = out[j, j] = c
    out[i, j], out[j, i] = -s, s
    return out


def from_angles(
    angles: tuple[float, float, float],
    sequence: str = "ZYX",
    *,
    intrinsic: bool = True,
) -> FloatArray:
    """(3, 3) rotation by Tait-Bryan angles about X, Y, Z in a sequence;
    intrinsic: about the axes as they turn.
    """
    by_axis = dict(zip("XYZ", angles, strict=True))
    first, second, third = (
        elementary(axis, by_axis[axis]) for axis in sequence
    )
    return (
        plain.product(plain.product(first, second), third)
        if intrinsic
        else plain.product(plain.product(third, second), first)
    )


def from_points(points: FloatArray) -> FloatArray:
    """(3, 3) axes of the plane through three points (3, 3): X from point 1 to
    point 2, Z with a positive component.

    A vertical plane keeps the sense of its points.  CollinearError if they
    determine no plane.
    """
    along = points[1] - points[0]
    across = points[2] - points[0]
    normal = np.cross(along, across)
    size = float(np.linalg.norm(normal))
    if size <= 1e-9 * float(
        np.linalg.norm(along) * np.linalg.norm(across),
    ):
        raise CollinearError("the three points lie on a line")
    if normal[2] < 0 and abs(normal[2]) > VERTICAL * size:
        normal = -normal
    x, z = along / np.linalg.norm(along), normal / size
    return np.column_stack([x, np.cross(z, x), z])


def zyx_angles(matrix: FloatArray) -> tuple[float, float, float]:
    """Angles about X, Y, Z, degrees, of the intrinsic sequence ZYX; at B = +-90
    degrees A is 0.
    """
    flat = float(np.hypot(matrix[0, 0], matrix[1, 0]))
    b = plain.atan2(-matrix[2, 0], flat)
    if flat > 1e-12:
        a = plain.atan2(matrix[2, 1], matrix[2, 2])
        c = plain.atan2(matrix[1, 0], matrix[0, 0])
    else:
        a = 0.0
        c = plain.atan2(-matrix[0, 1], matrix[1, 1])
    angles = (a, b, c)
    x, y, z = (float(np.rad2deg(angle)) + 0.0 for angle in angles)
    return x, y, z


def all_sequences() -> list[tuple[str, bool]]:
    """Every sequence, intrinsic and extrinsic."""
    return list(itertools.product(SEQUENCES, (True, False)))
