"""#SIGNAL and #WAIT: between the channels of a cell, or within the only one.

Syntax and meaning follow the programming manual of TF5200, pages "Sending
signals" and "Waiting for signals".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.blocks import EVENT, EVENT_COMMAND, HAS_VALUE
from cnc_core.errors import Place
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import Kind, fail
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.port import Condition, Wait
from cnc_core.frontend.signals import (
    ChannelSignals,
    Removal,
    Signal,
    Values,
    Wanted,
)

from ..state.store import Reference
from .base import CommandBase, Items, Run

SIGNALS_MAX = 12
KEYS = ("COUNT", "AHEAD", "SYN", "IDMIN", "IDMAX", "ID", "CH", "P")
WORDS = ("AHEAD", "SYN")  # without a value
# the value of a key without = : a number, a parameter or a variable
VALUE_BEHIND = re.compile(r"[\d+\-\[]|P\s*\d|V\.", re.IGNORECASE)
NUMBER_MAX = 2**31 - 1
TRUE_ABOVE = 0.5
WHO = "the PLC or another channel, by a variable of the condition"

Whole = Callable[[], int]


@dataclass
class _Keys:
    """What stands in the bracket.

    ``at``: #SIGNAL and #WAIT with SYN act where the path is.
    ``highest``: the end of a range of numbers.  ``values``: index and value of
    #SIGNAL; ``targets``: index and variable of #WAIT.
    """

    number: Whole | None = None
    highest: Whole | None = None
    count: Whole | None = None
    at: bool = False
    ahead: bool = False
    channels: list[Whole] = field(default_factory=list)
    values: list[tuple[Whole, Formula]] = field(default_factory=list)
    targets: list[tuple[Whole, Reference]] = field(default_factory=list)


class SignalCommands(CommandBase):
    """#SIGNAL, #SIGNAL REMOVE, #SIGNAL READ, #WAIT, #WAIT FOR."""

    def _signal(self) -> Run:
        """``#SIGNAL [SYN] [ID=.. COUNT=.. P[0]=.. CH=..]``, ``#SIGNAL REMOVE``,
        ``#SIGNAL READ``.
        """
        if self._stream.accept_name("READ"):
            return self._signal_read()
        if self._stream.accept_name("REMOVE"):
            return self._signal_remove()
        keys, number = self._signal_keys("SIGNAL")
        signals = self._state.port.signals
        if signals is None:
            return self._alone(number)
        channels = self._channels(signals, keys)

        def send() -> Items:
            signal = Signal(
                number(),
                channels(),
                {index(): self._real(value()) for index, value in keys.values},
                keys.count() if keys.count else 0,
            )
            if not keys.at:
                signals.send(signal)
                return []
            return [self._on_path(signals.later(signal))]

        return send

    def _on_path(self, token: float) -> Row:
        """It acts when the path has passed it."""
        return self._modal.row(
            EVENT,
            self._modal.n,
            code=EVENT_COMMAND,
            value=token,
            flags=HAS_VALUE,
        )

    def _signal_remove(self) -> Run:
        """``[SYN] [ID=.. | IDMIN=.. IDMAX=.. CH=..]``: one signal, or all of a
        range.
        """
        keys, lowest = self._signal_keys("SIGNAL REMOVE")
        signals = self._state.port.signals
        if signals is None:
            return self._remove_alone(keys, lowest)
        channels = self._channels(signals, keys)

        def remove() -> Items:
            highest = keys.highest() if keys.highest else None
            removal = Removal(lowest(), highest, channels())
            if keys.at:
                return [self._on_path(signals.later(removal))]
            signals.remove(removal)
            return []

        return remove

    def _signal_read(self) -> Run:
        """``[ID=.. P[0]=V.. CH=..]``: as #WAIT, without a wait.

        Where the signal is not there the program goes on a cycle later: one
        that asks in a loop sees what comes.
        """
        keys, number = self._signal_keys("SIGNAL READ")
        if keys.at:
            text = (
                "#SIGNAL READ takes no SYN: it acts where blocks are prepared"
            )
            raise fail(21344, text, self._start)
        state, start = self._state, self._start
        signals = state.port.signals
        if signals is None:
            return self._read_alone(number)
        channels = self._channels(signals, keys)

        def read() -> Items:
            place = state.place(start)
            wanted = Wanted(
                number(), channels(), self._taking(keys, place), place
            )
            state.signal_read = signals.read(wanted)
            return [] if state.signal_read else [Wait.CYCLE]

        return read

    def _wait(self) -> Run:
        """``#WAIT [SYN] [ID=.. P[0]=V.. CH=.. AHEAD]``, ``#WAIT FOR``."""
        if self._stream.accept_name("FOR"):
            return self._wait_for()
        keys, number = self._signal_keys("WAIT")
        signals = self._state.port.signals
        if signals is None:
            return self._wait_alone(number)
        if keys.at and keys.targets:
            raise fail(
                21344,
                "#WAIT SYN takes no P: values are read where blocks are prepared",
                self._start,
            )
        channels, start = self._channels(signals, keys), self._start
        self._drain = keys.at and not keys.ahead

        def wait() -> Items:
            place = self._state.place(start)
            signals.wait(
                Wanted(number(), channels(), self._taking(keys, place), place)
            )
            if signals.came():
                return []
            flying = keys.at and keys.ahead
            return [Wait.DRAINED, Wait.SIGNAL] if flying else [Wait.SIGNAL]

        return wait

    def _wait_for(self) -> Run:
        """``#WAIT FOR expression``: looked at once a cycle."""
        offset = self._stream.current.offset
        condition = self._formulas.expression()
        said = self._stream.text[offset:].split(";")[0].strip()

        def true() -> bool:
            value = condition()
            if isinstance(value, str):
                raise fail(900012, "#WAIT FOR: a number is expected", offset)
            return value > TRUE_ABOVE

        def wait() -> Items:
            port = self._state.port
            if not port.answers or true():
                return []
            port.condition = Condition(true, said, WHO)
            return [Wait.CONDITION]

        return wait

    def _taking(self, keys: _Keys, place: Place) -> Callable[[Values], None]:
        """Puts the values that came along into their variables."""

        def take(values: Values) -> None:
            for index, target in keys.targets:
                if index() not in values:
                    error = fail(
                        21549,
                        f"#WAIT: no value P[{index()}] came with the signal",
                        self._start,
                    )
                    error.place = place
                    raise error
                assert target.store is not None
                target.store(values[index()])

        return take

    def _channels(
        self, signals: ChannelSignals, keys: _Keys
    ) -> Callable[[], tuple[int, ...]]:
        start = self._start

        def channels() -> tuple[int, ...]:
            numbers = tuple(one() for one in keys.channels)
            for number in numbers:
                signals.check(number, self._state.place(start))
            return numbers

        return channels

    def _real(self, value: object) -> float:
        if isinstance(value, (int, float)):
            return float(value)
        raise fail(900012, "P: a number is expected", self._start)

    # ---------------------------------------------------------------- the bracket
    def _signal_keys(self, name: str) -> tuple[_Keys, Whole]:
        """SYN may stand in front of the bracket too."""
        stream, keys = self._stream, _Keys()
        keys.at = stream.accept_name("SYN") is not None
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if not stream.accept(","):
                self._signal_key(name, keys)
        self._formulas.close(opened)
        if len(keys.values) + len(keys.targets) > SIGNALS_MAX:
            raise fail(900012, f"#{name}: at most {SIGNALS_MAX} values", opened)
        if keys.number is None:
            raise fail(900010, f"#{name} without ID", self._start)
        return keys, keys.number

    def _signal_key(self, name: str, keys: _Keys) -> None:
        key = self._prefix(name)
        if key == "SYN":
            keys.at = True
        elif key == "AHEAD":
            keys.ahead = True
        elif key in ("ID", "IDMIN", "IDMAX"):
            self._number_key(name, key, keys)
        elif key == "COUNT":
            keys.count = self._key_number("COUNT", 1, NUMBER_MAX)
        elif key == "CH":
            keys.channels.append(self._key_number("CH", 1, NUMBER_MAX, 20996))
        else:
            self._parameter_key(name, keys)

    def _number_key(self, name: str, key: str, keys: _Keys) -> None:
        """IDMIN alone is the same as ID."""
        if key != "ID" and name != "SIGNAL REMOVE":
            raise fail(900010, f"{key} is of #SIGNAL REMOVE alone", self._start)
        value = self._key_number(key, 0, NUMBER_MAX, 20995)
        if key == "IDMAX":
            keys.highest = value
        else:
            keys.number = value

    def _prefix(self, name: str) -> str:
        """The next key; its value may follow without a space: ``ID4711``."""
        stream, token = self._stream, self._stream.current
        rest = stream.text[token.offset :].upper()
        key = next((k for k in KEYS if rest.startswith(k)), None)
        behind = rest[len(key) :] if key else ""
        glued = behind[:1].isalpha() and (
            key in WORDS or not VALUE_BEHIND.match(behind)
        )
        if token.kind is not Kind.NAME or key is None or glued:
            raise fail(
                900010, f"#{name}: unexpected {token.text!r}", token.offset
            )
        stream.take_letters(len(key))
        return key

    def _key_number(
        self, key: str, lowest: int, highest: int, code: int = 900012
    ) -> Whole:
        self._stream.accept("=")
        if not self._formulas.starts_here():
            raise fail(900004, f"{key} without a value", self._start)
        value = self._formulas.expression()
        return self._whole(value, key, lowest, highest, code)

    def _parameter_key(self, name: str, keys: _Keys) -> None:
        """``P[0]=value`` of #SIGNAL, ``P[0]=variable`` of #WAIT."""
        if not self._stream.is_op("["):
            raise fail(900010, f"#{name}: P without an index", self._start)
        places = self._formulas.arguments()
        index = self._whole(places[0], "P", 0, SIGNALS_MAX - 1)
        receives = name in ("WAIT", "SIGNAL READ")
        reads = receives and self._state.port.signals is not None
        if not reads:
            keys.values.append((index, self._key_value("P")))
            return
        offset = self._stream.current.offset
        self._stream.accept("=")
        target = self._formulas.reference()
        if target.store is None:
            raise fail(900010, "#WAIT: P takes a variable", offset)
        keys.targets.append((index, target))

    # ---------------------------------------------------------------- one channel
    def _alone(self, number: Whole) -> Run:
        """Within the only channel a wait uses up one signal."""
        signals = self._state.signals

        def run() -> Items:
            signals[number()] = signals.get(number(), 0) + 1
            return []

        return run

    def _remove_alone(self, keys: _Keys, lowest: Whole) -> Run:
        signals = self._state.signals

        def run() -> Items:
            low = lowest()
            high = keys.highest() if keys.highest else None
            if high is None:
                signals[low] = max(signals.get(low, 0) - 1, 0)
                return []
            for number in [one for one in signals if low <= one <= high]:
                del signals[number]
            return []

        return run

    def _read_alone(self, number: Whole) -> Run:
        state = self._state

        def run() -> Items:
            found = number()
            state.signal_read = state.signals.get(found, 0) > 0
            if state.signal_read:
                state.signals[found] -= 1
            return []

        return run

    def _wait_alone(self, number: Whole) -> Run:
        """No other channel could send it."""
        signals = self._state.signals

        def run() -> Items:
            wanted = number()
            if not signals.get(wanted, 0):
                text = f"#WAIT: no signal {wanted} has been sent, and no other channel can send it"
                if not self._state.lenient:
                    raise fail(907052, text, self._start)
                self._state.warn(907052, text, self._start)
                return []
            signals[wanted] -= 1
            return []

        return run
