"""All built-in cycles by name; ``docs/reference/cycles.md`` prints the same."""

from __future__ import annotations

from pathlib import PurePosixPath

from cnc_core.frontend.isg.cycles import (
    calc_circle,
    calc_line,
    calc_plane,
    calc_plane_circle,
    calc_sphere,
    hsc_settings,
    mill_rectangular_pocket,
    pos_rotation_to_plane,
)
from cnc_core.frontend.isg.cycles.declaration import Cycle

CYCLES: tuple[Cycle, ...] = (
    pos_rotation_to_plane.CYCLE,
    calc_circle.CYCLE,
    calc_plane.CYCLE,
    calc_line.CYCLE,
    calc_sphere.CYCLE,
    calc_plane_circle.CYCLE,
    hsc_settings.CYCLE,
    mill_rectangular_pocket.CYCLE,
)
BY_NAME = {cycle.name.lower(): cycle for cycle in CYCLES}


def find(name: str) -> Cycle | None:
    """The built-in cycle of a file name, with or without ``.ecy`` and folders;
    case does not count.
    """
    base = PurePosixPath(name.replace("\\", "/")).name.lower()
    return BY_NAME.get(base.removesuffix(".ecy"))
