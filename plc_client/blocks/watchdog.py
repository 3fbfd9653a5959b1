"""Watchdogs between the two sides (hli_reference 3) and the error records (7.2)."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from enum import Enum

from hli import layout
from hli.structures import HLI_CHANNEL, MC_ERROR, MC_WATCHDOG_UNIT
from hli.view import expect

from .. import clock
from .base import (
    ERROR_INPUT,
    ERROR_NOT_PRESENT,
    TIMEOUT_S,
    ExecuteBlock,
    FunctionBlock,
    present,
)
from .owner import channel_of

DEFAULT_PERIOD_US = 1_000_000


class WatchState(Enum):
    """States of both watchdog blocks (docs/reference/plc.md draws them)."""

    OFF = "off"
    WAITING = "waiting"  # enabled, no sign of life seen yet
    ALIVE = "alive"
    MISSED = (
        "missed"  # the CNC's: restart required; the PLC's: until the next sign
    )


class Watchdog(FunctionBlock):
    """The CNC monitors the PLC: ``Watchdog(ch)(enable=True)`` in a task of its
    own sets ``mc_watchdog.alive_rw``.

    The CNC clears the flag when it sees it.  ``cycle_time_us`` is the longest
    time between two signs (0: 1 s); a miss is P-ERR-270053 and needs a restart.
    Outputs ``alive`` (``alive_state_r``), ``error`` after a miss.
    """

    def __init__(self, ch: HLI_CHANNEL | MC_WATCHDOG_UNIT) -> None:
        ch = channel_of(self, ch, "head.mc_watchdog")
        super().__init__()
        self._ch = ch
        self._unit = ch.head.mc_watchdog
        self.state = WatchState.OFF
        self.alive = False

    def __call__(
        self, enable: bool = True, cycle_time_us: int = DEFAULT_PERIOD_US
    ) -> bool:
        """One scan; returns ``alive``."""
        unit = self._unit
        if enable:
            unit.cycle_time_w = cycle_time_us
            unit.alive_rw = True
        unit.enable_w = enable
        self.alive = bool(unit.alive_state_r)
        self.state = self._next(enable)
        self.error, self.busy = (
            self.state is WatchState.MISSED,
            self.state is WatchState.WAITING,
        )
        self.done = self.state is WatchState.ALIVE
        self.error_id = (
            270053
            if self.error
            else ERROR_NOT_PRESENT
            if enable and not present(self._ch)
            else 0
        )
        return self.alive

    def _next(self, enable: bool) -> WatchState:
        if not enable:
            return WatchState.OFF
        if self.alive:
            return WatchState.ALIVE
        lost = self.state in (WatchState.ALIVE, WatchState.MISSED)
        return WatchState.MISSED if lost else WatchState.WAITING


class CncWatchdog(FunctionBlock):
    """The PLC monitors the CNC (``lc_watchdog``, roles swapped): the CNC sets
    ``alive_rw``, this block clears it.

    Outputs ``alive`` (also shown in ``alive_state_r``), ``missed`` (how often
    the sign came too late).
    """

    def __init__(
        self,
        ch: HLI_CHANNEL | MC_WATCHDOG_UNIT,
        cycle_time_us: int = DEFAULT_PERIOD_US,
    ) -> None:
        ch = channel_of(self, ch, "head.lc_watchdog")
        super().__init__()
        self._unit = ch.head.lc_watchdog
        self._period_us = cycle_time_us or DEFAULT_PERIOD_US
        self.state = WatchState.OFF
        self.alive = False
        self.missed = 0
        self._seen_ns = 0

    def __call__(self, enable: bool = True) -> bool:
        """One scan; returns ``alive``."""
        unit, now = self._unit, clock.now_ns()
        unit.cycle_time_w, unit.enable_w = self._period_us, enable
        if not enable:
            self.state = WatchState.OFF
        elif unit.alive_rw:
            unit.alive_rw = False
            self._seen_ns, self.state = now, WatchState.ALIVE
        elif self.state is WatchState.OFF:
            self._seen_ns, self.state = now, WatchState.WAITING
        elif (
            self.state is not WatchState.MISSED
            and now - self._seen_ns > self._period_us * 1000
        ):
            self.missed += 1
            self.state = WatchState.MISSED
        self.alive = self.state is WatchState.ALIVE
        unit.alive_state_r = self.alive
        self.done, self.busy = self.alive, self.state is WatchState.WAITING
        self.error = self.state is WatchState.MISSED
        return self.alive


@dataclass(frozen=True)
class CncErrorRecord:
    """One record of ``mc_error``: number, classes, the NC block it belongs to
    (where the record has one).
    """

    error_id: int
    module: str
    line: int
    channel: int
    recovery_class: int
    reaction_class: int
    program: str
    file: str
    block_number: int
    file_offset: int


_BODY_NC_PROGRAM = 1
_AN_ERROR_UNIT = "hli.gpCh[0].mc_error or hli.gpCh[0].lc_error"


class ErrorState(Enum):
    """States of an ``ErrorReader`` (docs/reference/plc.md draws them)."""

    FREE = "free"
    STANDING = "standing"  # a record waits for its acknowledgement


class ErrorReader(FunctionBlock):
    """Fetches the records of ``mc_error`` and frees the unit: ``for record in
    ErrorReader(ch)(): ...``.

    With ``enable`` the CNC waits for the acknowledgement (``semaphor_rw``
    FALSE) before it writes the next record, so none is lost; without it the CNC
    overwrites.  Outputs ``last``, ``count``; ``error`` while an unread record
    stands.
    """

    def __init__(self, ch: HLI_CHANNEL | MC_ERROR) -> None:
        ch = channel_of(self, ch, "mc_error")
        super().__init__()
        self._unit = ch.mc_error
        self.state = ErrorState.FREE
        self.last: CncErrorRecord | None = None
        self.count = 0

    def __call__(
        self, enable: bool = True, acknowledge: bool = True
    ) -> list[CncErrorRecord]:
        """One scan: the records of this scan (one at the most).

        ``acknowledge`` FALSE leaves it standing.
        """
        records = self._read(enable, acknowledge)
        self.state = ErrorState.STANDING if self.error else ErrorState.FREE
        return records

    def _read(self, enable: bool, acknowledge: bool) -> list[CncErrorRecord]:
        unit = self._unit
        unit.enable_w = enable
        self.error = bool(unit.semaphor_rw)
        if not self.error:
            self.error_id = 0
            return []
        record = read_record(unit)
        self.error_id = record.error_id
        if not acknowledge:
            return []
        unit.semaphor_rw = False
        self.error = False
        self.last = record
        self.count += 1
        return [record]


NO_ERROR = CncErrorRecord(
    *(0, "PLC", 0, 0, 0, 0),
    *("", "", 0, 0),
)


def read_record(unit: MC_ERROR) -> CncErrorRecord:
    """The record in an MC_ERROR unit."""
    expect(unit, "read_record", _AN_ERROR_UNIT, layout.MC_ERROR)
    head = unit.satz_r.kopf
    body = layout.HLI_RUMPF_NC_PROG()
    if head.body_type == _BODY_NC_PROGRAM:
        body = layout.HLI_RUMPF_NC_PROG.from_buffer_copy(
            bytes(unit.satz_r.rumpf.maske._c.err_mask)
        )
    return CncErrorRecord(
        head.error_id,
        head.modul_name.zeichen,
        head.line,
        head.channel,
        head.recovery_class,
        head.reaction_class,
        body.prog_name.decode("utf-8", "replace"),
        body.file_name.decode("utf-8", "replace"),
        body.satz_nr,
        body.fileoffset,
    )


def write_record(unit: MC_ERROR, record: CncErrorRecord) -> None:
    """Fill the record of an MC_ERROR unit; the caller sets the semaphore."""
    expect(unit, "write_record", _AN_ERROR_UNIT, layout.MC_ERROR)
    head = unit.satz_r.kopf
    ctypes.memset(unit.satz_r._address, 0, ctypes.sizeof(layout.HLI_ERROR_SATZ))
    head.error_id, head.line, head.channel = (
        record.error_id,
        record.line,
        record.channel,
    )
    head.modul_name.zeichen = record.module[:15]
    head.recovery_class, head.reaction_class = (
        record.recovery_class,
        record.reaction_class,
    )
    if not (record.program or record.file or record.block_number):
        return
    head.body_type = _BODY_NC_PROGRAM
    body = layout.HLI_RUMPF_NC_PROG(
        satz_nr=record.block_number, fileoffset=record.file_offset
    )
    body.prog_name, body.file_name = (
        record.program.encode()[:263],
        record.file.encode()[:259],
    )
    ctypes.memmove(
        unit.satz_r.rumpf.maske._address,
        ctypes.addressof(body),
        ctypes.sizeof(body),
    )


class ErrorWriter(ExecuteBlock):
    """Reports an error of the PLC to the CNC (``lc_error``):
    ``ErrorWriter(ch)(execute, error_id=4711)``.

    Waits until the unit is free, writes the record, sets ``semaphor_rw``; done
    when the CNC has cleared it.
    """

    def __init__(
        self, ch: HLI_CHANNEL | MC_ERROR, timeout_s: float = TIMEOUT_S
    ) -> None:
        ch = channel_of(self, ch, "lc_error")
        super().__init__(timeout_s)
        self._ch = ch
        self._unit = ch.lc_error
        self._record = NO_ERROR

    def __call__(
        self,
        execute: bool,
        number: int = 0,
        reaction_class: int = 0,
        recovery_class: int = 0,
        module: str = "PLC",
    ) -> bool:
        """One scan; the inputs count in the call with the rising edge."""
        if not self.busy:
            self._record = CncErrorRecord(
                number,
                module,
                0,
                self._ch.head.channel_nr,
                recovery_class,
                reaction_class,
                "",
                "",
                0,
                0,
            )
        return self._run(execute)

    def _check(self) -> int:
        record = self._record
        in_range = 0 < record.error_id < 1 << 32
        classes = (
            0 <= record.reaction_class <= 8 and 0 <= record.recovery_class <= 8
        )
        if not (in_range and classes):
            return ERROR_INPUT
        return 0 if present(self._ch) else ERROR_NOT_PRESENT

    def _may_send(self) -> bool:
        return not self._unit.semaphor_rw

    def _send(self) -> None:
        write_record(self._unit, self._record)
        self._unit.enable_w = True
        self._unit.semaphor_rw = True

    def _taken(self) -> bool:
        return not self._unit.semaphor_rw
