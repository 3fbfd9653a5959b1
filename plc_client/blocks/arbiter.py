"""One control unit, many function blocks: requests are served first come, first served.

The arbiter of a unit holds at most one waiting request per function block and places the next one as soon as the unit
is free, whoever's call notices it.  A function block that is no longer called therefore holds nothing: its waiting
request is placed and its answer is fetched for it by the others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple
from weakref import WeakValueDictionary

import numpy as np
from hli._sync import lib

from hli.handshake import ContourUnit

from .. import stats


class Request(NamedTuple):
    """What was asked: index and 0 (mode 1), or start distance and range in 0.1 um (mode 2)."""

    start_position: float
    length: float


Deliver = Callable[[Request, "np.ndarray[Any, Any]"], None]


class Arbiter:
    """Who may use the unit next.  ``Arbiter.of(unit)`` gives the one of a control unit."""

    _all: WeakValueDictionary[int, Arbiter] = WeakValueDictionary()

    def __init__(self, unit: Any) -> None:
        self._unit = ContourUnit(unit)
        self._waiting: dict[Deliver, Request] = {}  # in order of arrival
        self._pending: tuple[Deliver, Request, int] | None = None

    @classmethod
    def of(cls, unit: Any) -> Arbiter:
        """The arbiter of this control unit; it lives as long as a function block uses it."""
        found = cls._all.get(unit._address)
        if found is None:
            found = cls._all[unit._address] = cls(unit)
        return found

    def enqueue(self, deliver: Deliver, request: Request) -> None:
        """Ask for the unit; a request still waiting is replaced and keeps its place."""
        self._waiting[deliver] = request

    def is_waiting(self, deliver: Deliver) -> bool:
        """Whether a request of this function block waits for its turn (it is not placed yet)."""
        return deliver in self._waiting

    def serve(self) -> None:
        """Fetch a finished answer for whoever asked, then place the next request if the unit is free."""
        if self._pending is not None and (n := self._unit.take()) >= 0:
            deliver, request, placed_ns = self._pending
            self._pending = None
            stats.HANDSHAKES.add(lib.hs_monotonic_ns() - placed_ns)
            deliver(request, self._unit.rows[:n].copy())
        if self._pending is None and self._waiting:
            self._place()

    def _place(self) -> None:
        deliver, request = next(iter(self._waiting.items()))
        placed_ns = lib.hs_monotonic_ns()
        if self._unit.request(*request):
            del self._waiting[deliver]
            self._pending = (deliver, request, placed_ns)
