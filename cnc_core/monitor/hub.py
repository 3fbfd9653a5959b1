"""One cell for all its pages: samples, frames, what the PLC was asked."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time
from collections.abc import Callable
from typing import Any

from hli.symbol import Symbol, SymbolError

from ..observing.events import Events
from ..observing.observer import Observer
from ..observing.plc import RefusedError
from .actions import Desk
from .channel import WatchedChannel
from .source import Source

SAMPLE_S = 0.01
IDLE_S = 0.05  # between two looks at what nobody has open
FRAME_S = 0.05
ASK_S = 0.1  # between two readings of variables of the PLC
STATISTICS_S = 0.4  # between two readings of its statistics
CNC_S, CNC_IDLE_S = (
    0.15,
    1.0,
)  # between two looks at dialogs, with pages and without


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
        self.desk.title = self._title
        self.on_life: Callable[[], object] = lambda: (
            None
        )  # another CNC is there
        self.pages = 0
        self.chosen: dict[str, int] = {}  # channel by page
        self.idle_since = time.monotonic()
        self.channels: list[WatchedChannel] = []  # of the CNC that is there
        self._source = source
        self._routes = 0  # programs read so far
        self._reading = asyncio.Lock()
        self._life = 0
        self._tasks: set[asyncio.Task[Any]] = set()
        self.asked: dict[str, Any] = {}  # of the PLC: values by path
        self.asked_at = 0.0
        self.statistics: dict[str, Any] = {}
        self._statistics_at = 0.0
        self.cnc: dict[str, Any] = {}  # dialog, and how far the programs are
        self.cnc_at = 0.0
        self._said = 0  # number of the last text of the CNC
        self.wanted: dict[str, int] = {}  # paths to ask for, with their pages

    def _cell_s(self) -> float | None:
        sight = self.observer.sight
        return sight.cell_s if sight else None

    def _title(self, order: dict[str, Any]) -> str:
        """The channel that an order is for, ahead of its text."""
        index = int(order.get("channel", 0))
        if order["do"] == "operate" and index < len(self.channels):
            return self.channels[index].title
        name = str((self.cnc.get("dialog") or {}).get("channel", ""))
        if order["do"] == "answer" and name:
            return f"channel {name}: "
        return ""

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
        if self.observer.look() is None:
            for channel in self.channels:
                channel.leave()
            return
        if self.observer.life != self._life:
            self._begin()
        shown = {self.channel(index) for index in self.chosen.values()}
        late = time.monotonic() - IDLE_S
        for channel in self.channels:
            due = channel in shown or channel.taken <= late
            if due and channel.look():
                self._look_for_news(channel)

    def _begin(self) -> None:
        """Another CNC is there, maybe with other channels."""
        self._life, self._said = self.observer.life, 0
        self.channels = [
            WatchedChannel(i, self.observer, None if i else self._source)
            for i in range(len(self.observer.sights))
        ]
        self.on_life()

    def channel(self, index: int) -> WatchedChannel | None:
        """A channel, the first one where there is none of this index; None: no
        CNC was seen.
        """
        if not self.channels:
            return None
        return self.channels[index if index < len(self.channels) else 0]

    def _look_for_news(self, channel: WatchedChannel) -> None:
        """Errors that the CNC does not tell in words, and another program,
        which is read beside the sampling.
        """
        error = channel.new_error()
        if error and not self.cnc:
            self.events.add("error", error, cell_s=self._cell_s())
        name = channel.new_program()
        if name is None:
            return
        pid = self.observer.pid
        task = asyncio.create_task(self._read(channel, name, pid))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _read(self, channel: WatchedChannel, name: str, pid: int) -> None:
        """One program at a time: each has its whole time to be read."""
        async with self._reading:
            self._routes += 1
            await channel.read(name, self._routes, pid)

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
                self._forget()
                continue
            order = {"do": "look", "since": self._said}
            order["attended"] = self.pages > 0
            begun = time.monotonic()
            try:
                self.cnc = await self.desk.look(order)
            except RefusedError:  # of another user, or just ending
                self._forget()
                continue
            self.cnc_at = begun
            self._tell_channels(self.cnc.pop("prepared", {}))
            for number, wall, kind, text in self.cnc.pop("said"):
                self._said = number
                self.events.add(kind, text, "CNC", self._cell_s(), wall)

    def _forget(self) -> None:
        """The CNC tells nothing."""
        self.cnc = {}
        for channel in self.channels:
            channel.prepared = {}

    def _tell_channels(self, facts: dict[str, Any]) -> None:
        """How far the programs are; of several channels also their names."""
        each = facts.pop("channels", [facts])
        for channel, told in zip(self.channels, each, strict=False):
            channel.told(told)

    # -- what pages take
    def frame(self, index: int = 0) -> dict[str, Any]:
        """What all pages of this channel show now."""
        cell = self.observer.facts()
        cell["channels"] = [channel.called for channel in self.channels]
        channel = self.channel(index)
        if channel is None:
            return {"cell": cell, "channel": 0, "route": 0}
        if channel.sight is None:
            return {"cell": cell} | channel.frame()
        return {"cell": cell} | self._told(time.monotonic()) | channel.frame()

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
            "cnc_age_ms": age(self.cnc_at) if self.cnc else None,
        }

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
