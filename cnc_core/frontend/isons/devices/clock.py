"""The time that timers and positioners count: the machine's, or a computed one
where nothing moves.
"""

from __future__ import annotations

from cnc_core.frontend.port import ChannelPort


class Clock:
    """``now_s``.  Without a machine, time passes by dwells, waits and
    ``tick_s`` with every look at a timer.
    """

    def __init__(self, port: ChannelPort, tick_s: float = 0.001) -> None:
        self._port, self._tick_s = port, tick_s
        self._passed_s = 0.0

    def now_s(self) -> float:
        return self._port.live_now_s() if self._port.answers else self._passed_s

    def look(self) -> float:
        """The time; where nothing moves, a loop that waits for a timer comes to
        its end.
        """
        if not self._port.answers:
            self._passed_s += self._tick_s
        return self.now_s()

    def passes(self, seconds: float) -> None:
        """The program rests."""
        self._passed_s += seconds
