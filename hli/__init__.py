"""The HLI: layout, shared memory, handshake."""

from .areas import Areas
from .errors import (
    HliAccessError,
    HliError,
    HliInUse,
    HliLost,
    HliNotConfigured,
    HliNotFound,
    HliNotReady,
    HliTimeout,
    HliVersionError,
)
from .segment import Segment, attach, create, sweep

__all__ = [
    "Areas",
    "HliAccessError",
    "HliError",
    "HliInUse",
    "HliLost",
    "HliNotConfigured",
    "HliNotFound",
    "HliNotReady",
    "HliTimeout",
    "HliVersionError",
    "Segment",
    "attach",
    "create",
    "sweep",
]
