"""The PLC side: connection, scan runtime, function blocks."""

from hli.errors import (
    HliAccessError,
    HliError,
    HliInUse,
    HliNotFound,
    HliNotReady,
    HliTimeout,
    HliVersionError,
)

from .blocks import AcknowledgeAll, AutoContinue, ContourLookahead, FeedControl, TechnoFunction
from .client import Hli, connect
from .iec import CTD, CTU, CTUD, F_TRIG, R_TRIG, RS, SR, TOF, TON, TP
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
    "AcknowledgeAll",
    "AutoContinue",
    "ContourLookahead",
    "FeedControl",
    "Hli",
    "HliAccessError",
    "HliError",
    "HliInUse",
    "HliNotFound",
    "HliNotReady",
    "HliTimeout",
    "HliVersionError",
    "PlcError",
    "TechnoFunction",
    "connect",
    "task",
]
