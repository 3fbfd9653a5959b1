"""The cell: a CNC process and a PLC process side by side, started, supervised
and ended together.

    with Cell("cell.toml") as cell:
        result = cell.run("part.nc", plc=OverrideFromContour)
"""

from __future__ import annotations

import difflib
import os
import secrets
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Unpack

from hli import segment
from hli.errors import HliError
from hli.interrupts import interrupts_held
from plc_client.task import refuse_cell_start

from ..config import CellConfig, load_config
from ..config.reading import config_of, config_text
from ..errors import CncError
from ..files import need_program
from ..frontend.operator import read_answers
from ..process.options import (
    OUT_FOLDER,
    CncOptions,
    RunKeywords,
    RunOptions,
    names_of,
    takes_run_options,
)
from ..process.recording import Missing, check_record_only
from ..program.restart import Restart
from ..recording.parts import Parts
from .child import Child, Job
from .judgement import be_strict, judge
from .kept import keep_recording, plc_part, recorded_aside
from .plc_choice import PlcChoice, tables_of
from .programs import Programs, programs_of, refuse_for_several
from .result import RunInterrupted, RunResult
from .scratch import files_below, scratch_folder, sweep_folders
from .supervision import stop, supervise
from .worker import worker_for_run

__all__ = ["Cell", "RunInterrupted", "RunResult"]


