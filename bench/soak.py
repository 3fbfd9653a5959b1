"""Hours of simulated time, one program behind the other, and what must not drift.

    python bench/soak.py --hours 168 [--seed 1] [--log soak.jsonl]

An engine and a segment run in this process at full speed (free run).  The dialects
take turns.  A PLC beside it asks for the contour ahead in every scan, acknowledges M
functions, holds the path at random, and is gone now and then until the next
program.  Checked for each program:

- the axes end within 1 nm of the last programmed position;
- the way of all cycles is the sum of the programmed lengths within 1 nm a metre;
- each request is answered in the cycle behind it;
- each M function comes once, in order, while a PLC is there.

A line of JSON an hour of simulated time has the sums, and memory, descriptors and
files now.  At the end memory must lie within 8 MiB of that behind the first tenth,
descriptors and files must be as many as then.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import os
import random
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

from hli.areas import Areas
from plc_client import AcknowledgeAll

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from support.inside import Inside  # noqa: E402 (its folder is put on the path above)

DIALECTS = ("isg", "iso", "isons", "osai")
END = {"isg": "M30", "iso": "M30", "isons": "M30", "osai": "M30"}
CELL = (
    '[channel]\ninterpolator_function = "FCT_IPO_DEFAULT | FCT_CONTOUR_LAH"\n'
    "[channel.m_synch]\n" + "".join(f'{k} = "MVS_SVS"\n' for k in range(70, 80))
)
NM, MB = 1e-6, 1 << 20
BLOCKS = 150
SCAN = 4  # cycles
MEMORY_BYTES = 8 * MB


@dataclass
class Sums:
    """What a soak has done so far."""

    cycles: int = 0
    programs: int = 0
    requests: int = 0
    functions: int = 0
    holds: int = 0
    restarts: int = 0
    worst_end_nm: float = 0.0
    worst_way_nm_a_m: float = 0.0
    wrong: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Part:
    """A program, and what it has to come to."""

    dialect: str
    text: str
    end: tuple[float, ...]
    way_mm: float
    functions: list[int]


def part(rng: random.Random, dialect: str) -> Part:
    """Lines of 0.05 to 60 mm over three axes; M70 to M79 in turn."""
    at = (0.0, 0.0, 0.0)
    lines, way, functions = ["G0 X0 Y0 Z0"], 0.0, []
    for k in range(BLOCKS):
        step = rng.choice((0.05, 1.0, 10.0, 60.0))
        to = tuple(round(v + rng.uniform(-step, step), 3) for v in at)
        to = tuple(max(-400.0, min(400.0, v)) for v in to)
        if math.dist(at, to) < 0.01:
            continue
        words = " ".join(
            f"{name}{value:.3f}" for name, value in zip("XYZ", to, strict=True)
        )
        lines.append(f"G1 {words} F{rng.choice((600, 3000, 12000))}")
        way += math.dist(at, to)
        at = to
        if k % 20 == 10:
            functions.append(70 + len(functions) % 10)
            lines.append(f"M{functions[-1]}")
    lines.append(END[dialect])
    return Part(dialect, "\n".join(lines) + "\n", at, way, functions)


class Plc:
    """What the other side of the memory does in a scan."""

    def __init__(self, cnc: Inside, rng: random.Random, sums: Sums) -> None:
        self._cnc, self._rng, self._sums = cnc, rng, sums
        self._held, self._asked = 0, False
        self._fetch = AcknowledgeAll(Areas(cnc.segment))
        self.functions: list[int] = []
        self.stays = rng.random() > 0.1

    def scan(self) -> None:
        """Read the answer, ask again, acknowledge, hold or let go."""
        clah = self._cnc.clah
        if self._asked:
            self._sums.requests += 1
            if clah.semaphor_rw:
                self._sums.wrong.append("a request was not answered")
        clah.request.start_position = self._rng.uniform(0.0, 1e6)
        clah.request.length = self._rng.choice((0.0, 5e4))
        clah.semaphor_rw = self._asked = True
        self.functions += [function.number for function in self._fetch()]
        if self._held:
            self._held -= 1
        elif self._rng.random() < 0.01:
            self._held = self._rng.randrange(1, 40)
            self._sums.holds += 1
        self._cnc.level(self._cnc.bahn.feedhold, self._held > 0)

    def leave(self) -> None:
        """It is gone: its functions count as acknowledged, nothing is held."""
        self._cnc.level(self._cnc.bahn.feedhold, False)
        self._cnc.channel.head.plc_present_w = False
        self._sums.restarts += 1


def drive(one: Part, folder: Path, rng: random.Random, sums: Sums) -> None:
    """One program from its start to its end."""
    with Inside(folder, one.text, CELL, one.dialect) as cnc:
        plc = Plc(cnc, rng, sums)
        leaves_at = rng.randrange(50, 3000) if not plc.stays else -1
        scans, way, here = 0, 0.0, (0.0, 0.0, 0.0)
        while not cnc.state.program_end_r:
            cnc.run(SCAN)
            for place in cnc.parts:
                for to in place.tolist():
                    here = to
            way = float(cnc.engine.state.path)
            cnc.parts.clear()
            cnc.paths.clear()
            cnc.events.clear()
            scans += 1
            if scans == leaves_at:
                plc.leave()
            elif leaves_at < 0 or scans < leaves_at:
                plc.scan()
        sums.cycles += int(cnc.engine.state.cycle)
    judge(one, plc, here, way, sums)


def judge(
    one: Part, plc: Plc, here: tuple[float, ...], way: float, sums: Sums
) -> None:
    """Add what the program came to."""
    sums.programs += 1
    sums.functions += len(plc.functions)
    off = math.dist(here, one.end) / NM
    share = abs(way - one.way_mm) / NM / (one.way_mm / 1000.0)
    sums.worst_end_nm = max(sums.worst_end_nm, off)
    sums.worst_way_nm_a_m = max(sums.worst_way_nm_a_m, share)
    expected = one.functions[: None if plc.stays else len(plc.functions)]
    if plc.functions != expected:
        sums.wrong.append(f"{one.dialect}: functions {plc.functions}")
    if off > 1.0:
        sums.wrong.append(f"{one.dialect}: ends {off:.3g} nm beside")
    if share > 1.0:
        sums.wrong.append(f"{one.dialect}: way off by {share:.3g} nm a metre")


def held_now() -> dict[str, int]:
    """Memory in bytes, descriptors, files of this user's runs in shared memory."""
    gc.collect()  # parts of a program refer to each other
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return {
        "memory": pages * os.sysconf("SC_PAGE_SIZE"),
        "descriptors": len(os.listdir("/proc/self/fd")),
        "files": len(list(Path("/dev/shm").glob(f"t{os.getpid()}-*"))),
    }


