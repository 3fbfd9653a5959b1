"""What CNC and PLC changed in the memory, scan by scan, for a replay.

Looked at twice a scan: when its inputs are latched, and at its end.  In
lockstep the CNC stands between the two, so the second look finds what the PLC
wrote, and the first one what the CNC wrote since.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from typing import Any

import numpy as np
from hli._sync import ffi, lib

from hli import layout
from hli.areas import Areas

from .image import InputImage

WORD = 8
_changes = lib.hs_trace_changes
Stretch = tuple[int, int, Any, Any]  # offset, bytes, source, guard


class MemoryTrace:
    """The words of one segment that changed since the last look."""

    def __init__(self, hli: Areas, image: InputImage) -> None:
        size = ctypes.sizeof(layout.HLI_SEGMENT)
        self._copy = np.zeros(size // WORD, np.uint64)
        stretches = list(_stretches(hli, image))
        self._keep = (hli, image)
        self._table = ffi.new("hs_stretch[]", len(stretches))
        for row, (offset, count, source, guard) in zip(
            self._table, stretches, strict=True
        ):
            row.source, row.guard = source, guard
            row.first, row.words = offset // WORD, count // WORD
        room = sum(row.words for row in self._table)
        self._at = ffi.new("uint32_t[]", room)
        self._values = ffi.new("uint64_t[]", room)
        self._bytes = ffi.buffer(self._at), ffi.buffer(self._values)
        self._arguments = (
            self._table,
            len(stretches),
            ffi.cast("uint64_t *", self._copy.ctypes.data),
            self._at,
            self._values,
        )

    def look(self) -> tuple[int, bytes, bytes]:
        """How many words changed, their numbers (uint32) and values (uint64)."""
        n: int = _changes(*self._arguments)
        at, values = self._bytes
        return n, at[: 4 * n], values[: 8 * n]


def _stretches(hli: Areas, image: InputImage) -> Iterator[Stretch]:
    """What is looked at: the configured areas, status as the scan has latched it."""
    base = hli.root._address
    latched = sorted(
        (_offset(copy.source, base), copy.size, copy.target)
        for copy in image.copies
    )
    for begin, size, guard in _areas(hli, base):
        at = begin
        for offset, count, target in latched:
            if begin <= offset < begin + size:
                if offset > at:
                    yield at, offset - at, _pointer(base + at), guard
                yield offset, count, target, ffi.NULL
                at = offset + count
        if at < begin + size:
            yield at, begin + size - at, _pointer(base + at), guard
    # the phase alone: cycle and time stand in the table plc
    phase = (
        layout.HLI_SEGMENT.sidecar.offset
        + layout.HLI_SIDECAR.cnc.offset
        + layout.HLI_SIDE_CNC.phase.offset
    )
    yield phase, WORD, _pointer(base + phase), ffi.NULL


def _areas(hli: Areas, base: int) -> Iterator[tuple[int, int, Any]]:
    """Offset, bytes and guard: what is large tells by a word of its own that it
    has changed.
    """
    views = [
        hli.gpPform,
        *hli.gpCh[: hli.gNrCh],
        *hli.gpAx[: hli.gNrAx],
        *hli.gpVECh[: hli.gNrCh],
        hli.gpVEGlobal,
    ]
    for view in views:
        yield view._address - base, ctypes.sizeof(view._c), ffi.NULL
    area = layout.HLI_AHEAD
    for view in hli.gpAhead[:1]:
        begin = view._address - base
        yield begin, area.plan.offset, ffi.NULL
        plan = begin + area.plan.offset
        seq = _pointer(base + plan + layout.HLI_AHEAD_PLAN.seq.offset)
        yield plan, area.plan.size, seq
        slots = begin + area.slot.offset
        size = ctypes.sizeof(layout.HLI_AHEAD_SLOT)
        for i in range(len(view.slot)):
            word = base + begin + area.slot_rw.offset + 4 * i
            yield slots + i * size, size, _pointer(word)


def _offset(pointer: Any, base: int) -> int:
    return int(ffi.cast("uintptr_t", pointer)) - base


def _pointer(address: int) -> Any:
    return ffi.cast("void *", address)
