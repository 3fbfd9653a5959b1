"""Entries of symbols and types, as uploads and questions for one give them."""

from __future__ import annotations

import struct

from ..symbols.kinds import Array, Kind, Number, Record, Text
from ..symbols.ownership import writable
from ..symbols.place import CONSTANT_SPACE, HLI_SPACE, Place
from .codes import Group

SYMBOL = struct.Struct("<IIIIIHHHHH")
TYPE = struct.Struct("<IIIIIIIIHHHHH")
DIMENSION = struct.Struct("<iI")
IS_TYPE, IS_ITEM = 0x1, 0x2
READ_ONLY = 0x20
BIG, STRING, WSTRING, BIT = 65, 30, 31, 33
NUMBERS = {
    "BOOL": 33,
    "BIT": 33,
    "SINT": 16,
    "USINT": 17,
    "BYTE": 17,
    "INT": 2,
    "UINT": 18,
    "WORD": 18,
    "DINT": 3,
    "UDINT": 19,
    "DWORD": 19,
    "TIME": 19,
    "DATE": 19,
    "TIME_OF_DAY": 19,
    "DATE_AND_TIME": 19,
    "LINT": 20,
    "ULINT": 21,
    "LWORD": 21,
    "LTIME": 21,
    "LDATE": 21,
    "LTIME_OF_DAY": 21,
    "LDATE_AND_TIME": 21,
    "REAL": 4,
    "LREAL": 5,
}
VERSION = 1


def type_number(kind: Kind) -> int:
    """ADST_* of a type; that of the elements for an array."""
    if isinstance(kind, Array):
        return type_number(kind.element)
    if isinstance(kind, Text):
        return WSTRING if kind.wide else STRING
    return NUMBERS[kind.name] if isinstance(kind, Number) else BIG


def address(place: Place) -> tuple[int, int]:
    """Index group and offset of a symbol."""
    if place.space == HLI_SPACE:
        return Group.HLI, place.offset
    if place.space == CONSTANT_SPACE:
        return Group.CONSTANTS, place.offset
    if place.bit >= 0:
        return Group.PLC_BITS + place.space, 8 * place.offset + place.bit
    return Group.PLC + place.space, place.offset


def _texts(*texts: str) -> bytes:
    return b"".join(t.encode("cp1252", "replace") + b"\0" for t in texts)


def _dims(kind: Kind) -> tuple[tuple[int, int], ...]:
    return kind.dims if isinstance(kind, Array) else ()


def symbol_entry(place: Place) -> bytes:
    """The entry of a symbol."""
    kind = place.kind
    dims = _dims(kind)
    tail = _texts(place.path, kind.name, "")
    tail += b"".join(DIMENSION.pack(*dim) for dim in dims)
    head = SYMBOL.pack(
        SYMBOL.size + len(tail),
        *address(place),
        kind.size,
        type_number(kind),
        0 if writable(place) else READ_ONLY,
        len(dims),
        len(place.path),
        len(kind.name),
        0,
    )
    return head + tail


def handle_details(place: Place) -> bytes:
    """What stands behind a new handle if a client has room for it."""
    name = place.kind.name.encode("cp1252", "replace")
    head = struct.pack("<IIH", place.size, type_number(place.kind), len(name))
    return head + name + b"\0"


def type_entry(kind: Kind) -> bytes:
    """The entry of a type, with those of its members."""
    items = b""
    count = 0
    base = kind.element.name if isinstance(kind, Array) else ""
    if isinstance(kind, Record):
        parts = kind.members.values()
        count = len(parts)
        items = b"".join(
            _entry(part.name, part.kind.name, part.kind, part.offset, IS_ITEM)
            for part in parts
        )
    return _entry(kind.name, base, kind, 0, IS_TYPE, count, items)


def _entry(
    name: str,
    type_name: str,
    kind: Kind,
    offset: int,
    flags: int,
    count: int = 0,
    items: bytes = b"",
) -> bytes:
    dims = _dims(kind)
    tail = _texts(name, type_name, "")
    tail += b"".join(DIMENSION.pack(*dim) for dim in dims) + items
    head = TYPE.pack(
        TYPE.size + len(tail),
        VERSION,
        0,
        0,
        kind.size,
        offset,
        type_number(kind),
        flags,
        len(name),
        len(type_name),
        0,
        len(dims),
        count,
    )
    return head + tail
