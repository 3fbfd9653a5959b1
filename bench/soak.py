"""A week of simulated time, one program behind the other, and what must not drift.

    python bench/soak.py --cycles 600e6 [--seed 1] [--log soak.jsonl]

Engine and segment run in this process at full speed (free run).  A lot is what one
seed does: cells that start and end, each with some programs, the dialects in turn.
A PLC between two batches of cycles asks for the contour ahead, acknowledges
functions, holds the path, changes the override, leaves and comes back.
Checked for each program, against an oracle of its own (``soak_programs.py``):

- the axes end within 1 nm of the last programmed position;
- the way of all cycles, and the distance that the PLC is shown, are the sum of the
  programmed lengths within 1 nm a metre;
- each request is answered in the cycle behind it, by the block at its place;
- each function comes once, in order, but while the PLC was away.

Cycles in which the path stands are counted by cause: ordered by the PLC (not
judged), waits of the program, no blocks, unexplained.  The last two have bounds.

The log has a line of JSON a lot.  Seeds that it has already are left out, so a
soak goes on where it ended.  The last line printed has the sums of the whole log.
Behind the first tenth memory may grow by 8 MiB, descriptors and files not at all.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import json
import os
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from soak_cell import EXACT_STOP, Cell, Sums
from soak_programs import DIALECTS

MB = 1 << 20
MEMORY_BYTES = 8 * MB
LOT_CYCLES = 3_600_000
"""An hour at a cycle of 1 ms."""
PROGRAMS = 4
MOTIONS = 400


def held_now() -> dict[str, int]:
    """Memory in bytes, descriptors, this process' files in shared memory.

    Memory is what is in use: what lies free is given back to the system first.
    """
    gc.collect()  # parts of a program refer to each other
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):
        trim(0)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return {
        "memory": pages * os.sysconf("SC_PAGE_SIZE"),
        "descriptors": len(os.listdir("/proc/self/fd")),
        "files": len(list(Path("/dev/shm").glob(f"t{os.getpid()}-*"))),
    }


@dataclass(frozen=True)
class Lot:
    """What a seed came to."""

    seed: int
    cpu_s: float
    sums: Sums
    held: dict[str, int]

    @classmethod
    def read(cls, line: str) -> Lot:
        """From a line of a log."""
        said: dict[str, Any] = json.loads(line)
        names = {member.name for member in fields(Sums)}
        sums = Sums(**{name: said[name] for name in names})
        return cls(said["seed"], said["cpu_s"], sums, said["held"])

    def line(self) -> str:
        """For a log."""
        head = {"seed": self.seed, "cpu_s": self.cpu_s, "held": self.held}
        return json.dumps(head | asdict(self.sums))


def drive(seed: int, cycles: int, motions: int, folder: Path) -> Lot:
    """One lot: cells until so many cycles have run, or a promise is broken."""
    rng, sums, began = random.Random(seed), Sums(), time.process_time()
    turn = 0
    while sums.cycles < cycles and not sums.wrong:
        cell = Cell(folder, rng, sums)
        try:
            for _ in range(PROGRAMS):
                cell.drive(DIALECTS[turn % len(DIALECTS)], motions)
                turn += 1
        finally:
            cell.close()
    cpu_s = round(time.process_time() - began, 2)
    return Lot(seed, cpu_s, sums, held_now())


def judged(sums: Sums) -> list[str]:
    """What is wrong with stands, over a lot or all of them."""
    said = []
    if sums.no_blocks_cycles:
        said.append(f"{sums.no_blocks_cycles} cycles without blocks")
    if sums.unexplained_longest > EXACT_STOP:
        said.append(f"stands {sums.unexplained_longest} cycles unexplained")
    return said


def grown(lots: list[Lot]) -> list[str]:
    """What one process holds more behind its last lot than behind its first tenth."""
    if len(lots) < 2:
        return []
    first, last = lots[len(lots) // 10].held, lots[-1].held
    said = []
    if last["memory"] > first["memory"] + MEMORY_BYTES:
        said.append(f"memory {first['memory']} to {last['memory']}")
    said += [
        f"{name} {first[name]} to {last[name]}"
        for name in ("descriptors", "files")
        if last[name] != first[name]
    ]
    return said


def soak(
    cycles: int, seed: int, done: list[Lot], lot_cycles: int, motions: int
) -> Iterator[Lot]:
    """Lots from ``seed`` on, those that are done left out, until so many cycles
    have run in all; it ends at a broken promise.
    """
    there = {lot.seed for lot in done}
    have = sum(lot.sums.cycles for lot in done)
    with tempfile.TemporaryDirectory() as root:
        while have < cycles:
            if seed not in there:
                lot = drive(seed, lot_cycles, motions, Path(root))
                yield lot
                have += lot.sums.cycles
                if lot.sums.wrong:
                    return
            seed += 1


def main() -> None:
    """See the module's text."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--cycles", type=float, default=3.6e6)
    parser.add_argument("--seed", type=int, default=1, help="of the first lot")
    parser.add_argument("--log", type=Path)
    parser.add_argument("--lot", type=float, default=LOT_CYCLES, help="cycles")
    parser.add_argument("--motions", type=int, default=MOTIONS)
    args = parser.parse_args()
    done: list[Lot] = []
    if args.log and args.log.exists():
        done = [Lot.read(line) for line in args.log.read_text().splitlines()]
    mine: list[Lot] = []
    for lot in soak(
        int(args.cycles), args.seed, done, int(args.lot), args.motions
    ):
        mine.append(lot)
        print(lot.line(), flush=True)
        if args.log:
            with args.log.open("a") as file:
                file.write(lot.line() + "\n")
    total = Sums()
    for lot in done + mine:
        total.add(lot.sums)
    total.wrong += judged(total) + grown(mine)
    cpu_s = sum(lot.cpu_s for lot in done + mine)
    head = {"lots": len(done + mine), "cpu_s": round(cpu_s, 1)}
    print(json.dumps(head | asdict(total)))
    sys.exit(bool(total.wrong))


if __name__ == "__main__":
    main()
