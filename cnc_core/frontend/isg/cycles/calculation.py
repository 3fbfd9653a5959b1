"""Common parts of the calculation cycles: points 1..10 in @P50.., @P60..,
@P70..
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from cnc_core.frontend.isg.cycles.declaration import (
    DEGENERATE,
    INVALID,
    CycleError,
    Given,
    Parameter,
    Problem,
    Rule,
    Surroundings,
)
from cnc_core.geometry.shapes.fits import DegenerateError
from cnc_core.units import FloatArray

Fit = TypeVar("Fit")
POINTS = 10
FIRST = (50, 60, 70)  # @P of X, Y, Z of point 1


def point_parameters(axes: str, fewest: int) -> tuple[Parameter, ...]:
    """The first ``fewest`` points are required."""
    return tuple(
        Parameter(first + i, f"{axis} of point {i + 1}", required=i < fewest)
        for i in range(POINTS)
        for axis, first in zip(axes, FIRST, strict=False)
    )


def whole_points(axes: str, fewest: int) -> Rule:
    """A point behind the required ones is given as a whole or not at all."""

    def rule(given: Given, around: Surroundings) -> list[Problem]:
        problems = []
        for i in range(fewest, POINTS):
            wanted = {
                first + i: axis
                for axis, first in zip(axes, FIRST, strict=False)
            }
            there = [number for number in wanted if number in given.programmed]
            problems += [
                Problem(
                    INVALID,
                    f"CYC_PARAM_INVALID: point {i + 1} without its {axis} (@P{number})",
                    there[0],
                )
                for number, axis in wanted.items()
                if there and number not in given.programmed
            ]
        return problems

    return rule


def points_of(given: Given, dimensions: int) -> FloatArray:
    """(n, dimensions) points of the call; gaps are skipped."""
    rows = [
        [given[first + i] for first in FIRST[:dimensions]]
        for i in range(POINTS)
        if FIRST[0] + i in given
    ]
    return np.array(rows, dtype=np.float64)


def fitted(fit: Callable[[FloatArray], Fit], points: FloatArray) -> Fit:
    """The fit, or the cycle's error for points that do not determine it."""
    try:
        return fit(points)
    except DegenerateError as error:
        raise CycleError(DEGENERATE, f"CYC_DEGENERATE: {error}") from None


def by_axis(name: str, values: FloatArray) -> dict[str, float]:
    """``NameX``, ``NameY``, .."""
    return {
        f"{name}{axis}": float(value) + 0.0
        for axis, value in zip("XYZ", values, strict=False)
    }
