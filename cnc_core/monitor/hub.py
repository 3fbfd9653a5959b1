"""One cell for all its pages: samples, frames, what the PLC was asked."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time
from collections import deque
from collections.abc import Callable
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
SLOW_S = 0.1  # between two looks at what changes slowly
ASK_S = 0.1  # between two readings of variables of the PLC
STATISTICS_S = 0.4  # between two readings of its statistics
CNC_S, CNC_IDLE_S = (
    0.15,
    1.0,
)  # between two looks at dialogs, with pages and without
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
        self.on_life: Callable[[], object] = lambda: (
            None
        )  # another CNC is there
        self.pages = 0
        self.idle_since = time.monotonic()
        self.taken = 0.0  # when the newest sample was taken
        self._cycle = (0, 0.0)  # the last one, and when it was new
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
        self._statistics_at = 0.0
        self.cnc: dict[str, Any] = {}  # dialog, and how far the program is
        self.cnc_at = 0.0
        self._said = 0  # number of the last text of the CNC
        self.wanted: dict[str, int] = {}  # paths to ask for, with their pages

    def _cell_s(self) -> float | None:
        sight = self.observer.sight
        return sight.cell_s if sight else None

    # -- the task
    async def run(self) -> None:
        """Sample until it is cancelled."""
        asking = [
            asyncio.create_task(task()) for task in (self._ask, self._ask_cnc)
        ]
        try:
            while True:
                self._look()
                await asyncio.sleep(SAMPLE_S if self.pages else IDLE_S)
        finally:
            for task in asking:
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await task
            self.observer.close()

    def _look(self) -> None:
        sight = self.observer.look()
        if sight is None or not sight.take():
            return
        self.taken = time.monotonic()
        if self.observer.life != self._life:
            self._life = self.observer.life
            self._trail.clear()
            self._said = 0
            self._cycle = 0, self.taken
            self.on_life()
        if sight.cycle != self._cycle[0]:
            self._cycle = sight.cycle, self.taken
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
        """A new error in the channel's error unit, if the CNC does not tell it
        in words.
        """
        areas = self.observer.areas
        assert areas is not None
        head: Any = areas.gpCh[0].mc_error._c.satz_r.kopf
        found = int(head.error_id), int(head.cycle)
        if found[0] and found != self._error and not self.cnc:
            text = f"error {found[0]}"
            place = f", line {head.line}" if head.line > 0 else ""
            self.events.add("error", text + place, cell_s=self._cell_s())
        self._error = found

    async def _ask(self) -> None:
        """Ask the PLC for what pages want of it; a page has its frames first."""
        await asyncio.sleep(STATISTICS_S)
        while True:
            await asyncio.sleep(ASK_S)
            sight = self.observer.sight
            plc = sight and sight.areas.sidecar.plc.attached
            if not self.pages or not plc:
                self.statistics = {}
                continue
            with contextlib.suppress(RefusedError):
                await self._ask_plc()

    async def _ask_plc(self) -> None:
        now = time.monotonic()
        if now - self._statistics_at > STATISTICS_S:
            self.statistics = await self.desk.ask({"do": "statistics"})
            self._statistics_at = time.monotonic()
        if self.wanted:
            order = {"do": "read", "symbols": [*self.wanted]}
            begun = time.monotonic()
            answer = await self.desk.ask(order)
            self.asked.update(answer["values"])
            self.asked_at = begun

    async def _ask_cnc(self) -> None:
        """Ask the CNC for dialogs and for what its program says."""
        while True:
            await asyncio.sleep(CNC_S if self.pages else CNC_IDLE_S)
            if self.observer.sight is None:
                self.cnc = {}
                continue
            order = {"do": "look", "since": self._said}
            order["attended"] = self.pages > 0
            begun = time.monotonic()
            try:
                self.cnc = await self.desk.look(order)
            except RefusedError:  # of another user, or just ending
                self.cnc = {}
                continue
            self.cnc_at = begun
            for number, wall, kind, text in self.cnc.pop("said"):
                self._said = number
                self.events.add(kind, text, "CNC", self._cell_s(), wall)

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
            "cycle_age_ms": round((now - self._cycle[1]) * 1e3, 1),
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
        return found | self._slow | self._told(now)

    def _told(self, now: float) -> dict[str, Any]:
        """What PLC and CNC tell when they are asked, with its age, ms."""

        def age(at: float) -> int | None:
            return round((now - at) * 1e3) if at else None

        return {
            "plc": self.statistics,
            "plc_age_ms": age(self._statistics_at),
            "asked_age_ms": age(self.asked_at),
            "asked": [*self.wanted],
            "dialog": self.cnc.get("dialog"),
            "prepared": self.cnc.get("prepared", {}),
            "cnc_age_ms": age(self.cnc_at) if self.cnc else None,
        }

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
