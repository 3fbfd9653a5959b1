"""Handshake latency beside a raw reference: the same payload, in the same run,
on the same two cores.

Every exchange asks for ``n_blocks`` elements out of a table whose row i is
known by its index alone, so each answer is derived from its request and
verified on every exchange (outside the measured time).  Times are ns from
before the request is written until the answer is copied, as the client sees
them.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._sync import ffi, lib
from .areas import Areas
from .errors import HliError
from .handshake import BLOCK_ROWS, ContourUnit
from .segment import Segment, attach, create
from .view import BLOCK_DTYPE

TABLE_ROWS = 4096
MAX_EXCHANGES = 2_000_000
STOP_LENGTH = -1.0  # request.length that ends the server
_STRIDE = 7  # successive requests start at different rows


Samples = np.ndarray[Any, np.dtype[np.int64]]


@dataclass
class Measurement:
    """Durations in ns, wrong answers, whether the two sides had a core each,
    answer bytes of one exchange.
    """

    ns: Samples
    torn: int
    pinned: bool
    payload_bytes: int


def table() -> np.ndarray[Any, Any]:
    """The elements both sides know."""
    rows = np.zeros(TABLE_ROWS, BLOCK_DTYPE)
    lib.hb_fill(ffi.cast("void *", rows.ctypes.data), TABLE_ROWS)
    return rows


def cores() -> tuple[int, int]:
    """(client, server) core numbers, different ones if this process may use
    two; (-1, -1) otherwise.
    """
    allowed = sorted(os.sched_getaffinity(0))
    if len(allowed) < 2:
        return -1, -1
    return allowed[0], allowed[1]


def _check_payload(n_blocks: int) -> None:
    if not 1 <= n_blocks <= BLOCK_ROWS:
        raise ValueError(f"n_blocks {n_blocks}: 1..{BLOCK_ROWS}")


def measure_raw(n_blocks: int = 64, seconds: float = 1.0) -> Measurement:
    """Two C threads that spin: request, ``n_blocks`` elements, semaphore, copy."""
    _check_payload(n_blocks)
    rows = table()
    samples = np.zeros(MAX_EXCHANGES, np.int64)
    torn, pinned = ffi.new("int64_t *"), ffi.new("int *")
    n = lib.hb_raw(
        ffi.cast("void *", rows.ctypes.data),
        TABLE_ROWS,
        n_blocks,
        MAX_EXCHANGES,
        int(seconds * 1e9),
        *cores(),
        ffi.cast("int64_t *", samples.ctypes.data),
        torn,
        pinned,
    )
    if n < 0:
        raise HliError(
            "the second thread of the raw benchmark could not be started"
        )
    return Measurement(
        samples[:n].copy(),
        torn[0],
        bool(pinned[0]),
        n_blocks * BLOCK_DTYPE.itemsize,
    )


def measure_python_both(
    n_blocks: int = 64, seconds: float = 1.0
) -> Measurement:
    """Two Python processes over a segment of their own; the server answers with
    rows of its table.
    """
    _check_payload(n_blocks)
    name = f"hli-bench-{os.getpid()}-{time.monotonic_ns()}"
    before = os.sched_getaffinity(0)
    client_core, server_core = cores()
    with create(name) as segment:
        server = _start_server(name, n_blocks, server_core)
        try:
            pinned = pin(client_core) and server_core != client_core
            return _measure(segment, server, n_blocks, seconds, pinned)
        finally:
            os.sched_setaffinity(0, before)
            server.terminate()
            server.wait()


def pin(core: int) -> bool:
    """Bind this process to one core; False if that is not possible."""
    try:
        os.sched_setaffinity(
            0, {core} if core >= 0 else os.sched_getaffinity(0)
        )
    except OSError:
        return False
    return core >= 0


def _start_server(
    name: str, n_blocks: int, core: int
) -> subprocess.Popen[bytes]:
    command = [
        sys.executable,
        "-P",
        "-m",
        "hli.bench",
        name,
        str(n_blocks),
        str(core),
        str(os.getpid()),
    ]
    root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    path = os.pathsep.join(
        p for p in (root, os.environ.get("PYTHONPATH", "")) if p
    )
    # Ctrl-C is for the benchmark, which ends this process
    return subprocess.Popen(
        command,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,
    )


def _measure(
    segment: Segment,
    server: subprocess.Popen[bytes],
    n_blocks: int,
    seconds: float,
    pinned: bool,
) -> Measurement:
    unit = ContourUnit(Areas(segment).gpCh[0].contour_lookahead)
    _wait_for_server(unit, server)
    ns, torn = exchange_many(unit, n_blocks, seconds)
    unit.request(0.0, STOP_LENGTH)
    return Measurement(ns, torn, pinned, n_blocks * BLOCK_DTYPE.itemsize)


def _wait_for_server(
    unit: ContourUnit, server: subprocess.Popen[bytes]
) -> None:
    unit.request(0.0, 1.0)
    while unit.take() < 0:
        if server.poll() is not None:
            raise HliError(
                f"the server of the benchmark ended with status {server.returncode}"
            )
        time.sleep(0.001)


def exchange_many(
    unit: ContourUnit, n_blocks: int, seconds: float
) -> tuple[Samples, int]:
    """(durations in ns, wrong answers) of exchanges with any server that
    answers out of ``table()``.
    """
    wrong, rows, span = lib.hb_wrong, unit._rows, TABLE_ROWS - n_blocks

    def check(n: int, first: int) -> bool:
        return n == n_blocks and wrong(rows, n, first) == 0

    return exchange_loop(
        unit,
        [k * _STRIDE % span for k in range(span)],
        n_blocks,
        check,
        seconds,
    )


def exchange_loop(
    unit: ContourUnit,
    starts: Sequence[float],
    length: float,
    check: Callable[[int, Any], bool],
    seconds: float,
) -> tuple[Samples, int]:
    """(durations in ns, wrong answers) of exchanges with any server.

    Requests go round ``starts`` with one ``length``; after each exchange
    ``check(n, start)`` judges the n elements in ``unit.rows``.  The time is
    taken in Python around the one C call of the exchange, so the call itself is
    part of it.
    """
    call, now, count = lib.hs_clah_call, time.perf_counter_ns, len(starts)
    control, bell, answer, rows = (
        unit._unit,
        unit._bell,
        unit._answer,
        unit._rows,
    )
    end = now() + int(seconds * 1e9)
    samples = np.zeros(MAX_EXCHANGES, np.int64)
    torn = k = 0
    while k < MAX_EXCHANGES:
        start = starts[k % count]
        begin = now()
        n = call(control, bell, answer, start, length, rows, 1_000_000_000)
        done = now()
        samples[k] = done - begin
        torn += not check(n, start)
        k += 1
        if done > end:
            break
    return samples[:k].copy(), torn


def serve(name: str, n_blocks: int, core: int) -> None:
    """The server process: one C call per exchange answers the last request and
    waits for the next one.
    """
    pin(core)
    segment = attach(name)
    unit = ContourUnit(Areas(segment).gpCh[0].contour_lookahead)
    rows = table()
    base, size = rows.ctypes.data, BLOCK_DTYPE.itemsize
    pointers = [
        ffi.cast("void *", base + i * size)
        for i in range(TABLE_ROWS - n_blocks)
    ]
    control, bell, answer, request = (
        unit._unit,
        unit._bell,
        unit._answer,
        unit._request,
    )
    while (
        lib.hs_clah_wait_request(control, bell, request, 100_000_000)
        != lib.HS_OK
    ):
        if not segment.owner_alive():
            return
    step = lib.hs_clah_serve
    while request[1] != STOP_LENGTH:
        if (
            step(
                control,
                bell,
                answer,
                pointers[int(request[0])],
                n_blocks,
                request,
                1_000_000_000,
            )
            != lib.HS_OK
        ):
            return
    unit.answer(rows[:0])


if __name__ == "__main__":
    if lib.hs_die_with_parent(15, int(sys.argv[4])) == 0:
        segment, *numbers = sys.argv[1:4]
        serve(segment, *map(int, numbers))
