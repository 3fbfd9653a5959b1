"""Shared fixtures: the command line as a user runs it, programs on disk,
nothing left in shared memory.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hli import layout
from support.command_line import SHM, Outcome, command
from support.osai_programs import shop
from support.processes import leftovers

__all__ = ["leftovers", "shop"]


@pytest.fixture
def cli(tmp_path: Path) -> Callable[..., Outcome]:
    """Run ``hli-cosim`` in a folder of its own; ``cli("plan", path, "--json")``."""

    def call(*arguments: object, timeout: float = 300.0) -> Outcome:
        done = subprocess.run(
            command(*arguments),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
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
    left = {
        n
        for n in set(os.listdir(SHM)) - before
        if n.startswith(("hli-", f"t{os.getpid()}"))
    }
    assert not {n for n in left if _owner_is_gone(n)}, (
        f"left in shared memory: {left}"
    )


def _owner_is_gone(name: str) -> bool:
    """Whether a segment stays behind its owner (other sessions on this machine
    have living ones).
    """
    for _ in range(50):
        try:
            head = layout.HLI_SEGMENT_HEAD.from_buffer_copy(
                (SHM / name).read_bytes()
            )
        except (OSError, ValueError):
            return False
        if (
            Path(f"/proc/{head.owner_pid}").exists()
            and head.owner_pid != os.getpid()
        ):
            return False
        time.sleep(0.02)
    return True
