"""The queue of the look-ahead beside a CNC process: two tasks at once, the same in
every run, and a PLC process that is killed in the middle of its requests.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from cnc_core import Cell
from plc_client import connect
from plc_client.blocks import ContourQueue
from plc_client.mock import MockCnc, line
from support.command_line import T1
from support.paths import ROOT

Write = Callable[..., Path]
QUICK = T1.replace("F1000", "F9000")
TASKS = ROOT / "tests" / "support" / "plc" / "two_queues.py"
KILLED = """
import os, signal, sys
from plc_client import connect
from plc_client.blocks import ContourQueue

hli = connect(sys.argv[1])
blocks = [ContourQueue(hli.gpCh[0]) for _ in range(3)]
for block in blocks:
    block(0.0, 1e9, execute=True)
hli.gpAhead[0].slot_rw[3] = (hli.plc.generation << 8) | 1  # claimed, no more
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.ci
def test_two_tasks_ask_at_once_and_every_run_is_the_same(
    program: Write,
) -> None:
    """An answer in every scan for both, bit-identical in two runs."""
    told = []
    for _ in range(2):
        with Cell() as cell:
            result = cell.run(program(QUICK), plc=TASKS)
        assert result.end == "completed", result.errors
        told.append(result.plc["result"])
    assert told[0] == told[1]
    near, far = (told[0][name] for name in ("Near", "Far"))
    for seen in (near, far):
        tags = [row[0] for row in seen]
        assert tags == list(range(1, len(tags) + 1))
    assert abs(len(near) - len(far)) <= 1
    assert near != far


def test_a_plc_process_killed_in_mid_request(tmp_path: Path) -> None:
    """The CNC goes on; the next PLC has all four slots, and its own answers."""
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    with MockCnc([line(10), line(20)]) as cnc:
        done = subprocess.run(
            [sys.executable, script, cnc.name], timeout=60, check=False
        )
        assert done.returncode == -signal.SIGKILL
        with connect(cnc.name) as hli:
            assert hli.plc.pid == os.getpid()
            blocks = [ContourQueue(hli.gpCh[0]) for _ in range(4)]
            for _ in range(3):
                for fb in blocks:
                    fb(100_000.0, 1.0, execute=True)
                cnc.cycle()
            for fb in blocks:
                assert fb(100_000.0, 1.0, execute=True)
                assert fb.blocks["block_number"].tolist() == [20]
