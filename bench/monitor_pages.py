"""What pages of the monitor cost: the GEO cycle with and without them, the
server's CPU time.

    python bench/monitor_pages.py [--pages 10] [--rounds 12] [--seconds 3]

The cell is pinned to one processor, as a cell in real time should be.  A round
is a cell without pages, one with them and one without.  Its ratio is that of the
second over the mean of the others.  ``p99_ratio_of_two_without`` compares the
two without pages: it tells how much the machine scatters by itself.

A page is a WebSocket that reads each frame and watches ten symbols.  The pages
stand for browsers on other computers, so they run at the lowest priority beside
the server.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import secrets
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from websockets.sync.client import connect

from cnc_core.benchmarks.workloads import contour_points, write_program
from cnc_core.config import CellConfig
from cnc_core.engine import Engine, Event
from cnc_core.planning import Feeder
from cnc_core.program import Program
from hli.segment import create

WATCHED = [f"gpCh[0].bahn_state.coord_r[{i}].act_position_r" for i in range(3)]
WATCHED += [
    f"gpCh[0].bahn_state.{name}"
    for name in (
        "dist_prog_start",
        "active_feed_r",
        "override_r",
        "block_count_r",
        "command_feed_r",
        "stop_condition_r",
        "dist_to_go_r",
    )
]


CELL = min(os.sched_getaffinity(0))  # the processor of the cell
PROGRAM = "contour.nc"


class Round(NamedTuple):
    """A cell's cycle: quantiles, us, and the server's share of a processor."""

    p50: float
    p99: float
    share: float


def cycles(name: str, path: Path, rows: int) -> np.ndarray[Any, Any]:
    """ns that each real-time cycle took, of a cell of this name."""
    program = Program(path, CellConfig(), "isg")
    with (
        create(name, 1, len(program.cell.axes)) as segment,
        closing(Engine(program.cell, segment=segment, clock=2)) as engine,
    ):
        feeder = Feeder(program, engine, lambda _batch: None)
        feeder.fill()
        took = engine.time_cycles(rows)[0]
        engine.start()
        while engine.timed < rows:
            if engine.wait(0.01) is Event.NEED_BLOCKS:
                feeder.fill()
        engine.stop()
        return np.array(took)


def page(address: str, name: str, token: str, end: threading.Event) -> None:
    """Read frames until the end, as a computer of its own would."""
    os.nice(19)  # of this thread
    others = os.sched_getaffinity(0) - {CELL}
    os.sched_setaffinity(0, others or {CELL})
    with connect(f"{address}/api/live?cell={name}", proxy=None) as live:
        live.send(json.dumps({"token": token}))
        live.recv()
        live.send(json.dumps({"subscribe": WATCHED, "scope": WATCHED[:4]}))
        while not end.is_set():
            live.recv()


@contextlib.contextmanager
def pages(name: str, count: int) -> Iterator[int]:
    """A monitor with so many pages; gives its process."""
    command = [sys.executable, "-m", "cnc_core.cli", "monitor", name]
    command += ["--port", "0"]
    end = threading.Event()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        base, _, token = process.stdout.readline().strip().partition("/#token=")
        address = base.replace("http", "ws")
        threads = [
            threading.Thread(target=page, args=(address, name, token, end))
            for _ in range(count)
        ]
        for thread in threads:
            thread.start()
        try:
            yield process.pid
        finally:
            end.set()
            for thread in threads:
                thread.join()
            process.terminate()


def cpu_s(pid: int) -> float:
    """CPU time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    ticks = int(fields[11]) + int(fields[12])
    return float(ticks / os.sysconf("SC_CLK_TCK"))


def hold_pages(name: str, count: int, seconds: float) -> None:
    """In a process of its own: pages, and what they cost the server."""
    os.sched_setaffinity(0, range(os.cpu_count() or 1))  # the cell is pinned
    with pages(name, count) as pid:
        sys.stdout.write("open\n")
        sys.stdout.flush()
        begin, before = time.monotonic(), cpu_s(pid)
        time.sleep(seconds)
        share = (cpu_s(pid) - before) / (time.monotonic() - begin)
        sys.stdout.write(f"{share}\n")


def round_us(folder: Path, args: argparse.Namespace, pages: int) -> Round:
    """One cell, with so many pages beside it."""
    name = f"hli-bench-{os.getpid()}-{secrets.token_hex(4)}"
    words = ["--hold", name, "--pages", str(pages)]
    words += ["--seconds", str(args.seconds)]
    holder = None
    if pages:
        holder = subprocess.Popen(
            [sys.executable, __file__, *words],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert holder.stdout is not None
        holder.stdout.readline()
    took = cycles(name, folder / PROGRAM, int(args.seconds * 1000)) / 1e3
    share = float(holder.communicate()[0]) if holder is not None else 0.0
    return Round(*np.percentile(took, (50, 99)), share)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--pages", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--hold")
    args = parser.parse_args()
    if args.hold:
        hold_pages(args.hold, args.pages, args.seconds)
        return
    os.sched_setaffinity(0, {CELL})
    rounds: list[tuple[Round, Round, Round]] = []
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        write_program(folder / PROGRAM, contour_points(100_000), 6000.0)
        for _ in range(args.rounds):
            counts = (0, args.pages, 0)
            found = [round_us(folder, args, count) for count in counts]
            rounds.append((found[0], found[1], found[2]))
    out = {
        "pages": args.pages,
        "rounds": args.rounds,
        "without_us": told(each[0] for each in rounds),
        "with_us": told(each[1] for each in rounds),
        "p99_ratio": ratio((w.p99, b.p99, a.p99) for b, w, a in rounds),
        "p50_ratio": ratio((w.p50, b.p50, a.p50) for b, w, a in rounds),
        "p99_ratio_of_two_without": ratio((a.p99, b.p99) for b, _, a in rounds),
        "server_cpu_share": float(np.mean([w.share for _, w, _ in rounds])),
    }
    sys.stdout.write(json.dumps(out) + "\n")


def told(rounds: Iterable[Round]) -> dict[str, float]:
    """Medians over the rounds, us."""
    kept = list(rounds)
    return {
        name: round(float(np.median([getattr(r, name) for r in kept])), 3)
        for name in ("p50", "p99")
    }


def ratio(rows: Iterable[tuple[float, ...]]) -> dict[str, Any]:
    """The first of each row over the mean of the others: quartiles."""
    found = [first / float(np.mean(others)) for first, *others in rows]
    low, middle, high = np.percentile(found, (25, 50, 75))
    return {
        "median": round(float(middle), 4),
        "quartiles": [round(float(low), 4), round(float(high), 4)],
    }


if __name__ == "__main__":
    main()
