"""One cell: what its tables say together."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import (
    Field,
    PrivateAttr,
    ValidationError,
    field_validator,
    model_validator,
)

from ..blocks import NC_AXES
from ..errors import ConfigError
from ..frontend.isons.base.machine import EVENT_PLACE, EVENT_SLOTS, IO_BLOCKS
from ..frontend.machine import (
    External,
    HscSetting,
    OsaiCell,
    ProgramMachine,
    Tool,
)
from ..kinematics.machine import Kinematics
from ..units import FloatArray
from .axes import AxisConfig
from .channel import (
    KNOWN_FUNCTIONS,
    MIN_FB_STORAGE,
    WITHOUT_EFFECT,
    ChannelConfig,
    StartupConfig,
)
from .channels import ChannelTable, ChannelTables
from .external import EXTERNAL_BLOCKS
from .inputs import InputConfig, by_symbol
from .isons import IsonsConfig
from .synchronisation import DEFAULT_M_SYNCH
from .tools import ToolConfig

AXIS_NAME = 15
"""Characters of an axis name: the HLI shows no more."""


def _default_axes() -> dict[str, AxisConfig]:
    return {name: AxisConfig() for name in "XYZ"}


class CellConfig(ChannelTables):
    """One cell: a machine with one channel, or with several (``channels``).

    What belongs to one channel is then asked channel by channel (``setups_of``).
    """

    name: str = "cell"
    cycle_s: Annotated[float, Field(ge=1e-5, le=0.1, allow_inf_nan=False)] = (
        0.001
    )
    axes: dict[str, AxisConfig] = Field(default_factory=_default_axes)
    startup: StartupConfig = Field(default_factory=StartupConfig)
    channel: ChannelConfig = Field(default_factory=ChannelConfig)
    inputs: dict[str, InputConfig] = Field(default_factory=dict)
    channels: dict[str, ChannelTable] = Field(default_factory=dict)
    _guests: int = PrivateAttr(default=0)

    @field_validator("inputs", mode="before")
    @classmethod
    def _input_names(cls, tables: Any) -> Any:
        return by_symbol(tables)

    @model_validator(mode="before")
    @classmethod
    def _isons_axes(cls, data: Any) -> Any:
        """IsoNs machine parameters set what the axes' tables leave open."""
        if isinstance(data, dict) and data.get("channels"):
            return data  # each channel has axes of its own
        table = data.get("isons") if isinstance(data, dict) else None
        if not isinstance(table, dict) or not any(
            key == key.upper() for key in table
        ):
            return data
        try:
            isons = IsonsConfig.model_validate(table)
        except ValidationError:
            return data  # told, with its place, when the field is validated
        axes = data.get("axes", {name: {} for name in "XYZ"})
        if not isinstance(axes, dict) or not all(
            isinstance(axis, dict) for axis in axes.values()
        ):
            return data
        return data | {
            "axes": {
                name: isons.axis_settings(name, axis) | axis
                for name, axis in axes.items()
            }
        }

    @model_validator(mode="before")
    @classmethod
    def _startup(cls, data: Any) -> Any:
        """Start-up parameters set what the channel's table leaves open."""
        if not isinstance(data, dict) or "startup" not in data:
            return data
        channel = data.get("channel", {})
        try:
            startup = StartupConfig.model_validate(data["startup"])
        except ValidationError:
            return data  # told, with its place, when the field is validated
        if not isinstance(channel, dict):
            return data
        return data | {"channel": startup.filling(channel) | channel}

    @model_validator(mode="after")
    def _isons_places(self) -> CellConfig:
        if "isons" in self.model_fields_set:
            places = range(self.isons.io_block, self.isons.io_block + IO_BLOCKS)
            for variable in self.externals.values():
                behind = variable.number + variable.blocks
                if (
                    variable.scope == "global"
                    and behind > places.start
                    and variable.number < places.stop
                ):
                    raise ValueError(
                        f"external {variable.name}: its block belongs to isons.io_block"
                    )
        return self

    @model_validator(mode="after")
    def _probe_axes(self) -> CellConfig:
        for axis in self.probe:
            if axis not in self.axes:
                raise ValueError(f"probe: the machine has no axis {axis!r}")
        return self

    @model_validator(mode="after")
    def _offset_names(self) -> CellConfig:
        for key, values in self.zero_offsets.items():
            if (
                not key.isdigit()
                or not 1 <= int(key) <= 96
                or key != str(int(key))
            ):
                raise ValueError(
                    f"zero offset {key!r} is not a number 1..96 (1 is G54)"
                )
            for axis in values:
                if axis not in self.axes:
                    raise ValueError(
                        f"zero offset {key}: the machine has no axis {axis!r}"
                    )
        return self

    @model_validator(mode="after")
    def _external_places(self) -> CellConfig:
        taken: dict[tuple[str, int], str] = {}
        for variable in self.externals.values():
            for block in range(
                variable.number, variable.number + variable.blocks
            ):
                if block > EXTERNAL_BLOCKS:
                    raise ValueError(
                        f"external {variable.name}: beyond the {EXTERNAL_BLOCKS} blocks of the area"
                    )
                other = taken.setdefault((variable.scope, block), variable.name)
                if other != variable.name:
                    raise ValueError(
                        f"external {variable.name}: block {block} belongs to {other} already"
                    )
        return self

    @property
    def simulated_inputs(self) -> dict[str, Any]:
        """Tables of the simulated inputs by symbol, as the PLC takes them."""
        return {
            path: one.model_dump(exclude_none=True)
            for path, one in self.inputs.items()
        }

    @property
    def externals(self) -> dict[str, External]:
        """Variables shared with the PLC by name in capitals, every one with its
        place.
        """
        found: dict[str, External] = {}
        free = {"channel": 1, "global": 1}
        for name, c in self.external.items():
            number = c.block or free[c.scope]
            made = External(
                name.upper(),
                c.type,
                number,
                c.size,
                c.scope,
                c.synchronised,
                c.characters,
            )
            free[c.scope] = max(free[c.scope], number + made.blocks)
            found[name.upper()] = made
        return found

    def external_bytes(self, dialect: str) -> dict[str, int]:
        """Bytes of the external-variable areas that programs of a dialect use,
        by scope.
        """
        io_blocks = (
            self.isons.io_block - 1 + IO_BLOCKS if dialect == "isons" else 0
        )
        out = {"channel": 0, "global": io_blocks * 24}
        for variable in self.externals.values():
            out[variable.scope] = max(
                out[variable.scope],
                (variable.number - 1 + variable.blocks) * 24,
            )
        return out

    def command_slots(self, dialect: str) -> tuple[int, int] | None:
        """Where the PLC sees commands of programs of a dialect.

        The block among the global external variables, and the number of slots.
        None: programs of this dialect show none.
        """
        if dialect != "isons":
            return None
        return self.isons.io_block - 1 + EVENT_PLACE, EVENT_SLOTS

    @property
    def skip_mask(self) -> int:
        """Bit 0 is block skip level 1."""
        return sum(1 << (level - 1) for level in set(self.channel.skip_levels))

    @model_validator(mode="after")
    def _numbers_differ(self) -> CellConfig:
        if self.channels:
            return self
        ids = [*self.axis_ids, *(s.id for s in self.spindles.values())]
        if len(set(ids)) < len(ids):
            raise ValueError(
                f"logical axis numbers {ids} are not all different"
            )
        if len(self.spindles) > 1:
            raise ValueError("a channel has one spindle here")
        return self

    @field_validator("axes")
    @classmethod
    def _axis_names(cls, axes: dict[str, AxisConfig]) -> dict[str, AxisConfig]:
        if not 1 <= len(axes) <= NC_AXES:
            raise ValueError(
                f"a channel has 1 to {NC_AXES} axes, not {len(axes)}"
            )
        for name in axes:
            if (
                not name.isalnum()
                or not name.isascii()
                or len(name) > AXIS_NAME
                or name[0] not in "XYZUVWQABC"
                or name != name.upper()
            ):
                raise ValueError(
                    f"axis name {name[:40]!r}: at most {AXIS_NAME} letters and"
                    " digits, upper case, beginning with one of XYZUVWQABC"
                )
        return axes

    @field_validator("tools")
    @classmethod
    def _tool_numbers(
        cls, tools: dict[str, ToolConfig]
    ) -> dict[str, ToolConfig]:
        for key in tools:
            if not key.isdigit() or int(key) == 0 or key != str(int(key)):
                raise ValueError(f"tool {key!r} is not a number from 1 on")
        return tools

    @property
    def guests(self) -> int:
        """How many of the axes, the last ones, are places for axes of other
        channels.
        """
        return self._guests

    def with_guests(self, count: int) -> CellConfig:
        """The same cell, its last ``count`` axes being such places."""
        self._guests = count
        return self

    @property
    def axis_names(self) -> tuple[str, ...]:
        self.of_one_channel()
        return tuple(self.axes)

    def of_one_channel(self) -> None:
        """ConfigError: somebody takes a cell with several channels for one."""
        if self.channels:
            names = ", ".join(self.channels)
            raise ConfigError(
                f"a cell with channels ({names}) does not go here: this takes"
                " a cell with one channel ([axes], [channel])"
            )

    @property
    def axis_ids(self) -> tuple[int, ...]:
        """Logical number of each axis, by default its place from 1 on."""
        self.of_one_channel()
        axes = enumerate(self.axes.values(), 1)
        return tuple(axis.id or place for place, axis in axes)

    @property
    def retrace_mm_s(self) -> float:
        """Path feed of motion back along the path, mm/s."""
        return self.isons.retrace_mm_s

    @property
    def main_axes(self) -> tuple[int, int, int]:
        """Channel index of X, Y, Z by name; -1 where the machine has none.

        A place for a guest is its index's main axis, where no name has it.
        """
        names = self.axis_names
        free = range(len(names) - self.guests, len(names))
        linear = [axis.kind == "linear" for axis in self.axes.values()]
        x, y, z = (
            names.index(name)
            if name in names
            else place
            if place in free and linear[place]
            else -1
            for place, name in enumerate("XYZ")
        )
        return x, y, z

    @model_validator(mode="after")
    def _kinematics_fit(self) -> CellConfig:
        if self.channels:
            return self
        for key, table in self.kinematics.items():
            if not key.isdigit() or key != str(int(key)) or int(key) > 999:
                raise ValueError(f"kinematics {key!r} is not a number 0..999")
            for kind, names in (
                ("linear", table.linear),
                ("rotary", table.rotary),
            ):
                for name in names:
                    if name not in self.axes:
                        raise ValueError(
                            f"kinematics {key}: the machine has no axis {name!r}"
                        )
                    if self.axes[name].kind != kind:
                        raise ValueError(
                            f"kinematics {key}: axis {name} is not a {kind} axis"
                        )
            if min(self.main_axes) < 0:
                raise ValueError(
                    f"kinematics {key}: the tip is programmed with X, Y and Z, "
                    "which the machine lacks"
                )
            if {self.axis_names[i] for i in self.main_axes} != set(
                table.linear
            ):
                raise ValueError(
                    f"kinematics {key}: linear axes are X, Y and Z, in the order of the chain"
                )
        try:
            self.kinematic_machines  # noqa: B018 - built once, to see that it can be
        except ValueError as error:
            raise ValueError(f"kinematics: {error}") from None
        if (
            self.channel.kin_id is not None
            and str(self.channel.kin_id) not in self.kinematics
        ):
            raise ValueError(
                f"channel.kin_id: there is no table kinematics.{self.channel.kin_id}"
            )
        return self

    @property
    def kinematic_machines(self) -> dict[int, Kinematics]:
        """Kinematic transformations by number."""
        low, high = self.axis_values("min_mm"), self.axis_values("max_mm")
        return {
            int(key): table.machine(
                int(key), self.axis_names, self.main_axes, low, high
            )
            for key, table in self.kinematics.items()
        }

    @property
    def kin_id(self) -> int | None:
        """Transformation that programs begin with (P-CHAN-00032):
        ``channel.kin_id``, else the first table.
        """
        if self.channel.kin_id is not None:
            return self.channel.kin_id
        return next((int(key) for key in self.kinematics), None)

    @property
    def m_functions(self) -> dict[int, str]:
        """Synchronisation type by M number."""
        return DEFAULT_M_SYNCH | {
            int(k): v for k, v in self.channel.m_synch.items()
        }

    def axis_values(self, key: str) -> FloatArray:
        """(axes,) one parameter of every axis."""
        self.of_one_channel()
        return np.array(
            [getattr(a, key) for a in self.axes.values()], dtype=np.float64
        )

    def program_machine(
        self, start: FloatArray | None = None
    ) -> ProgramMachine:
        """What programs see of this cell, with the axes at ``start`` (axes,) if
        that is given.
        """
        return ProgramMachine(
            axes=self.axis_names,
            rotary=tuple(a.kind == "rotary" for a in self.axes.values()),
            main=self.main_axes,
            start=self.axis_values("start_mm")
            if start is None
            else start.copy(),
            tools={
                int(k): Tool(t.radius_mm, t.length_mm, t.kin_id)
                for k, t in self.tools.items()
            },
            m_functions=self.m_functions,
            externals=self.externals,
            zero_offsets={int(k): v for k, v in self.zero_offsets.items()},
            g_programs={int(k): v for k, v in self.channel.g_programs.items()},
            m6_program=self.channel.m6_program,
            velocity=self.axis_values("v_max_mm_s"),
            acceleration=self.axis_values("a_max_mm_s2"),
            limits=(self.axis_values("min_mm"), self.axis_values("max_mm")),
            dialects=(
                self.isons.machine,
                OsaiCell(
                    self.osai.feed == "arc",
                    self.osai.location == "centre",
                    25.4 if self.osai.setup_unit == "inch" else 1.0,
                ),
            ),
            probe=dict(self.probe),
            equidistant="FCT_EXTENSION_EQUIDIST" in self.channel.functions,
            hsc_settings={
                str(state): HscSetting(h.prog or h.prg, h.tolerance * 1e-4)
                for state, h in self.channel.hscs.items()
            },
            axis_ids=self.axis_ids,
            guests=self.guests,
            kinematics=self.kinematic_machines,
            kin_id=self.kin_id,
            repeated_blocks_max=self.channel.repeated_blocks_max,
        )

    def warnings(self) -> list[str]:
        """What is accepted but does not act as written."""
        out = [
            f"P-CHAN-00650: unknown identifier {w!r} is ignored"
            for w in sorted(self.channel.functions - KNOWN_FUNCTIONS)
        ]
        out += [
            f"hscs.{state}.prg: the name is hscs.{state}.prog"
            for state, h in self.channel.hscs.items()
            if h.prg
        ]
        out += [
            f"P-CHAN-00650: {name} has no effect: {why}"
            for name, why in WITHOUT_EFFECT.items()
            if name in self.channel.functions
        ]
        out += self.isons.warnings()
        entries, window = (
            self.channel.contour_lookahead_log_max,
            self.channel.window,
        )
        if self.channel.contour_lah and 0 < entries < window:
            out.append(
                f"P-CHAN-00658: {entries} log entries hold less than the {window} "
                "blocks of the look-ahead (P-CHAN-00650): "
                f"mode 2 tells at most {entries} elements ahead"
            )
        if 0 < self.channel.fb_storage_size < MIN_FB_STORAGE:
            out.append(
                f"P-STUP-00033: fb_storage_size raised to the minimum of {MIN_FB_STORAGE} bytes"
            )
        return out
