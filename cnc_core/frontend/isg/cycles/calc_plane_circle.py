"""SysCalcPlaneCircle: the circle in space through points: their plane first,
then the circle in it.
"""

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
from cnc_core.geometry.shapes.fits import fit_plane_circle


def build(given: Given, around: Surroundings) -> Work:
    """Centre, radius, normal, variance in the plane."""
    found = fitted(fit_plane_circle, points_of(given, 3))
    assert found.normal is not None
    outputs = by_axis("SysRetCenter", found.centre) | by_axis(
        "SysRetNormal", found.normal
    )
    return Work(
        outputs=outputs
        | {"SysRetRadius": found.radius, "SysRetRadVariance": found.variance}
    )


CYCLE = Cycle(
    "SysCalcPlaneCircle",
    "circle in space through points",
    point_parameters("XYZ", 3),
    build,
    (whole_points("XYZ", 3),),
    (
        *(f"SysRetCenter{axis}" for axis in "XYZ"),
        "SysRetRadius",
        *(f"SysRetNormal{axis}" for axis in "XYZ"),
        "SysRetRadVariance",
    ),
)
