"""Switching at a path distance, compensated for everything that takes time
between the decision and its effect.

A scan sees the tool only every interval, and what it switches acts late: the
scan itself, the output, the valve. Therefore the blocks look forward: they
extrapolate the distance to the moment at which a decision made now takes effect
(``distance + speed * lead``) and decide in the scan whose effect is nearest to
the wanted place.
"""

from __future__ import annotations

import math
from enum import Enum

from hli.structures import HLI_BAHN_STATE, HLI_CHANNEL

from .. import clock
from .base import FunctionBlock
from .owner import channel_of
from .planned_path import PlannedPath

TENTH_UM_PER_S = 10.0
"""Speed is published in 1 um/s, distance in 0.1 um."""


class PathEstimate:
    """Where the tool will be: by the plan of the CNC as far as that reaches
    (``planned``), else by ``dist_prog_start`` and ``active_feed_r`` with the
    acceleration of the last two scans.

    Call it once per scan; ``at(seconds)`` is the expected distance (0.1 um) and
    ``speed_at(seconds)`` the expected speed (0.1 um/s) that much later.  The
    plan knows the override of its making; waits for the PLC take no time in it,
    and distances run on over a distance reset.  Behind its end the speed there
    goes on.  Without a plan braking is
    followed to standstill and no further, acceleration to the programmed feed
    with its override and no further.
    """

    def __init__(self, ch: HLI_CHANNEL | HLI_BAHN_STATE) -> None:
        channel = channel_of(self, ch, "bahn_state")
        self._state = channel.bahn_state
        self.distance = 0.0
        self.speed = 0.0  # 0.1 um/s, negative while the path runs backwards
        self.acceleration = 0.0
        self._top = 0.0  # the speed an acceleration leads to
        self._time_ns = -1
        self.plan = PlannedPath(channel)
        self.planned = False

    def __call__(self) -> float:
        """One scan; returns the distance now."""
        self.planned = self.plan()
        state, now = self._state, clock.now_ns()
        speed = abs(state.active_feed_r) * TENTH_UM_PER_S
        speed = -speed if state.backward_active_r else speed
        if self._time_ns >= 0 and now > self._time_ns:
            self.acceleration = (
                (speed - self.speed) * 1e9 / (now - self._time_ns)
            )
        self.distance, self.speed, self._time_ns = (
            float(state.dist_prog_start),
            speed,
            now,
        )
        feed = (
            0.0
            if state.rapid_active_r
            else state.command_feed_r
            * TENTH_UM_PER_S
            * state.override_r
            / 1000.0
        )
        self._top = max(feed, abs(speed))
        return self.distance

    def at(self, seconds: float) -> float:
        """Expected distance after ``seconds``."""
        if self._is_planned(seconds):
            return self.distance + self.plan.at(seconds).way
        if self._goes_on(seconds):
            reach = self.plan.horizon
            behind = self.plan.rate * (seconds - reach)
            return self.distance + self.plan.at(reach).way + behind
        v, a, t = self.speed, self.acceleration, self._changes(seconds)
        return self.distance + v * seconds + a * t * (seconds - 0.5 * t)

    def speed_at(self, seconds: float) -> float:
        """Expected speed after ``seconds``, 0.1 um/s along the driven path;
        negative while it runs backwards.
        """
        if self._is_planned(seconds) or self._goes_on(seconds):
            return math.copysign(self.plan.at(seconds).speed, self.speed)
        return self.speed + self.acceleration * self._changes(seconds)

    def _is_planned(self, seconds: float) -> bool:
        return self.planned and 0.0 <= seconds <= self.plan.horizon

    def _goes_on(self, seconds: float) -> bool:
        """Behind the plan's end, which is driven on with the speed there."""
        return self.planned and seconds > self.plan.horizon > 0.0

    def _changes(self, seconds: float) -> float:
        """How long the speed goes on changing, without a plan."""
        v, a = self.speed, self.acceleration
        change = -v if v * a < 0.0 else math.copysign(self._top, v) - v
        return min(seconds, max(change / a, 0.0)) if a else 0.0


class _Reach:
    """An extrapolated distance that falls back only by more than the hysteresis
    (a tool that brakes for a corner).
    """

    def __init__(self, hysteresis: float) -> None:
        self._hysteresis = hysteresis
        self._value = -math.inf

    def __call__(self, value: float) -> float:
        if value >= self._value or value < self._value - self._hysteresis:
            self._value = value
        return self._value


