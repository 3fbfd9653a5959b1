"""What a recorded CNC does for a PLC that asks or commands otherwise than the
recorded one did: look-ahead requests are answered from the recorded elements,
commands count as taken.
"""

from __future__ import annotations

import ctypes
from itertools import pairwise
from typing import Any

import numpy as np

from cnc_core.units import AnyArray
from hli import layout
from hli.handshake import BLOCK_ROWS, ContourUnit
from hli.queue import BUSY, Queue
from hli.view import BLOCK_DTYPE

from .reading import Recording

Rows = AnyArray
NEAR = 1e-3  # 0.1 um: rounding of distances
# column of the table ``elements``: member of the block
COLUMNS = {
    "type": "block_type",
    "n": "block_number",
    "count": "block_count_r",
    "start": "start_position",
    "length": "length",
    "length_min": "length_min",
    "programmed_radius": "programmed_radius",
    "compensated_radius": "compensated_radius",
    "angle": "circle_angle",
    "turn": "tangent_variation",
}


class RecordedContour:
    """The elements of a recording as the blocks of answers."""

    def __init__(self, recording: Recording) -> None:
        count = 0
        if "elements" in recording.tables:
            count = len(recording.elements)
        self.blocks: Rows = np.zeros(count, BLOCK_DTYPE)
        self._epoch = np.zeros(count, np.int64)
        if count:
            table = recording.elements
            for column, member in COLUMNS.items():
                if column in table.columns:
                    self.blocks[member] = table[column]
            if "epoch" in table.columns:
                self._epoch = table["epoch"].astype(np.int64)
        starts = self.blocks["start_position"].astype(np.float64)
        self._begin, self._end = starts, starts + self.blocks["length"]
        # in the order of the path: so are the distances between two resets
        self._stretches: dict[int, slice] = {}
        cuts = np.flatnonzero(np.diff(self._epoch)) + 1
        for first, end in pairwise([0, *cuts.tolist(), count]):
            if end > first:
                self._stretches[int(self._epoch[first])] = slice(first, end)

    def answer(
        self, start: float, length: float, epoch: int, known: float
    ) -> Rows:
        """Blocks of the epoch (as the HLI counts them) from ``start`` over
        ``length``, as far as the contour is known; 0.1 um.
        """
        part = self._stretches.get(epoch - 1, slice(0, 0))
        begin, end = self._begin[part], self._end[part]
        first = int(np.searchsorted(end, start, side="right"))
        last = min(
            int(np.searchsorted(begin, start + length)),
            int(np.searchsorted(end, known + NEAR, side="right")),
        )
        found: Rows = self.blocks[part][first:last]
        return found


