"""Shared fixtures: the command line as a user runs it, programs on disk, nothing left in shared memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

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
        return json.loads(self.out)

    @property
    def lines(self) -> list[Any]:
        return [json.loads(line) for line in self.out.splitlines()]


def command(*arguments: object) -> list[str]:
    """The command line of one ``hli-cosim`` call."""
    return [sys.executable, "-P", "-m", "cnc_core.cli", *map(str, arguments)]


def wait_for_cycle(launcher: int, cycle: int) -> None:
    """Until the CNC that a launcher has started has run so many cycles."""
    at = layout.HLI_SEGMENT.sidecar.offset + layout.HLI_SIDECAR.cnc.offset + layout.HLI_SIDE_CNC.cycle.offset
    for _ in range(3000):
        for path in SHM.glob(f"hli-cosim-{launcher}-*"):
            if int.from_bytes(path.read_bytes()[at : at + 8], "little") >= cycle:
                return
        time.sleep(0.02)
    raise AssertionError("the CNC does not run")


@pytest.fixture
def cli(tmp_path: Path) -> Callable[..., Outcome]:
    """Run ``hli-cosim`` in a folder of its own; ``cli("plan", path, "--json")``."""

    def call(*arguments: object, timeout: float = 300.0) -> Outcome:
        done = subprocess.run(
            command(*arguments), cwd=tmp_path, capture_output=True, text=True, timeout=timeout, check=False
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    return call


@pytest.fixture
def program(tmp_path: Path) -> Callable[..., Path]:
    """Write a text to a file below the test's folder."""

    def write(text: str, name: str = "part.nc") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.fixture(autouse=True)
def nothing_left_in_shared_memory() -> Iterator[None]:
    """Every test leaves /dev/shm without segments of its own (or its children's) making."""
    before = set(os.listdir(SHM))
    yield
    left = {n for n in set(os.listdir(SHM)) - before if n.startswith(("hli-", f"t{os.getpid()}"))}
    assert not {n for n in left if _owner_is_gone(n)}, f"left in shared memory: {left}"


def _owner_is_gone(name: str) -> bool:
    """Whether a segment stays behind its owner (other sessions on this machine have living ones)."""
    for _ in range(50):
        try:
            head = layout.HLI_SEGMENT_HEAD.from_buffer_copy((SHM / name).read_bytes())
        except (OSError, ValueError):
            return False
        if Path(f"/proc/{head.owner_pid}").exists() and head.owner_pid != os.getpid():
            return False
        time.sleep(0.02)
    return True
