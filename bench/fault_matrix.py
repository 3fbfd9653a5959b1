"""Kill and stop CNC, PLC and launcher at chosen and random moments; every run
must end and leave nothing.

    python bench/fault_matrix.py --runs 200 [--seed 1] [--clock freerun ...]
    python bench/fault_matrix.py --log faults.jsonl --from 1 --to 200

The runs take the clocks in turn (all three unless some are named).
The seed alone decides what run K is.  So the matrix may be run in parts, and
runs that the log has already are left out.  The counts are those of the whole log.
Each run is ``hli-cosim run`` in a temporary folder of its own (TMPDIR).  A
fault is (who, what, when):

- CNC, PLC or launcher: SIGKILL, or SIGSTOP and SIGCONT after a while;
- the machine: all three stop and go on, as if it were suspended;
- the terminal: SIGHUP to its processes;
- the PLC: RESTART, three times by SIGUSR1; AGAIN, killed three times, with another
  process behind each (``fault_apart.py``).

Asserted per run: the launcher ends within 5 s of a kill or of its terminal's end (a
killed launcher: its children do), a stopped side goes on to a completed run, no
process, segment or folder is left but those of a killed launcher; the clean run behind
each batch completes and removes these too.  In a run that completes, the PLC has seen
each M function of the program in order and once.  In every second run the PLC also drives
back and forth: a function comes again where the path passes it again, twice more each time.
Functions that a PLC fetched and died before it acknowledged come again, marked.
Every third run records: what is there behind it can be read, cycle by cycle.

``--channels N``: N channels with functions of their own.  Each channel shows its
functions alone, and CNC and PLC have counted the same for each of them.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from fault_apart import one_apart
from fault_run import (
    CLOCKS,
    DRIVING,
    LIMIT_S,
    MOMENTS,
    Fault,
    Setting,
    clean,
    one,
)

BATCH = 20
MOMENTS_OF = {
    "AGAIN": ("cycle 1", "motion", "request pending", "M pending"),
    "RESTART": DRIVING,
    "HUP": MOMENTS,
    "KILL": MOMENTS,
    "STOP": MOMENTS,
}


def faults(
    seed: int, clocks: Sequence[str] = CLOCKS, apart: bool = True
) -> Iterator[Fault]:
    """All chosen combinations in random order, over and over, without end.

    ``apart``: CNC and PLC started apart are among them.
    """
    rng = random.Random(seed)
    kinds = [
        (a, b) for a in ("cnc", "plc", "launcher") for b in ("KILL", "STOP")
    ]
    kinds += [("machine", "STOP"), ("terminal", "HUP"), ("plc", "RESTART")]
    kinds += [("plc", "AGAIN")] if apart else []
    table = [
        Fault(who, what, when, clock)
        for who, what in kinds
        for when in MOMENTS_OF[what]
        for clock in clocks
    ]
    while True:
        rng.shuffle(table)
        yield from table


@dataclass(frozen=True)
class Outcome:
    """What run ``k`` of a seed came to; ``broken``: the promise it broke, or ""."""

    seed: int
    k: int
    fault: Fault | None  # None: the clean run behind a batch
    hit: bool
    seconds: float
    broken: str = ""

    @property
    def name(self) -> str:
        """What it is counted as."""
        if self.broken:
            return "broken"
        if self.fault is None:
            return "clean runs"
        return f"{self.fault.what} {self.fault.who}" if self.hit else "missed"


class Matrix:
    """The runs of a seed, any part of them, in a folder of its own."""

    def __init__(
        self,
        folder: Path,
        seed: int,
        clocks: Sequence[str],
        limit_s: float,
        channels: int = 1,
    ) -> None:
        self._channels = channels
        self._folder, self._seed, self._limit_s = folder, seed, limit_s
        self._clocks = clocks
        self._launchers: set[int] = set()

    def runs(self, ks: range, done: set[int]) -> Iterator[Outcome]:
        """The runs with these numbers but those that are done."""
        table = faults(self._seed, self._clocks, self._channels == 1)
        for k, fault in enumerate(table, 1):
            if k >= ks.stop:
                return
            if k not in ks or k in done:
                continue
            yield self._one(k, fault)
            if k % BATCH == 0 or k == ks.stop - 1:
                yield self._clean(k)

    def _one(self, k: int, fault: Fault) -> Outcome:
        try:
            hit, seconds = self._hit(k, fault)
        except AssertionError as error:
            return Outcome(self._seed, k, fault, True, 0.0, str(error))
        return Outcome(self._seed, k, fault, hit, seconds)

    def _hit(self, k: int, fault: Fault) -> tuple[bool, float]:
        rng = random.Random(f"{self._seed} {k}")
        if fault.what == "AGAIN":
            return one_apart(fault, self._folder, rng, self._limit_s)
        setting = Setting(
            self._channels,
            back=k % 2 == 0 or fault.when == "backward",
            recorded=k % 3 == 0 or fault.when == "recording",
        )
        launchers = self._launchers
        return one(fault, self._folder, rng, self._limit_s, setting, launchers)

    def _clean(self, k: int) -> Outcome:
        began = time.monotonic()
        try:
            clean(self._folder, self._limit_s, self._launchers, self._channels)
        except AssertionError as error:
            return Outcome(self._seed, k, None, True, 0.0, str(error))
        took = time.monotonic() - began
        return Outcome(self._seed, k, None, True, took)


class Log:
    """Outcomes as lines of JSON, and their counts."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self.outcomes: list[Outcome] = []
        if path and path.exists():
            lines = path.read_text().splitlines()
            self.outcomes = [self._read(line) for line in lines]

    def _read(self, line: str) -> Outcome:
        said = json.loads(line)
        fault = said["fault"] and Fault(**said["fault"])
        return Outcome(**(said | {"fault": fault}))

    def done(self, seed: int) -> set[int]:
        """Numbers of the runs of a seed that are there."""
        return {
            one.k for one in self.outcomes if one.fault and one.seed == seed
        }

    def add(self, outcome: Outcome) -> None:
        """Keep it, on the disk at once."""
        self.outcomes.append(outcome)
        if self._path:
            with self._path.open("a") as file:
                file.write(json.dumps(asdict(outcome)) + "\n")

    def counts(self) -> dict[str, int]:
        """How often each outcome, and the slowest end behind a kill in ms."""
        slowest = [
            outcome.seconds
            for outcome in self.outcomes
            if outcome.fault and outcome.fault.what == "KILL" and outcome.hit
        ]
        found = Counter(outcome.name for outcome in self.outcomes)
        return dict(sorted(found.items())) | {
            "slowest end, ms": round(1000 * max(slowest, default=0.0))
        }

    def hits(self) -> dict[str, dict[str, int]]:
        """How many faults have hit each moment and each clock."""
        hit = [each.fault for each in self.outcomes if each.hit and each.fault]
        return {
            "moments": dict(Counter(fault.when for fault in hit)),
            "clocks": dict(Counter(fault.clock for fault in hit)),
        }


