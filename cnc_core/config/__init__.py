"""Cell configuration: ``cell.toml`` into validated values.

Unknown keys are errors that name the nearest known one; every number has its
range.  Names follow the parameters of the manual where there is one
(P-CHAN-00650 and friends, see ``docs/reference/glossary.md``).
"""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from ..blocks import NC_AXES
from ..errors import ConfigError, Place
from ..frontend.isons.base.machine import EVENT_PLACE, EVENT_SLOTS, IO_BLOCKS
from ..frontend.machine import (
    External,
    HscSetting,
    OsaiCell,
    ProgramMachine,
    Tool,
)
from ..kinematics.machine import Kinematics
from .isons import IsonsConfig
from .kinematics import KinematicsConfig

EXTERNAL_BLOCKS = 1000  # 24-byte blocks of one area of external variables
# P-STUP-00033: smaller values other than 0 are raised to it, with a warning
MIN_FB_STORAGE = 65536
# mm/s3: motions with less last so long that positions round to more than that
LEAST_JERK = 1.0
LOOKAHEAD_BLOCKS = {  # low, standard, high by build generation
    "2.11.28+": {"LOW": 30, "STANDARD": 120, "HIGH": 190},
    "2.11.20": {"LOW": 30, "STANDARD": 70, "HIGH": 120},
}
KNOWN_FUNCTIONS = {
    "FCT_IPO_DEFAULT", "FCT_LOOK_AHEAD_LOW", "FCT_LOOK_AHEAD_STANDARD", "FCT_LOOK_AHEAD_HIGH",
    "FCT_LOOK_AHEAD_CUSTOM", "FCT_SYNC", "FCT_LOOK_AHEAD_OPT", "FCT_LIFT_UP_TIME", "FCT_SHIFT_NCBL",
    "FCT_CALC_STATE_AT_T", "FCT_CALC_TIME", "FCT_CONTOUR_LAH", "FCT_DYN_POS_LIMIT", "FCT_EXTENSION_EQUIDIST",
    "FCT_CALC_POS_V_0", "FCT_DLM",
}  # fmt: skip
# Identifiers that are accepted and do nothing here, and why.
WITHOUT_EFFECT = {
    "FCT_SYNC": "there are no independent axes that could be synchronised to the path",
    "FCT_LIFT_UP_TIME": "there is no lifting axis",
    "FCT_SHIFT_NCBL": "M functions are shifted by their synchronisation (MEP_SVS, MET_SVS) alone",
    "FCT_DYN_POS_LIMIT": "position limits are those of the cell, checked when blocks are prepared",
    "FCT_DLM": "there is no conveyor that could be tracked",
}
# Synchronisation of the M functions of the built-in machine (P-CHAN-00041);
# what is absent is undefined.
DEFAULT_M_SYNCH: dict[int, str] = dict.fromkeys(
    (0, 1, 2, 3, 4, 5, 17, 19, 29, 30), "NO_SYNCH"
) | dict.fromkeys((6, 7, 8, 9, 10, 11, 40, 41, 42, 43, 44, 45), "NO_SYNCH")
SYNCH_BASES = (
    *("NO_SYNCH", "MOS", "MVS_SVS", "MVS_SNS", "MNS_SNS", "MNE_SNS"),
    *("MVS_SLM", "MVS_SLP", "MEP_SVS", "MET_SVS"),
)
SYNCH_FLAGS = ("BWD_SYNCH", "FWD_SYNCH")
SYNCH: dict[str, int] = {  # values of P-CHAN-00041 (hli_reference 6.4)
    "NO_SYNCH": 0,
    "MOS": 0x1,
    "MVS_SVS": 0x2,
    "MVS_SNS": 0x4,
    "MNS_SNS": 0x8,
    # 0x20; the front end puts it where the probe trips, from there it acts as
    # MVS_SNS
    "MNE_SNS": 0x4,
    "MVS_SLM": 0x4000,
    "MVS_SLP": 0x8000,
    "MEP_SVS": 0x1000000,
    "MET_SVS": 0x2000000,
    "BWD_SYNCH": 0x400000,
    "FWD_SYNCH": 0x800000,
}


