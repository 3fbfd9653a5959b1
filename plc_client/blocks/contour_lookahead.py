"""Function block for the contour look-ahead control unit (FCT-C40, sections 3 to 5)."""

from __future__ import annotations

import math
from enum import Enum
from typing import Any

import numpy as np

from hli.handshake import BLOCK_ROWS
from hli.structures import HLI_CHANNEL, HLI_CONTOUR_LOOKAHEAD
from hli.view import BLOCK_DTYPE

from .ahead import EmptyReason
from .arbiter import Answer, Arbiter, Asked, Request
from .base import FunctionBlock
from .owner import channel_of
from .paging import ContourFollower, LogReader

ERROR_REQUEST = 1
"""error_id: start_position or length is not a finite number; nothing was requested."""
ERROR_LENGTH = 2
"""error_id: a length that is no range (negative; with ``mode`` 2 also 0; with
``mode`` 1 anything but 0); nothing was requested."""
ERROR_MODE = 3
"""error_id: ``mode`` is not 0, 1 or 2; nothing was requested."""
ERROR_NAMES = {
    0: "",
    ERROR_REQUEST: "ERROR_REQUEST",
    ERROR_LENGTH: "ERROR_LENGTH",
    ERROR_MODE: "ERROR_MODE",
}


_NOT_EMPTY = EmptyReason.NOT_EMPTY


class LookaheadState(Enum):
    """States of the block (docs/reference/plc.md draws them)."""

    IDLE = "idle"
    QUEUED = "queued"
    PENDING = "pending"
    DONE = "done"
    ERROR = "error"


