"""When the next scan is due, for the three clocks of a cell.

A pacer counts in ticks: CNC cycles in lockstep and freerun, ns of the monotonic
clock in realtime.
"""

from __future__ import annotations

from typing import Protocol

from hli._sync import lib

from hli import layout

from .client import SLICE_NS, Hli


class Pacer(Protocol):
    """``ticks`` of an interval, ``now``, and ``wait`` for a tick: True when
    reached, False to look around first.
    """

    def ticks(self, interval_s: float) -> int: ...

    def now(self) -> int: ...

    def wait(self, due: int) -> bool: ...


class CyclePacer:
    """Lockstep and freerun: the PLC waits for the CNC's cycle counter.

    ``plc_turn`` always holds the cycle of the next scan; in lockstep the CNC
    stops there, in freerun it runs on.
    """

    def __init__(self, hli: Hli) -> None:
        self._hli = hli

    def ticks(self, interval_s: float) -> int:
        """Whole cycles, at least one."""
        return max(round(interval_s / self._hli.cycle_s), 1)

    def now(self) -> int:
        """Completed cycles."""
        return self._hli.cycle

    def wait(self, due: int) -> bool:
        """Let the CNC run up to cycle `due` and wait for it, at most 100 ms."""
        return self._hli.turn(due)


class RealtimePacer:
    """Realtime: absolute deadlines on the monotonic clock, which no scan's
    duration shifts.
    """

    def __init__(self, hli: Hli) -> None:
        self._hli = hli

    def ticks(self, interval_s: float) -> int:
        """ns."""
        return max(round(interval_s * 1e9), 1)

    def now(self) -> int:
        """Monotonic time in ns."""
        return int(lib.hs_monotonic_ns())

    def wait(self, due: int) -> bool:
        """Sleep until `due`, at most 100 ms at a time."""
        self._hli.release_until(self._hli.cycle + 1)
        soon = min(due, self.now() + SLICE_NS)
        return bool(lib.hs_sleep_until(soon) == lib.HS_OK) and soon == due


def pacer_of(hli: Hli) -> Pacer:
    """The pacer for the clock the CNC runs on."""
    return (
        RealtimePacer(hli)
        if hli.cnc.clock == layout.HLI_CLOCK_REALTIME
        else CyclePacer(hli)
    )
