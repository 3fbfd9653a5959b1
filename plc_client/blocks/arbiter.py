"""One control unit, many function blocks: requests are served first come, first
served.

The arbiter of a unit holds at most one waiting request per function block and
places the next one as soon as the unit is free, whoever's call notices it.  A
function block that is no longer called therefore holds nothing: its waiting
request is placed and its answer is fetched for it by the others.
"""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic_ns
from typing import Any, NamedTuple
from weakref import WeakValueDictionary

import numpy as np

from hli.handshake import ContourUnit

from .. import stats


class Request(NamedTuple):
    """What was asked: index and 0 (mode 1), or start distance and range in 0.1
    um (mode 2).
    """

    start_position: float
    length: float


Asked = tuple[float, float]  # what becomes a Request when somebody looks at it
Answer = tuple[Asked, "np.ndarray[Any, Any]"]
Deliver = Callable[[Asked, "np.ndarray[Any, Any]"], None]


class Arbiter:
    """Who may use the unit next.

    ``Arbiter.of(unit)`` gives the one of a control unit.
    """

    _all: WeakValueDictionary[int, Arbiter] = WeakValueDictionary()

    def __init__(self, unit: Any) -> None:
        self._unit = ContourUnit(unit)
        self._waiting: dict[Deliver, Asked] = {}  # in order of arrival
        self._owner: Deliver | None = None  # who has placed a request
        self._request: Asked = (0.0, 0.0)

    @classmethod
    def of(cls, unit: Any) -> Arbiter:
        """The arbiter of this control unit; it lives as long as a function
        block uses it.
        """
        found = cls._all.get(unit._address)
        if found is None:
            found = cls._all[unit._address] = cls(unit)
        return found

    def enqueue(self, deliver: Deliver, request: Asked) -> None:
        """Ask for the unit; a request still waiting is replaced and keeps its place."""
        self._waiting[deliver] = request

    def is_waiting(self, deliver: Deliver) -> bool:
        """Whether a request of this function block waits for its turn (it is
        not placed yet).
        """
        return deliver in self._waiting

    def serve(self) -> None:
        """Fetch a finished answer for whoever asked, then place the next
        request if the unit is free.
        """
        if self._owner is not None and (n := self._unit.take()) >= 0:
            deliver, self._owner = self._owner, None
            stats.HANDSHAKES.add(monotonic_ns() - self._unit.asked_ns)
            deliver(self._request, self._unit.copy(n))
        if self._owner is None and self._waiting:
            self._place()

    def next(
        self, deliver: Deliver, start_position: float, length: float
    ) -> Answer | None:
        """The short way of a block that asks in every scan: take its answer and
        place its next request at once.

        None, and nothing was done, if the answer is not there yet, another
        block owns the unit or waits for it, or the request is not finite: the
        way over ``enqueue`` and ``serve`` tells these apart.
        """
        if self._owner is not deliver or self._waiting:
            return None
        unit = self._unit
        n = unit.next(start_position, length)
        if n < 0:
            return None
        stats.HANDSHAKES.add(unit.took_ns)
        answered = self._request
        self._request = (float(start_position), float(length))
        return answered, unit.taken

    def rest(self, n: int) -> tuple[bool, int]:
        """(more, empty) of the answer of ``n`` elements that was taken last."""
        return self._unit.rest(n)

    def _place(self) -> None:
        deliver, request = next(iter(self._waiting.items()))
        self._unit.asked_ns = monotonic_ns()
        if self._unit.request(*request):
            del self._waiting[deliver]
            self._owner, self._request = deliver, request
