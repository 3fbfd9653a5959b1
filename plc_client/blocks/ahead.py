"""What the look-ahead extension says of its answers, as names."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from hli import layout
from hli.view import root_of


class EmptyReason(IntEnum):
    """Why an answer of the look-ahead holds nothing (HLI_AHEAD_EMPTY_*)."""

    NOT_EMPTY = layout.HLI_AHEAD_NOT_EMPTY
    DISABLED = layout.HLI_AHEAD_EMPTY_DISABLED
    """The function, or its memory, is not configured."""
    NOT_KNOWN = layout.HLI_AHEAD_EMPTY_NOT_KNOWN
    """Nothing is known there yet: ask again."""
    BEHIND_END = layout.HLI_AHEAD_EMPTY_BEHIND_END
    """Behind the end of the program, or of the marked area."""
    BEFORE_RESET = layout.HLI_AHEAD_EMPTY_BEFORE_RESET
    """A distance reset, or the end of a real-time loop, is still ahead: what
    lies behind it belongs to the next epoch."""
    DROPPED = layout.HLI_AHEAD_EMPTY_DROPPED
    """In front of everything that is kept."""
    BAD_START = layout.HLI_AHEAD_EMPTY_BAD_START
    BAD_LENGTH = layout.HLI_AHEAD_EMPTY_BAD_LENGTH
    BAD_MODE = layout.HLI_AHEAD_EMPTY_BAD_MODE
    BAD_EPOCH = layout.HLI_AHEAD_EMPTY_BAD_EPOCH
    BAD_FLAGS = layout.HLI_AHEAD_EMPTY_BAD_FLAGS


class ContourEnd(IntEnum):
    """What ends that which is known (HLI_AHEAD_END_*)."""

    OPEN = layout.HLI_AHEAD_END_OPEN
    """More will come."""
    RESET = layout.HLI_AHEAD_END_RESET
    LOOP = layout.HLI_AHEAD_END_LOOP
    PROGRAM = layout.HLI_AHEAD_END_PROGRAM
    LOG = layout.HLI_AHEAD_END_LOG
    """The marked area is closed."""


def extension_of(ch: Any) -> Any:
    """The extension of a channel, or None."""
    root: Any = root_of(ch)
    for channel, area in zip(root.channel, root.ahead, strict=False):
        if channel._address == ch._address:
            return area
    return None
