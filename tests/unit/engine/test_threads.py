"""Planner, GEO and immediate service as threads while the PLC commands all that touches them.

`.ci/run` runs it under the thread sanitizer.
"""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from cnc_core.engine import Event
from hli import layout
from hli.areas import Areas
from hli.queue import BUSY, Ask, Queue, Told
from support.inside import Inside
from support.limits import legal
from support.threaded import (
    CONFIG,
    FORESIGHT,
    FUNCTIONS,
    PROGRAM,
    TURNS,
    drive,
    far_enough,
)

pytestmark = pytest.mark.sanitize_threads

SECONDS = 2.5


@pytest.mark.ci
@pytest.mark.parametrize(
    "functions", [FUNCTIONS, FORESIGHT], ids=["recall", "foresight"]
)
def test_commands_beside_running_threads(
    tmp_path: Path, functions: str
) -> None:
    """Backward motion, inserted stops, overrides, deleted distance and requests
    while the threads run: all is legal.
    """
    rng = np.random.default_rng(3)
    with Inside(
        tmp_path,
        PROGRAM,
        CONFIG % functions,
        service=layout.HLI_SERVICE_IMMEDIATE,
    ) as cnc:
        drive(cnc, rng, SECONDS)
        state = cnc.engine.state
        assert far_enough(cnc, TURNS + 1)
        assert state.requests_mode1 + state.requests_mode2 > 10
        assert not state.fault
        assert state.techno_functions > 0
        assert cnc.preparation.error is None
        if not state.record_lost:
            legal(cnc.pos, cnc.cell)


def test_starting_and_stopping_threads(tmp_path: Path) -> None:
    """Threads stop and start again in the middle of the motion, which then goes
    on without a jump.
    """
    with Inside(
        tmp_path,
        PROGRAM,
        CONFIG % FORESIGHT,
        service=layout.HLI_SERVICE_IMMEDIATE,
    ) as cnc:
        for _ in range(20):
            cnc.engine.serve_start()
            cnc.engine.start()
            if cnc.engine.wait(0.005) is Event.NEED_BLOCKS:
                cnc.preparation.pump()
            cnc.engine.stop()
            cnc.engine.serve_stop()
            cnc._take()
        stopped = float(cnc.engine.state.path)
        cnc.run(200)
        waits = cnc.state.wait_techno_acknowledge_r  # for M20
        assert waits or cnc.engine.state.path > stopped
        assert not cnc.engine.state.record_lost
        legal(cnc.pos, cnc.cell)


def test_the_planner_is_away_for_nobody_without_a_deadline(
    tmp_path: Path,
) -> None:
    """Where GEO may have SCHED_FIFO the planner has it too, below GEO: ordinary
    processes that want the core do not make the path stand.
    """
    with Inside(tmp_path, PROGRAM) as cnc:
        before = set(os.listdir("/proc/self/task"))
        fifo = cnc.engine.start()
        threads = set(os.listdir("/proc/self/task")) - before
        found = sorted(
            (os.sched_getscheduler(int(k)), os.sched_getparam(int(k)))
            for k in threads
        )
        cnc.engine.stop()
        assert len(found) == 2
        if not fifo:
            return
        (low, planner), (high, geo) = found
        assert low == high == os.SCHED_FIFO
        assert 0 < planner.sched_priority < geo.sched_priority


def _asks(areas: Areas, first: int, wrong: list[str]) -> None:
    """One task of the PLC: 200 requests, each with a tag of its own."""
    queue = Queue(areas.gpAhead[0])
    late = time.monotonic() + 60.0
    for tag in range(first, first + 200):
        wanted = Ask(10_000.0 * (tag % 50), 50_000.0, tag=tag)
        while (slot := queue.ask(wanted)) < 0 and time.monotonic() < late:
            time.sleep(0)
        while (told := queue.take(slot)) == BUSY and time.monotonic() < late:
            time.sleep(0)
        if not isinstance(told, Told):
            wrong.append(f"{tag}: no answer")
            return
        begin = float(told.blocks["start_position"][0])
        mine = told.facts.start_position == wanted.start_position
        if told.facts.tag != tag or not mine or begin > wanted.start_position:
            wrong.append(f"{tag}: {told.facts.tag} from {begin}")


def test_tasks_share_the_queue(tmp_path: Path) -> None:
    """Six tasks on threads of their own ask through four slots while the
    service's thread answers: everybody gets what he has asked for.
    """
    text = "".join(f"N{k} G01 X{k + 1} F1000\n" for k in range(60))
    with Inside(
        tmp_path,
        text,
        CONFIG % FUNCTIONS,
        service=layout.HLI_SERVICE_IMMEDIATE,
    ) as cnc:
        cnc.engine.serve_start()
        wrong: list[str] = []
        tasks = [
            threading.Thread(
                target=_asks, args=(Areas(cnc.segment), 1000 * k, wrong)
            )
            for k in range(1, 7)
        ]
        for task in tasks:
            task.start()
        for task in tasks:
            task.join()
        cnc.engine.serve_stop()
        assert wrong == []
