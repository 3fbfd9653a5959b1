"""Questions of a front end to the running channel, and its waits.

Values of the machine or the PLC pass through one ``ChannelPort``. The port
latches them at a stated cycle. A lockstep run is therefore the same every time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..files import Quota
from ..units import FloatArray
from .axes import ChannelAxes
from .jobs import ChannelJobs, OpenJobs
from .machine import External
from .operator import Answer, Operator, Question
from .signals import ChannelSignals

ExternalValue = float | str
RT_CYCLES = 16  # in one channel
RT_OPS, RT_DEPTH = 512, 32  # of one real-time cycle: instructions, values held
RT_DELETED, RT_HELD, RT_RUNNING, RT_STARTED = range(4)


class RtOp(NamedTuple):
    """An instruction of a real-time cycle: ``engine_rt_op``."""

    code: int
    kind: int = 0
    area: int = 0
    at: int = 0
    value: float = 0.0


MESSAGES_KEPT = 10_000


def keep(texts: list[str], text: str, most: int) -> None:
    """Add a text that somebody else can cause as often as he likes.

    ``most``: no more are kept.
    """
    if len(texts) < most:
        texts.append(text)
    elif len(texts) == most:
        texts.append("further messages are not kept")


class Condition(NamedTuple):
    """What a program waits for until it is true, how people call it, and who
    makes it so.
    """

    true: Callable[[], bool]
    said: str
    who: str


class Wait(Enum):
    """Why ``FrontEnd.read`` stopped before the end: resume by calling it again
    when this has come true.
    """

    DRAINED = "drained"  # every row handed out so far has been executed
    PLC = "plc"  # the PLC has answered
    OPERATOR = "operator"  # the operator has answered
    PROBE = "probe"  # the measuring event has happened
    AXES = "axes"  # the exchange of axes that was asked for is done
    SIGNAL = "signal"  # another channel has sent what was waited for
    CONDITION = "condition"  # ``ChannelPort.condition`` is true
    CYCLE = "cycle"  # the machine and the PLC have had another cycle
    # the axes have been stopped where they were, what was handed out is left
    # out
    STOPPED = "stopped"


class ChannelPort(Protocol):
    """The channel as the front end sees it.

    ``manual_data``: the program was typed in (MDI), it is no file.
    ``channel``: its number in the cell, from 1 on.
    ``condition``: what ``Wait.CONDITION`` waits for; None: nothing.
    """

    manual_data: bool
    channel: int
    condition: Condition | None

    @property
    def operator(self) -> Operator:
        """Who answers the dialogs."""
        ...

    @property
    def answers(self) -> bool:
        """Waits are answered by a machine that moves.

        A program may then wait as long as it likes.
        """
        ...

    @property
    def retained(self) -> dict[str, Any]:
        """Data that a dialect keeps from program to program, by its name."""
        ...

    @property
    def signals(self) -> ChannelSignals | None:
        """Signals of the other channels; None: there are none."""
        ...

    @property
    def axes(self) -> ChannelAxes | None:
        """Axes that the channel may exchange; None: there are none."""
        ...

    @property
    def jobs(self) -> ChannelJobs | None:
        """Programs in other channels; None: there is one channel."""
        ...

    def moved(self, position: FloatArray) -> None:
        """The rows handed out so far end at ``position`` (axes,).

        A channel with a machine knows its position itself.
        """
        ...

    def live_position(self) -> FloatArray:
        """Present command position of all channel axes, mm or degrees."""
        ...

    def position(self) -> FloatArray:
        """Command position of all channel axes, mm or degrees, latched when the
        last wait came true.
        """
        ...

    def message(self, text: str) -> None:
        """A line for the operator (warnings, #MSG)."""
        ...

    def ask(self, question: Question) -> Answer | None:
        """The operator's answer to a dialog; None if there is no operator."""
        ...

    def now_s(self) -> float:
        """Machine time, s, latched when the last wait came true."""
        ...

    def live_now_s(self) -> float:
        """Present machine time, s."""
        ...

    def skip_levels(self) -> int:
        """Bit mask of the block skip levels that are switched on, latched at
        program start.
        """
        ...

    def read_external(self, variable: External, element: int) -> ExternalValue:
        """Present value of an element of a variable that the PLC shares."""
        ...

    def write_external(
        self, variable: External, element: int, value: ExternalValue
    ) -> None:
        """Write it at once."""
        ...

    def loop_state(self, written: bool) -> tuple[bool, int]:
        """The condition of real-time loops and how many passes are over,
        latched when the last wait came true.

        ``written``: what the program has made of the condition.
        """
        ...

    def rt_cycle(
        self, slot: int, state: int, program: bool, ops: Sequence[RtOp]
    ) -> None:
        """Hand over a real-time cycle, or what becomes of it (``RT_...``).

        ``program``: it ends with the program.
        """
        ...

    def append_file(self, name: str, text: str) -> None:
        """Add text to a file in the folder of the run.

        ``name`` is relative and stays inside the folder.
        """
        ...

    def write_file(self, name: str, text: str) -> None:
        """Write a file in the folder of the run, or write it again.

        Refused: a file that the run has not written.
        """
        ...

    def read_file(self, name: str) -> str | None:
        """Text of a file in the folder of the run, None if there is none."""
        ...


class OfflinePort:
    """A channel that does not move: waits are true at once, messages and texts
    are kept, nothing is written.
    """

    answers = False
    manual_data = False
    condition: Condition | None = None

    def __init__(
        self,
        position: FloatArray,
        skip_levels: int = 0,
        operator: Operator | None = None,
        signals: ChannelSignals | None = None,
        axes: ChannelAxes | None = None,
        channel: int = 1,
    ) -> None:
        self.channel = channel
        self.signals = signals
        self.jobs = OpenJobs() if signals is not None else None
        self.axes = axes
        self.operator = operator or Operator()
        self._position = np.array(position, dtype=np.float64)
        self._skip_levels = skip_levels
        self._external: dict[tuple[str, str, int], ExternalValue] = {}
        self.messages: list[str] = []
        self._quota = Quota()
        self.retained: dict[str, Any] = {}
        self._texts: dict[str, list[str]] = {}

    @property
    def texts(self) -> dict[str, str]:
        """What a run would have written, by file name."""
        return {name: "".join(parts) for name, parts in self._texts.items()}

    def position(self) -> FloatArray:
        return self._position.copy()

    def live_position(self) -> FloatArray:
        return self._position.copy()

    def moved(self, position: FloatArray) -> None:
        """The rows handed out so far end at ``position``."""
        self._position = np.array(position, dtype=np.float64)

    def message(self, text: str) -> None:
        keep(self.messages, text, MESSAGES_KEPT)

    def ask(self, question: Question) -> Answer | None:
        """The script's answer; behind the script a dialog counts as
        acknowledged.
        """
        return (
            self.operator.ask(question)
            if self.operator.waiting
            else Answer(given=False)
        )

    def now_s(self) -> float:
        return 0.0

    def live_now_s(self) -> float:
        return 0.0

    def skip_levels(self) -> int:
        return self._skip_levels

    def read_external(self, variable: External, element: int) -> ExternalValue:
        initial: ExternalValue = "" if variable.type == "STRING" else 0.0
        return self._external.get(
            (variable.scope, variable.name, element), initial
        )

    def write_external(
        self, variable: External, element: int, value: ExternalValue
    ) -> None:
        self._external[variable.scope, variable.name, element] = value

    def loop_state(self, written: bool) -> tuple[bool, int]:
        return written, 0

    def rt_cycle(
        self, slot: int, state: int, program: bool, ops: Sequence[RtOp]
    ) -> None:
        """There are no cycles."""

    def append_file(self, name: str, text: str) -> None:
        self._quota.take(name, text)
        self._texts.setdefault(name, []).append(text)

    def write_file(self, name: str, text: str) -> None:
        self._quota.take(name, text)
        self._texts[name] = [text]

    def read_file(self, name: str) -> str | None:
        parts = self._texts.get(name)
        return None if parts is None else "".join(parts)
