"""Cell configuration: ``cell.toml`` into validated values.

Unknown keys are errors that name the nearest known one.
Every number has its range.
Names follow the parameters of the manual where there is one
(P-CHAN-00650 and friends, see ``docs/reference/glossary.md``).
"""

from __future__ import annotations

from .axes import LEAST_JERK, SPINDLE_SYNCH, AxisConfig, SpindleConfig
from .cell import CellConfig
from .channel import (
    KNOWN_FUNCTIONS,
    LOOKAHEAD_BLOCKS,
    MIN_FB_STORAGE,
    WITHOUT_EFFECT,
    ChannelConfig,
    HscsConfig,
)
from .channels import ChannelPlace
from .external import EXTERNAL_BLOCKS, ExternalConfig
from .isons import IsonsConfig
from .kinematics import KinematicsConfig
from .osai import OsaiConfig
from .reading import load_config, parse_config
from .setups import ChannelSetup, setups_of
from .synchronisation import (
    DEFAULT_M_SYNCH,
    SYNCH,
    SYNCH_BASES,
    SYNCH_FLAGS,
    SynchName,
    synch_value,
)
from .tools import ToolConfig
from .values import Finite, Moving, NotNegative, Uns32

__all__ = [
    "DEFAULT_M_SYNCH",
    "EXTERNAL_BLOCKS",
    "KNOWN_FUNCTIONS",
    "LEAST_JERK",
    "LOOKAHEAD_BLOCKS",
    "MIN_FB_STORAGE",
    "SPINDLE_SYNCH",
    "SYNCH",
    "SYNCH_BASES",
    "SYNCH_FLAGS",
    "WITHOUT_EFFECT",
    "AxisConfig",
    "CellConfig",
    "ChannelConfig",
    "ChannelPlace",
    "ChannelSetup",
    "ExternalConfig",
    "Finite",
    "HscsConfig",
    "IsonsConfig",
    "KinematicsConfig",
    "Moving",
    "NotNegative",
    "OsaiConfig",
    "SpindleConfig",
    "SynchName",
    "ToolConfig",
    "Uns32",
    "load_config",
    "parse_config",
    "setups_of",
    "synch_value",
]
