"""The tables ``[kinematics.N]`` of a cell file: the chain of a machine, by
directions and points or by CIN steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from ..kinematics.chain import Chain, Fixed, HasMatrix, Step
from ..kinematics.machine import Kinematics
from ..kinematics.machine_types import (
    BASIC,
    CHAINS,
    CUTS,
    PART,
    TOOL,
    Element,
    machine_chain,
)
from ..units import FloatArray

AxisName = Annotated[str, Field(min_length=1)]
Finite = Annotated[float, Field(gt=-1e9, lt=1e9, allow_inf_nan=False)]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Cin = Annotated[list[Finite], Field(min_length=6, max_length=6)]
ALIASES = {"table-table": "WRK", "head-table": "MIX", "head-head": "TOL"}
TypeName = Literal[
    "table-table",
    "head-table",
    "head-head",
    "WRK",
    "MIX",
    "TOL",
    "WC1",
    "WC2",
    "TC1",
    "TC2",
    "C12",
]
BedName = Literal["WRK", "B12", "BC1", "B23", "BC2", "TOL"]
UNIT = {
    "X": (1.0, 0.0, 0.0),
    "Y": (0.0, 1.0, 0.0),
    "Z": (0.0, 0.0, 1.0),
}
ABOUT = dict(zip("ABCUVW", "XYZXYZ", strict=True))


class KinematicsConfig(BaseModel):
    """One kinematic transformation.

    Vectors are given in the machine frame with all axes at 0 (home), mm.

    ``linear``: three axes, from the part to the tool.  ``rotary``: two axes,
    the one nearer to the part first.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    type: TypeName
    bed: BedName = "WRK"
    linear: Annotated[list[AxisName], Field(min_length=3, max_length=3)] = (
        Field(default_factory=lambda: ["X", "Y", "Z"])
    )
    rotary: Annotated[list[AxisName], Field(min_length=2, max_length=2)]
    directions: dict[str, Vector] = Field(default_factory=dict)
    points: dict[str, Vector] = Field(default_factory=dict)
    part: Vector = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    spindle: Vector = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    tool_direction: Vector = Field(default_factory=lambda: [0.0, 0.0, 1.0])
    cin: dict[str, Cin] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _consistent(self) -> KinematicsConfig:
        named = [*self.linear, *self.rotary]
        if len(set(named)) < 5:
            raise ValueError("linear and rotary: an axis stands twice")
        if self.mac in BASIC and self.bed in ("BC1", "BC2"):
            raise ValueError(
                f"type {self.type} has no bed {self.bed}; choose WRK, B12, B23 or TOL"
            )
        if self.cin:
            self._check_cin(named)
        else:
            self._check_vectors(named)
        return self

    def _check_cin(self, named: list[str]) -> None:
        for key in (
            "directions",
            "points",
            "part",
            "spindle",
            "tool_direction",
        ):
            if key in self.model_fields_set:
                raise ValueError(f"cin and {key} exclude each other")
        wanted = {*named, PART, TOOL}
        if set(self.cin) != wanted:
            wrong = sorted(set(self.cin) ^ wanted)[0]
            raise ValueError(
                f"cin: {wrong} is {'not in the chain' if wrong in self.cin else 'missing'}"
            )

    def _check_vectors(self, named: list[str]) -> None:
        for key, table, allowed in (
            ("directions", self.directions, named),
            ("points", self.points, self.rotary),
        ):
            for axis in table:
                if axis not in allowed:
                    raise ValueError(
                        f"{key}: {axis} is none of {', '.join(allowed)}"
                    )
        for axis in named:
            if (
                axis not in self.directions
                and axis[0] not in UNIT
                and axis[0] not in ABOUT
            ):
                raise ValueError(f"directions: {axis} is missing")
            if not np.linalg.norm(self._direction(axis)) > 1e-6:
                raise ValueError(f"directions: {axis} has no length")
        if not np.linalg.norm(self.tool_direction) > 1e-6:
            raise ValueError("tool_direction has no length")

    @property
    def mac(self) -> str:
        """The chain's name in the OSAI manual."""
        return ALIASES.get(self.type, self.type)

    def _direction(self, axis: str) -> FloatArray:
        letter = axis[0]
        given = self.directions.get(axis) or UNIT[ABOUT.get(letter, letter)]
        return np.array(given)

    def chain(self, axes: Sequence[str]) -> Chain:
        """The chain over channel axes ``axes``; ValueError."""
        order = list(CHAINS[self.mac])
        names = dict(zip(("LI1", "LI2", "LI3"), self.linear, strict=True))
        rotary = iter(self.rotary)
        names |= {
            element: next(rotary)
            for element in order
            if element in ("WRK", "TOL")
        }
        steps = (
            self._given_steps() if self.cin else self._home_steps(order, names)
        )
        elements = {
            e: Element(list(axes).index(name), steps[name])
            for e, name in names.items()
        }
        return machine_chain(
            self.mac, self.bed, elements, steps[PART], steps[TOOL]
        )

    def _given_steps(self) -> dict[str, HasMatrix]:
        steps: dict[str, HasMatrix] = {}
        for name, (x, y, z, a, b, c) in self.cin.items():
            steps[name] = Step((x, y, z), (a, b, c))
        return steps

    def _home_steps(
        self, order: list[str], names: dict[str, str]
    ) -> dict[str, HasMatrix]:
        """Steps between the frames that the elements have at home."""
        element, behind = CUTS[self.bed]
        cut = order.index(element) + behind
        frames = {
            name: home_frame(self._direction(name), self.points.get(name))
            for name in names.values()
        }
        frames[PART] = home_frame(np.array(UNIT["Z"]), self.part)
        frames[TOOL] = home_frame(np.array(self.tool_direction), self.spindle)
        steps: dict[str, HasMatrix] = {}
        for side in (
            [names[e] for e in reversed(order[:cut])] + [PART],
            [names[e] for e in order[cut:]] + [TOOL],
        ):
            before: FloatArray = np.eye(4)
            for name in side:
                inverse = np.eye(4)
                turn, place = before[:3, :3], before[:3, 3]
                inverse[:3, :3] = turn.T
                inverse[:3, 3] = -turn.T @ place
                steps[name] = Fixed(inverse @ frames[name])
                before = frames[name]
        return steps

    def machine(
        self,
        number: int,
        axes: Sequence[str],
        main: tuple[int, int, int],
        low: FloatArray,
        high: FloatArray,
    ) -> Kinematics:
        """Bound to the axes of the channel."""
        return Kinematics(self.chain(axes), main, low, high, number)


def home_frame(
    direction: FloatArray, point: Sequence[float] | None
) -> FloatArray:
    """(4, 4): +Z along ``direction``, origin at ``point``; X and Y stay as near
    to the machine's as they can.
    """
    z = direction / np.linalg.norm(direction)
    # the shortest turn of the machine's Z onto z; about X by 180 degrees if it
    # points down
    cross = np.array([-z[1], z[0], 0.0])
    cosine = float(z[2])
    out = np.eye(4)
    if cosine < -1.0 + 1e-12:
        out[:3, :3] = np.diag([1.0, -1.0, -1.0])
    else:
        k = np.array(
            [
                [0.0, 0.0, cross[1]],
                [0.0, 0.0, -cross[0]],
                [-cross[1], cross[0], 0.0],
            ]
        )
        out[:3, :3] += k + k @ k / (1.0 + cosine)
    if point is not None:
        out[:3, 3] = point
    return out


__all__ = ["KinematicsConfig", "home_frame"]
