"""The table ``[isons]`` of a cell file: machine parameters by the guide's
names, slots, tools, simulated devices.
"""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from ..frontend.isons.base import parameters as machine_parameters
from ..frontend.isons.base.machine import (
    EVENTS,
    IO_BLOCKS,
    SLOTS,
    Head,
    HomingSensors,
    IsonsCell,
    ToolTable,
)
from ..frontend.isons.base.text import AXIS_LETTERS
from .axes import AxisConfig
from .external import EXTERNAL_BLOCKS
from .values import Finite, NotNegative, Table

Axes = dict[str, Finite]
EventNumber = Annotated[int, Field(ge=-1, le=65535)]
Settings = dict[str, Any]
_OBJECT = re.compile(r"(0x[0-9a-fA-F]+|\d+):(0x[0-9a-fA-F]+|\d+)")


class HeadConfig(Table):
    """Offsets from home, sensor offsets from head 0, mm or degrees by axis; two
    values of the user.
    """

    offset: Axes = Field(default_factory=dict)
    sensor: Axes = Field(default_factory=dict)
    user: Annotated[list[Finite], Field(max_length=2)] = Field(
        default_factory=list
    )


class ToolTableConfig(Table):
    """Diameter and length, mm; largest speed; 17 values of the user."""

    diameter: NotNegative = 0.0
    length: Finite = 0.0
    max_rpm: NotNegative = 0.0
    user: Annotated[list[Finite], Field(max_length=17)] = Field(
        default_factory=list
    )


class HomingConfig(Table):
    """Simulated sensors of one axis: machine positions, mm or degrees
    (``HomingSensors``).
    """

    negative: Finite | None = None
    positive: Finite | None = None
    release: NotNegative = 0.1
    index: NotNegative = 0.0
    index_offset: Finite = 0.0
    absolute: Finite | None = None
    limit_negative: Finite | None = None
    limit_positive: Finite | None = None


def _whole_keys(
    table: dict[str, Any], what: str, highest: int
) -> dict[str, Any]:
    for key in table:
        plain = key.isdigit() and key == str(int(key))
        if not (plain and int(key) <= highest):
            raise ValueError(
                f"{what} {key!r} is not a number 0..{highest} (without leading zeros)"
            )
    return table


