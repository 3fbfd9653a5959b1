"""The example of three federates: in one process, in three, in three network
namespaces.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from support.paths import ROOT

helics = pytest.importorskip("helics")
EXAMPLE = ROOT / "examples/federation/federation.py"


def example(form: str, folder: Path) -> str:
    """What the recorder wrote."""
    out = folder / f"{form}.csv"
    words = [sys.executable, EXAMPLE, form, "--out", out]
    done = subprocess.run(
        words, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return out.read_text()


@pytest.fixture(scope="module")
def near(tmp_path_factory: pytest.TempPathFactory) -> str:
    """In one process."""
    return example("threads", tmp_path_factory.mktemp("near"))


@pytest.mark.long
def test_three_processes_see_the_same(near: str, tmp_path: Path) -> None:
    """To the bit; the robot has slowed the cell."""
    assert example("processes", tmp_path) == near
    assert near.splitlines()[-1].endswith(",30.0")


def may_make_networks() -> bool:
    ip = shutil.which("ip")
    if ip is None or os.geteuid() != 0:
        return False
    words = [shutil.which("unshare") or "unshare", "-n", "true"]
    return (
        subprocess.run(words, check=False, capture_output=True).returncode == 0
    )


@pytest.mark.long
@pytest.mark.skipif(
    not may_make_networks(), reason="network namespaces need root and iproute2"
)
def test_three_networks_see_the_same(near: str, tmp_path: Path) -> None:
    """To the bit; no namespace and no bridge is left."""
    assert example("namespaces", tmp_path) == near
    left = subprocess.check_output(["ip", "netns"], text=True)
    assert "hli" not in left


LONELY = """
import sys
sys.path.insert(0, sys.argv[1])
import federation
federation.TIMEOUT_S = 2.0
federation.cell("zmq", sys.argv[2])
"""
BROKER = """
import sys, time, helics
broker = helics.helicsCreateBroker("zmq", "", "-f 3 --port=" + sys.argv[1])
print("stands", flush=True)
time.sleep(120)
"""


@pytest.mark.long
@pytest.mark.parametrize("killed", [False, True])
def test_nobody_comes_and_nothing_hangs(killed: bool, tmp_path: Path) -> None:
    """The others stay away, or the broker is killed: the cell ends with the
    reason, and its process, too.
    """
    port = str(24000 + os.getpid() % 1000)
    broker = subprocess.Popen(
        [sys.executable, "-c", BROKER, port], stdout=subprocess.PIPE
    )
    assert broker.stdout is not None
    assert broker.stdout.readline() == b"stands\n"
    address = f"tcp://127.0.0.1:{port}"
    cell = subprocess.Popen(
        [sys.executable, "-c", LONELY, str(EXAMPLE.parent), address],
        stderr=subprocess.PIPE,
        text=True,
    )
    if killed:
        time.sleep(1.0)
        broker.send_signal(signal.SIGKILL)
    try:
        _, said = cell.communicate(timeout=120)
    finally:
        cell.kill()
        broker.kill()
        broker.communicate()
    assert cell.returncode != 0
    assert "federation:" in said
