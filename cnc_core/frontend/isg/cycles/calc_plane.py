"""SysCalcPlane: the plane through points."""

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
from cnc_core.geometry.shapes.fits import fit_plane


def build(given: Given, around: Surroundings) -> Work:
    """Normal and the centroid."""
    found = fitted(fit_plane, points_of(given, 3))
    return Work(
        outputs=by_axis("SysRetNormal", found.normal)
        | by_axis("SysRetSupVector", found.support)
    )


CYCLE = Cycle(
    "SysCalcPlane",
    "plane through points",
    point_parameters("XYZ", 3),
    build,
    (whole_points("XYZ", 3),),
    tuple(
        f"SysRet{name}{axis}"
        for name in ("Normal", "SupVector")
        for axis in "XYZ"
    ),
)
