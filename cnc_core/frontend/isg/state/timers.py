"""The timers of a program."""

from __future__ import annotations

from cnc_core.frontend.base.expression import round_half_away


class Timers:
    """#TIMER: running since, ms kept, and what was read last, by number."""

    def __init__(self) -> None:
        self._since: dict[int, float] = {}
        self._kept_ms: dict[int, float] = {}
        self.read_ms: dict[int, float] = {}

    def start(self, timer: int, now_s: float) -> None:
        self._since.setdefault(timer, now_s)

    def stop(self, timer: int, now_s: float) -> None:
        if timer in self._since:
            since = self._since.pop(timer)
            self._kept_ms[timer] = (
                self._kept_ms.get(timer, 0.0) + (now_s - since) * 1000.0
            )

    def read(self, timer: int, now_s: float) -> None:
        running = (
            (now_s - self._since[timer]) * 1000.0
            if timer in self._since
            else 0.0
        )
        self.read_ms[timer] = float(
            round_half_away(self._kept_ms.get(timer, 0.0) + running)
        )

    def clear(self, timer: int, now_s: float) -> None:
        self._kept_ms.pop(timer, None)
        if timer in self._since:
            self._since[timer] = now_s
