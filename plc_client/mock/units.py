"""The CNC's side of the control units: level, edge, mode machine, watchdogs,
errors, technology (hli_reference).
"""

from __future__ import annotations

from collections import deque
from typing import Any

from hli import layout
from hli.view import overlay

from ..blocks.mode import REFUSED, Mode, ProcessState
from ..blocks.watchdog import CncErrorRecord, write_record
from .script import FUNCTIONS, Step

DEFAULT_PERIOD_S = 1.0
QUEUE = 16
ERROR_WATCHDOG = 270053
ERROR_TRANSITION = 270061
STEPS_TO = {
    ProcessState.DESELECTED: ProcessState.DESELECTING,
    ProcessState.SELECTED: ProcessState.ABORTING,
    ProcessState.READY: ProcessState.PREPARING,
    ProcessState.ACTIVE: ProcessState.STARTING,
    ProcessState.HOLD: ProcessState.STOPPING,
}


def level(unit: Any, present: bool, default: Any) -> Any:
    """What a level unit says; shown in ``state_r``."""
    value = unit.command_w if present and unit.enable_w else default
    unit.state_r = value
    return value


class Edge:
    """A level unit whose rising edge counts."""

    def __init__(self, unit: Any) -> None:
        self._unit = unit
        self._before = False

    def __call__(self, present: bool) -> bool:
        value = bool(level(self._unit, present, False))
        rising, self._before = value and not self._before, value
        return rising


class ErrorQueue:
    """``mc_error``: records go out one by one; with ``enable_w`` each waits for
    the PLC.
    """

    def __init__(self, unit: Any) -> None:
        self._unit = unit
        self._waiting: deque[CncErrorRecord] = deque(maxlen=QUEUE)
        self._cycles = 0

    def add(
        self,
        number: int,
        block_number: int = 0,
        program: str = "",
        class_: int = 2,
    ) -> None:
        """One more error."""
        self._waiting.append(
            CncErrorRecord(
                number,
                "MOCK",
                0,
                1,
                class_,
                class_,
                program,
                "",
                block_number,
                0,
            )
        )

    def cycle(self) -> None:
        """Put the next record out if the unit is free."""
        unit = self._unit
        self._cycles += 1
        if self._waiting and not (unit.enable_w and unit.semaphor_rw):
            write_record(unit, self._waiting.popleft())
            unit.satz_r.kopf.cycle = self._cycles
            unit.semaphor_rw = True


class Watchdogs:
    """``mc_watchdog`` (this side watches the PLC) and ``lc_watchdog`` (this
    side gives signs).
    """

    def __init__(self, head: Any, cycle_s: float, errors: ErrorQueue) -> None:
        self._mc, self._lc = head.mc_watchdog, head.lc_watchdog
        self._cycle_s = cycle_s
        self._errors = errors
        self._silent_s = 0.0
        self._missed = False
        self.lc_dead = False  # a test may let this CNC fall silent

    def cycle(self, present: bool) -> None:
        """One cycle of both."""
        if self._lc.enable_w and not self.lc_dead:
            self._lc.alive_rw = True
        if self._mc.enable_w and present and not self._missed:
            self._watch()

    def _watch(self) -> None:
        period = self._mc.cycle_time_w / 1e6 or DEFAULT_PERIOD_S
        if self._mc.alive_rw:
            self._mc.alive_rw = False
            self._mc.alive_state_r = True
            self._silent_s = 0.0
            return
        self._silent_s += self._cycle_s
        if self._mc.alive_state_r and self._silent_s > period:
            self._mc.alive_state_r = False
            self._missed = True
            self._errors.add(ERROR_WATCHDOG)


