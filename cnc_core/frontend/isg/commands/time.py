"""# commands about time and synchronisation."""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.blocks import DWELL
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail

from .base import CommandBase, Items, Run

DWELL_MAX_S = 1e6
SIGNALS_MAX = 12


class TimeCommands(CommandBase):
    """#TIME, #TIMER, #WAIT, #SIGNAL."""

    def _time(self) -> Run:
        """``#TIME 2.5`` or ``#TIME [2.5]``: dwell, s."""
        seconds = self._formulas.number("#TIME", self._start)

        def run() -> Items:
            value = seconds()
            if not 0 <= value <= DWELL_MAX_S:
                raise fail(
                    20752,
                    f"#TIME: {value:g} s out of range 0..{DWELL_MAX_S:g} s",
                    self._start,
                )
            return [self._modal.row(DWELL, self._modal.n, value=value)]

        return run

    def _timer(self) -> Run:
        """``START | STOP | READ | CLEAR [SYN ID=1]``; READ puts ms into
        V.G.TIMER[ID].
        """
        stream = self._stream
        word = stream.accept_name("START", "STOP", "READ", "CLEAR")
        if not word:
            raise fail(
                900010,
                f"#TIMER: expected START, STOP, READ or CLEAR, found {stream.describe()}",
                self._start,
            )
        keys = (
            self._keys({"SYN": False, "ID": True}) if stream.is_op("[") else {}
        )
        timer = self._whole(keys.get("ID") or (lambda: 1.0), "ID", 0, 127)
        self._drain = "SYN" in keys
        act = {
            "START": self._state.timers.start,
            "STOP": self._state.timers.stop,
            "READ": self._state.timers.read,
            "CLEAR": self._state.timers.clear,
        }[word.text.upper()]

        def run() -> Items:
            act(timer(), self._state.port.now_s())
            return []

        return run

    def _signal_keys(
        self, name: str
    ) -> tuple[Callable[[], int], list[Formula]]:
        """``[SYN ID=.. P[1]=.. CH=.. AHEAD]``: the number, and the values of P[i].

        SYN may stand in front of the bracket too.
        """
        stream, values = self._stream, []
        stream.accept_name("SYN")
        number: Formula | None = None
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            token = stream.current
            if stream.accept(",") or stream.accept_name("SYN", "AHEAD"):
                continue
            if stream.accept_name("ID"):
                number = self._key_value("ID")
            elif stream.accept_name("CH"):
                self._key_value("CH")
            elif stream.accept_name("P") and stream.is_op("["):
                self._formulas.arguments()
                values.append(self._key_value("P"))
            else:
                raise fail(
                    900010, f"#{name}: unexpected {token.text!r}", token.offset
                )
        self._formulas.close(opened)
        if len(values) > SIGNALS_MAX:
            raise fail(21549, ERRORS[21549], self._start)
        if number is None:
            raise fail(900010, f"#{name} without ID", self._start)
        return self._whole(number, "ID", 0, 2**31 - 1), values

    def _signal(self) -> Run:
        """``#SIGNAL [ID=..]``, ``#SIGNAL REMOVE [ID=..]``."""
        remove = self._stream.accept_name("REMOVE") is not None
        number, _ = self._signal_keys("SIGNAL")
        signals = self._state.signals

        def run() -> Items:
            if remove:
                signals.pop(number(), None)
            else:
                signals[number()] = signals.get(number(), 0) + 1
            return []

        return run

    def _wait(self) -> Run:
        """``#WAIT [ID=..]`` uses up one signal.

        No other channel could send it.
        """
        number, _ = self._signal_keys("WAIT")
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
