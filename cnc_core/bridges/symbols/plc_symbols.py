"""The symbols of the PLC's tasks, as its process describes them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hli.symbol import SymbolError

from .kinds import FORMATS, Array, Kind, Member, Number, Record, Text
from .place import Place, walk

LEVELS_MAX = 32


class PlcSymbols:
    """Roots by their names; each is a space of its own, from byte 0 on.

    ``told``: the answer of the order ``symbols`` (``plc_client.listing``).
    """

    def __init__(self, told: dict[str, Any] | None = None) -> None:
        told = told or {"types": [], "roots": []}
        self._rows = told["types"]
        self._kinds: dict[int, Kind | None] = {}
        self._roots: dict[str, tuple[str, int]] = {}
        self.spaces: list[Place] = []
        for name, number in told["roots"]:
            kind = self._kind(number)
            if kind is None or name.upper() in self._roots:
                continue
            space = len(self.spaces)
            self._roots[name.upper()] = name, space
            self.spaces.append(Place(name, kind, space, 0))

    def _kind(self, number: int, level: int = 0) -> Kind | None:
        """None: a pointer and the like, which no other process can follow."""
        if number not in self._kinds:
            made = None
            if level < LEVELS_MAX:
                made = self._made(self._rows[number], level + 1)
            self._kinds[number] = made
        return self._kinds[number]

    def _made(self, row: list[Any], level: int) -> Kind | None:
        what = row[0]
        if what in ("e", "n"):
            return Number(row[1]) if row[1] in FORMATS else None
        if what == "s":
            return Text(row[1], row[2], row[3] if len(row) > 3 else "cp1252")
        if what == "a":
            element = self._kind(row[1], level)
            dims = tuple((low, high - low + 1) for low, high in row[2])
            return Array(element, dims) if element else None
        if what == "t":
            return self._record(row, level)
        return None

    def _record(self, row: list[Any], level: int) -> Record:
        _, name, size, members = row
        found = {}
        for member, (number, offset, bit) in members.items():
            kind = self._kind(number, level)
            if kind is not None:
                found[member.upper()] = Member(member, kind, offset, bit)
        return Record(name, size, found)

    def __contains__(self, name: str) -> bool:
        return name.upper() in self._roots

    def find(self, parts: list[str], path: str) -> Place:
        """SymbolError: there is no such symbol."""
        found = self._roots.get(parts[0].upper())
        if found is None:
            raise SymbolError(f"symbol {path!r}: {parts[0]} is unknown")
        return walk(self.spaces[found[1]], parts[1:], path)

    def roots(self) -> Iterator[Place]:
        """Programs, lists of globals, tasks."""
        yield from self.spaces
