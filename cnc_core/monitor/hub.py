"""One cell for all its pages: samples, frames, what the PLC was asked."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time
from collections import deque
from typing import Any

from hli.symbol import Symbol, SymbolError

from ..observing.events import Events
from ..observing.observer import Observer
from ..observing.plc import RefusedError
from .actions import Desk
from .functions import in_units
from .route import Route, read_route
from .source import Source, source_of

SAMPLE_S = 0.01
IDLE_S = 0.05  # between two looks while nobody has a page open
FRAME_S = 0.05
SLOW_S = 0.25  # between two looks at what changes slowly
ASK_S = 0.2  # between two readings of variables of the PLC
TRAIL = 20_000
FIRST_TRAIL = 4000


class Hub:
    """Looks at a cell; pages take frames from it.

    ``run`` is its task.  ``pages`` counts those that are open.
    """

    def __init__(
        self, name: str, source: Source | None = None, *, keep: bool = False
    ) -> None:
        self.events = Events()
        self.observer = Observer(name, self.events)
        self.desk = Desk(name, self.events, keep=keep)
        self.desk.cell_s = self._cell_s
        self.pages = 0
        self.idle_since = time.monotonic()
        self.taken = 0.0  # when the newest sample was taken
        self.route: Route | None = None
        self.route_number = 0
        self._source = source
        self._program: tuple[int, str] | None = None
        self._trail: deque[list[float]] = deque(maxlen=TRAIL)
        self.trail_end = 0  # samples taken so far
        self._life = 0
        self._slow: dict[str, Any] = {}
        self._slow_at = 0.0
        self._error = (0, 0)
        self._tasks: set[asyncio.Task[Any]] = set()
        self.asked: dict[str, Any] = {}  # of the PLC: values by path
        self.asked_at = 0.0
        self.statistics: dict[str, Any] = {}
        self.wanted: dict[str, int] = {}  # paths to ask for, with their pages

    def _cell_s(self) -> float | None:
        sight = self.observer.sight
        return sight.cell_s if sight else None

    # -- the task
    async def run(self) -> None:
        """Sample until it is cancelled."""
        asking = asyncio.create_task(self._ask())
        try:
            while True:
                self._look()
                await asyncio.sleep(SAMPLE_S if self.pages else IDLE_S)
        finally:
            asking.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await asking
            self.observer.close()

    def _look(self) -> None:
        sight = self.observer.look()
        if sight is None or not sight.take():
            return
        self.taken = time.monotonic()
        if self.observer.life != self._life:
            self._life = self.observer.life
            self._trail.clear()
        sample = sight.sample()
        last = self._trail[-1] if self._trail else None
        if last is None or sample[1:] != last[1:]:
            self._trail.append(sample)
            self.trail_end += 1
        self._look_for_error()
        self._look_for_program()

    def _look_for_program(self) -> None:
        """Read the program that the cell has now, beside the sampling."""
        sight = self.observer.sight
        assert sight is not None
        name = sight.program()
        if self._program == (self._life, name):
            return
        self._program = self._life, name
        source = self._source
        if source is None or (name and source.program.name != name):
            source = source_of(self.observer.pid, name)
        task = asyncio.create_task(self._read(source, name))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _read(self, source: Source | None, name: str) -> None:
        if source is None:
            problem = "its file is not known: give --program FILE"
            self.route = Route(name, problem=problem)
        else:
            self.route = await asyncio.to_thread(read_route, source)
        self.route_number += 1

    def _look_for_error(self) -> None:
        """A new error in the channel's error unit."""
        areas = self.observer.areas
        assert areas is not None
        head: Any = areas.gpCh[0].mc_error._c.satz_r.kopf
        found = int(head.error_id), int(head.cycle)
        if found[0] and found != self._error:
            text = f"error {found[0]}"
            place = f", line {head.line}" if head.line > 0 else ""
            self.events.add("error", text + place, cell_s=self._cell_s())
        self._error = found

    async def _ask(self) -> None:
        """Ask the PLC for what pages want of it."""
        while True:
            await asyncio.sleep(ASK_S)
            sight = self.observer.sight
            plc = sight and sight.areas.sidecar.plc.attached
            if not self.pages or not plc:
                self.statistics = {}
                continue
            with contextlib.suppress(RefusedError):
                self.statistics = await self.desk.ask({"do": "statistics"})
                if self.wanted:
                    order = {"do": "read", "symbols": [*self.wanted]}
                    answer = await self.desk.ask(order)
                    self.asked.update(answer["values"])
                self.asked_at = time.monotonic()

    # -- what pages take
    def frame(self) -> dict[str, Any]:
        """What all pages show now."""
        now = time.monotonic()
        sight = self.observer.sight
        found: dict[str, Any] = {
            "cell": self.observer.facts(),
            "route": self.route_number,
        }
        if sight is None or not sight.taken:
            return found
        found |= {
            "age_ms": round((now - self.taken) * 1e3, 1),
            "motion": sight.motion(),
            "axes": sight.positions(),
        }
        if now - self._slow_at > SLOW_S:
            self._slow_at = now
            self._slow = {
                "contour": sight.contour(),
                "functions": in_units(sight.areas),
                "counters": sight.counters(),
            }
        age = round((now - self.asked_at) * 1e3) if self.asked_at else None
        return found | self._slow | {"plc": self.statistics, "plc_age_ms": age}

    def trail(self, begin: int) -> list[list[float]]:
        """Samples from this number on, as far as they are kept."""
        missing = self.trail_end - begin
        if missing <= 0:
            return []
        kept = list(self._trail)[-missing:]
        step = max(1, math.ceil(len(kept) / FIRST_TRAIL))
        return kept[::-step][::-1]

    async def symbol(self, path: str) -> Symbol | None:
        """A variable of the HLI; None: the PLC knows it, and is asked for it.

        RefusedError: nobody knows it.
        """
        areas = self.observer.areas
        if areas is None:
            raise RefusedError(self.observer.problem)
        try:
            return areas.symbol(path)
        except SymbolError as error:
            problem = str(error)
        try:
            await self.desk.ask({"do": "read", "symbols": [path]})
        except RefusedError as error:
            raise RefusedError(
                f"{error}" if "symbol" in str(error) else problem
            ) from None
        return None


def as_text(value: dict[str, Any]) -> str:
    """JSON that a page can read: no NaN in it."""
    try:
        return json.dumps(value, allow_nan=False, separators=(",", ":"))
    except ValueError:
        return json.dumps(finite(value), separators=(",", ":"))


def finite(value: Any) -> Any:
    """The same with None for what is no finite number."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return value
