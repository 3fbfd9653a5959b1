"""What the front end may ask the running channel, and how it says that it has to wait for it.

Values that come from the machine or the PLC pass through one ``ChannelPort``; it latches them at a stated cycle, so a
lockstep run is the same every time.
"""

from __future__ import annotations

from enum import Enum
from typing import Protocol

import numpy as np
import numpy.typing as npt


class Wait(Enum):
    """Why ``FrontEnd.read`` stopped before the end: resume by calling it again when this has come true."""

    DRAINED = "drained"  # every row handed out so far has been executed
    PLC = "plc"  # the PLC has answered
    OPERATOR = "operator"  # the operator has answered
    PROBE = "probe"  # the measuring event has happened


class ChannelPort(Protocol):
    """The channel as the front end sees it."""

    @property
    def answers(self) -> bool:
        """Waits are answered by a machine that moves; a program may wait as long as it likes."""
        ...

    def position(self) -> npt.NDArray[np.float64]:
        """Command position of all channel axes, mm or degrees, latched when the last wait came true."""
        ...

    def message(self, text: str) -> None:
        """A line for the operator (warnings, #MSG)."""
        ...


class OfflinePort:
    """A channel that does not move: waits are true at once, messages are kept."""

    answers = False

    def __init__(self, position: npt.NDArray[np.float64]) -> None:
        self._position = np.array(position, dtype=np.float64)
        self.messages: list[str] = []

    def position(self) -> npt.NDArray[np.float64]:
        return self._position.copy()

    def message(self, text: str) -> None:
        self.messages.append(text)
