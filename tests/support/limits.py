"""Samples at the cycle against the limits of the axes: one measure and one slack.

The slack is the goal of the planners (``docs/explanation/planner.md``): 2 % at the cycle.
A speed has less, since nothing but rounding may exceed it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cnc_core.config import CellConfig
from cnc_core.units import FloatArray

SPEED_SLACK = 1.001
SLACK = 1.02


class Shares(NamedTuple):
    """Largest sampled value over its limit, over cycles and axes; a jerk without limit is 0."""

    velocity: float
    acceleration: float
    jerk: float


def shares(pos: FloatArray, cell: CellConfig, *, ended: bool = True) -> Shares:
    """Measure positions (n, axes) in mm that begin at rest at the cell's start.

    ``ended``: the program has ended, so the axes stand still behind the last position, too.
    """
    start = np.repeat(cell.axis_values("start_mm")[None], 3, axis=0)
    behind = np.repeat(pos[-1:], 3 if ended else 0, axis=0)
    path = np.vstack([start, pos, behind])
    largest = [
        np.abs(np.diff(path, n=order, axis=0)).max(axis=0) / cell.cycle_s**order
        for order in (1, 2, 3)
    ]
    jerk_limit = cell.axis_values("j_max_mm_s3")
    return Shares(
        float((largest[0] / cell.axis_values("v_max_mm_s")).max()),
        float((largest[1] / cell.axis_values("a_max_mm_s2")).max()),
        float(
            (largest[2] / np.where(jerk_limit > 0, jerk_limit, np.inf)).max()
        ),
    )


def ratios(
    pos: FloatArray, cell: CellConfig, jerk: bool = True
) -> tuple[float, float]:
    """(velocity, acceleration) over their limits, of a program that has ended.

    The jerk is asserted here (``jerk`` False: it was not planned with).
    """
    found = shares(pos, cell)
    assert not jerk or found.jerk <= SLACK, found
    return found.velocity, found.acceleration


def legal(pos: FloatArray, cell: CellConfig) -> None:
    """Assert that velocity, acceleration and jerk keep their limits; the path may go on."""
    found = shares(pos, cell, ended=False)
    assert found.velocity <= SPEED_SLACK, found
    assert found.acceleration <= SLACK, found
    assert found.jerk <= SLACK, found
