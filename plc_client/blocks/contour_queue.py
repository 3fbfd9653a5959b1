"""Function block for the queue of the look-ahead extension: a second way to the
contour beside the manual's unit, for several tasks at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hli import layout
from hli.queue import BUSY, DETAIL_DTYPE, Ask, Queue, Told
from hli.structures import HLI_CHANNEL, HLI_CONTOUR_LOOKAHEAD
from hli.view import BLOCK_DTYPE

from .ahead import ContourEnd, EmptyReason, extension_of
from .base import FunctionBlock
from .contour_lookahead import LookaheadState
from .owner import channel_of


class ContourQueue(FunctionBlock):
    """Requests contour elements through one of the four slots of the queue;
    called once per scan, never waits.

    Two blocks, also of two tasks, ask at the same time and are answered in the
    same cycle of the CNC.  Without ``execute`` the block is continuous, with it
    a rising edge places one request, as with ``ContourLookahead``.

    Inputs: ``start_position`` and ``length`` (0.1 um), or an index with ``mode``
    1 (the marked log; ``length`` 0).  ``epoch``: the epoch that
    ``start_position`` counts in, 0 is the present one.  ``beyond``: the range
    goes on behind distance resets and ends of real-time loops.  ``events``: M,
    H, S, T and dwells stand between the elements.  ``details``: a row of
    ``details`` for each row of ``blocks``; the CNC then makes its plan known,
    too.

    Outputs beside the usual ones: ``blocks``, ``details``, ``count``, ``more``,
    ``empty``, ``end``, ``epoch`` (the present one), ``distance``
    (dist_prog_start at the answer), ``tag`` (of the answer).  ``error`` with
    ``error_id`` is the reason (``EmptyReason``) of a request that the CNC
    refuses.
    """

    def __init__(self, ch: HLI_CHANNEL | HLI_CONTOUR_LOOKAHEAD) -> None:
        super().__init__()
        area = extension_of(channel_of(self, ch, "contour_lookahead"))
        if area is None:
            raise ValueError("this channel has no look-ahead extension")
        self._area = area
        self._queue = Queue(area)
        self.blocks: np.ndarray[Any, Any] = np.zeros(0, BLOCK_DTYPE)
        self.details: np.ndarray[Any, Any] = np.zeros(0, DETAIL_DTYPE)
        self.count, self.more = 0, False
        self.empty, self.end = EmptyReason.NOT_EMPTY, ContourEnd.OPEN
        self.epoch, self.distance, self.tag = 0, 0.0, 0
        self._asked: Ask | None = None  # under way
        self._held = self._queue.hold_for(self)
        self._execute = False
        self._tag = 0

    def __call__(
        self,
        start_position: float = 0.0,
        length: float = 0.0,
        execute: bool | None = None,
        *,
        mode: int = layout.HLI_AHEAD_MODE_CONTOUR,
        epoch: int = 0,
        beyond: bool = False,
        events: bool = False,
        details: bool = False,
    ) -> bool:
        """One scan; returns ``done``."""
        flags = layout.HLI_AHEAD_BEYOND * beyond
        flags |= layout.HLI_AHEAD_EVENTS * events
        flags |= layout.HLI_AHEAD_DETAILS * details
        fresh = self._take()
        rising = bool(execute) and not self._execute
        self._execute = bool(execute)
        self.done = fresh or (self.done and self._execute)
        if self._asked is None and (execute is None or rising):
            self.done = fresh and execute is None
            self._tag = (self._tag + 1) & 0xFFFFFFFF
            self._asked = Ask(
                float(start_position),
                float(length),
                int(mode),
                flags,
                int(epoch),
                self._tag,
            )
        self._place()
        self.busy = self._asked is not None
        return self.done

    @property
    def state(self) -> LookaheadState:  # type: ignore[override]
        """IDLE, QUEUED (all slots are taken), PENDING (placed), DONE, ERROR."""
        if self._asked is not None:
            placed = self._held[0] >= 0
            return LookaheadState.PENDING if placed else LookaheadState.QUEUED
        if self.error:
            return LookaheadState.ERROR
        return LookaheadState.DONE if self.done else LookaheadState.IDLE

    def _place(self) -> None:
        if self._asked is None or self._held[0] >= 0:
            return
        if self._asked.flags & layout.HLI_AHEAD_DETAILS:
            self._area.plan_enable_w = True
        self._held[0] = self._queue.ask(self._asked)

    def _take(self) -> bool:
        if self._asked is None or self._held[0] < 0:
            return False
        wanted = bool(self._asked.flags & layout.HLI_AHEAD_DETAILS)
        told = self._queue.take(self._held[0], wanted)
        if told == BUSY:
            return False
        self._held[0] = BUSY
        if not isinstance(told, Told):
            return False  # another PLC was here: ask again
        self._asked = None
        self._show(told)
        return True

    def _show(self, told: Told) -> None:
        facts = told.facts
        self.blocks, self.details = told.blocks, told.details
        self.count, self.more = len(told.blocks), bool(facts.more)
        self.empty, self.end = EmptyReason(facts.empty), ContourEnd(facts.end)
        self.epoch, self.tag = int(facts.epoch), int(facts.tag)
        self.distance = float(facts.dist_prog_start)
        self.error = self.empty >= EmptyReason.BAD_START
        self.error_id = int(self.empty) if self.error else 0
