"""A PLC program in the caller's own process, scan by scan: for tests, notebooks
and debugging.

The same tasks, the same runtime and the same memory as in a PLC process; only
the waiting differs.  Against a mock CNC (``PlcRunner.on_mock``) the CNC's
cycles run in the same thread; against a real CNC process in lockstep
(``PlcRunner(connect(...), ...)``) it is stepped through the handshake.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from hli import layout
from hli.symbol import Symbol

from .blocks.watchdog import read_record
from .client import Hli, connect
from .guard import Guard
from .inputs import Inputs
from .mock import MockCnc, Step
from .online import check, views_of
from .pace import CyclePacer
from .program import Program, task_statistics
from .scan import Scanner
from .scan_record import ScanRecord, memory_of, missing_rows
from .sources import load_tasks
from .task import PlcError

LIMIT_S = 3600.0
"""Cell time after which ``run_until`` gives up."""
TOLERANCE = 0.001
"""0.1 nm: distances are sums of many steps."""


class _MockPacer(CyclePacer):
    """The mock runs its cycles when the PLC waits for them."""

    def __init__(self, hli: Hli, cnc: MockCnc) -> None:
        super().__init__(hli)
        self._cnc = cnc

    def wait(self, due: int) -> bool:
        self._cnc.run_to(due)
        return True


Tasks = Sequence[type | str | Path] | type | str | Path


def task_classes(tasks: Tasks) -> list[type]:
    """Task classes from classes and files of classes.

    PlcError: none, or something that is no task.
    """
    given = tasks if isinstance(tasks, (list, tuple)) else [tasks]
    found = [cls for item in given for cls in _classes_of(item)]
    if not found:
        raise PlcError(
            "no task given: a class with a method cyclic(), or a file of such classes"
        )
    return found


def _classes_of(item: Any) -> list[type]:
    if isinstance(item, (str, Path)):
        return load_tasks(str(item))
    if not isinstance(item, type):
        raise PlcError(f"task {item!r}: the class itself is needed, or a file")
    if not callable(getattr(item, "cyclic", None)):
        raise PlcError(f"task {item.__name__} has no method cyclic()")
    return [item]


class PlcRunner:
    """PLC tasks under the control of the caller; lockstep only.

    A fresh runner has done its ``setup()`` and no scan.  ``step()`` runs scans;
    the ``run_to_*`` methods stop before the scan whose inputs first fulfil the
    condition: the task has not seen them yet, the caller has.

    ``watch``: symbols that are recorded from the first scan on.
    ``record``: file and tables of the PLC's part of a recording.
    """

    def __init__(
        self,
        hli: Hli,
        tasks: Tasks,
        cnc: MockCnc | None = None,
        close: Callable[[dict[str, Any]], dict[str, Any]] | None = None,
        inputs: Mapping[str, Any] | None = None,
        watch: str | Sequence[str] = (),
        record: tuple[Path, Sequence[str]] | None = None,
    ) -> None:
        if hli.cnc.clock != layout.HLI_CLOCK_LOCKSTEP:
            raise PlcError("a PlcRunner needs a CNC in lockstep")
        self.hli = hli
        self.cnc = cnc
        self._close = close
        self._closed = False
        self.cnc_report: dict[str, Any] = {}  # of a CNC process, after close()
        self._pacer = (
            _MockPacer(hli, cnc) if cnc is not None else CyclePacer(hli)
        )
        programs = [Program.of(cls) for cls in task_classes(tasks)]
        self._guard = Guard()
        self._scanner = Scanner(
            hli,
            programs,
            self._pacer,
            guard=self._guard,
            may_finish=False,
            inputs=inputs,
        )
        for path in [watch] if isinstance(watch, str) else watch:
            self._scanner.watch.add(path, self._scanner.symbols[path])
        if record is not None:
            self._record(hli, programs, *record)
        self.tasks: dict[str, Program] = {
            p.name.rpartition(".")[2]: p for p in programs
        }
        self._scanner.start()

    @classmethod
    def on_mock(
        cls,
        tasks: Tasks,
        script: Sequence[Step] | Sequence[Sequence[Step]] | MockCnc = (),
        *,
        inputs: Mapping[str, Any] | None = None,
        watch: str | Sequence[str] = (),
        **options: Any,
    ) -> PlcRunner:
        """A runner with a mock CNC of its own (``options``: those of ``MockCnc``)."""
        cnc = (
            script
            if isinstance(script, MockCnc)
            else MockCnc(script, **options)
        )
        try:
            hli = connect(cnc.name, present=False)
            return cls(hli, tasks, cnc, inputs=inputs, watch=watch)
        except BaseException:
            cnc.close()
            raise

    def _record(
        self,
        hli: Hli,
        programs: Sequence[Program],
        part: Path,
        tables: Sequence[str],
    ) -> None:
        """The PLC's part of a recording, with the symbols that are watched now."""
        names = ", ".join(program.name for program in programs)
        scanner = self._scanner
        scanner.watch.record_to(
            ScanRecord(
                part,
                scanner.watch.paths,
                {"plc": {"file": names}, "memory": memory_of(hli)},
                scanner.trace() if "exchange" in tables else None,
                waits=True,
            )
        )

    # -- life
    def close(self) -> None:
        """Detach; removes the mock, ends a CNC process that was started for
        this runner.
        """
        if self._closed:
            return
        self._closed = True
        self._scanner.close()
        self._guard.close()
        report: dict[str, Any] = {}
        if self._scanner.watch.to is not None:
            self._scanner.watch.to.close()
            report["recording"] = missing_rows(self._scanner.watch.to)
        self.hli.close()
        if self.cnc is not None:
            self.cnc.close()
        if self._close is not None:
            self.cnc_report = self._close(report)

    def __enter__(self) -> PlcRunner:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    # -- what there is
    def __getitem__(self, name: str) -> Any:
        """The instance of a task by its class's name; after a restart the new
        one.  KeyError names what there is.
        """
        if name not in self.tasks:
            views = views_of(self.task)
            if name in views:
                return views[name]
            raise KeyError(f"no task {name}; tasks: {', '.join(self.tasks)}")
        return self.tasks[name].instance

    @property
    def task(self) -> Any:
        """The instance of the only task (the first one)."""
        return next(iter(self.tasks.values())).instance

    @property
    def inputs(self) -> Inputs:
        """Simulated inputs: ``inputs["Clamp.closed"] = True``."""
        return self._scanner.inputs

    @property
    def ch(self) -> Any:
        """Channel 0."""
        return self.hli.gpCh[0]

    @property
    def cycle(self) -> int:
        """Completed CNC cycles."""
        return self.hli.cycle

    @property
    def time_s(self) -> float:
        """Cell time."""
        return self.hli.cell_time_s

    @property
    def distance(self) -> float:
        """``dist_prog_start`` now, 0.1 um."""
        return float(self.ch._c.bahn_state.dist_prog_start)

    @property
    def ended(self) -> bool:
        """Whether the program has ended."""
        return bool(self.hli.phase == layout.HLI_PHASE_ENDED)

    @property
    def warnings(self) -> list[str]:
        """What the tasks should know: intervals that are no multiple of the
        cell's cycle.
        """
        return [
            text
            for program in self._scanner.programs
            for text in program.warnings
        ]

    def statistics(self) -> dict[str, dict[str, Any]]:
        """Scans, times, jitter, overruns of every task."""
        return task_statistics(self._scanner.programs)

    # -- running
    def step(self, scans: int = 1) -> None:
        """So many scans: scan, then the CNC's cycles up to the next one.
        ValueError: below 0.
        """
        if scans < 0:
            raise ValueError(f"step of {scans} scans: 0 or more")
        for _ in range(scans):
            self.scan()
            self.advance()

    def scan(self) -> None:
        """The first half of a step: one scan, behind which the CNC stands."""
        self._scanner.scan()

    def advance(self) -> None:
        """The second half: the CNC's cycles up to the next scan."""
        due = self._scanner.next_due()
        while not self._pacer.wait(due):
            if (
                not self.hli.alive()
                or self.hli.phase == layout.HLI_PHASE_SHUTDOWN
            ):
                raise PlcError(
                    f"the CNC behind segment {self.hli.name!r} has ended"
                )

    def run_until(
        self, condition: Callable[[], Any], limit_s: float = LIMIT_S
    ) -> None:
        """Scans until the condition is true; PlcError when it is not after
        ``limit_s`` of cell time.
        """
        end = self.time_s + limit_s
        while not condition():
            if self.time_s >= end:
                raise PlcError(
                    f"{_text_of(condition)} did not come true within {limit_s:g} s of cell time"
                )
            self.step()

    def run_to_cycle(self, cycle: int) -> None:
        """Scans until so many cycles are completed."""
        self.run_until(lambda: self.cycle >= cycle)

    def run_to_time(self, seconds: float) -> None:
        """Scans until this cell time."""
        self.run_until(lambda: self.time_s >= seconds - 1e-12)

    def run_to_distance(
        self, distance: float, limit_s: float = LIMIT_S
    ) -> None:
        """Scans until the tool has passed this path distance (0.1 um) or the
        program has ended.
        """
        self.run_until(
            lambda: self.distance >= distance - TOLERANCE or self.ended, limit_s
        )

    def run_to_end(
        self, limit_s: float = LIMIT_S, scans_behind: int = 10
    ) -> None:
        """Scans to the program's end and some behind it.

        PlcError: an error ended the program of a channel.
        """
        self.run_until(lambda: self.ended, limit_s)
        self.step(scans_behind)
        for ch in self.hli.gpCh:
            if ch is not None and _failed(ch):
                raise PlcError(_ended_by(ch))

    def restart(self) -> None:
        """PLC restart beside the CNC that stays as it is: new instances,
        ``setup()`` again.
        """
        self._scanner.restart()

    # -- online
    def symbol(self, path: str) -> Symbol:
        """A variable of the HLI or of a task, by its path."""
        return self._scanner.symbols[path]

    def force(self, path: str, value: Any) -> None:
        """Hold a symbol at a value, twice a scan, until ``unforce``.

        SymbolError: there is no such variable.
        """
        symbol = self.symbol(path)
        check(symbol)
        self._scanner.forces.force(symbol.path, symbol, value)

    def unforce(self, path: str | None = None) -> None:
        """Let one symbol go, or all.  SymbolError: it is not forced."""
        forces = self._scanner.forces
        if path is None:
            forces.unforce()
        else:
            forces.let_go([(path, self.symbol(path).path)])

    def watch(self, *paths: str) -> None:
        """Record these symbols at the end of every scan from now on."""
        for path in paths:
            symbol = self.symbol(path)
            check(symbol)
            self._scanner.watch.add(path, symbol)

    def trace(self) -> dict[str, np.ndarray[Any, Any]]:
        """What was watched: ``t`` (s) and one array per path."""
        return self._scanner.watch.columns()


def _failed(ch: Any) -> bool:
    state = ch._c.channel_mc_control.mode_and_state.state_r.state
    return bool(state == layout.HLI_IMCM_PROCESS_ERROR)


def _ended_by(ch: Any) -> str:
    """The error that a channel stands in, by the last record of ``mc_error``."""
    record = read_record(ch.mc_error)
    block = f", N{record.block_number}" if record.block_number else ""
    file = Path(record.file or record.program).name
    place = f" ({file}{block})" if file else ""
    return (
        f"the program ended with error {record.error_id}{place};"
        f" hli-cosim explain {record.error_id}; after close() cnc_report tells more"
    )


def _text_of(condition: Callable[[], Any]) -> str:
    try:
        return f"the condition ({' '.join(inspect.getsource(condition).split())[:80]})"
    except (OSError, TypeError):
        return "the condition"
