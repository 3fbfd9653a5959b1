"""What pages of the monitor cost: the GEO cycle with and without them, the
server's CPU time, in rounds that take turns.

    python bench/monitor_pages.py [--pages 10] [--rounds 6] [--seconds 5]

Figures are medians over the rounds.  A page is a WebSocket that reads each frame
and watches ten symbols.
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
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

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
    """Read frames until the end."""
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
        base, _, token = process.stdout.readline().strip().partition("/?token=")
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
    with pages(name, count) as pid:
        sys.stdout.write("open\n")
        sys.stdout.flush()
        begin, before = time.monotonic(), cpu_s(pid)
        time.sleep(seconds)
        share = (cpu_s(pid) - before) / (time.monotonic() - begin)
        sys.stdout.write(f"{share}\n")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--pages", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--hold")
    args = parser.parse_args()
    if args.hold:
        hold_pages(args.hold, args.pages, args.seconds)
        return
    rows = int(args.seconds * 1000)
    found: dict[bool, list[np.ndarray[Any, Any]]] = {False: [], True: []}
    shares = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "contour.nc"
        write_program(path, contour_points(100_000), 6000.0)
        for k in range(2 * args.rounds):
            name = f"hli-bench-{os.getpid()}-{secrets.token_hex(4)}"
            watched = k % 2 == 1
            holder = None
            if watched:
                words = ["--hold", name, "--pages", str(args.pages)]
                words += ["--seconds", str(args.seconds)]
                holder = subprocess.Popen(
                    [sys.executable, __file__, *words],
                    stdout=subprocess.PIPE,
                    text=True,
                )
                assert holder.stdout is not None
                holder.stdout.readline()
            found[watched].append(cycles(name, path, rows))
            if holder is not None:
                shares.append(float(holder.communicate()[0]))
    out = {
        which: {
            f"p{q}": float(np.median([np.percentile(r, q) for r in rounds]))
            / 1e3
            for q in (50, 99)
        }
        for which, rounds in (
            ("without_us", found[False]),
            ("with_us", found[True]),
        )
    }
    ratio = out["with_us"]["p99"] / out["without_us"]["p99"]
    sys.stdout.write(
        json.dumps(
            out
            | {"pages": args.pages, "p99_ratio": ratio}
            | {"server_cpu_share": float(np.mean(shares))}
        )
        + "\n"
    )


if __name__ == "__main__":
    main()
