"""The scan runtime: inputs latched, tasks in priority order at their intervals,
outputs published; against one CNC.

One ``Scanner`` lives from attachment to the end of that CNC (``Ending``);
``plc_client.__main__`` makes a new one after a re-attachment.  Order after
attachment: every task's ``setup()``, then ``plc_present_w``, then a scan at
once. One scan: latch the clock and the input image, write simulated inputs and
forced values, run the tasks that are due, write forced values, record the watch
list; then the CNC runs on and sees all that was written.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np
from hli._sync import lib

from hli import layout
from hli.errors import HliTimeout
from hli.orders import Orders

from . import advice, clock, stats
from .client import Hli
from .guard import Guard, TaskOverrun
from .image import InputImage
from .inputs import Inputs
from .memory_trace import MemoryTrace
from .online import Forces, SymbolTable, Watch
from .orders_obeyed import Online
from .pace import CyclePacer, Pacer, pacer_of
from .panel import Panels
from .program import Program, task_statistics
from .scan_loop import DUE, NOT_DUE, TRAPPED, ScanLoop
from .task import PlcError

SCANS_AFTER_END = 10
_FLAG_CHECK_NS = 100_000_000
_ENDED = layout.HLI_PHASE_ENDED

__all__ = ["SCANS_AFTER_END", "Ending", "Program", "Scanner", "report"]


class Ending(Enum):
    """Why a scanner stopped."""

    SHUTDOWN = "shutdown"  # the CNC asked for it
    CNC_GONE = "cnc gone"
    STOPPED = "stopped"  # signal or stop()


class Scanner:
    """Runs the programs against one CNC until it ends, or scan by scan
    (``start``, ``scan``, ``next_due``).
    """

    def __init__(
        self,
        hli: Hli,
        programs: Sequence[Program],
        pacer: Pacer | None = None,
        *,
        watch: Watch | None = None,
        forces: Forces | None = None,
        guard: Guard | None = None,
        may_finish: bool = True,
        inputs: Mapping[str, Any] | None = None,
    ) -> None:
        self._hli = hli
        self._may_finish = may_finish
        self.programs = sorted(programs, key=lambda p: p.spec.priority)
        self._pacer = pacer or pacer_of(hli)
        self._in_cycles = isinstance(self._pacer, CyclePacer)
        self._on_wall = hli.cnc.clock == layout.HLI_CLOCK_REALTIME
        self.watch = watch if watch is not None else Watch()
        self.forces = forces if forces is not None else Forces()
        self._guard = guard or Guard()
        self._own_guard = guard is None
        self._stop = self._restart = False
        self.halted = False  # scans without the tasks' logic
        self.before_restart: Callable[[], Sequence[Program] | None] = lambda: (
            self.programs
        )
        self.on_start: Callable[[], None] = lambda: None
        self._end_seen = False
        self._next_check_ns = 0
        self._loop: ScanLoop | None = None
        # the structure itself: twice a scan, nothing to check
        self._counters: Any = hli.plc._c
        self._plc = hli.plc
        self._image = InputImage(hli)
        # cycle, cell time and phase as they were latched
        self._now = self._image.now
        self._live_ns = lambda: int(self._now.cell_time_ns)
        self.symbols = SymbolTable(hli, self.programs)
        self.inputs = Inputs(hli, self.symbols, inputs)
        self.orders = (
            Orders()
        )  # of other processes; a PLC process puts its own here
        self.panel = Panels(hli, self.symbols, self.forces)
        self._online = Online(
            self.symbols,
            self.forces,
            self.panel.operate,
            self._statistics,
            self.halt,
        )

    def trace(self) -> MemoryTrace:
        """What CNC and PLC change in the memory from now on."""
        return MemoryTrace(self._hli, self._image)

    def stop(self) -> None:
        """End after the current scan; may be called from a signal handler."""
        self._stop = True

    def request_restart(self) -> None:
        """Restart the PLC before the next scan; may be called from a signal handler."""
        self._restart = True

    def halt(self, value: bool) -> bool:
        """Leave the tasks' logic out from now on, or run it again.

        What they have written stands.
        """
        self.halted = value
        return value

    def run(self) -> Ending:
        """Setup, presence, scans.  Raises PlcError when the user's code fails,
        HliTimeout when a CNC that lives stays in the middle of a write.
        """
        try:
            self.start()
            while True:
                if not self._scans_in_c():
                    self.scan()
                ending = self._wait_next()
                if ending is not None:
                    return ending
        except HliTimeout:
            if self._hli.alive():
                raise
            return Ending.CNC_GONE  # it died in the middle of a write
        # the watchdog bit just when the call had returned after all
        except TaskOverrun as error:
            raise PlcError("task watchdog: a task took too long") from error
        finally:
            self.close()

    def close(self) -> None:
        """The connection's views read the memory again; ends the watchdog's thread."""
        self._image.close()
        if self._own_guard:
            self._guard.close()

    # -- the steps of a PLC's life
    def start(self) -> None:
        """Latch, ``setup()`` of all tasks, ``plc_present_w``; the first scan is
        due now.
        """
        self._latch()
        record = self.watch.to
        if record is not None:
            record.look(self._now.cycle, by_plc=False)
        for program in self.programs:
            program.start(self._ticks(program), self._guard)
            if program.has("setup"):
                program.call("setup", self._hli)
            program.ready = True
        self.watch.rebind(self.symbols)
        self.forces.rebind(self.symbols)
        self.inputs.rebind(self.programs)
        self._hli.set_present()
        self._loop = (
            ScanLoop(self._hli, self._image, self.programs)
            if self._in_cycles
            else None
        )
        if record is not None:
            record.look(self._now.cycle, by_plc=True)
        self.on_start()
        now = self._pacer.now()
        for program in self.programs:
            program.due = now

    def _ticks(self, program: Program) -> int:
        """The interval on the pacer's clock; what the cell's cycle makes of it
        is told where it differs.
        """
        interval = program.spec.interval
        ticks = self._pacer.ticks(interval)
        real = ticks * self._hli.cycle_s
        if self._in_cycles:
            program.interval_s = real
        program.warnings = advice.of_class(program)
        if self._in_cycles and abs(real - interval) > 1e-6 * interval:
            cycle_ms = self._hli.cycle_s * 1e3
            problem = (
                f"{interval * 1e3:g} ms is no multiple of the cell's cycle "
                f"of {cycle_ms:g} ms"
            )
            program.warnings.append(
                f"task {program.name}: {problem}; it runs every {real * 1e3:g} ms"
            )
        return ticks

    def restart(self) -> None:
        """PLC restart beside a CNC that runs on: new instances, ``setup()``
        again (it must rewrite all ``_w`` data).
        """
        self._restart = False
        programs = self.before_restart()
        if programs is None:  # nothing to restart with: told already
            return
        self.programs = sorted(programs, key=lambda p: p.spec.priority)
        self.symbols.update(self.programs)
        for program in self.programs:
            program.restart()
        self.start()

    def next_due(self) -> int:
        """Tick of the next scan."""
        if len(self.programs) == 1:
            return self.programs[0].due
        return min(p.due for p in self.programs)

    def scan(self) -> None:
        """Inputs, logic of all tasks that are due, outputs."""
        if self._restart:
            self.restart()
        if self.orders.waiting:
            self.orders.serve(self._online)
        self._latch()
        self.scan_latched()

    @property
    def now(self) -> Any:
        """The image as C latches it (``hs_image``)."""
        return self._now

    def scan_latched(self) -> None:
        """The scan of the image that is latched, here or by somebody else."""
        record = self.watch.to
        if record is not None:
            record.scan += 1
            record.look(self._now.cycle, by_plc=False)
        if self.inputs.any:
            self.inputs.apply(self._now.cell_time_ns / 1e9)
        if self.forces.any:
            self.forces.apply()
        self._logic(self._now.cycle if self._in_cycles else self._pacer.now())
        if self.panel.any:
            self.panel.step()
        if self.inputs.any:
            self.inputs.scanned()
        if self.forces.any:
            self.forces.apply()
        if self.watch.any:
            self.watch.record(self._now.cell_time_ns / 1e9, self._now.cycle)
        if record is not None:  # the CNC goes on as soon as the scan counts
            record.end_scan(self._now.cycle)
        counters = self._counters
        counters.scans = counters.heartbeat = counters.scans + 1
        if self._end_seen or self._now.phase == _ENDED:
            self._tell_finished()

    def _scans_in_c(self) -> bool:
        """Scans in C while nothing but the tasks needs Python.  True: they are
        done, and none is due.  PlcError: a task failed or its trap stopped it.
        """
        loop, result = self._loop, DUE
        if loop is None or self._end_seen or self._asked:
            return False
        clock.set_source(self._live_ns)
        while result == DUE and not self._asked:
            result = self.scan_by(lib.hs_scan_tasks)
        self._latch()
        return bool(result == NOT_DUE)

    @property
    def in_c(self) -> bool:
        """Whether C may run the scans: nobody wants something of the next one."""
        return self._loop is not None and not self._asked

    def scan_by(self, loop: Callable[[Any], int]) -> int:
        """Scans that a loop in C runs (see ``ScanLoop.run``); PlcError: a task
        failed or its trap stopped it.
        """
        assert self._loop is not None
        result = self._loop.run(loop)
        if result == TRAPPED:
            self._loop.stopped()
            self._loop = None
        return result

    @property
    def _asked(self) -> bool:
        """Whether somebody wants something of the next scan."""
        return (
            self._stop
            or self._restart
            or self.halted
            or self.orders.waiting
            or self.inputs.any
            or self.forces.any
            or self.panel.any
            or self.watch.any
            or self.watch.to is not None
        )

    # -- steps of one scan
    def _latch(self) -> None:
        self._image.latch()
        clock.set_source(self._live_ns)

    def _logic(self, now: int) -> None:
        """The tasks that are due, in order of priority."""
        at_ns = None if self._on_wall else self._now.cell_time_ns
        for program in self.programs:
            if program.due > now:
                continue
            if self.halted:
                program.schedule(now)
            else:
                program.scan(now, at_ns, self._end_seen)

    def _statistics(self) -> dict[str, Any]:
        """What other processes may know of the tasks and the handshake."""
        states = self.panel.states()
        return {
            "tasks": task_statistics(self.programs),
            "handshake": stats.HANDSHAKES.histogram_us(),
            "panel": states[0],
            "panels": states,
        }

    def _tell_finished(self) -> None:
        """The PLC's wish to end: the program has ended, each task had its scans
        since and says it is finished.
        """
        ended = self._now.phase == _ENDED
        if ended != self._end_seen:
            self._end_seen = ended
            for program in self.programs:
                program.scans_after_end = 0
        if not (ended and self._may_finish) or self._plc.finished:
            return
        if (
            all(p.scans_after_end >= SCANS_AFTER_END for p in self.programs)
            and self._all_finished()
        ):
            self._hli.finish()

    def _all_finished(self) -> bool:
        return all(
            p.call("finished") for p in self.programs if p.has("finished")
        )

    def _wait_next(self) -> Ending | None:
        due = self.next_due()
        while True:
            if self._stop:
                return Ending.STOPPED
            if self._hli.phase == layout.HLI_PHASE_SHUTDOWN:
                return Ending.SHUTDOWN
            reached = self._pacer.wait(due)
            if (
                not reached or (self._on_wall and self._check_is_due())
            ) and not self._hli.alive():
                return (
                    Ending.SHUTDOWN
                    if self._hli.phase == layout.HLI_PHASE_SHUTDOWN
                    else Ending.CNC_GONE
                )
            if reached:
                return None
            if self.orders.waiting:  # while the CNC stands
                self.orders.serve(self._online)

    def _check_is_due(self) -> bool:
        """Whether it is time to look after the CNC although scans go on
        (realtime: nothing else would tell).
        """
        now = lib.hs_monotonic_ns()
        if now < self._next_check_ns:
            return False
        self._next_check_ns = now + _FLAG_CHECK_NS
        return True


def report(
    programs: Sequence[Program],
    requests: int,
    handshake_ns: dict[str, int],
    watch: Watch | None = None,
    results: bool = True,
) -> dict[str, Any]:
    """The JSON report of a PLC process: statistics, what the tasks'
    ``result()`` give, the watch list.

    Raises PlcError, which names the task, if ``result()`` fails or gives what
    JSON cannot hold.
    """
    found = {
        p.name: _result(p)
        for p in programs
        if results and p.ready and p.has("result")
    }
    return {
        "scans": sum(p.times.n for p in programs),
        "overruns": sum(p.overruns for p in programs),
        "tasks": task_statistics(programs),
        "warnings": [
            text for p in programs for text in (*p.warnings, *advice.of_run(p))
        ],
        "requests": requests,
        "handshake_ns": handshake_ns,
        "result": next(iter(found.values()))
        if len(found) == 1
        else found or None,
        **({"watch": watch.report()} if watch else {}),
    }


def _result(program: Program) -> Any:
    try:
        return plain(program.call("result"))
    except TypeError as error:
        raise PlcError(
            f"result() of task {program.name} gives no JSON value: {error}"
        ) from None


def plain(value: Any, place: str = "result") -> Any:
    """The value as JSON holds it: numpy's numbers and arrays too, what is not
    finite as None.

    Raises TypeError that names the place inside the value.
    """
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, (str, int)):
                raise TypeError(
                    f"{place} has the key {key!r} ({type(key).__name__})"
                )
        return {
            key: plain(item, f"{place}[{key!r}]") for key, item in value.items()
        }
    if isinstance(value, (list, tuple)):
        return [plain(item, f"{place}[{i}]") for i, item in enumerate(value)]
    raise TypeError(f"{place} is a {type(value).__name__}")
