"""The symbols of the HLI, by the vendor's paths."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Iterator
from typing import Any

from hli import layout
from hli.symbol import NAMESPACES, SymbolError
from hli.view import aliases_of

from .kinds import Array, Kind, Member, Number, Record, Text
from .place import HLI_SPACE, Place, index_numbers, walk

GVL = "HLI_Global_Variables"
NUMBERS = {
    layout.BOOL: "BOOL",
    layout.BYTE: "BYTE",
    layout.INT: "INT",
    layout.UINT: "UINT",
    layout.DINT: "DINT",
    layout.UDINT: "UDINT",
    layout.LREAL: "LREAL",
    layout.ULINT: "ULINT",
    layout.LINT: "LINT",
}
SINGLE = {
    "GPPFORM": ("gpPform", "platform"),
    "GPVEGLOBAL": ("gpVEGlobal", "ext_var_global"),
}
# pointer -> spelling, member of the segment, count in the head
LISTS = {
    "GPCH": ("gpCh", "channel", "channel_count"),
    "GPAX": ("gpAx", "axis", "axis_count"),
    "GPVECH": ("gpVECh", "ext_var_channel", "channel_count"),
    "GPAHEAD": ("gpAhead", "ahead", "channel_count"),
}
COUNTS = {"GNRCH": ("gNrCh", "channel_count"), "GNRAX": ("gNrAx", "axis_count")}


@functools.cache
def kind_of(ctype: Any) -> Kind:
    """The type of a member of the layout."""
    if ctype in NUMBERS:
        return Number(NUMBERS[ctype])
    if layout.is_string(ctype):
        return Text(ctype._length_ - 1, encoding="utf-8")
    base, dims = layout.element_type(ctype)
    if dims:
        return Array(kind_of(base), tuple((0, n) for n in dims))
    if ctype is layout.HLI_EXT_VAR:  # an ARRAY OF UDINT by itself
        return kind_of(_members_of(ctype)["value"])
    return _record(ctype)


def _record(structure: Any) -> Record:
    members = {
        name.upper(): Member(
            name, kind_of(ctype), getattr(structure, name).offset
        )
        for name, ctype in _members_of(structure).items()
    }
    aliases = {a.upper(): m.upper() for a, m in aliases_of(structure)}
    size = ctypes.sizeof(structure)
    return Record(structure.__name__, size, members, aliases)


def _members_of(structure: Any) -> dict[str, Any]:
    return dict(structure._fields_)


def _fields() -> dict[str, tuple[Any, int]]:
    return {
        name: (ctype, getattr(layout.HLI_SEGMENT, name).offset)
        for name, ctype in _members_of(layout.HLI_SEGMENT).items()
    }


class HliSymbols:
    """The symbols of an HLI with so many channels and axes."""

    def __init__(self, channels: int, axes: int) -> None:
        self._counts = {"channel_count": channels, "axis_count": axes}
        self._fields = _fields()

    def _configured(self, pointer: str) -> int:
        _, member, count = LISTS[pointer]
        length: int = self._fields[member][0]._length_
        return min(self._counts[count], length)

    def find(self, parts: list[str], path: str) -> Place:
        """SymbolError: there is no such symbol, or its pointer is NULL."""
        if parts[0].upper() in NAMESPACES and len(parts) > 1:
            parts = parts[1:]
        name = parts[0].upper()
        if name in LISTS:
            place, rest = self._of_list(name, parts, path)
        elif name in SINGLE:
            place, rest = self._single(name), parts[1:]
        elif name in COUNTS:
            place, rest = self._count(name), parts[1:]
        else:
            raise SymbolError(f"symbol {path!r}: {parts[0]} is unknown")
        if (
            rest
            and rest[0].upper() == "VALUE"
            and isinstance(place.kind, Array)
        ):
            rest = rest[1:]
        return walk(place, rest, path)

    def _of_list(
        self, name: str, parts: list[str], path: str
    ) -> tuple[Place, list[str]]:
        spelled = LISTS[name][0]
        if len(parts) < 2 or not parts[1].startswith("["):
            raise SymbolError(f"symbol {path!r}: {spelled} needs an index")
        index, *more = index_numbers(path, parts[1])
        if more or not 0 <= index < self._configured(name):
            raise SymbolError(
                f"symbol {path!r}: {spelled}[{index}] is not configured"
                " (its pointer is NULL)"
            )
        return self._area(name, index), parts[2:]

    def _area(self, name: str, index: int) -> Place:
        spelled, member, _ = LISTS[name]
        ctype, offset = self._fields[member]
        size = ctypes.sizeof(ctype._type_)
        path = f"{GVL}.{spelled}[{index}]^"
        kind = kind_of(ctype._type_)
        return Place(path, kind, HLI_SPACE, offset + index * size)

    def _single(self, name: str) -> Place:
        spelled, member = SINGLE[name]
        ctype, offset = self._fields[member]
        return Place(f"{GVL}.{spelled}^", kind_of(ctype), HLI_SPACE, offset)

    def _count(self, name: str) -> Place:
        spelled, member = COUNTS[name]
        head = layout.HLI_SEGMENT.segment_head.offset
        offset = head + getattr(layout.HLI_SEGMENT_HEAD, member).offset
        return Place(f"{GVL}.{spelled}", Number("UDINT"), HLI_SPACE, offset)

    def roots(self) -> Iterator[Place]:
        """All areas that are there."""
        yield from (self._count(name) for name in COUNTS)
        yield from (self._single(name) for name in SINGLE)
        for name in LISTS:
            for index in range(self._configured(name)):
                yield self._area(name, index)
