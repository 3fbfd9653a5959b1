"""The child processes of a run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hli.interrupts import interrupts_held

from ..process.options import CncOptions
from ..recording.parts import Parts
from .worker import WarmProcess, Worker


class Child:
    """One process with its report and what it says on standard error."""

    def __init__(
        self,
        title: str,
        module: str,
        arguments: Sequence[str],
        folder: Path,
        terminal: bool = False,
        own_session: bool = False,
        worker: Worker | None = None,
    ) -> None:
        self.title = title
        self.report_file = folder / f"{title}.json"
        self.log_file = folder / f"{title}.log"
        with (
            self.log_file.open("wb") as log,
            open(os.devnull, "rb") as nothing,
        ):
            # what user code prints goes to our standard error, as it comes
            streams = (
                0 if terminal else nothing.fileno(),
                sys.__stderr__.fileno() if sys.__stderr__ else 2,
                log.fileno(),
            )
            self.process: WarmProcess | subprocess.Popen[bytes] = (
                worker.start(module, arguments, streams, own_session)
                if worker is not None
                else _started(module, arguments, streams, own_session)
            )

    @classmethod
    def of_cnc(
        cls, options: CncOptions, folder: Path, worker: Worker | None = None
    ) -> Child:
        """A CNC process with its report in the folder."""
        arguments = [options.as_json()]
        return cls(
            "cnc",
            "cnc_core.process",
            arguments,
            folder,
            options.terminal,
            worker=worker,
        )

    @classmethod
    def of_plc(
        cls,
        name: str,
        arguments: Sequence[str],
        folder: Path,
        record: tuple[Path, Sequence[str]] | None = None,
        worker: Worker | None = None,
    ) -> Child:
        """A PLC process on the segment, for one run; ``record``: its part of the
        recording, and the tables in it.
        """
        report = str(folder / "plc.json")
        more = ["--report", report, "--once"]
        if record is not None:
            file, tables = record
            more += ["--record", str(file)]
            more += [
                part for name in tables for part in ("--record-table", name)
            ]
        # Ctrl-C ends the CNC first: it tells what the PLC has left open
        return cls(
            "plc",
            "plc_client",
            ["--name", name, *arguments, *more],
            folder,
            own_session=True,
            worker=worker,
        )

    @property
    def ended(self) -> bool:
        return self.process.poll() is not None

    def end(self, seconds: float) -> None:
        """Wait, then kill: our own child only."""
        for insist in (False, True):
            if insist:
                self.process.kill()
            try:
                self.process.wait(seconds)
                return
            except subprocess.TimeoutExpired:
                continue

    def report(self) -> dict[str, Any]:
        try:
            out: dict[str, Any] = json.loads(self.report_file.read_text())
        except (OSError, ValueError):
            return {}
        return out

    def said(self) -> str:
        return self.log_file.read_text(errors="replace").strip()


def _started(
    module: str,
    arguments: Sequence[str],
    streams: tuple[int, int, int],
    own_session: bool,
) -> subprocess.Popen[bytes]:
    """A process that is started anew."""
    stdin, stdout, stderr = streams
    with interrupts_held():
        return subprocess.Popen(
            [
                *(sys.executable, "-P", "-m", module, *arguments),
                *("--parent", str(os.getpid())),
            ],
            stdin=stdin,
            stdout=stdout,
            stderr=stderr,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            start_new_session=own_session,
        )


@dataclass
class Job:
    """One run on its way."""

    cnc: Child
    plc: Child | None
    folder: Path
    name: str
    started: float
    stalled: bool = False
    out_of_time: bool = False  # the CNC has not kept --max-wall itself
    parts: Parts | None = None  # of the recording

    @property
    def children(self) -> list[Child]:
        return [child for child in (self.cnc, self.plc) if child is not None]

    def reports(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """The reports of CNC and PLC; empty where a side left none."""
        plc = self.plc.report() if self.plc is not None else {}
        return self.cnc.report(), plc