def synch_value(text: str) -> int:
    """Value of a synchronisation type: one base type, flags joined by ``|``.
    ValueError if it is none.
    """
    words = [word.strip() for word in text.split("|")]
    unknown = [word for word in words if word not in SYNCH]
    if unknown:
        near = difflib.get_close_matches(unknown[0], SYNCH, n=1, cutoff=0.0)[0]
        raise ValueError(
            f"unknown synchronisation type {unknown[0]!r}; did you mean {near!r}?"
        )
    bases = [word for word in words if word in SYNCH_BASES]
    if len(bases) != 1 or len(set(words)) < len(words):
        raise ValueError(
            f"{text!r}: one of {', '.join(SYNCH_BASES)}, and flags {', '.join(SYNCH_FLAGS)} with |"
        )
    value = 0
    for word in words:
        value |= SYNCH[word]
    return 0 if bases == ["NO_SYNCH"] else value


def _checked_synch(text: str) -> str:
    synch_value(text)
    return text


SynchName = Annotated[str, AfterValidator(_checked_synch)]


def _ends_motions(limit: float) -> float:
    if limit < 1e-6:
        raise ValueError("no motion ends with less than 0.000001")
    return limit


Moving = Annotated[
    float,
    Field(gt=0, lt=1e12, allow_inf_nan=False),
    AfterValidator(_ends_motions),
]
Finite = Annotated[float, Field(gt=-1e12, lt=1e12, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, lt=1e12, allow_inf_nan=False)]
Uns32 = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class AxisConfig(_Table):
    """One axis; for ``kind = "rotary"`` read degrees for mm in every name."""

    kind: Literal["linear", "rotary"] = "linear"
    v_max_mm_s: Moving = 300.0
    a_max_mm_s2: Moving = 3000.0
    j_max_mm_s3: NotNegative = 50000.0
    min_mm: Finite = -100000.0
    max_mm: Finite = 100000.0
    start_mm: Finite = 0.0
    id: Annotated[int, Field(ge=1, le=65535)] | None = None

    @model_validator(mode="after")
    def _ordered(self) -> AxisConfig:
        if 0.0 < self.j_max_mm_s3 < LEAST_JERK:
            raise ValueError(
                f"j_max_mm_s3 {self.j_max_mm_s3:g} is below {LEAST_JERK:g} mm/s3 (0: no limit)"
            )
        if self.min_mm >= self.max_mm:
            raise ValueError(
                f"min_mm {self.min_mm:g} is not below max_mm {self.max_mm:g}"
            )
        if not self.min_mm <= self.start_mm <= self.max_mm:
            raise ValueError(
                f"start_mm {self.start_mm:g} lies outside min_mm..max_mm"
            )
        return self


class ToolConfig(_Table):
    """Tool data set ``D``."""

    radius_mm: Finite = 0.0
    length_mm: Finite = 0.0
    kin_id: Annotated[int, Field(ge=1, le=999)] | None = None


class ExternalConfig(_Table):
    """A variable ``V.E.<name>`` that the program shares with the PLC, in
    24-byte blocks.

    ``block``: the first one, counted from 1; by default the next free one of
    its scope, in the order of the file.
    """

    type: Literal[
        "BOOLEAN",
        "SGN08",
        "UNS08",
        "SGN16",
        "UNS16",
        "SGN32",
        "UNS32",
        "REAL64",
        "STRING",
    ] = "REAL64"
    scope: Literal["channel", "global"] = "channel"
    block: Annotated[int, Field(ge=1, le=1000)] | None = None
    size: Annotated[int, Field(ge=1, le=1000)] | None = None
    characters: Annotated[int, Field(ge=1, le=126)] = 23
    synchronised: bool = True


SPINDLE_SYNCH = Literal["NO_SYNCH", "MOS", "MVS_SVS", "MVS_SNS", "MNS_SNS"]


