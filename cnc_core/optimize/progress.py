"""How far the Path Optimizer is with a program."""

from __future__ import annotations

from collections.abc import Callable

Tick = Callable[[float, int], None]
"""Called with the share of the work that is done, and N of the block."""

READ, TIMED, CURVED = 0.05, 0.15, 0.9  # share at the end of each stage


class Progress:
    """Shares of the whole work; none is below an earlier one."""

    def __init__(self, tick: Tick) -> None:
        self._tick, self._share = tick, 0.0
        self._points = self._done = 0

    def reading(self, share: float, n: int) -> None:
        """The share of the program that has been read."""
        self._tell(READ * share, n)

    def timing(self, share: float, n: int) -> None:
        """The share of the input whose time is known."""
        self._tell(READ + (TIMED - READ) * share, n)

    def begin_curves(self, points: int) -> None:
        """From now on curves are made of so many points."""
        self._points, self._done = max(points, 1), 0

    def curve(self, points: int, n: int) -> None:
        """A curve is made of so many more points."""
        self._done += points
        share = min(self._done / self._points, 1.0)
        self._tell(TIMED + (CURVED - TIMED) * share, n)

    def writing(self, share: float, n: int) -> None:
        """The share of the output whose time is known."""
        self._tell(CURVED + (1.0 - CURVED) * share, n)

    def end(self) -> None:
        """All is done."""
        self._tell(1.0, 0)

    def _tell(self, share: float, n: int) -> None:
        self._share = max(self._share, min(share, 1.0))
        self._tick(self._share, n)
