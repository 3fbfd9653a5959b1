"""What a run with one channel costs, beside another checkout in the same run.

``python bench/single_channel.py --before PATH [ROUNDS]``: PATH is a checkout
whose C code is built.  Worker processes of both checkouts drive the contour
workload in virtual time, in turns, so that what else runs hits both alike.
Prints CPU time a cycle in ns, of the least round, without and with a look-ahead
request of the PLC in each cycle, and the ratio of this checkout to the other.
``--at-most 1.03`` ends with 1 if a ratio is above it.
"""

from __future__ import annotations

import argparse
import json
import os
import secrets
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CYCLES = 4000
WAY = 100_000.0  # 0.1 um


def spent(path: Path, asks: bool) -> float:
    """CPU time of a cycle, ns; ``asks``: with a request of the PLC in each."""
    from cnc_core.config import CellConfig  # noqa: PLC0415
    from cnc_core.engine import Engine, Event  # noqa: PLC0415
    from cnc_core.planning import Feeder  # noqa: PLC0415
    from cnc_core.program import Program  # noqa: PLC0415
    from hli import layout  # noqa: PLC0415
    from hli.areas import Areas  # noqa: PLC0415
    from hli.segment import create  # noqa: PLC0415
    from plc_client import ContourLookahead  # noqa: PLC0415

    cell = CellConfig()
    program = Program(path, cell, "isg")
    name = f"hli-bench-{os.getpid()}-{secrets.token_hex(4)}"
    clock = layout.HLI_CLOCK_FREERUN
    with (
        create(name, 1, len(cell.axes)) as segment,
        closing(Engine(cell, segment=segment, clock=clock)) as engine,
    ):
        channel = Areas(segment).gpCh[0]
        unit = ContourLookahead(channel)
        feeder = Feeder(program, engine, lambda _batch: None)
        feeder.fill()
        began = time.process_time_ns()
        left = CYCLES
        while left:
            if asks:
                at = channel.bahn_state.dist_prog_start
                unit(start_position=at, length=WAY)
            count = 1 if asks else left
            before = int(engine.state.cycle) if not asks else 0
            if engine.run(count) is Event.NEED_BLOCKS:
                feeder.fill()
            left -= 1 if asks else int(engine.state.cycle) - before
        return (time.process_time_ns() - began) / CYCLES


def worker() -> None:
    """One round: the least of some goes."""
    from cnc_core.benchmarks.workloads import (  # noqa: PLC0415
        contour_points,
        write_program,
    )

    with tempfile.TemporaryDirectory(prefix="hli-cosim-bench-") as name:
        path = write_program(
            Path(name) / "contour.nc", contour_points(20_000), 6000.0
        )
        found = {
            way: min(spent(path, asks) for _ in range(3))
            for way, asks in (("cycles", False), ("requests", True))
        }
    print(json.dumps(found))


def of_checkout(checkout: Path) -> dict[str, float]:
    """A round of this checkout in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-P", str(Path(__file__).resolve()), "--worker"],
        env=os.environ | {"PYTHONPATH": str(checkout)},
        cwd=checkout,
        check=True,
        text=True,
        stdout=subprocess.PIPE,
    )
    return dict(json.loads(done.stdout))


def compared(before: Path, rounds: int) -> dict[str, dict[str, float]]:
    """The least of all rounds, for either checkout, and their ratio."""
    both = {"before": before, "now": ROOT}
    found: dict[str, list[dict[str, float]]] = {name: [] for name in both}
    for i in range(rounds):
        order = list(both) if i % 2 else list(both)[::-1]
        for name in order:
            found[name].append(of_checkout(both[name]))
    ways = found["now"][0]
    told = {}
    for way in ways:
        least = {
            name: min(one[way] for one in each) for name, each in found.items()
        }
        told[way] = {
            f"{name}_ns": round(value, 1) for name, value in least.items()
        } | {"ratio": least["now"] / least["before"]}
    return told


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rounds", nargs="?", type=int, default=10)
    parser.add_argument("--before", type=Path)
    parser.add_argument("--at-most", type=float, default=float("inf"))
    parser.add_argument("--worker", action="store_true")
    args = parser.parse_args()
    if args.worker:
        worker()
        return
    if args.before is None:
        parser.error("--before PATH: the checkout to compare with")
    told = compared(args.before.resolve(), args.rounds)
    print(json.dumps(told))
    if any(one["ratio"] > args.at_most for one in told.values()):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