class SpindleConfig(_Table):
    """A spindle: an axis area behind those of the channel's axes, with the
    synchronisation of its functions.
    """

    id: Annotated[int, Field(ge=1, le=65535)]
    m3_synch: SPINDLE_SYNCH = "NO_SYNCH"
    m4_synch: SPINDLE_SYNCH = "NO_SYNCH"
    m5_synch: SPINDLE_SYNCH = "NO_SYNCH"
    m19_synch: SPINDLE_SYNCH = "NO_SYNCH"
    s_synch: SPINDLE_SYNCH = "NO_SYNCH"

    @property
    def functions(self) -> dict[int, str]:
        """Synchronisation by M number; 0: an S word alone."""
        return {
            3: self.m3_synch,
            4: self.m4_synch,
            5: self.m5_synch,
            19: self.m19_synch,
            0: self.s_synch,
        }


class OsaiConfig(_Table):
    """10-Series programs: what the manual leaves open (docs/reference/osai.md).

    ``feed``: of polynomials and B-splines, that of their parameter or along the
    arc.  ``location``: where a cutter location point lies on a ball or toroidal
    tool.
    """

    feed: Literal["parameter", "arc"] = "parameter"
    location: Literal["tip", "centre"] = "tip"


class HscsConfig(_Table):
    """One state of SysHscSettings (``hscs.*``): subprogram, tolerance in 0.1
    um.  ``prg``: another spelling of prog.
    """

    prog: str = ""
    prg: str = ""
    tolerance: NotNegative = 0.0

    @model_validator(mode="after")
    def _one_name(self) -> HscsConfig:
        if self.prog and self.prg:
            raise ValueError("prog and prg name the same: give prog alone")
        return self


class ChannelConfig(_Table):
    """Channel parameters."""

    interpolator_function: str = "FCT_IPO_DEFAULT | FCT_CONTOUR_LAH"
    fct_enable: str = ""
    build_generation: Literal["2.11.28+", "2.11.20"] = "2.11.28+"
    lookahead_blocks_max: Annotated[int, Field(ge=10, le=10000)] = 120
    lookahead_blocks: Annotated[int, Field(ge=10, le=10000)] = 120
    contour_lookahead_log_max: Annotated[int, Field(ge=0, lt=0xFFFFFFFF)] = 128
    fb_storage_size: Uns32 = 1_000_000
    service: Literal["cyclic", "immediate"] = "cyclic"
    rapid_override_mode: Annotated[int, Field(ge=0, le=3)] = 0
    m_synch: dict[str, SynchName] = Field(default_factory=dict)
    h_synch: dict[str, SynchName] = Field(default_factory=dict)
    tool_synch: SynchName = "NO_SYNCH"
    m_pre_outp: dict[str, NotNegative] = Field(default_factory=dict)
    g_programs: dict[str, str] = Field(default_factory=dict)
    m6_program: str = ""
    esa_time: Annotated[list[NotNegative], Field(max_length=3)] = Field(
        default_factory=list
    )
    kin_id: Annotated[int, Field(ge=0, le=999)] | None = None
    skip_levels: list[Annotated[int, Field(ge=1, le=10)]] = Field(
        default_factory=list
    )
    hscs: dict[
        Literal["deselect", "rough", "prefinish", "finish"], HscsConfig
    ] = Field(default_factory=dict)

    @field_validator("g_programs")
    @classmethod
    def _user_codes(cls, value: dict[str, str]) -> dict[str, str]:
        for key in value:
            if not (
                key.isdigit()
                and key == str(int(key))
                and (80 <= int(key) <= 89 or 800 <= int(key) <= 839)
            ):
                raise ValueError(
                    f"{key!r} is none of the G functions 80..89, 800..839"
                )
        return value

    state_after_program: Literal["SELECTED", "READY"] = "SELECTED"

    @field_validator("m_synch", "h_synch", "m_pre_outp")
    @classmethod
    def _numbers(cls, value: dict[str, Any]) -> dict[str, Any]:
        for key in value:
            if not key.isdigit() or int(key) > 65535 or key != str(int(key)):
                raise ValueError(
                    f"{key!r} is not a function number 0..65535 (without leading zeros)"
                )
        return value

    @model_validator(mode="after")
    def _custom_in_range(self) -> ChannelConfig:
        if (
            "FCT_LOOK_AHEAD_CUSTOM" in self.functions
            and self.lookahead_blocks > self.lookahead_blocks_max
        ):
            raise ValueError(
                f"lookahead_blocks {self.lookahead_blocks} exceeds lookahead_blocks_max"
            )
        return self

    @property
    def functions(self) -> set[str]:
        """Identifiers of P-CHAN-00650 and its alias, joined."""
        words = f"{self.interpolator_function}|{self.fct_enable}".split("|")
        return {w.strip() for w in words if w.strip()}

    @property
    def contour_lah(self) -> bool:
        return "FCT_CONTOUR_LAH" in self.functions

    @property
    def window(self) -> int:
        """Look-ahead blocks N; of several sizes named together the largest wins."""
        sizes = LOOKAHEAD_BLOCKS[self.build_generation]
        named = [
            n
            for name, n in sizes.items()
            if f"FCT_LOOK_AHEAD_{name}" in self.functions
        ]
        if "FCT_LOOK_AHEAD_CUSTOM" in self.functions:
            named.append(self.lookahead_blocks)
        return max(named, default=sizes["STANDARD"])

    @property
    def storage(self) -> int:
        """Backward-motion memory in bytes, raised to the minimum unless 0."""
        return (
            0
            if self.fb_storage_size == 0
            else max(MIN_FB_STORAGE, self.fb_storage_size)
        )


