"""What can go wrong with the shared memory, by name."""

# ruff: noqa: N818 (the names are promised to users: HliNotFound, HliInUse ...)

from __future__ import annotations


class HliError(Exception):
    """Base of all errors of the HLI's shared memory."""


class HliNotFound(HliError):
    """There is no segment of this name, or the process that owned it is gone."""


class HliNotReady(HliError):
    """The segment exists but its creator has not published it yet."""


class HliVersionError(HliError):
    """Magic, ABI version, size or layout hash differ; the message names which and gives both values."""


class HliAccessError(HliError):
    """The segment belongs to another user or is open to other users."""


class HliInUse(HliError):
    """The name is held by a living process, or the segment already has a living PLC."""


class HliTimeout(HliError):
    """The other side did not answer in time."""
