"""The server of the monitor beside a CNC that is pinned to a processor."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

from cnc_core.observing.cores import keep_off

SLEEPS = [
    sys.executable,
    "-c",
    "import time; print(flush=True); time.sleep(60)",
]


@pytest.fixture
def allowed() -> Iterator[set[int]]:
    """The processors of this process, which has them again behind the test."""
    before = os.sched_getaffinity(0)
    if len(before) < 2:
        pytest.skip("one processor")
    yield before
    os.sched_setaffinity(0, before)


def test_it_leaves_the_processor_of_a_pinned_cnc(allowed: set[int]) -> None:
    """And takes it again when the CNC has ended, or when no other is left."""
    with subprocess.Popen(SLEEPS, stdout=subprocess.PIPE) as cnc:
        try:
            assert cnc.stdout is not None
            cnc.stdout.readline()
            assert keep_off([cnc.pid], allowed) == allowed
            one = {min(allowed)}
            os.sched_setaffinity(cnc.pid, one)
            assert keep_off([cnc.pid], allowed) == allowed - one
            assert os.sched_getaffinity(0) == allowed - one
            assert keep_off([cnc.pid], one) == one
        finally:
            cnc.kill()
    assert keep_off([cnc.pid], allowed) == allowed
