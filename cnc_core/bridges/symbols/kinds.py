"""Types of symbols: numbers, texts, arrays, records; values from and to bytes."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from typing import Any

# name of the type -> character of struct
FORMATS = {
    "BOOL": "?",
    "BIT": "?",
    "SINT": "b",
    "USINT": "B",
    "BYTE": "B",
    "INT": "h",
    "UINT": "H",
    "WORD": "H",
    "DINT": "i",
    "UDINT": "I",
    "DWORD": "I",
    "TIME": "I",
    "DATE": "I",
    "TIME_OF_DAY": "I",
    "DATE_AND_TIME": "I",
    "LINT": "q",
    "ULINT": "Q",
    "LWORD": "Q",
    "LTIME": "Q",
    "LDATE": "Q",
    "LTIME_OF_DAY": "Q",
    "LDATE_AND_TIME": "Q",
    "REAL": "f",
    "LREAL": "d",
}


@dataclass(frozen=True)
class Number:
    """A single number or BOOL; ``name`` is that of the PLC's type."""

    name: str

    @property
    def code(self) -> str:
        return "<" + FORMATS[self.name]

    @property
    def size(self) -> int:
        return struct.calcsize(self.code)


@dataclass(frozen=True)
class Text:
    """STRING(length) or WSTRING(length), closed by a zero character."""

    length: int
    wide: bool = False
    encoding: str = "cp1252"

    @property
    def name(self) -> str:
        return f"{'W' if self.wide else ''}STRING({self.length})"

    @property
    def size(self) -> int:
        return (self.length + 1) * (2 if self.wide else 1)


@dataclass(frozen=True)
class Array:
    """Elements row by row; ``dims`` are (lowest index, count)."""

    element: Kind
    dims: tuple[tuple[int, int], ...]

    @property
    def name(self) -> str:
        ranges = ",".join(f"{low}..{low + n - 1}" for low, n in self.dims)
        return f"ARRAY [{ranges}] OF {self.element.name}"

    @property
    def count(self) -> int:
        return math.prod(n for _, n in self.dims)

    @property
    def size(self) -> int:
        return self.count * self.element.size


@dataclass(frozen=True)
class Member:
    """A part of a record; ``bit``: of a BIT, -1 for everything else."""

    name: str
    kind: Kind
    offset: int
    bit: int = -1


@dataclass(frozen=True, eq=False)
class Record:
    """A structure or an instance; ``members`` by their names in capitals.

    ``aliases``: further names in capitals, and the members that they mean.
    """

    name: str
    size: int
    members: dict[str, Member]
    aliases: dict[str, str] = field(default_factory=dict)

    def member(self, name: str) -> Member | None:
        """By any spelling; None: there is none."""
        upper = name.upper()
        return self.members.get(self.aliases.get(upper, upper))


Kind = Number | Text | Array | Record


def decode(kind: Kind, data: bytes) -> Any:
    """The value: a number, a text, a list (flat), or a dict of the members."""
    if isinstance(kind, Number):
        return struct.unpack_from(kind.code, data)[0]
    if isinstance(kind, Text):
        return _text(kind, data)
    if isinstance(kind, Array):
        return _elements(kind, data)
    return {
        part.name: decode(part.kind, data[part.offset :])
        for part in kind.members.values()
    }


def _elements(kind: Array, data: bytes) -> list[Any]:
    element = kind.element
    if isinstance(element, Number):
        code = f"<{kind.count}{FORMATS[element.name]}"
        return list(struct.unpack_from(code, data))
    size = element.size
    return [decode(element, data[k * size :]) for k in range(kind.count)]


def _text(kind: Text, data: bytes) -> str:
    if kind.wide:
        found = data[: kind.size].decode("utf-16-le", "replace")
        return found.partition("\0")[0]
    return (
        data[: kind.size].partition(b"\0")[0].decode(kind.encoding, "replace")
    )


def encode(kind: Kind, value: Any) -> bytes:
    """The bytes of a value; what is None or does not fit is zeros."""
    if isinstance(kind, Number):
        return _number(kind, value)
    if isinstance(kind, Text):
        return _text_bytes(kind, value)
    if isinstance(kind, Array):
        values = value if isinstance(value, list) else []
        values = [*values, *([None] * (kind.count - len(values)))]
        return b"".join(encode(kind.element, v) for v in values[: kind.count])
    data = bytearray(kind.size)
    given = value if isinstance(value, dict) else {}
    for part in kind.members.values():
        if part.bit >= 0:
            data[part.offset] |= bool(given.get(part.name)) << part.bit
            continue
        end = part.offset + part.kind.size
        data[part.offset : end] = encode(part.kind, given.get(part.name))
    return bytes(data)


def _number(kind: Number, value: Any) -> bytes:
    if value is None or isinstance(value, (str, list, dict)):
        value = 0
    try:
        return struct.pack(kind.code, value)
    except (struct.error, OverflowError):
        if kind.name in ("REAL", "LREAL"):
            return struct.pack(kind.code, math.nan)
        try:
            whole = int(value) & (1 << 8 * kind.size) - 1
        except (ValueError, OverflowError):
            return bytes(kind.size)
        return whole.to_bytes(kind.size, "little")


def _text_bytes(kind: Text, value: Any) -> bytes:
    text = value if isinstance(value, str) else ""
    encoding = "utf-16-le" if kind.wide else kind.encoding
    unit = 2 if kind.wide else 1
    data = text.encode(encoding, "replace")[: kind.length * unit]
    return data.ljust(kind.size, b"\0")
