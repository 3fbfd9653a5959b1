"""Auxiliary axes run by the CN application, simulated: each moves at its feed,
in the channel's time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cnc_core.frontend.base.lexer import fail

from ..base.parameters import Parameters
from .clock import Clock

DEFAULT_FEED_MM_MIN = 6000.0
LIMIT_UNIT_MM = 0.001
START, WAIT, HOME, ENABLE = 0, 1, 2, 3


@dataclass
class Positioner:
    """``begun_s``: when the motion from ``origin`` to ``target`` began, mm."""

    origin: float = 0.0
    target: float = 0.0
    begun_s: float = 0.0
    feed_mm_min: float = DEFAULT_FEED_MM_MIN
    offset: float = 0.0
    enabled: bool = True
    homed: bool = False

    def position(self, now_s: float) -> float:
        way = self.target - self.origin
        driven = self.feed_mm_min / 60.0 * (now_s - self.begun_s)
        return (
            self.target
            if driven >= abs(way)
            else self.origin + math.copysign(max(driven, 0.0), way)
        )

    def rest_s(self, now_s: float) -> float:
        """Seconds until it stands."""
        return abs(self.target - self.position(now_s)) * 60.0 / self.feed_mm_min


class Positioners:
    """All of them by number."""

    def __init__(
        self, count: int, parameters: Parameters, clock: Clock
    ) -> None:
        self._all = [Positioner() for _ in range(count)]
        self._parameters, self._clock = parameters, clock

    def rest(self, now_s: float) -> bool:
        """All of them stand."""
        return not any(one.rest_s(now_s) > 0 for one in self._all)

    @property
    def state(self) -> tuple[object, ...]:
        """Where they stand or go, and how."""
        return tuple(
            (one.target, one.feed_mm_min, one.offset, one.enabled, one.homed)
            for one in self._all
        )

    def _one(self, number: float, offset: int) -> Positioner:
        if number != int(number) or not 0 <= number < len(self._all):
            raise fail(
                909140,
                f"positioner {number:g}: the machine has {len(self._all)} (from 0)",
                offset,
            )
        return self._all[int(number)]

    def move(
        self,
        number: float,
        par: float,
        value: float,
        relative: bool,
        offset: int,
    ) -> float:
        """PA, PD; seconds that the program waits for it."""
        one = self._one(number, offset)
        now = self._clock.now_s()
        if par == ENABLE:
            self._begin(one, one.position(now))
            one.enabled = value > 0
            return 0.0
        if par not in (START, WAIT, HOME):
            raise fail(900012, f"positioner: par {par:g} is not 0..3", offset)
        if not one.enabled:
            raise fail(
                909141, f"positioner {int(number)} is not enabled", offset
            )
        here = one.position(now)
        target = (
            0.0 if par == HOME else value + (here if relative else one.offset)
        )
        self._check(int(number), target, offset)
        one.homed = one.homed or par == HOME
        self._begin(one, here, target)
        return 0.0 if par == START else one.rest_s(now)

    def _check(self, number: int, target: float, offset: int) -> None:
        for name, low in (("LIMITE_N", True), ("LIMITE_P", False)):
            full = f"{name}_P{number}"
            limit = self._parameters[full] * LIMIT_UNIT_MM
            if self._parameters.given(full) and (
                target < limit if low else target > limit
            ):
                raise fail(
                    903001,
                    f"positioner {number} would reach {target:g}, {full} is {limit:g} mm",
                    offset,
                )

    def _begin(
        self, one: Positioner, origin: float, target: float | None = None
    ) -> None:
        one.origin, one.target = origin, origin if target is None else target
        one.begun_s = self._clock.now_s()

    def set_feed(self, number: float, feed: float, offset: int) -> None:
        """PF, mm/min."""
        one = self._one(number, offset)
        if not feed > 0:
            raise fail(900006, f"PF: {feed:g} is not positive", offset)
        highest = self._parameters[f"VMAX_P{int(number)}"]
        self._begin(one, one.position(self._clock.now_s()), one.target)
        one.feed_mm_min = min(feed, highest) if highest else feed

    def stop(self, number: float, offset: int) -> None:
        """PS."""
        one = self._one(number, offset)
        self._begin(one, one.position(self._clock.now_s()))

    def set_offset(
        self, number: float, value: float, relative: bool, offset: int
    ) -> None:
        """G93 P[n] and DP[n]."""
        one = self._one(number, offset)
        one.offset = value + (one.offset if relative else 0.0)

    def status(self, number: float, par: float, offset: int) -> float:
        """$_PM."""
        one = self._one(number, offset)
        now = self._clock.look()
        here = one.position(now)
        values = [
            float(one.rest_s(now) > 0),
            here,
            here,
            float(one.enabled),
            float(one.homed),
            0.0,
        ]
        if par != int(par) or not 0 <= par < len(values):
            raise fail(900012, f"$_PM: par {par:g} is not 0..5", offset)
        return values[int(par)]
