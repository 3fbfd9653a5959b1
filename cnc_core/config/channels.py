"""The channels of a cell: ``[channels.NAME]`` of a cell file.

Each table is a channel's part of the cell; ``setups`` joins it with what stands
at the top for all channels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from .axes import AxisConfig, SpindleConfig
from .channel import ChannelConfig
from .external import ExternalConfig
from .isons import IsonsConfig
from .kinematics import KinematicsConfig
from .osai import OsaiConfig
from .tools import ToolConfig
from .values import Finite, Table


class ChannelTables(Table):
    """Tables that a channel may have of its own, and a cell for all of them."""

    tools: dict[str, ToolConfig] = Field(default_factory=dict)
    external: dict[str, ExternalConfig] = Field(default_factory=dict)
    zero_offsets: dict[str, dict[str, Finite]] = Field(default_factory=dict)
    isons: IsonsConfig = Field(default_factory=IsonsConfig)
    osai: OsaiConfig = Field(default_factory=OsaiConfig)
    probe: dict[str, Finite] = Field(default_factory=dict)
    kinematics: dict[str, KinematicsConfig] = Field(default_factory=dict)
    spindles: dict[str, SpindleConfig] = Field(default_factory=dict)


class ChannelTable(ChannelConfig, ChannelTables):
    """One channel of several: parameters of ``[channel]``, and what else the
    channel has of its own.

    ``program``: what it executes where the command line names none, relative to
    the cell file.  ``guest_axes``: logical numbers of axes of other channels
    that may come into this one; each makes a place behind the channel's own.
    """

    axes: dict[str, AxisConfig]
    guest_axes: list[Annotated[int, Field(ge=1, le=65535)]] = Field(
        default_factory=list
    )
    program: str = ""
    dialect: Literal["isg", "iso", "isons", "osai"] | None = None


@dataclass(frozen=True)
class ChannelPlace:
    """Where a channel stands in the HLI.

    ``index``: of ``gpCh``.  ``name``: empty in a cell with one channel.
    ``axis_base``: index in ``gpAx`` of its first axis; its spindles follow.
    """

    index: int = 0
    name: str = ""
    axis_base: int = 0

    def __str__(self) -> str:
        return f"channel {self.name}" if self.name else "the channel"
