"""The PLC side: connection, scan runtime, function blocks."""

from hli.errors import (
    HliAccessError,
    HliError,
    HliInUse,
    HliNotConfigured,
    HliNotFound,
    HliNotReady,
    HliTimeout,
    HliVersionError,
)

from . import blocks as _blocks
from .blocks import *  # noqa: F403 (every function block, by the names of blocks.__all__)
from .client import Hli, connect
from .iec import CTD, CTU, CTUD, F_TRIG, R_TRIG, RS, SR, TOF, TON, TP
from .inputs import Input, Step
from .task import PlcError, task

__all__ = [
    "CTD",
    "CTU",
    "CTUD",
    "F_TRIG",
    "RS",
    "R_TRIG",
    "SR",
    "TOF",
    "TON",
    "TP",
    "Hli",
    "HliAccessError",
    "HliError",
    "HliInUse",
    "HliNotConfigured",
    "HliNotFound",
    "HliNotReady",
    "HliTimeout",
    "HliVersionError",
    "Input",
    "PlcError",
    "Step",
    "connect",
    "task",
]
__all__ += _blocks.__all__
