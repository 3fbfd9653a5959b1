"""From a place of the segment to its member, and whose the members are."""

from __future__ import annotations

import ctypes
import functools
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import layout

AREAS = {
    "platform": "gpPform",
    "channel": "gpCh",
    "axis": "gpAx",
    "ext_var_channel": "gpVECh",
    "ext_var_global": "gpVEGlobal",
    "ahead": "gpAhead",
    "sidecar": "sidecar",
    "segment_head": "segment_head",
}
# members that a PLC writes although their names do not end with _w or _rw
PLC_MEMBERS = {
    layout.HLI_CONTOUR_LOOKAHEAD: ("request",),
    layout.HLI_AHEAD_SLOT: ("request",),
    layout.HLI_EXT_VAR: ("value",),
}


class Member(NamedTuple):
    """A single value: its path, where it begins in the segment, its type."""

    path: str
    offset: int
    type: Any

    def value(self, memory: Any) -> Any:
        """The value in a copy of the segment's bytes."""
        found = self.type.from_buffer_copy(memory, self.offset)
        if layout.is_string(self.type):
            return found.value.decode("utf-8", "replace")
        if self.type is layout.BOOL:
            return bool(found.value)
        return found.value


def member_at(offset: int) -> Member | None:
    """The single value that holds this byte of the segment; None: none does."""
    ctype: Any = layout.HLI_SEGMENT
    path, begin = "", 0
    while not layout.is_string(ctype):
        if hasattr(ctype, "_length_"):
            item = ctype._type_
            index = (offset - begin) // ctypes.sizeof(item)
            path += f"[{index}]"
            begin += index * ctypes.sizeof(item)
            ctype = item
        elif issubclass(ctype, ctypes.Structure):
            name, inner = _field_at(ctype, offset - begin)
            if name.startswith("fill_"):
                return None
            begin += getattr(ctype, name).offset
            path = f"{path}.{name}" if path else AREAS[name]
            ctype = inner
        else:
            break
    return Member(path, begin, ctype)


def _fields_of(structure: Any) -> list[tuple[str, Any]]:
    return list(structure._fields_)


def _field_at(structure: Any, offset: int) -> tuple[str, Any]:
    for name, ctype in reversed(_fields_of(structure)):
        if getattr(structure, name).offset <= offset:
            return name, ctype
    raise IndexError(offset)


def plc_bytes(shared: bool = True) -> npt.NDArray[np.uint8]:
    """0xff for each byte of the segment that a PLC may write; ``shared``: those
    that the CNC writes too among them.  The sidecar is nobody's.
    """
    mask = np.zeros(ctypes.sizeof(layout.HLI_SEGMENT), np.uint8)
    for name, ctype in _fields_of(layout.HLI_SEGMENT):
        if name not in ("sidecar", "segment_head"):
            begin = getattr(layout.HLI_SEGMENT, name).offset
            part = _bytes_of(ctype, shared)
            mask[begin : begin + len(part)] = part
    return mask


@functools.cache
def _bytes_of(ctype: Any, shared: bool) -> npt.NDArray[np.uint8]:
    if not layout.is_string(ctype) and hasattr(ctype, "_length_"):
        return np.tile(_bytes_of(ctype._type_, shared), ctype._length_)
    mask = np.zeros(ctypes.sizeof(ctype), np.uint8)
    if issubclass(ctype, ctypes.Structure):
        for name, inner in _fields_of(ctype):
            begin = getattr(ctype, name).offset
            end = begin + ctypes.sizeof(inner)
            mask[begin:end] = (
                0xFF
                if _is_plc(ctype, name, shared)
                else _bytes_of(inner, shared)
            )
    return mask


def _is_plc(structure: Any, name: str, shared: bool) -> bool:
    if name in PLC_MEMBERS.get(structure, ()) or name.endswith("_rw"):
        return shared or name == "request"
    # the CNC takes an acknowledgement back
    return name.endswith("_w") and (shared or name != "done_w")
