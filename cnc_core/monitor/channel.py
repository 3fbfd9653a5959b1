"""One channel of a cell for the pages that look at it: trail, program, contour."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from typing import Any

from ..observing.observer import Observer
from ..observing.sight import Sight
from .functions import axis_areas, in_units
from .route import Route, read_route
from .source import Source, source_of

SLOW_S = 0.1  # between two looks at what changes slowly
TRAIL = 20_000
FIRST_TRAIL = 4000
UNKNOWN = "its file is not known: give --program FILE"


class WatchedChannel:
    """A channel of one CNC, by its index.

    ``name``: of the cell file, as soon as it is known.  ``source``: its
    program, where somebody has named it.
    """

    def __init__(
        self, index: int, observer: Observer, source: Source | None
    ) -> None:
        self.index = index
        self.name = ""
        self.home = range(observer.sights[index].areas.gNrAx)  # axis areas
        self.sight: Sight | None = observer.sights[index]
        self.taken = 0.0  # when the newest sample was taken
        self.route: Route | None = None
        self.route_number = 0
        self.prepared: dict[str, Any] = {}
        self.trail_end = 0  # samples taken so far
        self._observer = observer
        self._several = len(observer.sights) > 1
        self._source = source
        self._program: str | None = None
        self._trail: deque[list[float]] = deque(maxlen=TRAIL)
        self._cycle = (0, time.monotonic())  # the last one, when it was new
        self._slow: dict[str, Any] = {}
        self._slow_at = 0.0
        self._error = (0, 0)

    @property
    def title(self) -> str:
        """Ahead of what is told of it, in a cell with several channels."""
        return f"channel {self.called}: " if self._several else ""

    @property
    def called(self) -> str:
        """Its name, else its number from 1 on."""
        return self.name or str(self.index + 1)

    def told(self, facts: dict[str, Any]) -> None:
        """What the CNC says of it."""
        self.prepared = facts
        self.name = str(facts.get("name", ""))
        if "areas" in facts:
            self.home = range(*facts["areas"])

    # -- looks
    def leave(self) -> None:
        """The CNC is gone: let go of its memory."""
        self.sight, self.prepared = None, {}

    def look(self) -> bool:
        """Take a sample; False: not now."""
        sight = self.sight
        if sight is None or not sight.take():
            return False
        self.taken = time.monotonic()
        if sight.cycle != self._cycle[0]:
            self._cycle = sight.cycle, self.taken
        sample = sight.sample()
        last = self._trail[-1] if self._trail else None
        if last is None or sample[1:] != last[1:]:
            self._trail.append(sample)
            self.trail_end += 1
        return True

    def new_error(self) -> str:
        """A new error in its error unit, in words; empty: none."""
        assert self.sight is not None
        number, cycle, line = self.sight.error()
        before, self._error = self._error, (number, cycle)
        if not number or before == self._error:
            return ""
        place = f", line {line}" if line > 0 else ""
        return f"{self.title}error {number}{place}"

    def new_program(self) -> str | None:
        """The name of its program, if it is another one now."""
        assert self.sight is not None
        name = self.sight.program()
        if name == self._program:
            return None
        self._program = name
        return name

    async def read(self, name: str, number: int, pid: int) -> None:
        """Read this program of a process, beside the sampling."""
        found = await asyncio.to_thread(self._read, name, pid)
        if name == self._program:  # not yet another one
            self.route, self.route_number = found, number

    def _read(self, name: str, pid: int) -> Route:
        source = self._source
        if source is None or (name and source.program.name != name):
            source = source_of(pid, name, self.index)
        if source is None:
            return Route(name, problem=UNKNOWN if name else "")
        return read_route(source)

    # -- what pages take
    def frame(self) -> dict[str, Any]:
        """What its pages show now."""
        found: dict[str, Any] = {
            "channel": self.index,
            "route": self.route_number,
        }
        sight, now = self.sight, time.monotonic()
        if sight is None or not sight.taken:
            return found
        if now - self._slow_at > SLOW_S:
            self._slow_at, self._slow = now, self._slowly(sight)
        found |= {
            "age_ms": round((now - self.taken) * 1e3, 1),
            "cycle_age_ms": round((now - self._cycle[1]) * 1e3, 1),
            "motion": sight.motion(),
            "axes": sight.positions(),
            "prepared": self.prepared,
        }
        return found | self._slow

    def _slowly(self, sight: Sight) -> dict[str, Any]:
        sights = self._observer.sights
        axes = axis_areas(sight.areas, sights, self.index, self.home)
        return {
            "contour": sight.contour(),
            "functions": in_units(sight.areas, self.index, axes),
            "counters": sight.counters(),
        }

    def trail(self, begin: int) -> list[list[float]]:
        """Samples from this number on, as far as they are kept."""
        missing = self.trail_end - begin
        if missing <= 0:
            return []
        kept = list(self._trail)[-missing:]
        step = max(1, math.ceil(len(kept) / FIRST_TRAIL))
        return kept[::-step][::-1]
