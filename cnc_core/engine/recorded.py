"""Rows that the engine records, as numpy sees the C structs."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np

from cnc_core._engine import ffi, lib
from cnc_core.units import AnyArray

Rows = AnyArray


class Recorded(IntEnum):
    """What is recorded: one ring each."""

    SAMPLES = lib.ENGINE_RECORD_SAMPLES
    FUNCTIONS = lib.ENGINE_RECORD_FUNCTIONS
    REQUESTS = lib.ENGINE_RECORD_REQUESTS


ROW_STRUCTS = {
    Recorded.SAMPLES: "engine_sample",
    Recorded.FUNCTIONS: "engine_function",
    Recorded.REQUESTS: "engine_request",
}
_NUMPY = {
    "double": "f8",
    "uint64_t": "u8",
    "int64_t": "i8",
    "uint32_t": "u4",
    "int32_t": "i4",
}


def row_type(struct: str, axes: int = 0) -> np.dtype[Any]:
    """The dtype of a C struct of numbers; ``axes``: length of an open array at
    its end.
    """
    c_type = ffi.typeof(struct)
    names, formats, offsets = [], [], []
    size = ffi.sizeof(struct)
    for name, member in c_type.fields or ():
        names.append(name)
        offsets.append(member.offset)
        if member.type.kind == "array":
            formats.append(f"({axes},){_NUMPY[member.type.item.cname]}")
            size = member.offset + 8 * axes
        else:
            formats.append(_NUMPY[member.type.cname])
    return np.dtype(
        {
            "names": names,
            "formats": formats,
            "offsets": offsets,
            "itemsize": size,
        }
    )
