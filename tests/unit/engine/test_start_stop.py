"""A thousand lives of an engine on a segment leave nothing behind."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from cnc_core.config import parse_config
from cnc_core.engine import Engine
from hli import layout, segment
from support.fake_cnc import unique_name


def resident_kb() -> int:
    """Memory of this process now."""
    line = next(
        x
        for x in Path("/proc/self/status").read_text().splitlines()
        if x.startswith("VmRSS")
    )
    return int(line.split()[1])


def lives() -> None:
    """Asserts that memory, descriptors, threads and segments are as before; every
    fiftieth life has its threads.
    """
    cell, name = parse_config(""), unique_name()

    def life(k: int) -> None:
        with segment.create(name, 1, 3) as memory:
            engine = Engine(
                cell, segment=memory, clock=layout.HLI_CLOCK_FREERUN
            )
            if k % 50 == 0:
                engine.serve_start()
                engine.start()
            else:
                engine.run(3)
            engine.close()

    def held() -> tuple[int, int, bool]:
        threads = len(os.listdir("/proc/self/task"))
        return (
            len(os.listdir("/proc/self/fd")),
            threads,
            (Path("/dev/shm") / name).exists(),
        )

    for k in range(100):
        life(k)
    alone = threading.active_count()
    before, kb = held(), resident_kb()
    for k in range(1000):
        life(k)
    assert held() == before, (held(), before)
    assert threading.active_count() == alone
    if (
        "libasan" not in Path("/proc/self/maps").read_text()
    ):  # it keeps what is freed for a while
        assert resident_kb() < kb + 4_000, (resident_kb(), kb)


@pytest.mark.ci
def test_a_thousand_starts_and_stops_leave_nothing() -> None:
    """Memory, descriptors, threads and segments are as before, in a process that
    has done nothing else: what other tests have freed does not count.
    """
    with ProcessPoolExecutor(1, get_context("spawn")) as process:
        process.submit(lives).result()
