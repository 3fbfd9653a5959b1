"""What all function blocks share: the IEC outputs in both spellings, edges,
time limits on the cell's clock.

Error numbers of the blocks (``error_id``): 1 to 99 here, the vendor's numbers
where there is one.
"""

from __future__ import annotations

from enum import Enum

from hli.structures import HLI_AXIS, HLI_CHANNEL

from .. import clock

ERROR_INPUT = 1
"""An input is not usable (not finite, out of range); nothing was sent."""
ERROR_NOT_PRESENT = 2
"""``plc_present_w`` of the area is FALSE: its control units are dead."""
ERROR_NO_ACCEPTANCE = 3
"""The CNC did not take the command (its semaphore stays TRUE) within ``timeout_s``."""
ERROR_NO_REACTION = 4
"""The CNC took the command but did not reach what was asked within ``timeout_s``."""
ERROR_CNC = 5
"""The CNC went into its error state while the block waited."""

ERROR_TEXTS = {
    ERROR_INPUT: "an input is not usable",
    ERROR_NOT_PRESENT: "the CNC is told that there is no PLC",
    ERROR_NO_ACCEPTANCE: "the CNC did not take it in time",
    ERROR_NO_REACTION: "the CNC took it, and did not do it in time",
    ERROR_CNC: "the CNC went into its error state",
}
"""What ``error_id`` of a block says, in words."""

TIMEOUT_S = 5.0


class FunctionBlock:
    """Outputs ``done``, ``busy``, ``error``, ``error_id``; the IEC spellings
    ``Done`` ... read the same values.
    """

    state: Enum
    refused = 0
    """Scans whose inputs were out of range, so that nothing was sent."""

    def __init__(self) -> None:
        self.done = self.busy = self.error = False
        self.error_id = 0

    @property
    def Done(self) -> bool:
        """``done``."""
        return self.done

    @property
    def Busy(self) -> bool:
        """``busy``."""
        return self.busy

    @property
    def Error(self) -> bool:
        """``error``."""
        return self.error

    @property
    def ErrorID(self) -> int:
        """``error_id``."""
        return self.error_id


class State(Enum):
    """States of the blocks with an ``execute`` input (docs/reference/plc.md draws them)."""

    IDLE = "idle"
    # another command is still in the unit, or another block's turn
    WAIT_FREE = "wait_free"
    SENT = "sent"  # semaphore TRUE, or command_w TRUE: the CNC has not taken it
    WAIT_STATE = "wait_state"  # taken, not there yet
    DONE = "done"
    ERROR = "error"


ACTIVE_STATES = frozenset({State.WAIT_FREE, State.SENT, State.WAIT_STATE})


class ExecuteBlock(FunctionBlock):
    """A command with a rising edge of ``execute``; the outputs stay until
    ``execute`` falls, at least for one call.

    Subclasses give ``_check`` (0 or an error number), ``_may_send``, ``_send``,
    ``_taken``, ``_reached`` and, where leaving a command needs it, ``_leave``.
    A falling ``execute`` does not take a command back that is under way.
    """

    def __init__(self, timeout_s: float = TIMEOUT_S) -> None:
        super().__init__()
        self.state = State.IDLE
        self.timeout_s = timeout_s
        self._execute = False
        self._since_ns = 0

    # -- what a command is
    def _check(self) -> int:
        return 0

    def _may_send(self) -> bool:
        return True

    def _send(self) -> None:
        raise NotImplementedError

    def _taken(self) -> bool:
        raise NotImplementedError

    def _reached(self) -> bool:
        return True

    def _failed(self) -> int:
        """An error number while the command is under way (0: none)."""
        return 0

    def _leave(self) -> None:
        """After the end of the command, whatever it was."""

    # -- one scan
    def _run(self, execute: bool) -> bool:
        rising, self._execute = execute and not self._execute, execute
        if self.state in (State.DONE, State.ERROR) and (rising or not execute):
            self.state, self.error_id = State.IDLE, 0
        if self.state is State.IDLE and rising:
            self._begin()
        self._advance()
        self.done, self.error = (
            self.state is State.DONE,
            self.state is State.ERROR,
        )
        self.busy = self.state in ACTIVE_STATES
        return self.done

    def _begin(self) -> None:
        error = self._check()
        if error:
            self._fail(error)
        else:
            self._enter(State.WAIT_FREE)

    def _enter(self, state: State) -> None:
        self.state, self._since_ns = state, clock.now_ns()

    def _fail(self, error: int) -> None:
        self.state, self.error_id = State.ERROR, error
        self._leave()

    def _advance(self) -> None:
        """As many steps as are possible in this scan."""
        if self.state is State.WAIT_FREE and self._may_send():
            self._send()
            self._enter(State.SENT)
            return
        if self.state is State.SENT and self._taken():
            self._enter(State.WAIT_STATE)
        if self.state is State.WAIT_STATE and self._reached():
            self.state = State.DONE
            self._leave()
        if self.state in ACTIVE_STATES:
            self._look_for_failure()

    def _look_for_failure(self) -> None:
        error = self._failed() if self.state is State.WAIT_STATE else 0
        late = clock.now_ns() - self._since_ns > self.timeout_s * 1e9
        if not error and late:
            error = (
                ERROR_NO_REACTION
                if self.state is State.WAIT_STATE
                else ERROR_NO_ACCEPTANCE
            )
        if error:
            self._fail(error)


def present(area: HLI_CHANNEL | HLI_AXIS) -> bool:
    """Whether the control units of a channel or axis are alive."""
    return bool(area._c.head.plc_present_w)