class ContourLookahead(FunctionBlock):
    """Requests contour elements from the CNC; called once per scan, never
    waits.

    ``fb(start_position, length)`` without ``execute`` is continuous: each call
    takes the answer that has arrived and places the next request.  ``fb(...,
    execute=flag)`` is the IEC way: a rising edge places one request with the
    inputs of that call; ``done`` stays until ``execute`` falls (at least for
    one call).

    ``state`` goes from IDLE over QUEUED (another block has the unit) and PENDING
    (the CNC has the request) to DONE; docs/reference/plc.md draws it.  A request
    that is not usable gives ERROR and is not sent.

    Outputs: ``done`` (continuous: TRUE for the call that brought an answer),
    ``busy``, ``error``, ``error_id``, ``blocks`` (numpy structured array,
    fields of HLI_CONTOUR_LOOKAHEAD_BLOCK, up to the last valid element; an own
    copy that nothing overwrites), ``answer_request`` (the request ``blocks``
    answers), ``full`` (128 elements: there may be more, ask again from the next
    index or from the end of the last element).  From the extension of the
    interface: ``count``, ``more`` (there are more, for sure), ``empty`` (why
    there are none).

    Mode 1: length 0, start_position = index in the marked area.  Mode 2: both
    in 0.1 um of path.  A length that is computed may come out as 0 and ask for
    the log by accident: say which ``mode`` is meant (1 or 2), and such a request
    is an error, ``error_name`` ERROR_LENGTH.  With ``mode`` 0 the length alone
    decides, as in the memory.  Two function blocks on one unit take turns.
    ``read_log()`` and ``follow()`` page across scans; use one instance in one
    way.
    """

    def __init__(self, unit: HLI_CONTOUR_LOOKAHEAD | HLI_CHANNEL) -> None:
        unit = channel_of(self, unit, "contour_lookahead").contour_lookahead
        super().__init__()
        self.unit = unit
        self.full = self.more = False
        self.count = 0
        self.empty = EmptyReason.NOT_EMPTY
        self.blocks: np.ndarray[Any, Any] = np.zeros(0, BLOCK_DTYPE)
        self._answered: Asked | None = None
        self._arbiter = Arbiter.of(unit)
        self._deliver = (
            self._take_delivery
        )  # one bound method: the arbiter's key
        self._arrived: tuple[Answer, bool, int] | None = None
        self._open = False  # a request is queued or pending
        self._mode = 0
        self._execute = False
        self._log: LogReader | None = None
        self._contour: ContourFollower | None = None

    def __call__(
        self,
        start_position: float = 0.0,
        length: float = 0.0,
        execute: bool | None = None,
        mode: int = 0,
    ) -> bool:
        """One scan; returns ``done``."""
        self._mode = mode
        if (
            execute is None
            and not self.error
            # most often mode 0; what is not finite is refused in C
            and (
                length >= 0.0
                if mode == 0
                else not self._wrong(start_position, length)
            )
        ):
            answer = self._arbiter.next(self._deliver, start_position, length)
            # our answer was there and our next request is placed
            if answer is not None:
                n = len(answer[1])
                if 0 < n < BLOCK_ROWS:
                    self._answered, self.blocks = answer
                    self.count, self.full, self.more = n, False, False
                    self.empty = _NOT_EMPTY
                else:
                    self._show(answer, *self._arbiter.rest(n))
                self.done = True
                return True
        self._arbiter.serve()
        fresh = self._take_arrived()
        if execute is None:
            self.done = fresh
            self._ask(start_position, length)
        else:
            self._edge(start_position, length, bool(execute), fresh)
        self._arbiter.serve()
        return self.done

    @property
    def error_name(self) -> str:
        """Name of ``error_id``; empty without an error."""
        return ERROR_NAMES[self.error_id]

    @property
    def answer_request(self) -> Request | None:
        """The request ``blocks`` answers."""
        return None if self._answered is None else Request(*self._answered)

    def read_log(self) -> np.ndarray[Any, Any]:
        """Mode 1, once per scan: the entries of the marked area that are new
        since the last call, each exactly once.
        """
        if self._log is None:
            self._log = LogReader(self)
        return self._log()

    def follow(self, length: float) -> np.ndarray[Any, Any]:
        """Mode 2, once per scan: the elements that became known since the last
        call, each exactly once.

        ``length`` is the range of one request in 0.1 um.  Starts again at 0
        after a distance reset.  One call brings at most one answer (128
        elements); what the CNC has dropped meanwhile is counted by ``gaps`` and
        ``lost_distance``.
        """
        if self._contour is None:
            self._contour = ContourFollower(self)
        return self._contour(length)

    @property
    def resets(self) -> int:
        """How often ``follow()`` began again at 0."""
        return self._contour.resets if self._contour is not None else 0

    @property
    def gaps(self) -> int:
        """How often ``follow()`` came too late for elements."""
        return self._contour.gaps if self._contour is not None else 0

    @property
    def lost_distance(self) -> float:
        """Path length of the elements ``follow()`` came too late for, 0.1 um."""
        return self._contour.lost_distance if self._contour is not None else 0.0

    @property
    def state(self) -> LookaheadState:  # type: ignore[override]
        """IDLE, QUEUED (another block's turn), PENDING (placed), DONE, ERROR."""
        if self.error:
            return LookaheadState.ERROR
        if self._open:
            waiting = self._arbiter.is_waiting(self._deliver)
            return LookaheadState.QUEUED if waiting else LookaheadState.PENDING
        return LookaheadState.DONE if self.done else LookaheadState.IDLE

    # -- for the paging helpers: the same steps one by one
    def poll(self) -> bool:
        """Take an answer that has arrived; TRUE for the call that brought one."""
        self._arbiter.serve()
        self.done = self._take_arrived()
        return self.done

    def ask(self, start_position: float, length: float) -> None:
        """Place a request unless one is under way."""
        if not self._open:
            self._ask(start_position, length)
            self._arbiter.serve()

    # -- steps
    def _edge(
        self, start_position: float, length: float, execute: bool, fresh: bool
    ) -> None:
        rising, self._execute = execute and not self._execute, execute
        self.done = fresh or (self.done and execute)
        if not execute and not self._open:
            self.error, self.error_id = False, 0
        if rising and not self._open:
            self.done = False
            self._ask(start_position, length)

    def _wrong(self, start_position: float, length: float) -> int:
        """0, or what is wrong with a request."""
        if not (math.isfinite(start_position) and math.isfinite(length)):
            return ERROR_REQUEST
        if self._mode not in (0, 1, 2):
            return ERROR_MODE
        if self._mode == 1:
            return ERROR_LENGTH if length else 0
        if length < 0.0 or (self._mode == 2 and length == 0.0):
            return ERROR_LENGTH
        return 0

    def _ask(self, start_position: float, length: float) -> None:
        wrong = self._wrong(start_position, length)
        if wrong:
            self.error, self.error_id = True, wrong
            self.refused += 1
            return
        self.error, self.error_id = False, 0
        if not self._open or self._arbiter.is_waiting(self._deliver):
            self._arbiter.enqueue(
                self._deliver, (float(start_position), float(length))
            )
        self._open = self.busy = True

    def _take_delivery(
        self, request: Asked, blocks: np.ndarray[Any, Any]
    ) -> None:
        self._arrived = ((request, blocks), *self._arbiter.rest(len(blocks)))

    def _take_arrived(self) -> bool:
        if self._arrived is None:
            return False
        self._show(*self._arrived)
        self._arrived = None
        self._open = self.busy = False
        return True

    def _show(self, answer: Answer, more: bool, empty: int) -> None:
        self._answered, self.blocks = answer
        self.count = len(self.blocks)
        self.full = self.count == BLOCK_ROWS
        self.more, self.empty = more, EmptyReason(empty)
