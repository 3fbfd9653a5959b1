"""SysCalcCircle: the circle through points of the XY plane."""

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
from cnc_core.geometry.shapes.fits import fit_circle


def build(given: Given, around: Surroundings) -> Work:
    """Centre, radius, variance."""
    found = fitted(fit_circle, points_of(given, 2))
    centre = by_axis("SysRetCenter", found.centre)
    return Work(
        outputs=centre
        | {"SysRetRadius": found.radius, "SysRetVariance": found.variance}
    )


CYCLE = Cycle(
    "SysCalcCircle",
    "circle through points of the XY plane",
    point_parameters("XY", 3),
    build,
    (whole_points("XY", 3),),
    ("SysRetCenterX", "SysRetCenterY", "SysRetRadius", "SysRetVariance"),
)
