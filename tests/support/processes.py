"""Real processes for tests: the PLC runtime and the fake CNC; what a failed
test leaves running is ended.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import hli

_started: list[subprocess.Popen[str]] = []


@pytest.fixture
def leftovers() -> Iterator[None]:
    """End the processes that a test started and did not end, and remove their segments."""
    yield
    for process in _started:
        if process.poll() is None:
            end(process)
    _started.clear()
    hli.sweep()


def _started_process(
    command: list[str], **options: Any
) -> subprocess.Popen[str]:
    process = subprocess.Popen(command, text=True, **options)
    _started.append(process)
    return process


def wait_for_scans(
    connection: Any, count: int, plc: subprocess.Popen[str]
) -> None:
    """Until the PLC process has done so many; AssertionError when it ends."""
    while connection.plc.scans < count:
        assert plc.poll() is None, plc.communicate()[1]


def start_plc(name: str, *arguments: str) -> subprocess.Popen[str]:
    """The PLC process."""
    command = [
        sys.executable,
        "-P",
        "-m",
        "plc_client",
        "--name",
        name,
        *arguments,
    ]
    return _started_process(command, stderr=subprocess.PIPE)


def run_plc(name: str, *arguments: str) -> tuple[int, str]:
    """(exit status, stderr) of a PLC process that ends by itself."""
    process = start_plc(name, *arguments)
    _, text = process.communicate(timeout=60)
    return process.returncode, text


def start_cnc(name: str, **arguments: Any) -> subprocess.Popen[str]:
    """The fake CNC as a process, ready."""
    command = [
        sys.executable,
        "-P",
        str(Path(__file__).with_name("fake_cnc.py")),
        name,
        json.dumps(arguments),
    ]
    process = _started_process(command, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def end(process: subprocess.Popen[str]) -> None:
    """Kill and reap."""
    process.kill()
    process.communicate()
