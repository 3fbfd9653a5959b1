"""The CNC's plan of the coming motion, as the look-ahead extension shows it."""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np
from hli._sync import ffi, lib

from hli import layout
from hli.structures import HLI_CHANNEL

from .ahead import extension_of

_TRIES = 1000
_US = 1e6
_OK: int = lib.HS_OK
_KNOT = np.dtype(layout.HLI_AHEAD_KNOT)


class Ahead(NamedTuple):
    """What the plan says of a moment."""

    way: float  # from now on, 0.1 um, negative backwards
    speed: float  # 0.1 um/s along the driven path, never negative


class PlannedPath:
    """The plan: knots in motion time, between which the way is a cubic.

    ``PlannedPath(ch)()`` once per scan: TRUE while there is a plan that holds
    now; then ``at(seconds)`` tells way and speed so much later.  ``horizon`` is
    how far it reaches, s; ``override`` (1: 100 %) what it was made with.  The
    first call switches the plan on (``plan_enable_w``).
    """

    def __init__(self, ch: HLI_CHANNEL) -> None:
        self._area = extension_of(ch)
        self._copy = layout.HLI_AHEAD_PLAN()
        self._target = ffi.cast("void *", ctypes.addressof(self._copy))
        self._edition = -1
        self._now = 0.0
        self.valid = False
        self._knots = np.zeros(0, _KNOT)
        self._times = np.zeros(0)
        if self._area is not None:
            plan = self._area.plan
            self._seq = plan._pointer(layout.HLI_AHEAD_PLAN.seq.offset)
            self._source = plan._pointer()

    def __call__(self) -> bool:
        """One scan; returns ``valid``."""
        area = self._area
        if area is None:
            return False
        area.plan_enable_w = True
        state = area.state
        self._now = state.motion_time
        self.valid = state.plan_valid and self._refresh(state.edition)
        return self.valid

    def _refresh(self, edition: int) -> bool:
        if edition == self._edition:
            return True
        size = ctypes.sizeof(self._copy)
        copied = lib.hs_snapshot(
            self._seq, self._source, self._target, size, _TRIES
        )
        if copied != _OK or not self._copy.count:
            return False
        self._edition = int(self._copy.edition)
        self._knots = np.frombuffer(self._copy.knot, _KNOT)[: self._copy.count]
        self._times = self._knots["motion_time"].copy()
        return True

    @property
    def override(self) -> float:
        """The override that the plan was made with, 1: 100 %."""
        return float(self._copy.override)

    @property
    def horizon(self) -> float:
        """How far the plan reaches, s; endless if the path rests at its end; 0
        without a plan.
        """
        if self._copy.complete:
            return float("inf")
        if not len(self._times):
            return 0.0
        return max(float(self._times[-1] - self._now) / _US, 0.0)

    @property
    def rate(self) -> float:
        """Change of the distance where the plan ends, 0.1 um/s."""
        return float(self._knots[-1]["rate"]) if len(self._knots) else 0.0

    def at(self, seconds: float) -> Ahead:
        """Way and speed after ``seconds`` of motion; behind the horizon, those of
        its end.
        """
        begin, _ = self._place(self._now)
        end, speed = self._place(self._now + seconds * _US)
        return Ahead(end - begin, speed)

    def _place(self, time: float) -> tuple[float, float]:
        """(distance, speed): cubic by distances and rates at both knots."""
        at = int(np.searchsorted(self._times, time, side="right")) - 1
        low = max(at, 0)
        a = self._knots[low]
        if at < 0 or at + 1 >= len(self._knots):
            rests = at >= 0 and self._copy.complete
            return float(a["distance"]), 0.0 if rests else float(
                a["speed"]
            ) * 10
        b = self._knots[low + 1]
        h = float(b["motion_time"] - a["motion_time"]) / _US
        u = (time - float(a["motion_time"])) / _US / h
        w = 1.0 - u
        way = float(b["distance"] - a["distance"])
        bend = float(a["rate"]) * w - float(b["rate"]) * u
        distance = (
            float(a["distance"])
            + way * u * u * (3.0 - 2.0 * u)
            + h * u * w * bend
        )
        rate = 6.0 * u * w * way / h
        rate += float(a["rate"]) * w * (1.0 - 3.0 * u)
        rate += float(b["rate"]) * u * (1.0 - 3.0 * w)
        stretch = _stretched(a, b) * w + _stretched(b, a) * u
        return distance, abs(rate) * stretch


def _stretched(knot: Any, other: Any) -> float:
    """Driven path over programmed path; where it stands, as at the other end."""
    if not knot["rate"]:
        knot = other
    if not knot["rate"]:
        return 0.0
    return float(knot["speed"]) * 10.0 / abs(float(knot["rate"]))