class ModeMachine:
    """``channel_mc_control.mode_and_state``: accepts commands, passes
    intermediate states, one a cycle.
    """

    def __init__(
        self, unit: Any, errors: ErrorQueue, ended_state: ProcessState
    ) -> None:
        self._unit = unit
        self._errors = errors
        self._ended_state = ended_state
        self.mode, self.state = Mode.AUTOMATIC, ProcessState.SELECTED
        self.parameter = ""
        self.accepted = 0
        self.warnings = 0
        self._route: list[ProcessState] = []

    def cycle(self, present: bool) -> str:
        """One cycle; returns "start", "abort", "select" or "" for what the
        program has to do.
        """
        action = (
            self._accept()
            if present
            and self._unit.enable_w
            and self._unit.command_semaphor_rw
            else ""
        )
        if not action and self._route:
            before, self.state = self.state, self._route.pop(0)
            action = self._action(before)
        self._show()
        return action

    def enter(self, state: ProcessState) -> None:
        """Program end, error: the machine goes there at once."""
        self.state, self._route = state, []
        self._show()

    def program_ended(self) -> None:
        """After M30 (SELECTED, or READY by the setting)."""
        self.enter(self._ended_state)

    def _show(self) -> None:
        self._unit.state_r.mode, self._unit.state_r.state = (
            self.mode,
            self.state,
        )

    def _accept(self) -> str:
        """Take the command, clear the semaphore: in the same cycle, whatever
        the content.
        """
        command = self._unit.command_w
        mode, state = command.to_mode, command.to_state
        another = self._names_another(mode, state, command.parameter)
        if not another:
            self.parameter = command.parameter or self.parameter
        origin = (command.from_mode, command.from_state)
        self.warnings += any(
            o and o != now
            for o, now in zip(origin, (self.mode, self.state), strict=True)
        )
        self._unit.command_semaphor_rw = False
        self.accepted += 1
        allowed = (
            (1, 2, 3)
            if mode == Mode.STANDBY
            else (1, 2, 3, 4, 5, ProcessState.RESETTING)
        )
        if (
            mode not in tuple(Mode)
            or state not in allowed
            or another
            or not self._plan(ProcessState(state))
        ):
            self._errors.add(ERROR_TRANSITION, class_=REFUSED)
            return ""
        self.mode = Mode(mode)
        return ""

    def _names_another(self, mode: int, state: int, parameter: str) -> bool:
        """ACTIVE while a program runs: that one goes on, no other begins."""
        runs = self.state in (ProcessState.ACTIVE, ProcessState.HOLD)
        if not (runs and parameter and state == ProcessState.ACTIVE):
            return False
        again = mode == Mode.MDI and self.state == ProcessState.ACTIVE
        return parameter != self.parameter or again

    def _plan(self, target: ProcessState) -> bool:
        """The states on the way; False if there is no way."""
        now = self.state
        if target == ProcessState.RESETTING:
            self._route = [ProcessState.RESETTING, ProcessState.SELECTED]
            return True
        if now == target:
            self._route = []
            return True
        if now == ProcessState.ERROR or (
            target == ProcessState.HOLD and now != ProcessState.ACTIVE
        ):
            return False
        if now == ProcessState.HOLD and target == ProcessState.ACTIVE:
            self._route = [ProcessState.RESUMING, target]
            return True
        between = []
        if target == ProcessState.ACTIVE and now in (
            ProcessState.DESELECTED,
            ProcessState.SELECTED,
        ):
            between = [ProcessState.PREPARING, ProcessState.READY]
        self._route = [*between, STEPS_TO[target], target]
        return True

    def _action(self, before: ProcessState) -> str:
        if (
            self.state == ProcessState.ACTIVE
            and before == ProcessState.STARTING
        ):
            return "start"
        aborted = before in (ProcessState.ABORTING, ProcessState.RESETTING)
        return (
            "abort"
            if aborted
            else "select"
            if self.state == ProcessState.READY
            else ""
        )


class Technology:
    """One technology array: output of functions, and when all of them are done with."""

    def __init__(self, area: Any, late: bool) -> None:
        self._area, self._late = area, late
        self._units = (
            area.techno_unit_late_sync if late else area.techno_unit_std_sync
        )
        self._open: dict[int, Step] = {}

    @property
    def open(self) -> int:
        """Functions that the PLC is not done with."""
        return len(self._open)

    def put_out(self, step: Step, count: int) -> bool:
        """Write into the next free unit: data first, ``please_rw`` TRUE last.
        False if none is free.
        """
        index = next(
            (i for i in range(len(self._units)) if i not in self._open), None
        )
        if index is None:
            return False
        unit = self._units[index]
        _fill(unit, step, count)
        unit.fkt_ctrl_r = FUNCTIONS[step.kind]
        unit.done_w = False
        unit.please_rw = True
        self._open[index] = step
        self._show()
        return True

    def cycle(self) -> None:
        """Free what was fetched and, where the CNC waits, acknowledged."""
        for index, step in list(self._open.items()):
            unit = self._units[index]
            if not unit.please_rw and (unit.done_w or not step.waits):
                del self._open[index]
        self._show()

    def reset(self) -> None:
        """Channel reset: pending functions are taken back."""
        for index in self._open:
            self._units[index].please_rw = False
        self._open.clear()
        self._show()

    def _show(self) -> None:
        count = max(self._open, default=-1) + 1
        name = (
            "used_units_late_sync_r" if self._late else "used_units_std_sync_r"
        )
        setattr(self._area, name, len(self._open) if self._late else count)


def _fill(unit: Any, step: Step, count: int) -> None:
    if step.kind == "S":
        spindle = overlay(unit.attribut_r.data, layout.HLI_S_PROZESS)
        spindle.rev, spindle.satz_nr = step.number, step.n
    elif step.kind == "T":
        overlay(
            unit.attribut_r.data, layout.HLI_T_PROZESS
        ).id.basic = step.number
    else:
        function = overlay(unit.attribut_r.data, layout.HLI_M_H_PROZESS)
        function.nr, function.satz_nr, function.zeilen_nr = (
            step.number,
            step.n,
            count,
        )
        function.add_value = step.value
