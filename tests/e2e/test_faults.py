"""A small sample of the fault matrix (``bench/fault_matrix.py`` runs hundreds),
and two CNCs on one name.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import hli
from fault_apart import one_apart
from fault_run import FUNCTIONS, Fault, Setting, clean, is_walk, one
from support.command_line import T1, command, wait_for_cycle

pytestmark = pytest.mark.ci

BUSY_S = 120.0
"""A machine that tests crowd may take so long; the bench asks for 5 s."""
TRIES = 12
"""Runs until one is hit: a function may wait for a single cycle of lockstep, and
nobody looks while others have the processors."""
SAMPLE = [
    Fault("cnc", "KILL", "M pending", "lockstep"),
    Fault("plc", "KILL", "request pending", "lockstep"),
    Fault("plc", "STOP", "motion", "lockstep"),
    Fault("launcher", "KILL", "motion", "lockstep"),
    Fault("launcher", "KILL", "recording", "lockstep"),
    Fault("terminal", "HUP", "recording", "lockstep"),
    Fault("machine", "STOP", "motion", "freerun"),
]


def test_faults_end_the_run_and_leave_nothing(tmp_path: Path) -> None:
    """Each fault ends the run; its recording can be read; behind them a clean run
    completes and sweeps a killed launcher's folder.
    """
    rng = random.Random(5)
    for fault in SAMPLE:
        recorded = fault.when == "recording"
        setting = Setting(recorded=recorded)
        assert any(
            one(fault, tmp_path, rng, BUSY_S, setting)[0] for _ in range(TRIES)
        ), fault
    clean(tmp_path, BUSY_S)


@pytest.mark.parametrize("clock", ["lockstep", "realtime"])
def test_plcs_that_die_lose_and_double_no_function(
    tmp_path: Path, clock: str
) -> None:
    """kill -9 of the PLC at a function, three times, with another PLC behind each:
    what the CNC calls seen has been with one of them, for the first time once.
    """
    fault = Fault("plc", "AGAIN", "M pending", clock)
    rng = random.Random(7)
    assert any(one_apart(fault, tmp_path, rng, BUSY_S)[0] for _ in range(TRIES))


def test_faults_mix_nothing_up_between_channels(tmp_path: Path) -> None:
    """A PLC that is restarted or stopped sees each channel's functions once, in
    order and in that channel, as often as the CNC has put them out.
    """
    rng = random.Random(5)
    for what, when in (("RESTART", "M pending"), ("STOP", "request pending")):
        fault = Fault("plc", what, when, "lockstep")
        one(fault, tmp_path, rng, BUSY_S, Setting(3))
    clean(tmp_path, BUSY_S, channels=3)


def owner_of(name: str) -> int:
    """Process id in the segment's head, 0 while the name is free."""
    try:
        return int.from_bytes(
            (Path("/dev/shm") / name).read_bytes()[32:40], "little"
        )
    except FileNotFoundError:
        return 0


def test_second_cnc_of_a_name_is_refused(program: Callable[..., Path]) -> None:
    """The first goes on, the second says who has the name; when the first is
    killed, the name is free.
    """
    name = f"hli-test-{os.getpid()}"
    start = command("cnc", program(T1), "--name", name, "--clock", "freerun")
    first = subprocess.Popen(start, stderr=subprocess.DEVNULL)
    try:
        while not (Path("/dev/shm") / name).exists():
            time.sleep(0.01)
        second = subprocess.run(
            start, capture_output=True, text=True, timeout=60, check=False
        )
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


