"""A segment that is cut while CNC and PLC use it: the CNC ends and says why."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import hli
from hli.segment import SHM_DIR
from support.fake_cnc import unique_name

PROGRAM = "G1 F600\n" + "X100\nX0\n" * 200 + "M30\n"


def is_there(name: str) -> bool:
    """The CNC has published its segment."""
    try:
        hli.attach(name).close()
    except hli.HliError:
        return False
    return True


@pytest.mark.parametrize("clock", ["realtime", "freerun"])
@pytest.mark.parametrize("size", [0, 8192])
@pytest.mark.ci
def test_a_cut_segment_ends_the_cnc_with_a_word(
    tmp_path: Path, clock: str, size: int
) -> None:
    """No SIGBUS: exit 1, the reason, nothing left in /dev/shm."""
    program, name = tmp_path / "part.nc", unique_name()
    program.write_text(PROGRAM)
    command = [sys.executable, "-P", "-m", "cnc_core.cli", "cnc", str(program)]
    command += ["--name", name, "--clock", clock, "--no-wait"]
    cnc = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        while not is_there(name):
            time.sleep(0.01)
        os.truncate(SHM_DIR / name, size)
        _, errors = cnc.communicate(timeout=60)
    finally:
        cnc.kill()
    assert cnc.returncode == 1, errors
    assert "cut" in str(errors)
    assert not (SHM_DIR / name).exists()


def test_memory_that_was_cut_reads_as_zeros() -> None:
    """Whoever looks at it goes on; ``lost`` tells; other memory is untouched."""
    name = unique_name()
    with hli.create(name) as first, hli.create(unique_name()) as other:
        other.root.platform.channel_count_r = 7
        assert not first.lost
        os.truncate(SHM_DIR / name, 0)
        assert first.root.platform.channel_count_r == 0
        assert first.lost
        assert (other.lost, other.root.platform.channel_count_r) == (False, 7)


def test_a_head_that_was_written_over_is_lost() -> None:
    with hli.create(unique_name()) as made:
        made.root.segment_head.magic = 1
        assert made.lost
