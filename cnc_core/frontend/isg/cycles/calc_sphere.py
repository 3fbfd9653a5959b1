"""SysCalcSphere: the sphere through points."""

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
from cnc_core.geometry.shapes.fits import fit_sphere


def build(given: Given, around: Surroundings) -> Work:
    """Centre, radius, variance."""
    found = fitted(fit_sphere, points_of(given, 3))
    centre = by_axis("SysRetCenter", found.centre)
    return Work(
        outputs=centre
        | {"SysRetRadius": found.radius, "SysRetVariance": found.variance}
    )


CYCLE = Cycle(
    "SysCalcSphere",
    "sphere through points",
    point_parameters("XYZ", 4),
    build,
    (whole_points("XYZ", 4),),
    (
        *(f"SysRetCenter{axis}" for axis in "XYZ"),
        "SysRetRadius",
        "SysRetVariance",
    ),
)
