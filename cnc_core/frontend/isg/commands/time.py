"""# commands about time."""

from __future__ import annotations

from cnc_core.blocks import DWELL
from cnc_core.frontend.base.lexer import fail

from .base import CommandBase, Items, Run

DWELL_MAX_S = 1e6


class TimeCommands(CommandBase):
    """#TIME, #TIMER."""

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