class IsonsConfig(Table):
    """Keys in capitals are machine parameters; each has its type and range
    (``frontend/isons/base/parameters.py``).
    """

    parameters: dict[str, float] = Field(default_factory=dict)
    origins: dict[str, Axes] = Field(default_factory=dict)
    offsets: dict[str, Axes] = Field(default_factory=dict)
    heads: dict[str, HeadConfig] = Field(default_factory=dict)
    tools: dict[str, ToolTableConfig] = Field(default_factory=dict)
    canopen: dict[str, dict[str, int]] = Field(default_factory=dict)
    events: dict[str, EventNumber] = Field(default_factory=dict)
    pauses: dict[str, str] = Field(default_factory=dict)
    homing: dict[str, HomingConfig] = Field(default_factory=dict)
    macro_folder: str = "."
    app_path: str = "."
    positioners: Annotated[
        int, Field(ge=0, le=machine_parameters.POSITIONERS_MAX)
    ] = 4
    passes_max: Annotated[int, Field(ge=0)] = 20_000
    io_block: Annotated[
        int, Field(ge=1, le=EXTERNAL_BLOCKS - IO_BLOCKS + 1)
    ] = 1

    @model_validator(mode="before")
    @classmethod
    def _collect(cls, data: Any) -> Any:
        """Keys in capitals become ``parameters``."""
        if not isinstance(data, dict):
            return data
        given = {
            key: value
            for key, value in data.items()
            if key == key.upper() and key != key.lower()
        }
        rest = {key: value for key, value in data.items() if key not in given}
        for key, value in given.items():
            known = machine_parameters.parameter(key)
            if known is None:
                near = machine_parameters.nearest(key)
                raise ValueError(
                    f"unknown machine parameter {key}; did you mean {near!r}?"
                )
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ValueError(
                    f"machine parameter {key} is a number, not {value!r}"
                )
            wrong = machine_parameters.wrong_value(key, known, float(value))
            if wrong:
                raise ValueError(f"machine parameter {wrong}")
        return rest | (
            {"parameters": {key: float(value) for key, value in given.items()}}
            if given
            else {}
        )

    @field_validator("origins", "offsets")
    @classmethod
    def _slots(cls, table: dict[str, Axes]) -> dict[str, Axes]:
        for axes in table.values():
            _check_axes(axes)
        return _whole_keys(table, "slot", SLOTS - 1)

    @field_validator("pauses")
    @classmethod
    def _pauses(cls, table: dict[str, str]) -> dict[str, str]:
        return _whole_keys(table, "pause code", 65535)

    @field_validator("heads")
    @classmethod
    def _heads(cls, table: dict[str, HeadConfig]) -> dict[str, HeadConfig]:
        for head in table.values():
            _check_axes(head.offset)
            _check_axes(head.sensor)
        return _whole_keys(table, "head", SLOTS - 1)

    @field_validator("homing")
    @classmethod
    def _homing(cls, table: dict[str, HomingConfig]) -> dict[str, HomingConfig]:
        _check_axes(table)
        return table

    @field_validator("tools")
    @classmethod
    def _tools(
        cls, table: dict[str, ToolTableConfig]
    ) -> dict[str, ToolTableConfig]:
        return _whole_keys(table, "tool", 65535)

    @field_validator("canopen")
    @classmethod
    def _nodes(
        cls, table: dict[str, dict[str, int]]
    ) -> dict[str, dict[str, int]]:
        for objects in table.values():
            for key in objects:
                if not _OBJECT.fullmatch(key):
                    raise ValueError(
                        f'CANopen object {key!r} is not "index:subindex", as "0x6014:0"'
                    )
        return _whole_keys(table, "CANopen node", 127)

    @field_validator("events")
    @classmethod
    def _events(cls, table: dict[str, int]) -> dict[str, int]:
        for key in table:
            if key not in EVENTS:
                raise ValueError(
                    f"event {key!r} is none of {', '.join(EVENTS)}"
                )
        return table

    @staticmethod
    def _jerk(
        values: machine_parameters.Parameters, accel: float | None
    ) -> float:
        """mm/s3 that reach the acceleration in JERK samples; 0: no limit."""
        samples_s = values["JERK"] * values["TAU"] / 1000.0
        if accel is None:
            accel = float(AxisConfig.model_fields["a_max_mm_s2"].default)
        return accel / samples_s if samples_s > 0.0 else 0.0

    def warnings(self) -> list[str]:
        """Machine parameters that change nothing here, and why."""
        found = []
        for name, value in self.parameters.items():
            known = machine_parameters.parameter(name)
            assert known is not None
            if known.stored and value != known.default:
                found.append(f"isons.{name} has no effect: {known.stored}")
        return found

    @property
    def machine(self) -> IsonsCell:
        """What programs see of it."""
        return IsonsCell(
            parameters=dict(self.parameters),
            origins={int(k): v for k, v in self.origins.items()},
            offsets={int(k): v for k, v in self.offsets.items()},
            heads={
                int(k): Head(h.offset, h.sensor, tuple(h.user))
                for k, h in self.heads.items()
            },
            tools={
                int(k): ToolTable(
                    t.diameter, t.length, t.max_rpm, tuple(t.user)
                )
                for k, t in self.tools.items()
            },
            canopen={
                int(k): {_object(name): v for name, v in o.items()}
                for k, o in self.canopen.items()
            },
            events=dict(self.events),
            pauses={float(code): text for code, text in self.pauses.items()},
            macro_folder=self.macro_folder,
            app_path=self.app_path,
            positioners=self.positioners,
            io_block=self.io_block,
            passes_max=self.passes_max,
            homing={
                name: HomingSensors(**sensors.model_dump())
                for name, sensors in self.homing.items()
            },
        )

    @property
    def retrace_mm_s(self) -> float:
        """Feed of backward motion, 0 as programmed."""
        return (
            machine_parameters.Parameters(self.parameters).speed(
                "VEL_GO_LINE_RETRACE"
            )
            / 60.0
        )

    def axis_settings(self, name: str, axis: Settings) -> Settings:
        """Keys of ``[axes.NAME]`` that machine parameters set, where the cell
        file does not set them itself.

        The limits are the wider ones of primary and secondary; which of them is
        in force, the program says (G81).
        """
        values = machine_parameters.Parameters(self.parameters)
        found: dict[str, Any] = {}
        if values.given(f"VMAX_{name}") and values[f"VMAX_{name}"] > 0:
            found["v_max_mm_s"] = values.speed(f"VMAX_{name}") / 60.0
        highest = max(values["ACC_LAV"], values["ACC_G0"])
        if values["ACC_LAV"] > 0:
            found["a_max_mm_s2"] = machine_parameters.acceleration(
                highest, values["TAU"]
            )
        if values.given("JERK"):
            found["j_max_mm_s3"] = self._jerk(
                values, found.get("a_max_mm_s2", axis.get("a_max_mm_s2"))
            )
        for key, end, widest in (("min_mm", "N", min), ("max_mm", "P", max)):
            names = [f"{rank}LIMITE_{end}_{name}" for rank in ("", "2ND_")]
            given = [one for one in names if values.given(one)]
            if f"LIMITE_{end}_{name}" in given:
                found[key] = widest(values[one] * 0.001 for one in given)
        return {key: value for key, value in found.items() if key not in axis}


def _check_axes(axes: dict[str, Any]) -> None:
    for name in axes:
        if name not in AXIS_LETTERS or len(name) != 1:
            raise ValueError(f"{name!r} is none of the axes {AXIS_LETTERS}")


def _object(name: str) -> tuple[int, int]:
    index, sub = name.split(":")
    return int(index, 0), int(sub, 0)
