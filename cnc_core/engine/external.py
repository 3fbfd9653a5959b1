"""External variables (V.E) in the memory that CNC and PLC share: 24-byte
blocks, little-endian.

Every variable begins with a block of its own; the elements of an array follow
each other, a long text takes several blocks (hli_reference 7.1).  There is no
handshake: single values are read and written whole.
"""

from __future__ import annotations

import ctypes
from typing import Any

from ..errors import CncError
from ..frontend.machine import External

BLOCK_BYTES = 24
AREA_BYTES = 24_000
TYPES: dict[str, Any] = {
    "BOOLEAN": ctypes.c_uint8,
    "SGN08": ctypes.c_int8,
    "UNS08": ctypes.c_uint8,
    "SGN16": ctypes.c_int16,
    "UNS16": ctypes.c_uint16,
    "SGN32": ctypes.c_int32,
    "UNS32": ctypes.c_uint32,
    "REAL64": ctypes.c_double,
}


def place(variable: External, element: int) -> int:
    """Byte of the area where an element begins."""
    return variable.place(element)


def read(area: Any, variable: External, element: int) -> float | str:
    """The element as it is now; a number that is not finite reads as 0."""
    begin = place(variable, element)
    if variable.type == "STRING":
        raw = (
            (ctypes.c_char * (variable.characters + 1))
            .from_buffer(area, begin)
            .raw
        )
        return raw.partition(b"\0")[0].decode("latin-1")
    value = float(TYPES[variable.type].from_buffer(area, begin).value)
    return value if abs(value) < float("inf") else 0.0


def write(
    area: Any, variable: External, element: int, value: float | str
) -> None:
    begin = place(variable, element)
    if isinstance(value, str):
        try:
            raw = value.encode("latin-1")
        except UnicodeEncodeError:
            raise CncError(
                907054,
                f"V.E.{variable.name}: the text has characters beyond Latin-1",
            ) from None
        target = (ctypes.c_char * (variable.characters + 1)).from_buffer(
            area, begin
        )
        ctypes.memmove(
            target,
            raw[: variable.characters] + b"\0",
            min(len(raw), variable.characters) + 1,
        )
        return
    kind = TYPES[variable.type]
    kind.from_buffer(area, begin).value = (
        value if kind is ctypes.c_double else int(value)
    )
