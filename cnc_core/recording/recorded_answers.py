"""What a recorded CNC does for a PLC that asks or commands otherwise than the
recorded one did: look-ahead requests are answered from the recorded elements,
commands count as taken.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import numpy.typing as npt

from hli import layout
from hli.handshake import BLOCK_ROWS, ContourUnit
from hli.queue import BUSY, Queue
from hli.view import BLOCK_DTYPE

from .reading import Recording

Rows = npt.NDArray[Any]
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

    def answer(
        self, start: float, length: float, epoch: int, known: float
    ) -> Rows:
        """Blocks of the epoch (as the HLI counts them) from ``start`` over
        ``length``, as far as the contour is known; 0.1 um.
        """
        chosen = (
            (self._epoch == epoch - 1)
            & (self._end > start)
            & (self._begin < start + length)
            & (self._end <= known + NEAR)
        )
        found: Rows = self.blocks[chosen]
        return found


class Answers:
    """Stands in for the CNC where the new PLC has left the recorded way."""

    def __init__(self, areas: Any, recording: Recording) -> None:
        self._areas, self._recording = areas, recording
        self._contour: RecordedContour | None = None
        self._units = [
            ContourUnit(channel.contour_lookahead)
            for channel in areas.gpCh[: areas.gNrCh]
        ]
        self._queue = Queue(areas.gpAhead[0])
        self._base = areas.root._address
        self._asked: list[int] = []  # units with a request of the new PLC
        self._slots: dict[int, int] = {}  # slots of its own: their words
        self._raised: list[tuple[Any, str]] = []
        self.log_requests = 0  # of the marked log: nothing can answer them

    def before(self, differing: list[int]) -> None:
        """Note what the new PLC has asked for and commanded; ``differing``:
        words that the recorded PLC left otherwise.
        """
        self._asked, self._slots, self._raised = [], {}, []
        if not differing:
            return
        at = np.array(differing) * 8
        for i, channel in enumerate(self._areas.gpCh[: self._areas.gNrCh]):
            unit = channel.contour_lookahead
            if unit.semaphor_rw and self._inside(
                at, unit, layout.HLI_CONTOUR_LOOKAHEAD.response.offset
            ):
                self._asked.append(i)
            self._raised += self._semaphores(channel, at)
        area = self._areas.gpAhead[0]
        slot = self._queue.asked()
        while slot != BUSY:
            word = layout.HLI_AHEAD.slot_rw.offset + 4 * slot
            place = area._address - self._base + word
            request = area.slot[slot].request
            if place // 8 * 8 in at or self._inside(
                at, request, ctypes.sizeof(request._c)
            ):
                self._slots[slot] = area.slot_rw[slot]
            slot = self._queue.asked(slot + 1)

    def _inside(self, at: Rows, view: Any, size: int) -> bool:
        begin = view._address - self._base
        return bool(((at >= begin) & (at < begin + size)).any())

    def _semaphores(self, channel: Any, at: Rows) -> list[tuple[Any, str]]:
        """What the PLC raises and the CNC takes."""
        bahn, mode = channel.bahn_mc_control, channel.channel_mc_control
        found = [
            (bahn.insert_cmd, "command_semaphor_rw"),
            (mode.mode_and_state, "command_semaphor_rw"),
            (channel.lc_error, "semaphor_rw"),
            (channel.head.mc_watchdog, "alive_rw"),
        ]
        return [
            (unit, name)
            for unit, name in found
            if getattr(unit, name)
            and self._inside(at, unit, ctypes.sizeof(unit._c))
        ]

    def after(self) -> None:
        """Answer and take what was noted, behind the recorded CNC's own changes."""
        for unit, name in self._raised:
            setattr(unit, name, False)
        for i in self._asked:
            unit = self._units[i]
            request = unit.view.request
            unit.answer(self._blocks(i, request.start_position, request.length))
        for slot, word in self._slots.items():
            area = self._areas.gpAhead[0]
            area.slot_rw[slot] = word
            request = area.slot[slot].request
            blocks = self._blocks(0, request.start_position, request.length)
            self._queue.answer(slot, blocks, blocks[:0], self._facts(blocks))

    def _blocks(self, channel: int, start: float, length: float) -> Rows:
        if self._contour is None:
            self._contour = RecordedContour(self._recording)
        if length == 0.0:
            self.log_requests += 1
            return self._contour.blocks[:0]
        state = self._areas.gpCh[channel].contour_lookahead.state
        epoch = int(self._areas.gpAhead[0].state.epoch)
        found = self._contour.answer(
            start, length, epoch, float(state.max_dist_prog_start)
        )
        facts = self._areas.gpAhead[0].answer
        facts.start_position, facts.length = start, length
        facts.mode = layout.HLI_AHEAD_MODE_CONTOUR
        facts.count = min(len(found), BLOCK_ROWS)
        for name, value in self._facts(found).items():
            setattr(facts, name, value)
        return found

    def _facts(self, blocks: Rows) -> dict[str, Any]:
        empty = layout.HLI_AHEAD_EMPTY_NOT_KNOWN
        return {
            "more": len(blocks) > BLOCK_ROWS,
            "end": layout.HLI_AHEAD_END_OPEN,
            "epoch": int(self._areas.gpAhead[0].state.epoch),
            "dist_prog_start": float(
                self._areas.gpCh[0].bahn_state.dist_prog_start
            ),
            "empty": layout.HLI_AHEAD_NOT_EMPTY if len(blocks) else empty,
        }