def soak(hours: float, seed: int, log: Path | None) -> Sums:
    """Programs until so many hours are simulated."""
    rng, sums, began = random.Random(seed), Sums(), time.process_time()
    goal = hours * 3_600_000
    first: dict[str, int] | None = None
    said = 0.0
    with tempfile.TemporaryDirectory() as root:
        while sums.cycles < goal and not sums.wrong:
            dialect = DIALECTS[sums.programs % len(DIALECTS)]
            drive(part(rng, dialect), Path(root), rng, sums)
            for path in Path(root).iterdir():
                path.unlink()
            if first is None and sums.cycles >= goal / 10:
                first = held_now()
            if sums.cycles >= said + 3_600_000 or sums.cycles >= goal:
                said = sums.cycles
                line = asdict(sums) | held_now()
                line["cpu_s"] = round(time.process_time() - began, 1)
                print(json.dumps(line), flush=True)
                if log:
                    with log.open("a") as file:
                        file.write(json.dumps(line) + "\n")
    last = held_now()
    if first:
        if last["memory"] > first["memory"] + MEMORY_BYTES:
            sums.wrong.append(f"memory {first['memory']} to {last['memory']}")
        for name in ("descriptors", "files"):
            if last[name] != first[name]:
                sums.wrong.append(f"{name} {first[name]} to {last[name]}")
    return sums


def main() -> None:
    """See the module's text."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--hours", type=float, default=0.1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--log", type=Path)
    args = parser.parse_args()
    sums = soak(args.hours, args.seed, args.log)
    for text in sums.wrong:
        print(text, file=sys.stderr)
    sys.exit(bool(sums.wrong))


if __name__ == "__main__":
    main()
