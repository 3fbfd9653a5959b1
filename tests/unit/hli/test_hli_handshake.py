"""Semaphores, exchanges, seqlock, waits, technology units; real processes where
processes matter.
"""

import ctypes
import math
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from hli._sync import ffi, lib

import hli
from hli import bench, layout
from hli.areas import Areas
from hli.handshake import BUSY, REFUSED, ContourUnit, snapshot, word_pointer
from support.fake_cnc import elements, unique_name

pytestmark = pytest.mark.sanitize("hli")

WRITER = """
import sys, hli
from hli._sync import lib
from hli.handshake import word_pointer
from hli.areas import Areas
areas = Areas(hli.attach(sys.argv[1]))
state, seq = areas.gpCh[0].bahn_state, word_pointer(areas.root, "channel_seq")
raw, n = state._c, 0
print("writing", flush=True)
while not areas.gpPform.plc_present_w:
    n += 1
    lib.hs_seq_begin(seq)
    raw.dist_prog_start = n
    raw.block_count_r = n & 0xFFFFFFFF
    raw.coord_r[31].act_position_r = n & 0x7FFFFFFF
    lib.hs_seq_end(seq)
print(n, flush=True)
"""


WAITER = """
import signal, sys, hli
signal.signal(signal.SIGINT, signal.default_int_handler)
from hli._sync import lib
from hli.handshake import word_pointer
from hli.areas import Areas
areas = Areas(hli.attach(sys.argv[1]))
print("waiting", flush=True)
try:
    lib.hs_word_wait(word_pointer(areas.root, "cnc_turn"), 1, 0, 10**18)
    while True:
        pass
except KeyboardInterrupt:
    print("interrupted")
"""

SLEEPER = """
import os, resource, sys, hli
from hli._sync import lib
from hli.handshake import word_pointer
from hli.areas import Areas
areas, core = Areas(hli.attach(sys.argv[1])), min(os.sched_getaffinity(0))
side, word = areas.sidecar.cnc_turn, word_pointer(areas.root, "cnc_turn")
os.sched_setaffinity(0, {core})
lib.hs_word_post(word, 0)
assert side.core == core + 1
if sys.argv[2] == "untold":
    side._c.core = 0  # a partner that does not tell where it is
before = resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw
assert lib.hs_word_wait(word, 1, 10**9, 2_000_000) == lib.HS_TIMEOUT
print(resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw > before)
"""


@pytest.fixture
def areas() -> Iterator[Areas]:
    """Areas over a fresh segment."""
    with hli.create(unique_name()) as segment:
        yield Areas(segment)


@pytest.fixture
def unit(areas: Areas) -> ContourUnit:
    """The look-ahead unit of channel 0."""
    return ContourUnit(areas.gpCh[0].contour_lookahead)


def test_next_takes_and_asks_in_one_step(
    areas: Areas, unit: ContourUnit
) -> None:
    """Nothing happens while the answer is missing or for a request that is not
    finite; the copy is the caller's own.
    """
    memory = areas.gpCh[0].contour_lookahead
    assert unit.request(1.0, 2.0)
    assert unit.next(3.0, 4.0) == BUSY
    assert (memory.request.start_position, memory.request.length) == (1.0, 2.0)
    rows = elements([1.0, 2.0, 3.0])
    unit.answer(rows)
    for wrong in ((math.nan, 1.0), (1.0, math.inf), (-math.inf, 1.0)):
        assert unit.next(*wrong) == REFUSED
        assert memory.semaphor_rw is False
    assert unit.next(3.0, 4.0) == 3
    assert (
        memory.request.start_position,
        memory.request.length,
        memory.semaphor_rw,
    ) == (3.0, 4.0, True)
    first = unit.taken
    assert first.tobytes() == rows.tobytes()
    unit.answer(elements([9.0]))
    assert unit.next(0.0, 1.0) == 1
    assert first.tobytes() == rows.tobytes()
    first["length"] = 7.0  # writable, and nobody else's
    assert unit.taken["length"].tolist() == [9.0]


def test_answers_taken_long_ago_stay_what_they_were(
    areas: Areas, unit: ContourUnit
) -> None:
    """Hundreds of answers, empty and full ones among them: each keeps its rows."""
    assert unit.request(0.0, 1.0)
    kept, sizes = [], [3, 0, 128, 1, 127, 128, 128, 64, 2] * 30
    for k, size in enumerate(sizes):
        unit.answer(elements([float(k)] * size))
        assert unit.next(0.0, 1.0) == size
        kept.append(unit.taken)
    for k, (size, rows) in enumerate(zip(sizes, kept, strict=True)):
        assert rows["length"].tolist() == [float(k)] * size


def test_request_is_placed_only_while_the_semaphore_is_false(
    areas: Areas, unit: ContourUnit
) -> None:
    """A pending request is not overwritten."""
    assert unit.request(1.0, 2.0)
    assert areas.gpCh[0].contour_lookahead.semaphor_rw is True
    assert not unit.request(3.0, 4.0)
    assert unit.wait_request(0.0) == (1.0, 2.0)


