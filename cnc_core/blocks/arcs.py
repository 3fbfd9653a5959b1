"""What circular rows reach."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import motion_planes

FloatArray = npt.NDArray[np.float64]


def arc_extremes(
    rows: npt.NDArray[Any], starts: FloatArray, main: tuple[int, int, int]
) -> tuple[FloatArray, FloatArray]:
    """(low, high), each (n, 2): what circular rows of one plane reach on the
    plane's first and second axis, mm.
    """
    first, second, _ = motion_planes(int(rows["plane"][0]))
    axes = [main[first], main[second]]
    centre, end = rows["center"], rows["end"][:, axes]
    d = starts[:, axes] - centre
    radius, angle0, sweep = (
        np.hypot(d[:, 0], d[:, 1]),
        np.arctan2(d[:, 1], d[:, 0]),
        rows["angle"],
    )
    low, high = (
        np.minimum(starts[:, axes], end),
        np.maximum(starts[:, axes], end),
    )
    for quadrant in range(4):
        angle = quadrant * np.pi / 2
        turn = np.mod(
            np.where(sweep > 0, angle - angle0, angle0 - angle), 2 * np.pi
        )
        point = centre + radius[:, None] * np.array(
            [np.cos(angle), np.sin(angle)]
        )
        passed = (turn <= np.abs(sweep))[:, None]
        low = np.where(passed, np.minimum(low, point), low)
        high = np.where(passed, np.maximum(high, point), high)
    return low, high
