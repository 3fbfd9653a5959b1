"""The real-time threads under a PLC's random commands, run after run, on crowded cores.

    python bench/stress.py --runs 2000 --log stress.jsonl [--load 4] [--seconds 0.4]
    setpriv --bounding-set -sys_nice python bench/stress.py ...

Each run is an engine with planner, GEO and service as threads in real time
(``tests/support/threaded.py``), and a seed of commands.  No sample may exceed a limit,
and none may jump.  ``--load N``: N busy loops beside it.  The second line takes the
permission for SCHED_FIFO away: then the planner is an ordinary thread among them.

The log has a line of JSON a run.  Runs that it has already are left out.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from hli import layout
from support import threaded
from support.inside import Inside
from support.limits import legal, shares

BUSY = "while True: pass"
SECONDS = 0.4
FAR_MM, TURNS = 10.0, 60
"""The commands come in turns of so many."""


@dataclass(frozen=True)
class Stressed:
    """What one run came to."""

    run: int
    fifo: bool
    load: float
    cycles: int
    driven_mm: float
    requests: int
    functions: int
    lost_samples: int
    acceleration: float
    jerk: float
    late: int
    late_cycles: int
    away_ms: float
    broken: str = ""


def stressed(run: int, seconds: float, folder: Path) -> Stressed:
    """One run; the seed alone decides what the PLC commands."""
    rng = np.random.default_rng(run)
    known = (threaded.FUNCTIONS, threaded.FORESIGHT)[run % 2]
    config = threaded.CONFIG % known
    service = layout.HLI_SERVICE_IMMEDIATE
    with Inside(folder, threaded.PROGRAM, config, service=service) as cnc:
        first = int(rng.integers(0, TURNS))
        fifo = threaded.drive(cnc, rng, seconds, first)
        return _judged(run, fifo, cnc)


def _judged(run: int, fifo: bool, cnc: Inside) -> Stressed:
    state = cnc.engine.state
    lost, driven = int(state.record_lost), float(cnc.paths[-1][-1])
    found = shares(cnc.pos, cnc.cell, ended=False)
    broken = "a fault" if state.fault else ""
    try:
        if not lost:  # a gap in the record is no jump
            legal(cnc.pos, cnc.cell)
    except AssertionError as error:
        broken = str(error) or "not legal"
    return Stressed(
        run=run,
        fifo=fifo,
        load=os.getloadavg()[0],
        cycles=int(state.cycle),
        driven_mm=round(driven, 3),
        requests=int(state.requests_mode1 + state.requests_mode2),
        functions=int(state.techno_functions),
        lost_samples=lost,
        acceleration=round(found.acceleration, 5),
        jerk=round(found.jerk, 5),
        late=int(state.planner_late),
        late_cycles=int(state.planner_late_cycles),
        away_ms=round(1e3 * float(state.planner_away_s), 3),
        broken=broken,
    )


@contextmanager
def crowded(loops: int) -> Iterator[None]:
    """So many processes that want a core all the time."""
    busy = [
        subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(loops)
    ]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def sums(found: list[Stressed]) -> dict[str, float]:
    """Over all runs."""
    checked = [run for run in found if not run.lost_samples]
    return {
        "runs": len(found),
        "with SCHED_FIFO": sum(run.fifo for run in found),
        "broken": sum(bool(run.broken) for run in found),
        "not checked, samples lost": len(found) - len(checked),
        "cycles": sum(run.cycles for run in found),
        "driven, m": round(sum(run.driven_mm for run in found) / 1000.0, 3),
        "requests": sum(run.requests for run in found),
        "functions": sum(run.functions for run in found),
        "largest acceleration": max(run.acceleration for run in checked),
        "largest jerk": max(run.jerk for run in checked),
        "runs with a late planner": sum(run.late > 0 for run in found),
        "late cycles": sum(run.late_cycles for run in found),
        "planner away, longest ms": max(run.away_ms for run in found),
        "least load": round(min(run.load for run in found), 1),
        "largest load": round(max(run.load for run in found), 1),
    }


def main() -> None:
    """Print the sums as JSON; 1 where a run broke a limit."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--from", type=int, default=1, dest="first")
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--load", type=int, default=0, help="busy loops")
    parser.add_argument("--log", type=Path, help="a line of JSON a run")
    args = parser.parse_args()
    found: list[Stressed] = []
    if args.log and args.log.exists():
        lines = args.log.read_text().splitlines()
        found = [Stressed(**json.loads(line)) for line in lines]
    done = {run.run for run in found}
    threaded.FAR_MM, threaded.TURNS = FAR_MM, TURNS // 4
    with tempfile.TemporaryDirectory() as folder, crowded(args.load):
        for run in range(args.first, args.first + args.runs):
            if run in done:
                continue
            each = stressed(run, args.seconds, Path(folder))
            found.append(each)
            if args.log:
                with args.log.open("a") as file:
                    file.write(json.dumps(asdict(each)) + "\n")
            if each.broken:
                print(f"run {run}: {each.broken}", flush=True)
    print(json.dumps(sums(found), indent=2))
    sys.exit(any(run.broken for run in found))


if __name__ == "__main__":
    main()
