"""The HLI: layout, shared memory, handshake."""

from .errors import (
    HliAccessError,
    HliError,
    HliInUse,
    HliNotConfigured,
    HliNotFound,
    HliNotReady,
    HliTimeout,
    HliVersionError,
)
from .segment import Segment, attach, create, sweep
from .view import Areas

__all__ = [
    "Areas",
    "HliAccessError",
    "HliError",
    "HliInUse",
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
