"""State of the profile that is being read."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from cnc_core.blocks.profile_columns import POINTS, ProfileChunk, ProfileSpec
from cnc_core.kinematics.machine import Kinematics
from cnc_core.units import FloatArray

from .blend import Blends
from .curves import Curves
from .limits import ProfileLimits
from .machine import tool_directions
from .to_axes import ToAxes


class OpenProfile:
    """The profile that is being read.  ``switched``: its kinematics are in force."""

    def __init__(
        self,
        spec: ProfileSpec,
        kinematics: Kinematics | None,
        number: int,
        edge_speed: Callable[[ProfileSpec, FloatArray, FloatArray], float],
        limits: ProfileLimits,
        exact: bool,
    ) -> None:
        self.spec = spec
        self.kinematics = kinematics
        self.number = number
        self.limits = limits
        self.curves = (
            Curves(spec, tool_directions(spec, kinematics))
            if spec.kind == POINTS
            else None
        )
        self.blends = Blends(
            spec, partial(edge_speed, spec), limits.weakest, exact=exact
        )
        self.first: ProfileChunk | None = None
        # the same until the machine stands where the profile begins
        self.approach: ProfileChunk | None = None
        self.switched = kinematics is not None and spec.point != "AXI"
        self.position = spec.start.copy()  # in programmed coordinates
        if self.switched:
            assert kinematics is not None
            self.position = kinematics.programmed(spec.start, spec.tool.length)[
                0
            ]
        self.arrived = (
            False  # at the beginning: the axes went there, not the tip
        )
        self.polynomials = 0  # that have become rows
        # mm that a unit of the parameter counts for the planner
        self.stretch: float | None = None
        self.to_axes = ToAxes(spec, kinematics, self.position.copy())
