"""The system variables ``$_Q0`` .. ``$_PARM_1`` by family."""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.machine import External
from cnc_core.frontend.port import ChannelPort
from cnc_core.units import FloatArray

from ..base.machine import GENERICS, INPUTS, M_PARAMETERS, OUTPUTS
from ..base.text import AXIS_LETTERS
from ..devices.clock import Clock
from ..devices.positioners import Positioners
from .output import OFF
from .state import ChannelState

AXES = len(AXIS_LETTERS)
FROM_HOME = 100
TIMERS, TOOL_VALUES, HEAD_VALUES, SPECIALS = 10, 20, 20, 14
INT32_LOW, INT32_HIGH = -(2**31), 2**31 - 1
DRAINING = frozenset({"PARM_"})
MOVING = frozenset({"Q", "R", "T"})
LIVING = MOVING | {"I", "O", "K"}
PLANE_NUMBERS = {17: 0, 18: 1, 19: 2}


def _positions() -> tuple[int, ...]:
    return (*range(AXES), *range(FROM_HOME, FROM_HOME + AXES))


INDICES: dict[str, tuple[int, ...]] = {
    "Q": _positions(),
    "R": _positions(),
    "I": tuple(range(INPUTS)),
    "O": tuple(range(OUTPUTS)),
    "T": tuple(range(TIMERS)),
    "U": tuple(range(TOOL_VALUES)),
    "H": tuple(range(HEAD_VALUES)),
    "C": tuple(range(AXES)),
    "N": tuple(range(AXES)),
    "S": tuple(range(AXES)),
    "X": tuple(range(SPECIALS)),
    "Y": tuple(range(AXES)),
    "W": tuple(range(AXES)),
    "K": tuple(range(GENERICS)),
    "PARM_": tuple(range(1, M_PARAMETERS + 1)),
}
WRITABLE = frozenset({"O", "T", "U", "K", "PARM_"})


class Shared:
    """Inputs, outputs, generic variables and M parameters in the global
    external variables that the PLC sees.
    """

    def __init__(self, port: ChannelPort, io_block: int) -> None:
        self._port = port
        # last value by family and index of what the program has written
        self.written: dict[tuple[str, int], float] = {}
        begin = io_block
        self._places: dict[str, External] = {}
        for family, kind, count in (
            ("I", "BOOLEAN", INPUTS),
            ("O", "BOOLEAN", OUTPUTS),
            ("K", "SGN32", GENERICS),
            ("PARM_", "SGN32", M_PARAMETERS),
        ):
            self._places[family] = External(
                f"ISONS_{family}", kind, begin, count, "global"
            )
            begin += count

    def read(self, family: str, index: int) -> float:
        value = self._port.read_external(self._places[family], index)
        return 0.0 if isinstance(value, str) else value

    def write(self, family: str, index: int, value: float, offset: int) -> None:
        if family == "O":
            value = float(value != 0)
        elif not INT32_LOW <= value <= INT32_HIGH:
            raise fail(
                900012, f"$_{family}: {value:g} is no 32-bit integer", offset
            )
        self.written[family, index] = float(int(value))
        self._port.write_external(
            self._places[family], index, float(int(value))
        )


