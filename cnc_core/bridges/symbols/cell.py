"""A cell as bridges serve it: symbols by their paths, bytes there and back."""

from __future__ import annotations

import asyncio
import ctypes
import time
from collections.abc import Iterator
from typing import Any

from hli import layout
from hli.symbol import SymbolError

from ...observing.events import Events
from ...observing.observer import Observer
from ...observing.plc import PlcLine, RefusedError
from . import constants
from .hli_symbols import HliSymbols
from .kinds import Array, Number, Text, decode, encode
from .listing import index_text, parts_of_place
from .ownership import plc_leaves, writable
from .place import CONSTANT_SPACE, HLI_SPACE, Place, parts_of
from .plc_symbols import PlcSymbols

SEGMENT_SIZE = ctypes.sizeof(layout.HLI_SEGMENT)
LOOK_S = 0.05  # between two looks whether CNC and PLC live
ASK_AGAIN_S = 1.0  # for the PLC's symbols, if it did not tell them
WAITING_MAX = 256


class GoneError(Exception):
    """The CNC, or the PLC, is not there."""


class OwnedError(Exception):
    """The CNC owns what a client wants to write."""


class ServedCell:
    """One cell by its name, for the event loop of one server.

    ``edition`` grows with each CNC and PLC that comes or goes.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.events = Events()
        self.observer = Observer(name, self.events)
        self.line = PlcLine(name, WAITING_MAX)
        self.hli = HliSymbols(0, 0)
        self.plc = PlcSymbols()
        self.edition = 0
        self.halted = False  # by ``halt``
        self._life = 0
        self._plc_seen: tuple[int, int] | None = None
        self._asked_at = 0.0

    # -- life
    async def run(self) -> None:
        """Look after CNC and PLC until it is cancelled."""
        try:
            while True:
                await self.look()
                await asyncio.sleep(LOOK_S)
        finally:
            self.observer.close()

    async def look(self) -> None:
        """Whether CNC and PLC are there, and what symbols they have."""
        self.observer.look()
        areas = self.observer.areas
        if areas is not None and self.observer.life != self._life:
            self._life = self.observer.life
            self.hli = HliSymbols(areas.gNrCh, areas.gNrAx)
            self.edition += 1
        plc = self._plc_now()
        again = time.monotonic() - self._asked_at > ASK_AGAIN_S
        if plc != self._plc_seen and (plc is None or again):
            await self._ask_symbols(plc)

    def _plc_now(self) -> tuple[int, int] | None:
        areas = self.observer.areas
        if areas is None or not self.observer.plc_there:
            return None
        side = areas.sidecar.plc
        return int(side.pid), int(side.generation)

    async def _ask_symbols(self, plc: tuple[int, int] | None) -> None:
        self._asked_at = time.monotonic()
        self.halted = False
        if plc is None:  # its symbols stay known until another one comes
            self._plc_seen = None
            return
        try:
            told = await self.line.ask({"do": "symbols"})
        except RefusedError:
            return  # it may not have begun: again later
        self.plc = PlcSymbols(told)
        self._plc_seen = plc
        self.edition += 1

    @property
    def there(self) -> bool:
        """The CNC is there."""
        return self.observer.areas is not None

    @property
    def plc_there(self) -> bool:
        """A PLC is attached."""
        return self.there and self.observer.plc_there

    @property
    def cycle_s(self) -> float:
        """The cycle of the cell, s."""
        areas = self.observer.areas
        return areas.sidecar.cnc.cycle_ns * 1e-9 if areas else 0.001

    def told(self) -> str:
        """For people: the cell, and which clock it has."""
        facts = self.observer.facts()
        if not facts["there"]:
            return f"cell {self.name!r} is not there yet"
        clock = facts["clock"]
        kind = "live" if clock == "realtime" else "virtual time"
        return f"cell {self.name!r}, clock {clock} ({kind})"

    # -- symbols
    def find(self, path: str) -> Place:
        """SymbolError: there is no such symbol."""
        parts = parts_of(path)
        if parts[0] in self.plc:
            return self.plc.find(parts, path)
        if constants.named(parts):
            return constants.find(parts, path)
        return self.hli.find(parts, path)

    def roots(self) -> Iterator[Place]:
        """Areas of the HLI and its constants, then programs and tasks of the PLC."""
        yield from self.hli.roots()
        yield from constants.roots()
        yield from self.plc.roots()

    # -- bytes
    def read_hli(self, offset: int, size: int) -> bytes:
        """Bytes of the segment.  GoneError."""
        areas = self.observer.areas
        if areas is None:
            raise GoneError(self.observer.problem)
        if offset < 0 or offset + size > SEGMENT_SIZE:
            raise SymbolError("these bytes are not in the HLI")
        return ctypes.string_at(areas.segment.base + offset, size)

    def read_now(self, place: Place) -> bytes:
        """The bytes of a symbol that the PLC need not be asked for."""
        return self.read_part(place, 0, place.size)

    def read_part(self, place: Place, begin: int, length: int) -> bytes:
        """Bytes of such a symbol, from one on.  GoneError."""
        begin += place.offset
        if place.space == CONSTANT_SPACE:
            return constants.VALUES[begin : begin + length]
        return self.read_hli(begin, length)

    async def read(self, places: list[Place]) -> list[bytes]:
        """The bytes of symbols.  GoneError, RefusedError."""
        asked = [p for p in places if p.of_plc]
        values = await self._fetch(asked) if asked else {}
        return [
            encode(place.kind, _value(place, values))
            if place.of_plc
            else self.read_now(place)
            for place in places
        ]

    async def _fetch(self, places: list[Place]) -> dict[str, Any]:
        if not self.plc_there:
            raise GoneError(f"no PLC is attached to cell {self.name!r}")
        paths = [p.path for place in places for p in _singles(place)]
        unique = [*dict.fromkeys(paths)]
        answer = await self.line.ask({"do": "fetch", "symbols": unique})
        return dict(zip(unique, answer["values"], strict=True))

    async def write(self, place: Place, data: bytes) -> None:
        """Set a symbol, by the PLC.

        OwnedError: the CNC owns it.  GoneError: there is no PLC.
        RefusedError: the PLC refuses the value.
        """
        if not self.there:
            raise GoneError(self.observer.problem)
        if not writable(place):
            raise OwnedError(f"the CNC owns {place.path}, or it is constant")
        if not self.plc_there:
            raise GoneError(f"no PLC is attached to cell {self.name!r}")
        await self.line.ask(
            {"do": "assign", "symbols": assignments(place, data)}
        )

    async def halt(self, value: bool) -> None:
        """Leave the logic of the PLC's tasks out, or run it again.

        GoneError, RefusedError.
        """
        if not self.plc_there:
            raise GoneError(f"no PLC is attached to cell {self.name!r}")
        answer = await self.line.ask({"do": "halt", "value": value})
        self.halted = answer["halted"]


def assignments(place: Place, data: bytes) -> list[list[Any]]:
    """Paths and values of what the PLC is to set."""
    mine = place.space == HLI_SPACE
    found = plc_leaves(place) if mine else [*_singles(place)]
    pairs = []
    for part in found:
        at = part.offset - place.offset
        value = decode(part.kind, data[at : at + part.size])
        if part.bit >= 0:
            value = bool(data[at] >> part.bit & 1)
        pairs.append([part.path, value])
    return pairs


def _singles(place: Place) -> Iterator[Place]:
    """Single values, and arrays of them, in a symbol of the PLC."""
    kind = place.kind
    if isinstance(kind, (Number, Text)) or (
        isinstance(kind, Array) and isinstance(kind.element, (Number, Text))
    ):
        yield place
    else:
        for part in _inner(place):
            yield from _singles(part)


def _inner(place: Place) -> Iterator[Place]:
    kind = place.kind
    if not isinstance(kind, Array):
        yield from parts_of_place(place)
        return
    for k in range(kind.count):
        at = place.offset + k * kind.element.size
        path = f"{place.path}[{index_text(kind, k)}]"
        yield Place(path, kind.element, place.space, at)


def _value(place: Place, values: dict[str, Any]) -> Any:
    """The value of a symbol of the PLC, put together from its parts."""
    if place.path in values:
        return values[place.path]
    kind = place.kind
    if isinstance(kind, Array):
        return [_value(part, values) for part in _inner(place)]
    return {
        part.path.rpartition(".")[2]: _value(part, values)
        for part in parts_of_place(place)
    }