def test_a_killed_launchers_folder_is_swept(
    program: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """kill -9 of the launcher leaves its folder; the next run removes it, and
    folders of living launchers stay.
    """
    scratch = Path(tempfile.mkdtemp(dir=program("", "x").parent))
    monkeypatch.setenv("TMPDIR", str(scratch))
    part = program(T1)
    foreign = scratch / "hli-cosim-run-of-mine"
    foreign.mkdir()
    killed = subprocess.Popen(
        command("run", part),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    wait_for_cycle(killed.pid, 1)
    killed.kill()
    killed.wait()
    assert len(list(scratch.iterdir())) == 2
    assert (
        subprocess.run(
            command("run", part), capture_output=True, check=False, timeout=100
        ).returncode
        == 0
    )
    assert list(scratch.iterdir()) == [foreign]


STEPPED = """
import os, sys, time
from cnc_core import start_plc
from plc_client import task
@task()
class T:
    def cyclic(self): pass
plc = start_plc(sys.argv[1], T)
plc.step(5)
print("there", flush=True)
time.sleep(600)
"""


@pytest.mark.parametrize("kind", ["cnc --record", "start_plc"])
def test_a_killed_process_leaves_its_folder_to_the_next_run(
    program: Callable[..., Path], tmp_path: Path, kind: str
) -> None:
    """Not the launcher alone: each process that makes a folder names it so that the
    next run knows when nobody needs it.
    """
    scratch, part = tmp_path / "scratch", program(T1)
    scratch.mkdir()
    name = f"hli-test-{os.getpid()}"
    options = ("--name", name, "--no-wait", "--record", tmp_path / "r.npz")
    call = {
        "cnc --record": command("cnc", part, *options),
        "start_plc": [sys.executable, "-P", "-c", STEPPED, str(part)],
    }[kind]
    environment = os.environ | {"TMPDIR": str(scratch)}
    killed = subprocess.Popen(
        call,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert killed.stdout is not None
    # not any file: Python tries a new temporary folder out with one of its own
    while not list(scratch.glob("hli-cosim-*")):
        assert killed.poll() is None
        time.sleep(0.01)
    killed.kill()
    killed.wait()
    killed.stdout.close()
    assert list(scratch.iterdir())
    subprocess.run(
        command("run", part), env=environment, capture_output=True, check=True
    )
    assert not list(scratch.iterdir())
    hli.sweep()


FULL = """mount -t tmpfs -o size=64k none /dev/shm || exit 77
"$@"
status=$?
ls -A /dev/shm
exit $status
"""


@pytest.mark.parametrize("verb", ["run", "cnc"])
def test_a_full_shared_memory_is_refused(
    program: Callable[..., Path], verb: str
) -> None:
    """A /dev/shm of 64 KiB: exit 1 with the reason and the bytes needed, and
    nothing is left in it.
    """
    call = command(
        verb, program(T1), *(["--name", "hli-full"] if verb == "cnc" else [])
    )
    done = in_namespace(FULL, call)
    assert done.returncode == 1, (done.stdout, done.stderr)
    assert (
        "cannot be created in /dev/shm: No space left on device" in done.stderr
    )
    assert "Traceback" not in done.stderr
    assert not [line for line in done.stdout.splitlines() if "hli-" in line]


@pytest.mark.parametrize("verb", ["run", "cnc"])
def test_a_limit_of_file_size_is_refused(
    program: Callable[..., Path], verb: str
) -> None:
    """The same where mounting is not permitted: RLIMIT_FSIZE below the segment's size."""
    name = f"hli-test-{os.getpid()}"
    call = command(
        verb, program(T1), *(["--name", name] if verb == "cnc" else [])
    )
    limited = ["sh", "-c", 'ulimit -f 100; exec "$@"', "sh", *call]
    done = subprocess.run(
        limited, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 1, (done.stdout, done.stderr)
    assert "cannot be created in /dev/shm: File too large" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (Path("/dev/shm") / name).exists()


def in_namespace(
    script: str, call: list[str]
) -> subprocess.CompletedProcess[str]:
    """Run a script with a file system table of its own; skips where users may not have one."""
    if shutil.which("unshare") is None:
        pytest.skip("no unshare")
    start = ["unshare", "-Urm", "sh", "-c", script, "sh", *call]
    done = subprocess.run(
        start, capture_output=True, text=True, timeout=60, check=False
    )
    if done.returncode == 77 or done.stderr.startswith("unshare:"):
        pytest.skip("users may not mount here")
    return done


ONCE = list(range(1, FUNCTIONS + 1))


@pytest.mark.parametrize(
    ("seen", "walks"),
    [
        (ONCE, True),
        ([1, 2, 2, 1, 1, *ONCE[1:]], True),  # back over both, and forward
        ([1, 2, *ONCE[1:]], True),  # turned while 2 was waited for
        (ONCE[:-1], False),
        ([1, *ONCE[2:]], False),
        ([1, 2, 3, 1, *ONCE[1:]], False),
        ([1, 2, 3, 3, 2, *ONCE[3:]], False),  # forward without 2 and 3
    ],
)
def test_a_path_that_turns_passes_neighbours(
    seen: list[int], walks: bool
) -> None:
    """What counts as nothing lost in a run that goes back and forth."""
    assert is_walk(seen, 0) is walks
