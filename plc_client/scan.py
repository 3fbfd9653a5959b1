"""The scan runtime: tasks in priority order at their intervals, against one CNC.

One ``Scanner`` lives from attachment to the end of that CNC (``Ending``); ``plc_client.__main__`` makes a new one
after a re-attachment.  Order after attachment: every task's ``setup()``, then ``plc_present_w``, then a scan at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from hli._sync import lib

from hli import layout

from . import clock
from .client import Hli
from .pace import Pacer, pacer_of
from .stats import Reservoir
from .task import PlcError, TaskSpec, describe, spec_of

SCANS_AFTER_END = 10
_FLAG_CHECK_NS = 100_000_000


class Ending(Enum):
    """Why a scanner stopped."""

    SHUTDOWN = "shutdown"  # the CNC asked for it
    CNC_GONE = "cnc gone"
    STOPPED = "stopped"  # signal or stop()


@dataclass
class Program:
    """One task of the user with its statistics, which outlive re-attachments."""

    instance: Any
    name: str
    spec: TaskSpec
    times: Reservoir = field(default_factory=Reservoir)
    overruns: int = 0
    due: int = 0
    interval_ticks: int = 1
    scans_after_end: int = 0

    @classmethod
    def of(cls, task_class: type, *args: Any) -> Program:
        """Instance of a user's class; PlcError names the place if the constructor fails."""
        try:
            instance = task_class(*args)
        except (Exception, SystemExit) as error:
            raise PlcError(describe(error)) from error
        return cls(instance, task_class.__qualname__, spec_of(task_class))

    def call(self, method: str, *args: Any) -> Any:
        """Call one of the user's methods; PlcError names the place if it fails."""
        try:
            return getattr(self.instance, method)(*args)
        except (Exception, SystemExit) as error:
            raise PlcError(describe(error)) from error

    def has(self, method: str) -> bool:
        """Whether the user gave this optional method."""
        return callable(getattr(self.instance, method, None))

    def schedule(self, now: int) -> None:
        """Set the next due tick behind `now`; intervals that passed entirely without a scan are overruns."""
        missed = max(now - self.due, 0) // self.interval_ticks
        self.overruns += missed
        self.due += (missed + 1) * self.interval_ticks

    def report(self) -> dict[str, Any]:
        """Statistics of this task."""
        return {
            "interval_s": self.spec.interval,
            "priority": self.spec.priority,
            "scans": self.times.n,
            "overruns": self.overruns,
            **self.times.summary_us(),
        }


class Scanner:
    """Runs the programs against one CNC until it ends."""

    def __init__(self, hli: Hli, programs: Sequence[Program], pacer: Pacer | None = None) -> None:
        self._hli = hli
        self._programs = sorted(programs, key=lambda p: p.spec.priority)
        self._pacer = pacer or pacer_of(hli)
        self._stop = False
        self._end_seen = False
        self._next_check_ns = 0
        self._counters: Any = hli.plc._c  # the structure itself: twice a scan, nothing to check
        self._plc = hli.plc
        self._bahn_state = hli.gpCh[0].bahn_state

    def stop(self) -> None:
        """End after the current scan; may be called from a signal handler."""
        self._stop = True

    def run(self) -> Ending:
        """Setup, presence, scans.  Raises PlcError when the user's code fails."""
        self._setup()
        while True:
            self._scan_due()
            self._tell_finished()
            ending = self._wait_next()
            if ending is not None:
                return ending

    # -- steps
    def _setup(self) -> None:
        self._latch_clock()
        for program in self._programs:
            program.interval_ticks = self._pacer.ticks(program.spec.interval)
            program.scans_after_end = 0
            if program.has("setup"):
                program.call("setup", self._hli)
        self._hli.set_present()
        now = self._pacer.now()
        for program in self._programs:
            program.due = now

    def _latch_clock(self) -> None:
        latched = self._hli.cell_time_ns
        clock.set_source(lambda: latched)

    def _scan_due(self) -> None:
        now = self._pacer.now()
        self._latch_clock()
        for program in self._programs:
            if program.due <= now:
                self._scan(program)
                program.schedule(now)
        self._counters.scans += 1
        self._counters.heartbeat += 1

    def _scan(self, program: Program) -> None:
        begin = lib.hs_monotonic_ns()
        program.call("cyclic")
        program.times.add(lib.hs_monotonic_ns() - begin)
        program.scans_after_end += self._end_seen

    def _tell_finished(self) -> None:
        """The PLC's wish to end: the program has ended, each task had its scans since and says it is finished."""
        ended = self._hli.phase == layout.HLI_PHASE_ENDED or self._bahn_state.program_end_r
        if ended != self._end_seen:
            self._end_seen = ended
            for program in self._programs:
                program.scans_after_end = 0
        if not ended or self._plc.finished:
            return
        if all(p.scans_after_end >= SCANS_AFTER_END for p in self._programs) and self._all_finished():
            self._hli.finish()

    def _all_finished(self) -> bool:
        return all(p.call("finished") for p in self._programs if p.has("finished"))

    def _wait_next(self) -> Ending | None:
        due = min(p.due for p in self._programs)
        while True:
            if self._stop:
                return Ending.STOPPED
            if self._hli.phase == layout.HLI_PHASE_SHUTDOWN:
                return Ending.SHUTDOWN
            reached = self._pacer.wait(due)
            if (not reached or self._check_is_due()) and not self._hli.alive():
                return Ending.SHUTDOWN if self._hli.phase == layout.HLI_PHASE_SHUTDOWN else Ending.CNC_GONE
            if reached:
                return None

    def _check_is_due(self) -> bool:
        """Whether it is time to look after the CNC although scans go on (realtime: nothing else would tell)."""
        now = lib.hs_monotonic_ns()
        if now < self._next_check_ns:
            return False
        self._next_check_ns = now + _FLAG_CHECK_NS
        return True


def report(programs: Sequence[Program], requests: int, handshake_ns: dict[str, int]) -> dict[str, Any]:
    """The JSON report of a PLC process: statistics and what the tasks' ``result()`` give."""
    results = {p.name: p.call("result") for p in programs if p.has("result")}
    return {
        "scans": sum(p.times.n for p in programs),
        "overruns": sum(p.overruns for p in programs),
        "tasks": {p.name: p.report() for p in programs},
        "requests": requests,
        "handshake_ns": handshake_ns,
        "result": next(iter(results.values())) if len(results) == 1 else results or None,
    }