def test_answer_is_taken_after_the_semaphore_fell(unit: ContourUnit) -> None:
    """take() tells "pending" as -1 and copies up to the end."""
    unit.request(0.0, 1.0)
    assert unit.take() == -1
    unit.answer(elements([5.0, 6.0, 7.0]))
    assert unit.take() == 3
    assert list(unit.rows["length"][:3]) == [5.0, 6.0, 7.0]


@pytest.mark.parametrize(
    "sizes", [(128, 0), (128, 127), (3, 128), (0, 0), (5, 2, 4, 1)]
)
def test_rows_behind_an_answer_are_empty(
    areas: Areas, unit: ContourUnit, sizes: tuple[int, ...]
) -> None:
    """Every block_type behind the last valid element is 0, whatever was answered before."""
    for n in sizes:
        unit.answer(elements([1.0] * n))
        types = areas.gpCh[0].contour_lookahead.response.as_array()[
            "block_type"
        ]
        assert np.count_nonzero(types) == n == unit.take()
        assert not types[n:].any()


def test_longer_answers_are_cut_at_128(unit: ContourUnit) -> None:
    """The array is full, nothing behind it is touched."""
    unit.answer(elements([1.0] * 200))
    assert unit.take() == 128


def test_plc_that_only_sets_the_byte_is_served(
    areas: Areas, unit: ContourUnit
) -> None:
    """A waiting server finds a request nobody rang the bell for."""
    control = areas.gpCh[0].contour_lookahead
    found: list[object] = []
    server = threading.Thread(
        target=lambda: found.append(unit.wait_request(30.0))
    )
    server.start()
    control.request.start_position = 9.0
    control.semaphor_rw = True
    server.join()
    assert found == [(9.0, 0.0)]


def test_exchange_without_a_server_times_out_and_names_it(
    unit: ContourUnit,
) -> None:
    """First "no answer", then "an earlier request"; also where the time is over
    before anything is asked.
    """
    with pytest.raises(hli.HliTimeout, match="no answer"):
        unit.exchange(0.0, 1.0, timeout_s=0.0)
    with pytest.raises(hli.HliTimeout, match="earlier request"):
        unit.exchange(0.0, 1.0, timeout_s=0.0001)


def test_exchange_with_a_slow_server_sleeps_and_is_woken(
    areas: Areas, unit: ContourUnit
) -> None:
    """Beyond the spin the client sleeps on the answer word."""
    server_unit = ContourUnit(areas.gpCh[0].contour_lookahead)
    waiters = areas.sidecar.clah_answer

    def serve() -> None:
        server_unit.wait_request(30.0)
        while waiters.waiters == 0:
            time.sleep(0.0005)
        server_unit.answer(elements([4.0]))

    server = threading.Thread(target=serve)
    server.start()
    assert list(unit.exchange(0.0, 1.0, timeout_s=30.0)["length"]) == [4.0]
    server.join()
    assert waiters.waiters == 0


def test_two_processes_exchange_without_a_torn_read() -> None:
    """Every answer fits its request, element by element, over thousands of exchanges."""
    exchanges = 0
    while exchanges < 2000:
        measured = bench.measure_python_both(n_blocks=128, seconds=0.2)
        assert measured.torn == 0
        assert measured.payload_bytes == 128 * 72
        exchanges += len(measured.ns)


def test_raw_reference_has_no_torn_read() -> None:
    """The C reference verifies its answers, too, over thousands of exchanges."""
    exchanges = 0
    while exchanges < 2000:
        measured = bench.measure_raw(n_blocks=50, seconds=0.05)
        assert measured.torn == 0
        exchanges += len(measured.ns)


@pytest.mark.parametrize("n", [0, 129])
def test_benchmark_refuses_wrong_payloads(n: int) -> None:
    """1 to 128 elements."""
    for measure in (bench.measure_raw, bench.measure_python_both):
        with pytest.raises(ValueError, match="n_blocks"):
            measure(n, 0.1)


