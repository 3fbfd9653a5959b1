"""What can go wrong with the shared memory, by name and number (``code``)."""

# ruff: noqa: N818 (the names are promised to users: HliNotFound, HliInUse ...)

from __future__ import annotations


class HliError(Exception):
    """Base of all errors of the HLI's shared memory."""

    code = 905000


class HliNotFound(HliError):
    """There is no segment of this name, or the process that owned it is gone."""

    code = 905010


class HliNotReady(HliError):
    """The segment exists but its creator has not published it yet."""

    code = 905011


class HliVersionError(HliError):
    """Magic, ABI version, size or layout hash differ; the message names which
    and gives both values.
    """

    code = 905012


class HliAccessError(HliError):
    """The segment belongs to another user or is open to other users."""

    code = 905013


class HliInUse(HliError):
    """The name is held by a living process, or the segment already has a living PLC."""

    code = 905002


class HliNotConfigured(HliError, IndexError, ValueError):
    """A channel or axis that the CNC does not have: its pointer is NULL."""

    code = 905016


class HliTimeout(HliError):
    """The other side did not answer in time."""

    code = 905014


class HliLost(HliError):
    """The memory was cut or written over by another process while in use."""

    code = 905017
