"""SysCalcLine: the line through points."""

from __future__ import annotations

from cnc_core.frontend.isg.cycles.calculation import (
    by_axis,
    fitted,
    point_parameters,
    points_of,
    whole_points,
)
from cnc_core.frontend.isg.cycles.declaration import (
    Cycle,
    Given,
    Surroundings,
    Work,
)
from cnc_core.geometry.shapes.fits import Line, fit_line

IDENTICAL_MM = 1e-9


def build(given: Given, around: Surroundings) -> Work:
    """Direction, the centroid, variance."""
    found: Line = fitted(
        lambda points: fit_line(points, IDENTICAL_MM / around.unit_mm),
        points_of(given, 3),
    )
    outputs = by_axis("SysRetDirVector", found.direction) | by_axis(
        "SysRetSupVector", found.support
    )
    return Work(outputs=outputs | {"SysRetVariance": found.variance})


CYCLE = Cycle(
    "SysCalcLine",
    "line through points",
    point_parameters("XYZ", 2),
    build,
    (whole_points("XYZ", 2),),
    (
        *(
            f"SysRet{name}{axis}"
            for name in ("DirVector", "SupVector")
            for axis in "XYZ"
        ),
        "SysRetVariance",
    ),
)