class Answers:
    """Stands in for the CNC where the new PLC has left the recorded way."""

    def __init__(self, areas: Any, recording: Recording) -> None:
        self._areas, self._recording = areas, recording
        self._contours: dict[int, RecordedContour] = {}
        self._base = areas.root._address
        channels = areas.gpCh[: areas.gNrCh]
        self._units = [_Unit(c, self._words) for c in channels]
        self._taken = [
            (unit, name, self._words(unit))
            for channel in channels
            for unit, name in _semaphores_of(channel)
        ]
        self._ahead = ahead = areas.gpAhead[0]
        self._queue = Queue(ahead)
        self._heeded = frozenset[int]().union(
            self._words(ahead),
            *(self._words(c.contour_lookahead) for c in channels),
            *(words for _, _, words in self._taken),
        )
        # the structures themselves: once a scan, nothing to check
        self._facts, self._state = ahead.answer._c, ahead.state._c
        self._shown = channels[0].bahn_state._c
        self._asked: list[int] = []  # units with a request of the new PLC
        self._slots: dict[int, int] = {}  # slots of its own: their words
        self._raised: list[tuple[Any, str]] = []
        self.log_requests = 0  # of the marked log: nothing can answer them

    def concern(self, differing: list[int]) -> bool:
        """Whether the CNC would do something about one of these words."""
        return not self._heeded.isdisjoint(differing)

    def before(self, differing: list[int]) -> None:
        """Note what the new PLC has asked for and commanded; ``differing``:
        words that the recorded PLC left otherwise.
        """
        self._asked, self._slots, self._raised = [], {}, []
        if not self.concern(differing):
            return
        for i, unit in enumerate(self._units):
            if unit.semaphore.semaphor_rw and not unit.words.isdisjoint(
                differing
            ):
                self._asked.append(i)
        self._raised = [
            (unit, name)
            for unit, name, words in self._taken
            if getattr(unit, name) and not words.isdisjoint(differing)
        ]
        slot = self._queue.asked()
        while slot != BUSY:
            word = layout.HLI_AHEAD.slot_rw.offset + 4 * slot
            place = (self._ahead._address - self._base + word) // 8
            words = self._words(self._ahead.slot[slot].request)
            if place in differing or not words.isdisjoint(differing):
                self._slots[slot] = self._ahead.slot_rw[slot]
            slot = self._queue.asked(slot + 1)

    def _words(self, view: Any, size: int = 0) -> frozenset[int]:
        """Words of a structure, or of its first bytes."""
        begin = view._address - self._base
        end = begin + (size or ctypes.sizeof(view._c))
        return frozenset(range((begin + 7) // 8, (end + 7) // 8))

    def after(self) -> None:
        """Answer and take what was noted, behind the recorded CNC's own changes."""
        for unit, name in self._raised:
            setattr(unit, name, False)
        for i in self._asked:
            asking = self._units[i]
            request = asking.request
            blocks = self._blocks(i, request.start_position, request.length)
            asking.unit.answer(blocks)
        for slot, word in self._slots.items():
            self._ahead.slot_rw[slot] = word
            request = self._ahead.slot[slot].request
            blocks = self._blocks(0, request.start_position, request.length)
            facts = self._facts_of(blocks)
            self._queue.answer(slot, blocks, blocks[:0], facts)

    def _blocks(self, channel: int, start: float, length: float) -> Rows:
        contour = self._contour(channel)
        if length == 0.0:
            self.log_requests += 1
            return contour.blocks[:0]
        known = self._units[channel].state.max_dist_prog_start
        # only the first channel shows how often its distance was reset
        epoch = self._state.epoch if channel == 0 else 1
        found = contour.answer(start, length, epoch, known)
        if channel:
            return found
        facts = self._facts
        facts.start_position, facts.length = start, length
        facts.mode = layout.HLI_AHEAD_MODE_CONTOUR
        facts.count = min(len(found), BLOCK_ROWS)
        for name, value in self._facts_of(found).items():
            setattr(facts, name, value)
        return found

    def _contour(self, channel: int) -> RecordedContour:
        """The recorded contour of a channel."""
        if channel not in self._contours:
            recording = self._recording
            if recording.channels:
                recording = recording.channel(recording.channels[channel])
            self._contours[channel] = RecordedContour(recording)
        return self._contours[channel]

    def _facts_of(self, blocks: Rows) -> dict[str, Any]:
        empty = layout.HLI_AHEAD_EMPTY_NOT_KNOWN
        return {
            "more": len(blocks) > BLOCK_ROWS,
            "end": layout.HLI_AHEAD_END_OPEN,
            "epoch": self._state.epoch,
            "dist_prog_start": self._shown.dist_prog_start,
            "empty": layout.HLI_AHEAD_NOT_EMPTY if len(blocks) else empty,
        }


class _Unit:
    """The look-ahead of a channel."""

    def __init__(self, channel: Any, words: Any) -> None:
        view = channel.contour_lookahead
        self.unit = ContourUnit(view)
        self.semaphore = view._c
        self.request, self.state = view.request._c, view.state._c
        self.words: frozenset[int] = words(
            view, layout.HLI_CONTOUR_LOOKAHEAD.response.offset
        )


def _semaphores_of(channel: Any) -> list[tuple[Any, str]]:
    """Units with the member that a PLC raises and the CNC takes."""
    bahn, mode = channel.bahn_mc_control, channel.channel_mc_control
    return [
        (bahn.insert_cmd, "command_semaphor_rw"),
        (mode.mode_and_state, "command_semaphor_rw"),
        (channel.lc_error, "semaphor_rw"),
        (channel.head.mc_watchdog, "alive_rw"),
    ]