class System:
    """Reads and writes all families."""

    message_result: Callable[[], float]
    run_type = 0  # $_X7: 0 normal, 1 simulation, 2 GO BLOCK, 3 RETRACE

    def __init__(
        self,
        port: ChannelPort,
        channel: ChannelState,
        clock: Clock,
        positioners: Positioners,
    ) -> None:
        self._port, self._channel, self._clock = port, channel, clock
        self.positioners = positioners
        self.shared = Shared(port, channel.cell.io_block)
        self.degrees = False
        self.message_result = lambda: 0.0
        self._timers = [0.0] * TIMERS  # when they stand at 0, s

    def drains(self, family: str) -> bool:
        """Its values are known when everything before has been executed."""
        return family in DRAINING

    def lives(self, family: str) -> bool:
        """Its values change while the machine runs."""
        return family in LIVING

    def moves(self, family: str) -> bool:
        """Its values go with the motion."""
        return family in MOVING

    def _check(self, family: str, index: int, offset: int) -> None:
        if family not in INDICES:
            raise fail(909101, f"$_{family}{index}: {ERRORS[909101]}", offset)
        known = INDICES[family]
        if index not in known:
            text = (
                "0..8, 100..108"
                if family in "QR"
                else f"{known[0]}..{known[-1]}"
            )
            raise fail(
                907014, f"$_{family}{index}: index out of range {text}", offset
            )

    def reader(
        self, family: str, index: int, offset: int
    ) -> Callable[[], float]:
        self._check(family, index, offset)
        if family in ("I", "O", "K"):
            return lambda: self.shared.read(family, index)
        if family == "PARM_":
            return lambda: self.shared.read(family, index - 1)
        read: dict[str, Callable[[int], float]] = {
            "Q": self._actual,
            "R": self._actual,
            "T": self._timer,
            "U": lambda i: self._channel.table[i],
            "H": self._head,
            "C": self._counter,
            "N": lambda i: self._limit(i, 1),
            "S": lambda i: self._limit(i, 0),
            "X": self._special,
            "Y": lambda i: self._of_axis(self._channel.frame.origin.acting, i),
            "W": lambda i: self._of_axis(self._channel.frame.offset.acting, i),
        }
        value = read[family]
        return lambda: float(value(index))

    def writer(
        self, family: str, index: int, offset: int
    ) -> Callable[[float], None]:
        self._check(family, index, offset)
        if family not in WRITABLE:
            raise fail(907016, f"$_{family}{index} is read only", offset)
        if family == "T":
            return lambda value: self._start(index, value, offset)
        if family == "U":
            return lambda value: self._channel.table.__setitem__(index, value)
        place = index - 1 if family == "PARM_" else index
        return lambda value: self.shared.write(family, place, value, offset)

    # values

    def _of_axis(self, values: FloatArray, index: int) -> float:
        """Of the axis with this letter, as a program writes it: in inch under G20.

        0 where the machine has none.
        """
        axis = self._channel.axes.get(AXIS_LETTERS[index])
        if axis is None:
            return 0.0
        return float(values[axis]) / self._channel.scale(axis)

    def _position(self, place: FloatArray, index: int) -> float:
        frame = self._channel.frame
        from_home = place - frame.home
        if index >= FROM_HOME:
            return self._of_axis(from_home, index - FROM_HOME)
        return self._of_axis(place - frame.total, index)

    def _counter(self, index: int) -> float:
        """The commanded target; behind a restart, where the program goes on."""
        channel = self._channel
        return self._position(
            channel.modal.position
            if channel.counter is None
            else channel.counter,
            index,
        )

    def _demand(self, index: int) -> float:
        return self._position(self._channel.modal.position, index)

    def _actual(self, index: int) -> float:
        if not self._port.answers or self._channel.output.side != OFF:
            return self._demand(index)
        return self._position(
            self._channel.tip.programmed(self._port.live_position()), index
        )

    @property
    def rests(self) -> bool:
        """No timer counts, no positioner moves."""
        now = self._clock.now_s()
        return max(self._timers) <= now and self.positioners.rest(now)

    @property
    def state(self) -> tuple[object, ...]:
        """What stays when time passes."""
        return self.degrees, self.run_type, self.positioners.state

    def _timer(self, index: int) -> float:
        return max(
            0.0, round((self._timers[index] - self._clock.look()) * 1000.0, 6)
        )

    def _start(self, index: int, value: float, offset: int) -> None:
        if value < 0:
            raise fail(900012, f"$_T{index}: {value:g} ms is negative", offset)
        self._timers[index] = self._clock.now_s() + value / 1000.0

    def _head(self, index: int) -> float:
        head = self._channel.frame.head
        if index < AXES:
            return head.offset.get(AXIS_LETTERS[index], 0.0)
        if index < 2 * AXES:
            return head.sensor.get(AXIS_LETTERS[index - AXES], 0.0)
        place = index - 2 * AXES
        return head.user[place] if place < len(head.user) else 0.0

    def _limit(self, index: int, end: int) -> float:
        limits = self._channel.output.limits
        return self._of_axis(limits.high if end else limits.low, index)

    def _special(self, index: int) -> float:
        channel = self._channel
        channel.follow_scanner()
        frame, modal = channel.frame, channel.modal
        axis = frame.length_axis
        length = (
            float((frame.length + frame.length_extra)[axis]) / modal.unit_mm
            if axis >= 0
            else 0.0
        )
        letter = channel.machine.axes[axis].upper() if axis >= 0 else "X"
        return float(
            (
                channel.spindle,
                frame.origin.index,
                frame.offset.index,
                frame.origin.on,
                frame.offset.on,
                max(frame.head_number, 0),
                channel.tool,
                self.run_type,
                modal.feed,
                not modal.absolute,
                PLANE_NUMBERS.get(channel.plane_code, 0),
                length,
                AXIS_LETTERS.index(letter) if letter in AXIS_LETTERS else 0,
                self.message_result(),
            )[index]
        )
