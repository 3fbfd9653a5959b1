"""The table ``[channel]`` of a cell file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from .synchronisation import SynchName
from .values import NotNegative, Table, Uns32

# P-STUP-00033: smaller values other than 0 are raised to it, with a warning
MIN_FB_STORAGE = 65536
LOOKAHEAD_BLOCKS = {  # low, standard, high by build generation
    "2.11.28+": {"LOW": 30, "STANDARD": 120, "HIGH": 190},
    "2.11.20": {"LOW": 30, "STANDARD": 70, "HIGH": 120},
}
KNOWN_FUNCTIONS = {
    "FCT_IPO_DEFAULT",
    "FCT_LOOK_AHEAD_LOW",
    "FCT_LOOK_AHEAD_STANDARD",
    "FCT_LOOK_AHEAD_HIGH",
    "FCT_LOOK_AHEAD_CUSTOM",
    "FCT_LOOK_AHEAD_OPT",
    "FCT_SYNC",
    "FCT_LIFT_UP_TIME",
    "FCT_SHIFT_NCBL",
    "FCT_CALC_STATE_AT_T",
    "FCT_CALC_TIME",
    "FCT_CALC_POS_V_0",
    "FCT_CONTOUR_LAH",
    "FCT_DYN_POS_LIMIT",
    "FCT_EXTENSION_EQUIDIST",
    "FCT_DLM",
}
# Identifiers that are accepted and do nothing here, and why.
WITHOUT_EFFECT = {
    "FCT_LOOK_AHEAD_OPT": "the planner always computes the best path velocity within its window",
    "FCT_SYNC": "there are no independent axes that could be synchronised to the path",
    "FCT_LIFT_UP_TIME": "there is no lifting axis",
    "FCT_SHIFT_NCBL": "M functions are shifted by their synchronisation (MEP_SVS, MET_SVS) alone",
    "FCT_DYN_POS_LIMIT": "position limits are those of the cell, checked when blocks are prepared",
    "FCT_DLM": "there is no conveyor that could be tracked",
}


class HscsConfig(Table):
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


class StartupConfig(Table):
    """Start-up parameters that channel parameters of the same name replace."""

    interpolator_function: str | None = None
    contour_lookahead_log_max: (
        Annotated[int, Field(ge=0, lt=0xFFFFFFFF)] | None
    ) = None

    def filling(self, channel: Mapping[str, Any]) -> dict[str, Any]:
        """The values that the channel's table leaves open."""
        given = set(channel)
        if "fct_enable" in given:  # the other name of P-CHAN-00650
            given.add("interpolator_function")
        values = self.model_dump(exclude_none=True)
        return {key: v for key, v in values.items() if key not in given}


class ChannelConfig(Table):
    """Channel parameters."""

    interpolator_function: str = "FCT_IPO_DEFAULT | FCT_CONTOUR_LAH"
    fct_enable: str = ""
    build_generation: Literal["2.11.28+", "2.11.20"] = "2.11.28+"
    lookahead_blocks_max: Annotated[int, Field(ge=10, le=10000)] = 120
    lookahead_blocks: Annotated[int, Field(ge=10, le=10000)] = 120
    tolerance_mm: NotNegative = 0.0
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
    repeated_blocks_max: Annotated[int, Field(ge=0)] = 100_000
    skip_levels: list[Annotated[int, Field(ge=1, le=10)]] = Field(
        default_factory=list
    )
    hscs: dict[
        Literal["deselect", "rough", "prefinish", "finish"], HscsConfig
    ] = Field(default_factory=dict)
    state_after_program: Literal["SELECTED", "READY"] = "SELECTED"

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