class SwitchState(Enum):
    """States of a distance switch (docs/reference/plc.md draws them)."""

    OFF = "off"  # enable FALSE
    BEFORE = "before"
    PASSED = "passed"


class DistanceTrigger(FunctionBlock):
    """Output ``q`` rises when the path passes ``distance`` (0.1 um from program
    start).

    ``lead_s``: how long the switched device takes (dead time).  ``scan_s``:
    interval of the task; half of it is added, so that the effect lies around
    the place instead of behind it.  ``time_to_go``: seconds from this scan to
    the moment at which the command has to be given; with an output that takes a
    time (oversampling, time stamp) hand it over in the scan in which it becomes
    smaller than the interval.  ``q`` falls again when the path runs back, or
    when the tool stands in front of the place after all; ``hysteresis`` (0.1
    um): by how much it must expect less.

    >>> valve = DistanceTrigger(ch, scan_s=0.001)                          #
    doctest: +SKIP
    >>> open_valve = valve(distance=200_000.0, lead_s=0.040)               #
    doctest: +SKIP
    """

    def __init__(
        self,
        ch: HLI_CHANNEL | HLI_BAHN_STATE,
        scan_s: float = 0.001,
        estimate: PathEstimate | None = None,
        hysteresis: float = 0.0,
    ) -> None:
        ch = channel_of(self, ch, "bahn_state")
        super().__init__()
        self.path = estimate or PathEstimate(ch)
        self._own = estimate is None
        self._scan_s = scan_s
        self._reach = _Reach(hysteresis)
        self.state = SwitchState.OFF
        self.q = False
        self.time_to_go = float("inf")

    def __call__(
        self, distance: float, lead_s: float = 0.0, enable: bool = True
    ) -> bool:
        """One scan; returns ``q``."""
        if self._own:
            self.path()
        passed = (
            enable
            and self._reach(self.path.at(lead_s + 0.5 * self._scan_s))
            >= distance
        )
        self.state = (
            (SwitchState.PASSED if passed else SwitchState.BEFORE)
            if enable
            else SwitchState.OFF
        )
        self.q = self.done = passed
        self.busy = enable and not passed
        self.time_to_go = (
            self._time_to_go(distance, lead_s)
            if self.busy
            else 0.0
            if passed
            else float("inf")
        )
        return self.q

    def _time_to_go(self, distance: float, lead_s: float) -> float:
        v = self.path.speed
        return (
            max((distance - self.path.distance) / v - lead_s, 0.0)
            if v > 0.0
            else float("inf")
        )


class DistanceCam(FunctionBlock):
    """Output ``q`` is TRUE on the tracks: pairs (begin, end) of path distances
    in 0.1 um, ascending.

    ``on_lead_s`` and ``off_lead_s``: how long the device takes to open and to
    close.  The tracks may change at any time (from look-ahead data); ``q``
    follows them in both directions of the path.  Output ``track``: index or -1.
    ``hysteresis`` as for ``DistanceTrigger``.
    """

    def __init__(
        self,
        ch: HLI_CHANNEL | HLI_BAHN_STATE,
        scan_s: float = 0.001,
        estimate: PathEstimate | None = None,
        hysteresis: float = 0.0,
    ) -> None:
        ch = channel_of(self, ch, "bahn_state")
        super().__init__()
        self.path = estimate or PathEstimate(ch)
        self._own = estimate is None
        self._scan_s = scan_s
        self._reach = (_Reach(hysteresis), _Reach(hysteresis))
        self.state = SwitchState.OFF
        self.q = False
        self.track = -1

    def __call__(
        self,
        tracks: list[tuple[float, float]],
        on_lead_s: float = 0.0,
        off_lead_s: float = 0.0,
        enable: bool = True,
    ) -> bool:
        """One scan; returns ``q``."""
        if self._own:
            self.path()
        leads = zip(self._reach, (on_lead_s, off_lead_s), strict=True)
        begin, end = (
            reach(self.path.at(lead + 0.5 * self._scan_s))
            for reach, lead in leads
        )
        self.track = (
            next(
                (
                    i
                    for i, (a, b) in enumerate(tracks)
                    if begin >= a and end < b
                ),
                -1,
            )
            if enable
            else -1
        )
        self.q = self.done = self.track >= 0
        self.busy = enable and not self.q
        self.state = (
            SwitchState.OFF
            if not enable
            else SwitchState.PASSED
            if self.q
            else SwitchState.BEFORE
        )
        return self.q
