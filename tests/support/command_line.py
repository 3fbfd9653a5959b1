"""The command line as tests run it, and what it printed."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hli import layout

SHM = Path("/dev/shm")
T1 = """N10 G00 X0 Y0
N20 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]
N30 G01 X30 Y0 F1000
N40 X30 Y40
N50 G03 X10 Y60 I-20 J0
N60 #CONTOUR LOOKAHEAD LOG [PARAM=5.5]
N70 G02 X0 Y70 I0 J10
N80 G01 X-20 Y70
N90 #CONTOUR LOOKAHEAD LOG OFF [PARAM=2]
"""


@dataclass
class Outcome:
    """What a command printed and its exit status."""

    status: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        assert self.out, f"nothing printed; status {self.status}: {self.err}"
        return json.loads(self.out)

    @property
    def lines(self) -> list[Any]:
        return [json.loads(line) for line in self.out.splitlines()]


def command(*arguments: object) -> list[str]:
    """The command line of one ``hli-cosim`` call."""
    return [sys.executable, "-P", "-m", "cnc_core.cli", *map(str, arguments)]


def wait_for_cycle(launcher: int, cycle: int) -> None:
    """Until the CNC that a launcher has started has run so many cycles."""
    at = (
        layout.HLI_SEGMENT.sidecar.offset
        + layout.HLI_SIDECAR.cnc.offset
        + layout.HLI_SIDE_CNC.cycle.offset
    )
    for _ in range(6000):
        for path in SHM.glob(f"hli-cosim-{launcher}-*"):
            if (
                int.from_bytes(path.read_bytes()[at : at + 8], "little")
                >= cycle
            ):
                return
        time.sleep(0.02)
    raise AssertionError("the CNC does not run")


def wait_for_segment(process: subprocess.Popen[str], owner: str) -> None:
    """Until a process has made a segment whose name begins so."""
    wait_for_path(process, SHM, f"{owner}*")


def wait_for_path(
    process: subprocess.Popen[str], folder: Path, pattern: str
) -> None:
    """Until a process has made something in the folder."""
    for _ in range(6000):
        if list(folder.glob(pattern)):
            return
        assert process.poll() is None, "ended before"
        time.sleep(0.02)
    raise AssertionError(f"no {pattern} was made")
