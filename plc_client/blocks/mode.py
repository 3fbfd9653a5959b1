"""Operation modes and program control: ``channel_mc_control.mode_and_state``
(hli_reference 5.4).

One command at a time: the unit's semaphore is waited for before anything is
written, set after all data, and the command counts as done only when
``state_r`` shows it.  All blocks on one channel share one turn, so that two of
them in one scan never overwrite each other's command.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any
from weakref import WeakValueDictionary

from hli.structures import HLI_CHANNEL, MC_CONTROL_MCM_MODE_STATE_UNIT

from .. import clock
from .base import (
    ACTIVE_STATES,
    ERROR_CNC,
    ERROR_INPUT,
    ERROR_NO_REACTION,
    ERROR_NOT_PRESENT,
    TIMEOUT_S,
    ExecuteBlock,
    State,
    present,
)
from .owner import channel_of

ERROR_TRANSITION = 270061
"""The target state is not allowed in the target mode (the CNC's number for the same thing)."""
PARAMETER_MAX = 299
REFUSED = 1
"""``reaction_class`` of an error record: a command that is not possible."""


class Mode(IntEnum):
    """HLI_IMCM_*_MODE."""

    STANDBY = 1
    AUTOMATIC = 2
    MDI = 3
    MANUAL = 4
    REFERENCE = 5


class ProcessState(IntEnum):
    """HLI_IMCM_PROCESS_*; 7 to 15 are transient, RESETTING is also what a reset
    asks for.
    """

    DESELECTED = 1
    SELECTED = 2
    READY = 3
    ACTIVE = 4
    HOLD = 5
    ERROR = 6
    SELECTING = 7
    DESELECTING = 8
    PREPARING = 9
    CLEARING = 10
    STARTING = 11
    ABORTING = 12
    STOPPING = 13
    RESUMING = 14
    RESETTING = 15


_STANDBY_TARGETS = frozenset({1, 2, 3})
_TARGETS = frozenset({1, 2, 3, 4, 5, 15})
_RESTING = frozenset(
    {ProcessState.DESELECTED, ProcessState.SELECTED, ProcessState.READY}
)


_ON_THE_WAY = frozenset(
    set(ProcessState)
    - _RESTING
    - {
        ProcessState.ACTIVE,
        ProcessState.HOLD,
        ProcessState.ERROR,
        ProcessState.STOPPING,  # a program that brakes takes other commands
    }
)
"""Another command is being carried out."""


_SILENT_NS = 500_000_000


class _Turn:
    """Which block's command is in a unit; a block that is not called for half a
    second has lost its turn.
    """

    _all: WeakValueDictionary[int, _Turn] = WeakValueDictionary()

    def __init__(self) -> None:
        self.holder: ModeControl | None = None
        self.called_ns = 0

    def free_for(self, block: ModeControl) -> bool:
        holder = self.holder
        if (
            holder is None
            or holder is block
            or holder.state not in ACTIVE_STATES
        ):
            return True
        return clock.now_ns() - self.called_ns > _SILENT_NS

    @classmethod
    def of(cls, unit: Any) -> _Turn:
        found = cls._all.get(unit._address)
        if found is None:
            found = cls._all[unit._address] = cls()
        return found


class ModeControl(ExecuteBlock):
    """Any transition: ``ModeControl(ch)(execute, Mode.AUTOMATIC,
    ProcessState.ACTIVE, parameter="part.nc")``.

    The interface passes intermediate states by itself: SELECTED to ACTIVE in
    one command is legal.  ``parameter`` is the program's name (AUTOMATIC) or
    the text (MDI), at most 299 characters.  ``from_*`` 0: do not care.

    Outputs beside the usual ones: ``mode``, ``process_state`` (what the CNC
    shows).  ``error_id`` 1 (input), 2 (``plc_present_w`` FALSE), 3 (not taken
    in time), 4 (taken, not reached in time; for HOLD also: the program has
    ended), 5 (the CNC went to ERROR), 270061 (target state not allowed; found
    here, nothing is sent), and the number with which the CNC refuses the
    command in ``mc_error``: 270061, 901001 (no such program), 905020 (no
    program is selected).
    """

    def __init__(
        self,
        ch: HLI_CHANNEL | MC_CONTROL_MCM_MODE_STATE_UNIT,
        timeout_s: float = TIMEOUT_S,
    ) -> None:
        ch = channel_of(self, ch, "channel_mc_control.mode_and_state")
        super().__init__(timeout_s)
        self._ch = ch
        self._unit = ch.channel_mc_control.mode_and_state
        self._status = ch.bahn_state
        self._errors = ch.mc_error
        self._turn = _Turn.of(self._unit)
        self._target = (0, 0)
        self._origin = (0, 0)
        self._parameter = ""
        self._end_was_false = self._rested = False
        self._told_before = (0, 0)
        self.mode = self.process_state = 0

    def __call__(
        self,
        execute: bool,
        to_mode: int = Mode.AUTOMATIC,
        to_state: int = ProcessState.ACTIVE,
        parameter: str = "",
        from_mode: int = 0,
        from_state: int = 0,
    ) -> bool:
        """One scan; the inputs count in the call with the rising edge.

        Returns ``done``.
        """
        if self.state not in ACTIVE_STATES:
            self._target, self._origin, self._parameter = (
                (to_mode, to_state),
                (from_mode, from_state),
                parameter,
            )
        self._look()
        if self._turn.holder is self:
            self._turn.called_ns = clock.now_ns()
        return self._run(execute)

    def _look(self) -> None:
        state = self._unit.state_r
        self.mode, self.process_state = state.mode, state.state

    # -- the command
    def _check(self) -> int:
        mode, state = self._target
        if (
            not isinstance(self._parameter, str)
            or len(self._parameter.encode()) > PARAMETER_MAX
        ):
            return ERROR_INPUT
        if mode not in tuple(Mode):
            return ERROR_INPUT
        if state not in (
            _STANDBY_TARGETS if mode == Mode.STANDBY else _TARGETS
        ):
            return ERROR_TRANSITION
        return 0 if present(self._ch) else ERROR_NOT_PRESENT

    def _may_send(self) -> bool:
        """Not ahead of the outcome of another command: its refusal would be
        taken for that of this one.
        """
        if self._unit.command_semaphor_rw or not self._turn.free_for(self):
            return False
        if self.process_state in _ON_THE_WAY:
            return False
        self._turn.holder, self._turn.called_ns = self, clock.now_ns()
        return True

    def _send(self) -> None:
        unit, command = self._unit, self._unit.command_w
        command.from_mode, command.from_state = self._origin
        command.to_mode, command.to_state = self._target
        command.parameter = self._parameter
        unit.enable_w = True
        self._end_was_false = self._rested = False
        self._told_before = self._told()
        unit.command_semaphor_rw = True  # last: release order

    def _taken(self) -> bool:
        return not self._unit.command_semaphor_rw

    def _told(self) -> tuple[int, int]:
        """Which error record the CNC has shown last."""
        head = self._errors.satz_r.kopf
        return head.cycle, head.error_id

    def _refusal(self) -> int:
        """Number with which the CNC has refused this command, 0: it has not.
        Its record stands before the state shows the outcome.
        """
        head = self._errors.satz_r.kopf
        told = self._told()
        new = told != self._told_before and head.reaction_class == REFUSED
        return told[1] if new else 0

    def _reached(self) -> bool:
        self._look()
        mode, state = self._target
        if self._refusal():
            return False
        if state == ProcessState.RESETTING:
            return self.process_state in _RESTING
        if self.mode == mode and self.process_state == state:
            return True
        return state == ProcessState.ACTIVE and self._ran_through()

    def _ran_through(self) -> bool:
        """A program shorter than a scan: its end was not there since the
        command, now it is.  Or it came and went between two scans: then the
        channel rests longer than in a state on the way.
        """
        ended = bool(self._status.program_end_r)
        self._end_was_false |= not ended
        rested = self._rested
        self._rested = ended and self.process_state in _RESTING
        return self._rested and (self._end_was_false or rested)

    def _failed(self) -> int:
        target = self._target[1]
        if (
            self.process_state == ProcessState.ERROR
            and target != ProcessState.RESETTING
        ):
            return ERROR_CNC
        refusal = self._refusal()
        ended = target == ProcessState.HOLD and self.process_state in _RESTING
        return refusal or (ERROR_NO_REACTION if ended else 0)

    def _leave(self) -> None:
        if self._turn.holder is self:
            self._turn.holder = None


class SelectProgram(ModeControl):
    """AUTOMATIC, READY with a program: ``SelectProgram(ch)(execute, "part.nc")``."""

    def __call__(self, execute: bool, program: str = "") -> bool:  # type: ignore[override]
        """One scan."""
        return super().__call__(
            execute, Mode.AUTOMATIC, ProcessState.READY, program
        )


class StartProgram(ModeControl):
    """AUTOMATIC, ACTIVE; with a name also selects: ``StartProgram(ch)(execute,
    "part.nc")``.
    """

    def __call__(self, execute: bool, program: str = "") -> bool:  # type: ignore[override]
        """One scan."""
        return super().__call__(
            execute, Mode.AUTOMATIC, ProcessState.ACTIVE, program
        )


class StopProgram(ModeControl):
    """HOLD in the mode the channel is in; only from ACTIVE."""

    def __call__(self, execute: bool) -> bool:  # type: ignore[override]
        """One scan."""
        self._look()
        return super().__call__(
            execute,
            self.mode or Mode.AUTOMATIC,
            ProcessState.HOLD,
            "",
            0,
            ProcessState.ACTIVE,
        )


class ResumeProgram(ModeControl):
    """ACTIVE again; only from HOLD."""

    def __call__(self, execute: bool) -> bool:  # type: ignore[override]
        """One scan."""
        self._look()
        return super().__call__(
            execute,
            self.mode or Mode.AUTOMATIC,
            ProcessState.ACTIVE,
            "",
            0,
            ProcessState.HOLD,
        )


class AbortProgram(ModeControl):
    """SELECTED: ends a program that is ACTIVE or in HOLD."""

    def __call__(self, execute: bool) -> bool:  # type: ignore[override]
        """One scan."""
        self._look()
        return super().__call__(
            execute, self.mode or Mode.AUTOMATIC, ProcessState.SELECTED
        )


class ResetChannel(ModeControl):
    """Reset (``to_state`` 15); done when the channel rests again."""

    def __call__(self, execute: bool) -> bool:  # type: ignore[override]
        """One scan."""
        self._look()
        return super().__call__(
            execute, self.mode or Mode.AUTOMATIC, ProcessState.RESETTING
        )


class RunMdi(ModeControl):
    """MDI, ACTIVE with the text of the blocks: ``RunMdi(ch)(execute, "G01 X10
    F1000")``.
    """

    def __call__(self, execute: bool, text: str = "") -> bool:  # type: ignore[override]
        """One scan."""
        return super().__call__(execute, Mode.MDI, ProcessState.ACTIVE, text)


__all__ = [
    "AbortProgram",
    "Mode",
    "ModeControl",
    "ProcessState",
    "ResetChannel",
    "ResumeProgram",
    "RunMdi",
    "SelectProgram",
    "StartProgram",
    "State",
    "StopProgram",
]