def test_snapshots_under_a_stressed_writer_are_consistent(areas: Areas) -> None:
    """Another process writes as fast as it can; members far apart always belong together."""
    command = [sys.executable, "-P", "-c", WRITER, areas.segment.name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "writing\n"
        seen = set()
        try:
            for _ in range(3000):
                copy = snapshot(areas.gpCh[0].bahn_state, timeout_s=60.0)
                n = int(copy.dist_prog_start)
                assert (
                    copy.block_count_r,
                    copy.coord_r[31].act_position_r,
                ) == (n & 0xFFFFFFFF, n & 0x7FFFFFFF)
                seen.add(n)
        finally:
            areas.gpPform.plc_present_w = True
        assert int(writer.stdout.readline()) >= max(seen)
    assert len(seen) > 1


def test_snapshot_of_a_writer_that_died_in_the_middle_times_out(
    areas: Areas,
) -> None:
    """An odd generation never ends; the reader does not hang."""
    lib.hs_seq_begin(word_pointer(areas.root, "channel_seq"))
    with pytest.raises(hli.HliTimeout):
        snapshot(areas.gpCh[0].bahn_state, timeout_s=0.01)


def test_snapshot_refuses_what_has_no_seqlock(areas: Areas) -> None:
    """Only the two structures written under it."""
    snapshot(areas.gpCh[0].contour_lookahead.state)
    with pytest.raises(ValueError, match="seqlock"):
        snapshot(areas.gpCh[0].head)


@pytest.mark.parametrize(
    ("word", "target", "reached"),
    [(5, 5, True), (6, 5, True), (4, 5, False), (2, 2**32 - 2, True)],
)
def test_word_wait_compares_signed_distance(
    areas: Areas, word: int, target: int, reached: bool
) -> None:
    """The counter may wrap at 32 bits."""
    side = word_pointer(areas.root, "cnc_turn")
    lib.hs_word_post(side, word)
    assert (lib.hs_word_wait(side, target, 0, 1000) == lib.HS_OK) is reached


def test_sleeping_waiter_is_woken_by_post(areas: Areas) -> None:
    """hs_word_post wakes who sleeps beyond the spin."""
    side, results = word_pointer(areas.root, "plc_turn"), []
    waiter = threading.Thread(
        target=lambda: results.append(
            lib.hs_word_wait(side, 1, 0, 60_000_000_000)
        )
    )
    waiter.start()
    while areas.sidecar.plc_turn.waiters == 0:
        time.sleep(0.0005)
    lib.hs_word_post(side, 1)
    waiter.join()
    assert results == [lib.HS_OK]
    assert areas.sidecar.plc_turn.waiters == 0


@pytest.mark.parametrize(
    ("partner", "sleeps"), [("here", True), ("untold", False)]
)
def test_a_waiter_sleeps_at_once_on_the_core_of_its_partner(
    areas: Areas, partner: str, sleeps: bool
) -> None:
    """Spinning would keep the partner from ever coming; elsewhere it may come.  In a
    process of its own: here it could also wait for the interpreter.
    """
    command = [sys.executable, "-P", "-c", SLEEPER, areas.segment.name, partner]
    ran = subprocess.run(command, check=True, capture_output=True, text=True)
    assert ran.stdout == f"{sleeps}\n"


def test_waits_end_early_when_a_signal_arrives() -> None:
    """Ctrl-C works: a process in a long C wait handles the signal at once."""
    name = unique_name()
    with hli.create(name) as segment:
        areas = Areas(segment)
        command = [sys.executable, "-P", "-c", WAITER, name]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None
            process.stdout.readline()
            while areas.sidecar.cnc_turn.waiters == 0:
                time.sleep(0.0005)
            process.send_signal(signal.SIGINT)
            while not select.select([process.stdout], [], [], 0.5)[0]:
                process.send_signal(
                    signal.SIGINT
                )  # the first came between its last look and its sleep
            assert process.stdout.readline() == "interrupted\n"


def test_sleep_until_a_past_deadline_returns_at_once() -> None:
    """Absolute deadlines: nothing to wait for."""
    assert lib.hs_sleep_until(0) == lib.HS_OK
    deadline = lib.hs_monotonic_ns() + 1_000_000
    assert lib.hs_sleep_until(deadline) == lib.HS_OK
    assert lib.hs_monotonic_ns() >= deadline


def test_child_dies_with_its_parent() -> None:
    """hs_die_with_parent: the grandchild gets the signal when its parent is
    killed; a gone parent is told as -1.
    """
    grandchild = (
        "import os,sys,time; from hli._sync import lib; "
        "lib.hs_die_with_parent(9, int(sys.argv[1])); "
        "print(os.getpid(), flush=True); time.sleep(60)"
    )
    child = (
        "import os,subprocess,sys,time\n"
        f"subprocess.Popen([sys.executable, '-P', '-c', {grandchild!r}, "
        f"str(os.getpid())])\ntime.sleep(60)"
    )
    with subprocess.Popen(
        [sys.executable, "-P", "-c", child], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        pid = int(process.stdout.readline())
        start = lib.hs_process_start(pid)
        assert start
        process.kill()
        while lib.hs_process_alive(pid, start):
            time.sleep(0.001)
    assert lib.hs_die_with_parent(0, 1 if os.getppid() != 1 else 2) == -1


def test_technology_units_are_found_fetched_and_acknowledged(
    areas: Areas,
) -> None:
    """Gaps are skipped; fetched first, acknowledged second."""
    units = areas.gpCh[0].techno_unit_late_sync
    units[7].fkt_ctrl_r = 2
    units[7].please_rw = True
    assert lib.hs_techno_next(units[0]._pointer(), len(units), 0) == 7
    assert lib.hs_techno_next(units[0]._pointer(), len(units), 8) == -1
    copy = layout.TECHNO_UNIT_CH()
    lib.hs_techno_fetch(
        units[7]._pointer(), ffi.cast("void *", ctypes.addressof(copy))
    )
    assert (copy.fkt_ctrl_r, units[7].please_rw, units[7].done_w) == (
        2,
        False,
        False,
    )
    lib.hs_techno_done(units[7]._pointer())
    assert units[7].done_w is True
