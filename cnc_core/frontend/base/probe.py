"""The simulated probe: where on a straight way it trips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def trip(
    start: Array, end: Array, axes: Sequence[str], sensors: Mapping[str, float]
) -> tuple[float, Array] | None:
    """Share of the way at which the first axis comes to its sensor, and the
    place (axes,) there; None if none does.
    """
    found = []
    for i, name in enumerate(axes):
        at, way = sensors.get(name.upper()), float(end[i] - start[i])
        if at is not None and way:
            share = (at - float(start[i])) / way
            if 0.0 <= share <= 1.0:
                found.append((share, i, at))
    if not found:
        return None
    share, axis, at = min(found)
    place = start + share * (end - start)
    place[axis] = at
    return share, place
