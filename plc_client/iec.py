"""Standard function blocks of IEC 61131-3 (edition 3, 6.6.3.5): timers, edges,
counters, bistables.

An instance is called once per scan with the standard's inputs and keeps its
outputs as attributes, under the standard's names.  Times are seconds of the
cell's clock.
"""

# ruff: noqa: N803 (inputs carry the standard's names)
from __future__ import annotations

from collections.abc import Callable

from . import clock

CV_MAX = 32767  # counters are INT
CV_MIN = -32768
_NS = 1_000_000_000


class _Timer:
    """Common part: the start of the running time on the cell's clock; PT below
    0 counts as 0.
    """

    def __init__(
        self, PT: float = 0.0, now_ns: Callable[[], int] | None = None
    ) -> None:
        self.IN = False
        self.PT = PT
        self.Q = False
        self.ET = 0.0
        self._now_ns = now_ns or clock.now_ns
        self._start_ns = 0
        self._running = False

    def _inputs(self, IN: bool, PT: float | None) -> tuple[bool, bool]:
        """Latch the inputs: (rising edge of IN, falling edge of IN)."""
        before, self.IN = self.IN, bool(IN)
        if PT is not None:
            self.PT = PT
        return self.IN and not before, before and not self.IN

    def _begin(self) -> None:
        self._start_ns, self._running = self._now_ns(), True

    def _elapsed(self) -> bool:
        """Refresh ET (held at PT) and tell whether PT has passed; exact to the ns."""
        limit_ns = max(round(self.PT * _NS), 0)
        now = self._now_ns()
        # a CNC that was started anew counts from 0
        self._start_ns = min(self._start_ns, now)
        passed_ns = now - self._start_ns
        self.ET = min(passed_ns, limit_ns) / _NS
        return passed_ns >= limit_ns


class TON(_Timer):
    """On-delay: Q becomes TRUE when IN has been TRUE for PT."""

    def __call__(self, IN: bool, PT: float | None = None) -> bool:
        rising, _ = self._inputs(IN, PT)
        if rising:
            self._begin()
        if self.IN:
            self.Q = self.Q or self._elapsed()
        else:
            self.Q, self.ET = False, 0.0
        return self.Q


class TOF(_Timer):
    """Off-delay: Q follows IN at once and falls when IN has been FALSE for PT."""

    def __call__(self, IN: bool, PT: float | None = None) -> bool:
        _, falling = self._inputs(IN, PT)
        if self.IN:
            self.Q, self.ET, self._running = True, 0.0, False
            return True
        if falling:
            self._begin()
        if self._running and self._elapsed():
            self.Q, self._running = False, False
        return self.Q


class TP(_Timer):
    """Pulse: a rising edge of IN gives a pulse of length PT, whatever IN does
    meanwhile.
    """

    def __call__(self, IN: bool, PT: float | None = None) -> bool:
        rising, _ = self._inputs(IN, PT)
        if self._running:
            self._running = not self._elapsed()
        # also in the scan that finds the last pulse over
        if rising and not self._running:
            self._begin()
            self._running = not self._elapsed()
        self.Q = self._running
        if not self._running and not self.IN:
            self.ET = 0.0
        return self.Q


class R_TRIG:
    """Q is TRUE for the one call in which CLK has risen."""

    def __init__(self) -> None:
        self.Q = False
        self._before = False

    def __call__(self, CLK: bool) -> bool:
        self.Q = bool(CLK) and not self._before
        self._before = bool(CLK)
        return self.Q


class F_TRIG:
    """Q is TRUE for the one call in which CLK has fallen."""

    def __init__(self) -> None:
        self.Q = False
        self._before = False

    def __call__(self, CLK: bool) -> bool:
        self.Q = self._before and not CLK
        self._before = bool(CLK)
        return self.Q


class CTU:
    """Up counter: CV counts rising edges of CU, R resets, Q = (CV >= PV)."""

    def __init__(self, PV: int = 0) -> None:
        self.PV, self.CV, self.Q = PV, 0, False
        self._up = R_TRIG()

    def __call__(
        self, CU: bool, R: bool = False, PV: int | None = None
    ) -> bool:
        self.PV = self.PV if PV is None else PV
        rising = self._up(CU)
        if R:
            self.CV = 0
        elif rising and self.CV < CV_MAX:
            self.CV += 1
        self.Q = self.CV >= self.PV
        return self.Q


class CTD:
    """Down counter: LD loads PV, CV counts rising edges of CD down, Q = (CV <= 0)."""

    def __init__(self, PV: int = 0) -> None:
        self.PV, self.CV, self.Q = PV, 0, True
        self._down = R_TRIG()

    def __call__(
        self, CD: bool, LD: bool = False, PV: int | None = None
    ) -> bool:
        self.PV = self.PV if PV is None else PV
        falling = self._down(CD)
        if LD:
            self.CV = self.PV
        elif falling and self.CV > CV_MIN:
            self.CV -= 1
        self.Q = self.CV <= 0
        return self.Q


class CTUD:
    """Up-down counter: R before LD before counting; both edges in one call
    cancel out; QU = CV >= PV, QD = CV <= 0.
    """

    def __init__(self, PV: int = 0) -> None:
        self.PV, self.CV = PV, 0
        self.QU, self.QD = False, True
        self._up, self._down = R_TRIG(), R_TRIG()

    def __call__(
        self,
        CU: bool = False,
        CD: bool = False,
        R: bool = False,
        LD: bool = False,
        PV: int | None = None,
    ) -> None:
        self.PV = self.PV if PV is None else PV
        step = int(self._up(CU)) - int(self._down(CD))
        if R:
            self.CV = 0
        elif LD:
            self.CV = self.PV
        else:
            self.CV = min(max(self.CV + step, CV_MIN), CV_MAX)
        self.QU, self.QD = self.CV >= self.PV, self.CV <= 0


class SR:
    """Bistable, set dominant."""

    def __init__(self) -> None:
        self.Q1 = False

    def __call__(self, S1: bool, R: bool) -> bool:
        self.Q1 = bool(S1) or (self.Q1 and not R)
        return self.Q1


class RS:
    """Bistable, reset dominant."""

    def __init__(self) -> None:
        self.Q1 = False

    def __call__(self, S: bool, R1: bool) -> bool:
        self.Q1 = not R1 and (bool(S) or self.Q1)
        return self.Q1
