"""The range of positions that circular rows reach."""

from __future__ import annotations

import numpy as np

from cnc_core import plain

from ..units import AnyArray, FloatArray
from . import motion_planes


def arc_extremes(
    rows: AnyArray, starts: FloatArray, main: tuple[int, int, int]
) -> tuple[FloatArray, FloatArray]:
    """(low, high), each (n, 2), mm: the range of circular rows of one plane.

    The columns are the plane's first and second axis.
    """
    first, second, _ = motion_planes(int(rows["plane"][0]))
    axes = [main[first], main[second]]
    centre, end = rows["center"], rows["end"][:, axes]
    d = starts[:, axes] - centre
    radius = np.hypot(d[:, 0], d[:, 1])
    angle0 = plain.directions(d[:, 1], d[:, 0])
    sweep = rows["angle"]
    low = np.minimum(starts[:, axes], end)
    high = np.maximum(starts[:, axes], end)
    for quadrant in range(4):
        angle = quadrant * np.pi / 2
        turn = np.mod(
            np.where(sweep > 0, angle - angle0, angle0 - angle), 2 * np.pi
        )
        point = centre + radius[:, None] * np.array(
            [plain.cosines(angle), plain.sines(angle)]
        )
        passed = (turn <= np.abs(sweep))[:, None]
        low = np.where(passed, np.minimum(low, point), low)
        high = np.where(passed, np.maximum(high, point), high)
    return low, high
