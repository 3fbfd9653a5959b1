"""A CNC process alone, in lockstep, for a PLC that lives in the caller's
process (tests, notebooks).

    with start_plc("part.nc", MyPlc) as plc:
        plc.run_to_distance(100_000.0)
"""

from __future__ import annotations

import os
import secrets
import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hli import segment
from hli.errors import HliNotFound, HliNotReady
from plc_client.client import Hli, connect
from plc_client.runner import PlcRunner, Tasks
from plc_client.task import refuse_cell_start

from ..config import load_config
from ..errors import CncError
from ..files import need_program
from ..process.options import CncOptions, RunOptions, names_of
from ..process.recording import Missing, check_record_only
from ..recording.parts import Parts
from .child import Child
from .kept import plc_part
from .programs import Programs, programs_of, refuse_mcap
from .scratch import scratch_folder
from .worker import worker_for_start

_RETRY_S = 0.01


class _Machine:
    """The CNC process with its folder and segment."""

    def __init__(
        self,
        programs: tuple[Path | None, ...],
        config: Path | None,
        dialect: str | None,
        service: str | None,
        autostart: bool,
        record: Path | None,
        only: tuple[str, ...],
    ) -> None:
        self.parts = Parts(record) if record else None
        self.folder = scratch_folder()
        self.name = f"hli-cosim-{os.getpid()}-{secrets.token_hex(4)}"
        chosen = RunOptions(
            dialect=dialect,
            service=service,
            autostart=autostart,
            record_only=only,
        )
        options = CncOptions(
            programs[0],
            self.name,
            chosen.checked(),
            config=config,
            report=self.folder / "cnc.json",
            samples=self.parts.cnc if self.parts else None,
            once=True,
            terminal=False,
            more=programs[1:],
        )
        self.child = Child.of_cnc(options, self.folder, worker_for_start())

    def connect(self) -> Hli:
        """As soon as its segment is there; CncError with what it said if it
        ended before.  A busy machine may take long.
        """
        while True:
            try:
                return connect(self.name, present=False)
            except (HliNotFound, HliNotReady):
                if self.child.ended:
                    said = self.child.said().splitlines()
                    raise CncError(
                        905001,
                        said[-1] if said else "the CNC process did not start",
                    ) from None
                time.sleep(_RETRY_S)

    def end(self, plc: dict[str, Any]) -> dict[str, Any]:
        """End it, write the recording, remove everything else; its report
        (empty if it was killed).  ``plc``: that of the PLC's side.
        """
        if not self.child.ended:
            self.child.process.terminate()
        self.child.end(5.0)
        report = self.child.report()
        segment.remove(self.name)
        shutil.rmtree(self.folder, ignore_errors=True)
        if self.parts is None:
            return report
        if not report and not self.parts.cnc.exists():
            self.parts.drop()  # it did not start
        else:
            lost = Missing.of(report, plc).lost
            self.parts.finish(end=report.get("end", "error"), lost=lost)
        return report


def start_plc(
    program: Programs,
    tasks: Tasks,
    *,
    config: str | Path | None = None,
    dialect: str | None = None,
    service: str | None = None,
    autostart: bool = True,
    inputs: Mapping[str, Any] | None = None,
    watch: str | Sequence[str] = (),
    record: str | Path | None = None,
    record_only: str | Sequence[str] = (),
) -> PlcRunner:
    """A ``PlcRunner`` beside the real CNC in a process of its own, in lockstep:
    nothing runs until ``step()``.

    ``program``: a list of them for a cell with several channels.
    ``tasks``: task classes (they may be local to a function) or files.
    ``close()`` ends the CNC; its report is then in ``cnc_report``.
    ``autostart`` FALSE: the program stands ready, the PLC starts it.
    ``inputs``: simulated inputs beside those of the cell file.
    ``watch``: symbols that are watched from the first scan on.
    ``record``: file of the recording, which ``close()`` writes; ``record_only``:
    tables and columns in it.
    CncError: no such file, the CNC did not start.
    """
    refuse_cell_start()
    cell = load_config(config)
    file = Path(config).resolve() if config is not None else None
    programs = _found(programs_of(cell, program, file))
    known = {**cell.simulated_inputs, **(inputs or {})}
    only = names_of(record_only)
    check_record_only(cell, only)
    if len(programs) > 1:
        refuse_mcap(Path(record) if record else None)
    machine = _Machine(
        programs,
        file,
        dialect,
        service,
        autostart,
        Path(record) if record else None,
        only,
    )
    try:
        hli = machine.connect()
        try:
            return PlcRunner(
                hli,
                tasks,
                close=machine.end,
                inputs=known,
                watch=names_of(watch),
                record=plc_part(machine.parts, only),
            )
        except BaseException:
            hli.close()
            raise
    except BaseException:
        machine.end({})
        raise


def _found(programs: tuple[Path | None, ...]) -> tuple[Path | None, ...]:
    """Whole paths; CncError: no such file, or none that is a program."""
    whole = tuple(path and path.resolve() for path in programs)
    for path in whole:
        if path is not None:
            need_program(path)
    return whole
