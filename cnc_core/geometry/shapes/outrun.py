"""Where other axes outrun the main ones: these all but stand while a rotary axis
goes on, as where a spline comes back.

The length of a curve is measured over the main axes.  There it all but stands,
too, and no speed along it is enough.  So it runs with the parameter there.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cnc_core.units import FloatArray

from .polynomial import derivative, points

STANDS = 1e-12
SAMPLES, WITHIN = 32, 8
SURE = 4.0
"""Samples of a cubic so many times above the rate stay above it between them."""


def parts(
    coef: FloatArray,
    between: tuple[float, float],
    main: list[int],
    rate: float,
) -> list[tuple[float, float, bool]]:
    """Of a polynomial (axes, order): the parameters where each part begins and
    ends, and whether others outrun the main axes there.  These are slower than
    ``rate``, mm per parameter, all over such a part.
    """
    begin, to = between
    first = derivative(coef)
    others = [a for a in range(len(coef)) if a not in main]
    moves = np.abs(first).sum(axis=1) > STANDS
    if not moves[main].any() or not moves[others].any():
        return [(begin, to, False)]
    at = np.linspace(begin, to, SAMPLES + 1)
    if _norms(first[main], at).min() > SURE * rate:
        return [(begin, to, False)]
    places = [begin, *_crossings(first[main], begin, to, rate), to]
    out: list[tuple[float, float, bool]] = []
    for a, b in pairwise(places):
        outrun = _are_outrun(first, main, others, (a, b), rate)
        joins = out and out[-1][2] == outrun
        out.append((out.pop()[0] if joins else a, b, outrun))
    return out


def _norms(first: FloatArray, at: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(points(first, at), axis=1))


def _crossings(
    first: FloatArray, begin: float, to: float, rate: float
) -> list[float]:
    """Parameters between two at which the derivative is as large as the rate."""
    square = np.sum([np.convolve(d, d) for d in first], axis=0)
    square[0] -= rate * rate
    found = np.roots(square[::-1])
    real = found[np.abs(found.imag) <= 1e-9 * (1.0 + np.abs(found.real))].real
    least = 1e-9 * (to - begin)
    return sorted(float(u) for u in real if begin + least < u < to - least)


def _are_outrun(
    first: FloatArray,
    main: list[int],
    others: list[int],
    between: tuple[float, float],
    rate: float,
) -> bool:
    """Whether the main axes are slow between two parameters, and somewhere the
    slower ones.
    """
    at = np.linspace(*between, WITHIN + 1)
    own = _norms(first[main], at)
    return bool(
        own[WITHIN // 2] < rate and (own < _norms(first[others], at)).any()
    )
