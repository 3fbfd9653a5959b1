"""The PLC's input image: what the CNC shows, latched once per scan.

In lockstep the CNC stands while the PLC scans; in freerun and realtime it runs
on, and a task that reads ``dist_prog_start`` twice would see two values.  With
an image all tasks of one scan see the same state, the same in every clock:
``bahn_state``, ``decoder_state`` and ``contour_lookahead.state`` of the
channels (each consistent under the seqlock), ``lr_state`` of the axes.
Control units, semaphores, technology units stay the memory itself.
"""

from __future__ import annotations

import ctypes
import mmap
import time
from typing import Any

from hli._sync import ffi, lib

from hli import layout
from hli.areas import Areas
from hli.errors import HliTimeout
from hli.handshake import OK, word_pointer
from hli.view import root_of, spelling, view_class

_latch = lib.hs_image_latch
# at once; behind them with pauses, for a CNC that lost its core while it wrote
_TRIES = 1000
_PAUSE_S = 50e-6
_LIMIT_S = 2.0


class _Copy:
    """One stretch of the memory and its private copy.  The copies of an image
    lie as far from each other as their stretches: one distance leads from the
    memory to all of them.
    """

    def __init__(
        self, mirror: mmap.mmap, area: Any, offset: int, size: int
    ) -> None:
        place = area._address + offset - root_of(area)._address
        self.bytes = (ctypes.c_char * size).from_buffer(mirror, place)
        self.source = area._pointer(offset)
        self.target = ffi.cast("void *", ctypes.addressof(self.bytes))
        self.size = size

    def structure(
        self, cls: type[ctypes.Structure], offset: int = 0
    ) -> ctypes.Structure:
        return cls.from_buffer(self.bytes, offset)


class InputImage:
    """Replaces the status views of a connection by views of copies; ``latch()``
    refreshes them, in one C call.

    ``now``: what was latched (cffi ``hs_image``): ``now.cycle``,
    ``now.cell_time_ns``, ``now.phase``. ``close()`` gives the views of the
    memory back.  Views taken before stay what they were.
    """

    def __init__(self, hli: Areas) -> None:
        if not isinstance(hli, Areas):
            raise TypeError(f"InputImage: takes hli; not {spelling(hli)}")
        # pages that hold no copy are never touched
        self._mirror = mmap.mmap(-1, ctypes.sizeof(layout.HLI_SEGMENT))
        self._replaced: list[tuple[Any, str]] = []
        self._locked: list[_Copy] = []
        self._plain: list[_Copy] = []
        for channel in hli.gpCh:
            if channel is not None:
                self._channel(channel)
        for area in hli.gpAhead:
            if area is not None:
                self._extension(area)
        for axis in hli.gpAx:
            if axis is not None:
                self._axis(axis)
        self.now = self._native(hli)
        self.latch()

    def _channel(self, channel: Any) -> None:
        """``decoder_state`` and ``bahn_state`` lie side by side: one copy."""
        start, status = (
            layout.HLI_CHANNEL.decoder_state.offset,
            layout.HLI_CHANNEL.bahn_state,
        )
        both = _Copy(
            self._mirror, channel, start, status.offset + status.size - start
        )
        self._replace(
            channel, "decoder_state", both.structure(layout.HLI_DECODER_STATE)
        )
        self._replace(
            channel,
            "bahn_state",
            both.structure(layout.HLI_BAHN_STATE, status.offset - start),
        )
        unit, state = (
            channel.contour_lookahead,
            layout.HLI_CONTOUR_LOOKAHEAD.state,
        )
        ahead = _Copy(self._mirror, unit, state.offset, state.size)
        self._replace(
            unit, "state", ahead.structure(layout.HLI_CONTOUR_LOOKAHEAD_STATE)
        )
        self._locked += [both, ahead]

    def _extension(self, area: Any) -> None:
        place = layout.HLI_AHEAD.state
        copy = _Copy(self._mirror, area, place.offset, place.size)
        self._replace(area, "state", copy.structure(layout.HLI_AHEAD_STATE))
        self._locked.append(copy)

    def _axis(self, axis: Any) -> None:
        place = layout.HLI_AXIS.lr_state
        copy = _Copy(self._mirror, axis, place.offset, place.size)
        self._replace(axis, "lr_state", copy.structure(layout.HLI_LR_STATE))
        self._plain.append(copy)

    def _replace(
        self, view: Any, name: str, structure: ctypes.Structure
    ) -> None:
        view._replace(name, view_class(type(structure))(structure, view))
        self._replaced.append((view, name))

    def _native(self, hli: Areas) -> Any:
        """The plan of copies as the C function takes it."""
        side = layout.HLI_SIDE_CNC
        # kept alive here
        self._tables = [
            _table(copies) for copies in (self._locked, self._plain)
        ]
        image = ffi.new("hs_image *")
        image.seq = word_pointer(hli.root, "channel_seq")
        cnc = hli.sidecar.cnc
        image.cycle_at = cnc._pointer(side.cycle.offset)
        image.cell_time_at = cnc._pointer(side.cell_time_ns.offset)
        image.phase_at = cnc._pointer(side.phase.offset)
        image.together, image.single = self._tables
        image.together_count, image.single_count = (
            len(self._locked),
            len(self._plain),
        )
        return image

    @property
    def copies(self) -> list[_Copy]:
        """What is latched: where it stands in the memory, and its copy."""
        return [*self._locked, *self._plain]

    def latch(self) -> None:
        """Copy everything once; with one channel its copies belong to one cycle.
        HliTimeout: the CNC died while it wrote.
        """
        if _latch(self.now, _TRIES) != OK:
            self._latch_patiently()

    def _latch_patiently(self) -> None:
        end = time.monotonic() + _LIMIT_S
        while _latch(self.now, _TRIES) != OK:
            if time.monotonic() > end:
                raise HliTimeout(
                    f"input image: no undisturbed copy of the channel's state within {_LIMIT_S} s"
                )
            time.sleep(_PAUSE_S)

    def close(self) -> None:
        """The connection's status views read the memory again."""
        for view, name in self._replaced:
            view._restore(name)
        self._replaced.clear()


def _table(copies: list[_Copy]) -> Any:
    table = ffi.new("hs_copy[]", len(copies))
    for row, copy in zip(table, copies, strict=True):
        row.source, row.target, row.size = copy.source, copy.target, copy.size
    return table
