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

from ..process.options import CncOptions
from ..recording.parts import Parts


class Child:
    """One process with its report and what it says on standard error."""

    def __init__(
        self,
        title: str,
        module: str,
        arguments: Sequence[str],
        folder: Path,
        terminal: bool = False,
    ) -> None:
        self.title = title
        self.report_file = folder / f"{title}.json"
        self.log_file = folder / f"{title}.log"
        command = [
            sys.executable,
            "-P",
            "-m",
            module,
            *arguments,
            "--parent",
            str(os.getpid()),
        ]
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
        # what user code prints goes to our standard error, as it comes
        with self.log_file.open("wb") as log:
            stdin = None if terminal else subprocess.DEVNULL
            self.process = subprocess.Popen(
                command,
                stdin=stdin,
                stdout=sys.__stderr__,
                stderr=log,
                env=environment,
            )

    @classmethod
    def of_cnc(cls, options: CncOptions, folder: Path) -> Child:
        """A CNC process with its report in the folder."""
        arguments = [options.as_json()]
        return cls(
            "cnc", "cnc_core.process", arguments, folder, options.terminal
        )

    @classmethod
    def of_plc(
        cls,
        name: str,
        arguments: Sequence[str],
        folder: Path,
        record: Path | None = None,
    ) -> Child:
        """A PLC process on the segment, for one run; ``record``: its part of the
        recording.
        """
        report = str(folder / "plc.json")
        more = ["--report", report, "--once"]
        more += ["--record", str(record)] if record else []
        return cls(
            "plc", "plc_client", ["--name", name, *arguments, *more], folder
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


@dataclass
class Job:
    """One run on its way."""

    cnc: Child
    plc: Child | None
    folder: Path
    name: str
    started: float
    stalled: bool = False
    parts: Parts | None = None  # of the recording

    @property
    def children(self) -> list[Child]:
        return [child for child in (self.cnc, self.plc) if child is not None]

    def reports(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """The reports of CNC and PLC; empty where a side left none."""
        plc = self.plc.report() if self.plc is not None else {}
        return self.cnc.report(), plc
