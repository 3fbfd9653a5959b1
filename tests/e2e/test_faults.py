"""A small sample of the fault matrix (``bench/fault_matrix.py`` runs hundreds), and two CNCs on one name."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import T1, command, wait_for_cycle

sys.path.append(str(Path(__file__).resolve().parents[2] / "bench"))
from fault_matrix import Fault, clean, one

SAMPLE = [
    Fault("cnc", "KILL", "M pending"),
    Fault("plc", "KILL", "request pending"),
    Fault("plc", "STOP", "motion"),
    Fault("launcher", "KILL", "motion"),
]


def test_faults_end_the_run_and_leave_nothing(tmp_path: Path) -> None:
    """Each fault ends the run within 5 s; behind them a clean run completes and sweeps a killed launcher's folder."""
    rng = random.Random(5)
    for fault in SAMPLE:
        one(fault, tmp_path, rng)
    clean(tmp_path)


def owner_of(name: str) -> int:
    """Process id in the segment's head, 0 while the name is free."""
    try:
        return int.from_bytes((Path("/dev/shm") / name).read_bytes()[32:40], "little")
    except FileNotFoundError:
        return 0


def test_second_cnc_of_a_name_is_refused(program: Callable[..., Path]) -> None:
    """The first goes on, the second says who has the name; when the first is killed, the name is free."""
    name = f"hli-test-{os.getpid()}"
    start = command("cnc", program(T1), "--name", name, "--clock", "freerun")
    first = subprocess.Popen(start, stderr=subprocess.DEVNULL)
    try:
        while not (Path("/dev/shm") / name).exists():
            time.sleep(0.01)
        second = subprocess.run(start, capture_output=True, text=True, timeout=60, check=False)
        assert second.returncode == 1
        assert f"in use by process {first.pid}" in second.stderr
        first.kill()
        first.wait()
        third = subprocess.Popen(start, stderr=subprocess.DEVNULL)
        try:
            for _ in range(1000):
                if owner_of(name) == third.pid:
                    break
                time.sleep(0.01)
            else:
                raise AssertionError("the name is not taken over")
        finally:
            third.send_signal(signal.SIGTERM)
            assert third.wait(20) in (0, 1, 143, -signal.SIGTERM)
    finally:
        first.kill()
        first.wait()


def test_a_killed_launchers_folder_is_swept(program: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """kill -9 of the launcher leaves its folder; the next run removes it, and folders of living launchers stay."""
    scratch = Path(tempfile.mkdtemp(dir=program("", "x").parent))
    monkeypatch.setenv("TMPDIR", str(scratch))
    part = program(T1)
    foreign = scratch / "hli-cosim-run-of-mine"
    foreign.mkdir()
    killed = subprocess.Popen(command("run", part), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_for_cycle(killed.pid, 1)
    killed.kill()
    killed.wait()
    assert len(list(scratch.iterdir())) == 2
    assert subprocess.run(command("run", part), capture_output=True, check=False, timeout=100).returncode == 0
    assert list(scratch.iterdir()) == [foreign]
