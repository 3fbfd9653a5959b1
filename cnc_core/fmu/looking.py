"""What an FMU shows beside single numbers of the memory: M functions and the
contour ahead.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from hli._sync import ffi, lib

from hli import layout
from hli.areas import Areas
from hli.handshake import BLOCK_ROWS, word_pointer
from hli.queue import BUSY
from hli.view import BLOCK_DTYPE
from plc_client.blocks.ahead import extension_of
from plc_client.blocks.program_flow import TechnoArray

from .variables import ARRAY, NO_FUNCTION

FAR = 1e9  # 0.1 um: as far as the CNC knows
RANGE = 0xFFFFFF  # of a PLC's generation in the word of a slot


class Functions:
    """The M functions of the channel: ``last`` the last ones, the newest first,
    ``count`` how many there were.

    A unit holds a new function where it offers one in front of the scan, and
    did not behind the scan before.
    """

    def __init__(self, hli: Areas) -> None:
        channel = hli.gpCh[0]
        self._arrays = [
            TechnoArray(channel, "gpCh[0]", late) for late in (False, True)
        ]
        self._behind = [0, 0]
        self.count = 0
        self.last = [NO_FUNCTION] * ARRAY

    def before_scan(self) -> None:
        for array, behind in zip(self._arrays, self._behind, strict=True):
            fresh = array.offered_units & ~behind
            while fresh:
                index = (fresh & -fresh).bit_length() - 1
                fresh &= fresh - 1
                self._note(array, index)

    def behind_scan(self) -> None:
        """Those that the PLC has not fetched yet."""
        self._behind = [array.offered_units for array in self._arrays]

    def _note(self, array: TechnoArray, index: int) -> None:
        function = array.function(index)
        if function.kind == "M":
            self.count += 1
            self.last = [int(function.number), *self.last[: ARRAY - 1]]


class Ahead:
    """The contour ahead of the tool: ``count`` elements stand in ``rows``, the
    rest of the first ones is 0.

    ``ask`` in front of a cycle, ``take`` behind it: they never wait.
    """

    def __init__(self, hli: Areas) -> None:
        area = extension_of(hli.gpCh[0])
        self.rows = np.zeros(BLOCK_ROWS, BLOCK_DTYPE)
        self.count = 0
        self._slot = BUSY
        self._ends = area is None
        if area is None:
            return
        self._area: Any = area._pointer()
        self._bell = word_pointer(hli.root, "clah_bell")
        self._generation = int(hli.sidecar.plc.generation) & RANGE
        self._requests = [slot.request._c for slot in area.slot]
        self._facts = layout.HLI_AHEAD_ANSWER()
        self._to = (
            ffi.cast("void *", self.rows.ctypes.data),
            ffi.NULL,
            ffi.cast("void *", ctypes.addressof(self._facts)),
        )

    def ask(self, distance: float) -> None:
        """What comes from here on (0.1 um), unless a request is under way."""
        if self._ends or self._slot >= 0:
            return
        slot = lib.hs_ahead_claim(self._area, self._generation)
        if slot < 0:
            return
        request = self._requests[slot]
        request.start_position, request.length = distance, FAR
        request.mode = layout.HLI_AHEAD_MODE_CONTOUR
        request.flags = request.epoch = request.tag = 0
        lib.hs_ahead_ask(self._area, self._bell, slot, self._generation)
        self._slot = slot

    def take(self) -> None:
        if self._slot < 0:
            return
        count = lib.hs_ahead_take(
            self._area, self._slot, self._generation, *self._to
        )
        if count == BUSY:
            return
        self._slot = BUSY
        if count < 0:
            return  # another PLC's
        if count < self.count:
            self.rows[count : self.count] = np.zeros(1, BLOCK_DTYPE)
        self.count = count