def _default_axes() -> dict[str, AxisConfig]:
    return {name: AxisConfig() for name in "XYZ"}


class CellConfig(_Table):
    """One cell: a machine with one channel."""

    name: str = "cell"
    cycle_s: Annotated[float, Field(ge=1e-5, le=0.1, allow_inf_nan=False)] = (
        0.001
    )
    axes: dict[str, AxisConfig] = Field(default_factory=_default_axes)
    channel: ChannelConfig = Field(default_factory=ChannelConfig)
    tools: dict[str, ToolConfig] = Field(default_factory=dict)
    external: dict[str, ExternalConfig] = Field(default_factory=dict)
    zero_offsets: dict[str, dict[str, Finite]] = Field(default_factory=dict)
    isons: IsonsConfig = Field(default_factory=IsonsConfig)
    osai: OsaiConfig = Field(default_factory=OsaiConfig)
    probe: dict[str, Finite] = Field(default_factory=dict)
    kinematics: dict[str, KinematicsConfig] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _isons_axes(cls, data: Any) -> Any:
        """IsoNs machine parameters set what the axes' tables leave open."""
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

    spindles: dict[str, SpindleConfig] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _numbers_differ(self) -> CellConfig:
        ids = [axis.id or i for i, axis in enumerate(self.axes.values(), 1)] + [
            s.id for s in self.spindles.values()
        ]
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
                or name[0] not in "XYZUVWQABC"
                or name != name.upper()
            ):
                raise ValueError(
                    f"axis name {name!r}: letters and digits, upper case, beginning with one of XYZUVWQABC"
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
    def axis_names(self) -> tuple[str, ...]:
        return tuple(self.axes)

    @property
    def main_axes(self) -> tuple[int, int, int]:
        """Channel index of X, Y, Z by name; -1 where the machine has none."""
        names = self.axis_names
        x, y, z = (names.index(n) if n in names else -1 for n in "XYZ")
        return x, y, z

    @model_validator(mode="after")
    def _kinematics_fit(self) -> CellConfig:
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
                    f"kinematics {key}: the tip is programmed with X, Y and Z, which the machine lacks"
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

    def axis_values(self, key: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """(axes,) one parameter of every axis."""
        return np.array(
            [getattr(a, key) for a in self.axes.values()], dtype=np.float64
        )

    def program_machine(
        self, start: np.ndarray[Any, np.dtype[np.float64]] | None = None
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
            limits=(self.axis_values("min_mm"), self.axis_values("max_mm")),
            dialects=(
                self.isons.machine,
                OsaiCell(
                    self.osai.feed == "arc", self.osai.location == "centre"
                ),
            ),
            probe=dict(self.probe),
            equidistant="FCT_EXTENSION_EQUIDIST" in self.channel.functions,
            hsc_settings={
                str(state): HscSetting(h.prog or h.prg, h.tolerance * 1e-4)
                for state, h in self.channel.hscs.items()
            },
            axis_ids=tuple(
                a.id or i for i, a in enumerate(self.axes.values(), 1)
            ),
            kinematics=self.kinematic_machines,
            kin_id=self.kin_id,
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
        if 0 < self.channel.fb_storage_size < MIN_FB_STORAGE:
            out.append(
                f"P-STUP-00033: fb_storage_size raised to the minimum of {MIN_FB_STORAGE} bytes"
            )
        return out


def _known_keys(path: tuple[Any, ...]) -> list[str]:
    tables: dict[str, type[BaseModel]] = {
        "axes": AxisConfig,
        "tools": ToolConfig,
        "external": ExternalConfig,
        "spindles": SpindleConfig,
        "kinematics": KinematicsConfig,
        "isons": IsonsConfig,
    }
    if len(path) == 1:
        return list(CellConfig.model_fields)
    if path[0] in ("isons", "osai") and len(path) == 2:
        return list(
            (IsonsConfig if path[0] == "isons" else OsaiConfig).model_fields
        )
    model = ChannelConfig if path[0] == "channel" else tables.get(str(path[0]))
    return list(model.model_fields) if model else []


def _message(error: Any) -> str:
    path = tuple(error["loc"])
    where = ".".join(str(p) for p in path)
    if error["type"] != "extra_forbidden":
        text = str(error["msg"]).removeprefix("Value error, ")
        return f"{where}: {text}" if where else text
    near = difflib.get_close_matches(
        str(path[-1]), _known_keys(path), n=1, cutoff=0.0
    )
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"{where}: unknown key{hint}"


def _toml_place(file: str, text: str, message: str) -> Place:
    """Place of a TOML syntax error, which tomllib only tells in its message."""
    match = re.search(r"at line (\d+), column (\d+)", message)
    lines = text.splitlines() or [""]
    line, column = (int(match[1]), int(match[2])) if match else (len(lines), 1)
    return Place(file, line, column, lines[min(line, len(lines)) - 1])


def _line_of(text: str, key: str) -> int:
    """First line that mentions the key, 0 if none does."""
    lines = text.splitlines()
    return next(
        (
            i
            for i, line in enumerate(lines, 1)
            if line.strip().startswith((key, f"[{key}")) or f".{key}" in line
        ),
        0,
    )


def parse_config(text: str, file: str = "") -> CellConfig:
    """Validated configuration from TOML text; ConfigError with the place of the
    first mistake.
    """
    try:
        return CellConfig.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(
            f"not TOML: {error}", _toml_place(file, text, str(error))
        ) from None
    except ValidationError as error:
        first = error.errors()[0]
        named = re.search(r"machine parameter (\w+)", first["msg"])
        key = (
            named[1] if named else str(first["loc"][-1]) if first["loc"] else ""
        )
        line = _line_of(text, key) if key else 0
        source = text.splitlines()[line - 1] if line else ""
        raise ConfigError(
            "; ".join(_message(e) for e in error.errors()),
            Place(file, line, 1, source),
        ) from None


def load_config(path: str | Path | None) -> CellConfig:
    """Configuration of a file, or the built-in machine (X Y Z) for None."""
    if path is None:
        return CellConfig()
    try:
        text = Path(path).read_text()
    except FileNotFoundError:
        raise ConfigError(
            "configuration file not found", Place(str(path))
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"configuration cannot be read: {error}", Place(str(path))
        ) from None
    return parse_config(text, str(path))
