"""Turns of a polynomial that are too sharp for a curve: a path of finite speed
has to stand there, or all but stand.

At a cusp the derivative vanishes and the direction turns at once, as where a
spline goes there and back.  Next to one the radius falls below any use.  Such a
place becomes a corner: the way to it and from it are lines, as far as they are
within ``LINE_MM`` of the polynomial.  At other slow places it is cut in two,
since one curve of the engine may be too coarse for both sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import sqrt

import numpy as np

from cnc_core.units import FloatArray

from .polynomial import derivative, point, points

SHARP_MM = 1.5e-5
"""Radius at the place of a turn that becomes a corner."""
LINE_MM = 1e-4
"""The way from the polynomial to the lines that take its place, at the most."""
SLOW = 0.05
"""Of the largest derivative: more is no sharp turn."""
BEYOND = 0.1
"""So far beyond its ends a polynomial is looked at, a share of it."""
SAMPLES, WITHIN, HALVINGS = 64, 16, 40


def parts(coef: FloatArray, end: float) -> list[tuple[float, float, bool]]:
    """Of a polynomial (axes, order) over 0..``end``: the parameters where each
    part begins and ends, and whether it is a line.
    """
    places = _places(coef, end)
    middles = [0.5 * (a + b) for (a, _), (b, _) in pairwise(places)]
    limits = [0.0, *middles, end]
    out, at = [], 0.0
    for i, (place, sharp) in enumerate(places):
        from_ = _line_from(coef, place, limits[i]) if sharp else place
        to = _line_from(coef, place, limits[i + 1]) if sharp else place
        if from_ > at:
            out.append((at, from_, False))
        out += [(a, b, True) for a, b in ((from_, place), (place, to)) if b > a]
        at = to
    if at < end:
        out.append((at, end, False))
    return out


def _places(coef: FloatArray, end: float) -> list[tuple[float, bool]]:
    """Slow places, ascending, and which are sharp.  A turn next to an end is
    there: what is left would be no way.
    """
    out: dict[float, bool] = {}
    for turn, sharp in _turns(coef, end):
        place = min(max(turn, 0.0), end)
        for other in (0.0, end):
            if _is_next_to(coef, place, other):
                place = other
        if sharp or 0.0 < place < end:
            out[place] = sharp or out.get(place, False)
    return sorted(out.items())


def _is_next_to(coef: FloatArray, place: float, end: float) -> bool:
    """Whether all that lies between is."""
    way = points(coef, np.linspace(place, end, WITHIN + 1)) - point(coef, end)
    return bool((way * way).sum(axis=1).max() < LINE_MM * LINE_MM)


def _turns(coef: FloatArray, end: float) -> Iterator[tuple[float, bool]]:
    """Parameters of slow places, ascending, and whether they are sharp turns; some
    lie beyond the ends, since the next polynomial begins there much as this one
    goes on.
    """
    first = derivative(coef)
    if first.shape[1] == 3 and _goes_on(first, end):
        return
    u = np.linspace(-BEYOND * end, (1.0 + BEYOND) * end, SAMPLES + 1)
    speed = np.sqrt((points(first, u) ** 2).sum(axis=1))
    most = float(speed.max())
    if float(speed.min()) > 2.0 * SLOW * most:
        return
    padded = np.pad(speed, 1, constant_values=np.inf)
    lowest = (speed <= padded[:-2]) & (speed < padded[2:])
    for k in np.flatnonzero(lowest):
        low, high = max(0, int(k) - 1), min(SAMPLES, int(k) + 1)
        place = _lowest(first, float(u[low]), float(u[high]))
        if _norm(point(first, place)) <= SLOW * most:
            yield place, _is_sharp(first, place, most)


def _goes_on(first: FloatArray, end: float) -> bool:
    """Whether all of a cubic goes on in one direction, by the hull of its
    derivative.
    """
    low, way = -BEYOND * end, (1.0 + 2.0 * BEYOND) * end
    high = low + way
    hull: list[list[float]] = [[], [], []]
    for constant, slope, bend in first.tolist():
        begin = constant + low * (slope + low * bend)
        hull[0].append(begin)
        hull[1].append(begin + 0.5 * way * (slope + 2.0 * low * bend))
        hull[2].append(constant + high * (slope + high * bend))
    along = [a + b for a, b in zip(hull[0], hull[2], strict=True)]
    norm = sqrt(sum(d * d for d in along))
    most = sqrt(max(sum(d * d for d in one) for one in hull))
    least = min(
        sum(a * b for a, b in zip(one, along, strict=True)) for one in hull
    )
    return least > 2.0 * SLOW * most * norm


def _lowest(first: FloatArray, low: float, high: float) -> float:
    """Where the derivative is least between two parameters."""
    for _ in range(80):
        a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
        at_a, at_b = point(first, a), point(first, b)
        if float((at_a * at_a).sum()) <= float((at_b * at_b).sum()):
            high = b
        else:
            low = a
    return 0.5 * (low + high)


def _norm(d: FloatArray) -> float:
    return float(np.sqrt((d * d).sum()))


def _is_sharp(first: FloatArray, place: float, most: float) -> bool:
    d1 = point(first, place)
    d2 = point(derivative(first), place)
    speed = _norm(d1)
    if speed <= 1e-9 * most:
        return True
    along = float((d1 * d2).sum()) / speed
    across = float(np.sqrt(max(0.0, (d2 * d2).sum() - along * along)))
    return speed * speed <= SHARP_MM * across


def _line_from(coef: FloatArray, place: float, to: float) -> float:
    """The parameter up to which, from ``place`` towards ``to``, a line takes its
    place.
    """
    far = to
    for _ in range(HALVINGS):
        if far == place or _is_near_line(coef, place, far):
            break
        far = place + 0.5 * (far - place)
    return far


def _is_near_line(coef: FloatArray, place: float, far: float) -> bool:
    off = points(coef, np.linspace(place, far, WITHIN + 1))
    off -= off[0].copy()
    way = off[-1].copy()
    length = _norm(way)
    if length == 0.0:
        return False
    along = (off * (way / length)).sum(axis=1)
    off -= np.clip(along, 0.0, length)[:, None] * (way / length)
    return float(np.sqrt((off * off).sum(axis=1).max())) <= LINE_MM