class Cell:
    """A machine that runs programs beside a PLC.

    ``config``: a configuration file, its content as a dict, or a CellConfig;
    None: the built-in machine X Y Z.  ConfigError tells what is wrong in it.
    """

    def __init__(
        self,
        config: str | Path | dict[str, Any] | CellConfig | None = None,
        *,
        clock: str = "lockstep",
        service: str | None = None,
    ) -> None:
        self.config_path: Path | None = None
        self.config: CellConfig
        if isinstance(config, (str, Path)):
            self.config_path = Path(config).resolve()
            config = load_config(self.config_path)
        self._given = config is not None and self.config_path is None
        self.config = CellConfig() if config is None else config_of(config)
        self.clock, self.service = clock, service
        self._job: Job | None = None

    def __enter__(self) -> Cell:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End what still runs and remove it from shared memory."""
        if self._job is not None:
            job, self._job = self._job, None
            stop(job)
            segment.remove(job.name)
            shutil.rmtree(job.folder, ignore_errors=True)

    @takes_run_options
    def run(
        self,
        program: Programs,
        plc: Any = None,
        *,
        plc_args: dict[str, Any] | None = None,
        **chosen: Unpack[RunKeywords],
    ) -> RunResult:
        """Run the program to its end.

        ``program``: a file, or several: one a channel in their order.  Channels
        behind them execute what the cell file names.
        ``plc``: a file, a task class, ``builtin:NAME`` or None.
        None acknowledges everything.
        ``"none"`` runs without a PLC process, in virtual time.
        Functions then count as acknowledged.
        A stop that waits for "continue" then ends the run with an error.
        ``chosen``: members of ``RunOptions``, among them ``clock``, ``dialect``,
        ``out``, ``record``, ``watch``, ``force`` and ``start_line``.
        ``record=True`` records without a file of yours.

        What was recorded and watched is in ``result.columns``.
        CncError: something is wrong before the start (files, names).
        Later errors are in the result.
        """
        if chosen.get("record") is not True:
            return self.run_with(
                self._options(chosen), program, plc, plc_args, warm=True
            )

        def run(target: Path) -> RunResult:
            named: RunKeywords = {**chosen, "record": target}
            options = self._options(named)
            return self.run_with(options, program, plc, plc_args, warm=True)

        return recorded_aside(run)

    def run_with(
        self,
        options: RunOptions,
        program: Programs,
        plc: Any = None,
        plc_args: dict[str, Any] | None = None,
        look: Callable[[str], None] = lambda _: None,
        warm: bool = False,
        attended: bool = False,
    ) -> RunResult:
        """As ``run``, with options that are complete.

        ``look``: called with the segment's name again and again.
        ``attended``: a monitor runs beside it, whose page answers dialogs.
        ``warm``: further runs may follow; a worker makes the processes.
        """
        refuse_cell_start()
        programs = programs_of(self.config, program, self.config_path)
        self._check(programs, options)
        choice = (
            PlcChoice.of(plc, plc_args)
            .online(options.watch, options.force)
            .structured(options.st)
        )
        segment.sweep()
        sweep_folders()
        folder = options.out or OUT_FOLDER
        before = files_below(folder)

        def collected(*, judged: bool) -> RunResult:
            result = self._collect(job, options, judged=judged)
            result.files = [
                name
                for name, stamp in files_below(folder).items()
                if before.get(name) != stamp
            ]
            return result

        with interrupts_held() as let_come:
            self._job = job = self._start(
                programs, choice, options, warm, attended
            )
            try:
                let_come()
                supervise(job, options.max_wall, look)
                stop(job)
                return collected(judged=True)
            except KeyboardInterrupt:
                stop(job)
                result = collected(judged=False)
                raise RunInterrupted(result, options.record) from None
            except BaseException:
                stop(job)
                if job.parts:
                    job.parts.finish(end="interrupted")
                raise
            finally:
                self.close()

    def _options(self, chosen: RunKeywords) -> RunOptions:
        """The options of a run; the cell's clock and service where none is named."""
        given: dict[str, Any] = {**chosen}
        _refuse_unknown(given)
        for name in ("out", "record", "answers"):
            if given.get(name):
                given[name] = Path(given[name])
        for name in ("watch", "record_only", "st"):
            given[name] = names_of(given.get(name, ()))
        given["force"] = given.get("force") or {}
        given["inputs"] = tables_of(given.get("inputs"))
        given["clock"] = given.get("clock") or self.clock
        given["service"] = given.get("service") or self.service
        return RunOptions(**given)

    def _check(
        self, programs: tuple[Path | None, ...], options: RunOptions
    ) -> None:
        """Refuse what is wrong before anything starts."""
        for program in programs:
            if program is not None:
                need_program(program)
        if len(programs) > 1:
            refuse_for_several(options)
        check_record_only(self.config, options.record_only)
        if options.answers:
            read_answers(options.answers)
        Restart.of(*options.checked().place)

    def _start(
        self,
        programs: tuple[Path | None, ...],
        choice: PlcChoice,
        options: RunOptions,
        warm: bool,
        attended: bool,
    ) -> Job:
        if options.name:
            _refuse_living(options.name)
        parts = Parts(options.record) if options.record else None
        folder = scratch_folder()
        choice = choice.beside(
            {**self.config.simulated_inputs, **options.inputs}
        )
        own = f"hli-cosim-{os.getpid()}-{secrets.token_hex(4)}"
        name = segment.check_name(options.name or own)
        alone = not choice.arguments
        if alone and options.clock == "lockstep":
            # the same cycles, and nobody to wait for
            options = replace(options, clock="freerun")
        chosen = CncOptions(
            programs[0],
            name,
            options,
            config=self._config_file(folder),
            wait_plc=not alone,
            report=folder / "cnc.json",
            samples=parts.cnc if parts else None,
            once=True,
            terminal=sys.stdin is not None and sys.stdin.isatty(),
            attended=attended,
            more=programs[1:],
        )
        started = time.monotonic()
        record = plc_part(parts, options.record_only)
        worker = worker_for_run() if warm else None
        cnc = Child.of_cnc(chosen, folder, worker)
        plc = (
            None
            if alone
            else Child.of_plc(name, choice.arguments, folder, record, worker)
        )
        return Job(cnc, plc, folder, name, started, parts=parts)

    def _config_file(self, folder: Path) -> Path | None:
        """The file from which the CNC process takes its configuration."""
        if not self._given:
            return self.config_path
        path = folder / "cell.json"
        path.write_text(config_text(self.config))
        return path

    def _collect(
        self, job: Job, options: RunOptions, *, judged: bool
    ) -> RunResult:
        """The result from the reports of both processes.

        ``judged``: how it ended counts; an interrupted run has no such end.
        """
        cnc, plc = job.reports()
        result = RunResult.from_reports(
            cnc, plc, time.monotonic() - job.started
        )
        result.name = job.name
        if judged:
            judge(result, job, cnc)
            if options.strict:
                be_strict(result)
        if job.parts:
            missing = Missing.of(cnc, plc, start=job.parts.problem)
            end = result.end if judged else "interrupted"
            keep_recording(result, job.parts, missing, end)
        return result


def _refuse_living(name: str) -> None:
    """CncError: a segment of this name has a living owner."""
    try:
        with segment.attach(name) as found:
            alive = found.owner_alive()
    except HliError:
        return  # none, or one that the CNC replaces or refuses itself
    if alive:
        raise CncError(
            905002,
            f"segment {name!r} is in use: end that cell, or choose another"
            " --name (hli-cosim ps lists them)",
        )


def _refuse_unknown(given: dict[str, Any]) -> None:
    """TypeError for what is no member of ``RunOptions``, with the nearest."""
    known = [*RunOptions.__dataclass_fields__, "plc", "plc_args"]
    for name in given.keys() - set(known):
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise TypeError(f"run() has no argument {name!r}{hint}")
