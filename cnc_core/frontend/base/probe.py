"""The simulated probe: where on a straight way it trips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cnc_core.units import FloatArray


def trip(
    start: FloatArray,
    end: FloatArray,
    axes: Sequence[str],
    sensors: Mapping[str, float],
) -> tuple[float, FloatArray] | None:
    """Where the first axis comes to its sensor on a straight way.

    Returns the share of the way and the place (axes,). None: no axis does.
    """
    found = []
    for i, name in enumerate(axes):
        at = sensors.get(name.upper())
        way = float(end[i] - start[i])
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
