"""The queue of the look-ahead extension over views: thin Python around the C
functions of ``hli._sync``, which do all ordering.
"""

from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import layout
from ._sync import ffi, lib
from .handshake import BLOCK_ROWS, word_pointer
from .structures import HLI_AHEAD
from .view import BLOCK_DTYPE, expect, root_of

DETAIL_DTYPE = np.dtype(layout.HLI_AHEAD_DETAIL)
Rows = np.ndarray[Any, Any]
Held = list[int]  # the slot that a block holds, or BUSY

GONE: int = lib.HS_GONE
BUSY: int = lib.HS_BUSY
_GENERATIONS = 0xFFFFFF
_left: dict[int, list[Held]] = {}  # by area: slots whose block is gone


@dataclass(frozen=True)
class Ask:
    """A request of the queue; the members of HLI_AHEAD_REQUEST."""

    start_position: float = 0.0
    length: float = 0.0
    mode: int = layout.HLI_AHEAD_MODE_CONTOUR
    flags: int = 0
    epoch: int = 0
    tag: int = 0


@dataclass(frozen=True)
class Told:
    """An answer of the queue, an own copy: elements, details (empty unless asked
    for), the members of HLI_AHEAD_ANSWER.
    """

    blocks: Rows
    details: Rows
    facts: Any


def _slot_checked(slot: int) -> None:
    """Raises IndexError for a slot that the memory does not have."""
    if not 0 <= slot <= layout.HLI_AHEAD_SLOT_MAXIDX:
        raise IndexError(
            f"slot {slot}: the index runs 0..{layout.HLI_AHEAD_SLOT_MAXIDX}"
        )


class Queue:
    """The slots of one channel's extension, as one PLC task uses them: ``ask``
    and ``take`` never wait.
    """

    def __init__(self, ahead: HLI_AHEAD) -> None:
        expect(ahead, "Queue", "hli.gpAhead[0]", layout.HLI_AHEAD)
        root: Any = root_of(ahead)
        self._view: Any = ahead
        self._area = ahead._pointer()
        self._bell = word_pointer(root, "clah_bell")
        self._answer = word_pointer(root, "clah_answer")
        self._plc = root.sidecar.plc
        self._address = ahead._address
        self._rows: Rows = np.zeros(BLOCK_ROWS, BLOCK_DTYPE)
        self._details: Rows = np.zeros(BLOCK_ROWS, DETAIL_DTYPE)

    @property
    def generation(self) -> int:
        """Whose slots they are: changes with every attachment of a PLC."""
        return int(self._plc.generation) & _GENERATIONS

    # -- PLC side
    def hold_for(self, block: Any) -> Held:
        """A place for the slot that ``block`` holds; when the block is gone, the
        slot's answer is taken by whoever asks next.
        """
        held = [BUSY]
        left = _left.setdefault(self._address, [])
        weakref.finalize(block, left.append, held)
        return held

    def _take_left(self) -> None:
        left = _left.get(self._address, [])
        for _ in range(len(left)):
            try:
                held = left.pop(0)  # no other task looks at it meanwhile
            except IndexError:
                return
            if held[0] >= 0 and self.take(held[0]) == BUSY:
                left.append(held)

    def ask(self, ask: Ask) -> int:
        """Claim a slot and place the request: its slot, or BUSY."""
        self._take_left()
        slot: int = lib.hs_ahead_claim(self._area, self.generation)
        if slot < 0:
            return BUSY
        request = self._view.slot[slot].request._c
        request.start_position, request.length = ask.start_position, ask.length
        request.mode, request.flags = ask.mode, ask.flags
        request.epoch, request.tag = ask.epoch, ask.tag
        lib.hs_ahead_ask(self._area, self._bell, slot, self.generation)
        return slot

    def take(self, slot: int, details: bool = False) -> Told | int:
        """The answer, and the slot is free again; BUSY while there is none,
        GONE: the slot is another PLC's.
        """
        _slot_checked(slot)
        facts = layout.HLI_AHEAD_ANSWER()
        n: int = lib.hs_ahead_take(
            self._area,
            slot,
            self.generation,
            ffi.cast("void *", self._rows.ctypes.data),
            ffi.cast("void *", self._details.ctypes.data)
            if details
            else ffi.NULL,
            ffi.cast("void *", ctypes.addressof(facts)),
        )
        if n < 0:
            return n
        return Told(
            self._rows[:n].copy(),
            self._details[: n if details else 0].copy(),
            facts,
        )

    # -- CNC side (the mock, tests)
    def asked(self, first: int = 0) -> int:
        """The next slot with a request, or BUSY."""
        if first < 0:
            _slot_checked(first)
        return int(lib.hs_ahead_asked(self._area, first))

    def answer(
        self, slot: int, blocks: Rows, details: Rows, facts: dict[str, Any]
    ) -> None:
        """Answer the request of a slot; facts are members of HLI_AHEAD_ANSWER."""
        _slot_checked(slot)
        place = self._view.slot[slot]
        request, told = place.request._c, place.answer._c
        count = len(blocks)
        place.block.as_array()[:count] = blocks
        if count < BLOCK_ROWS:
            place.block.as_array()[count:] = np.zeros(1, BLOCK_DTYPE)
        if len(details):
            place.detail.as_array()[:count] = details
        told.mode, told.tag = request.mode, request.tag
        told.start_position, told.length = (
            request.start_position,
            request.length,
        )
        for name, value in facts.items():
            setattr(told, name, value)
        told.count = count
        lib.hs_ahead_answer(self._area, self._answer, slot)