def main() -> None:
    """Print the counts as JSON; 1 where a promise was broken."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--clock", action="append", choices=CLOCKS)
    parser.add_argument("--log", type=Path, help="a line of JSON a run")
    parser.add_argument("--from", type=int, default=1, dest="first")
    parser.add_argument("--to", type=int, help="instead of --runs")
    parser.add_argument(
        "--limit",
        type=float,
        default=LIMIT_S,
        help="s to the end of a killed run; more where others use the processors",
    )
    parser.add_argument("--channels", type=int, default=1)
    args = parser.parse_args()
    last = args.to or args.first + args.runs - 1
    log = Log(args.log)
    with tempfile.TemporaryDirectory() as root:
        clocks = args.clock or CLOCKS
        matrix = Matrix(
            Path(root), args.seed, clocks, args.limit, args.channels
        )
        ks = range(args.first, last + 1)
        for outcome in matrix.runs(ks, log.done(args.seed)):
            log.add(outcome)
            if outcome.broken:
                print(f"run {outcome.k}, {outcome.fault}: {outcome.broken}")
            if outcome.fault is None:
                counts = log.counts()
                print(outcome.k, counts, file=sys.stderr, flush=True)
    print(json.dumps(log.counts() | log.hits(), indent=2))
    sys.exit(any(outcome.broken for outcome in log.outcomes))


if __name__ == "__main__":
    main()
