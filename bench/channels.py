"""What several channels cost: one cell with 1, 2, 4, 8 and 12 channels.

``python bench/channels.py [SECONDS] [--cores 1|2]``: in lockstep at 1 ms a PLC
sends a contour look-ahead request to every channel in every scan, both
processes on one core or on two.  Each answer is compared with an oracle that
reads the program's text itself and shares no code with the CNC.  Prints the
table of docs/channels.md: CPU time that a cycle takes on either side, which
other work on the machine changes less, and times real time by wall time.

``--realtime``: instead the GEO cycle of 1 to 12 channels in real time, us.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cnc_core.cell import Cell, RunResult
from cnc_core.process.options import RunOptions
from plc_client import ContourLookahead

ROOT = Path(__file__).resolve().parents[1]
COUNTS = (1, 2, 4, 8, 12)
AHEAD = 50_000.0  # 0.1 um
SHORT_S = 1.0
PLC = """
from plc_client import ContourLookahead, task

KEPT = @KEPT@

@task(interval=0.001)
class Asks:
    def setup(self, hli):
        self.channels = [hli.gpCh[i] for i in range(hli.gNrCh)]
        self.units = [ContourLookahead(ch) for ch in self.channels]
        self.answers = [[] for _ in self.channels]
        self.asked = [0.0] * len(self.channels)
        self.done = [0] * len(self.channels)
        self.scans = 0

    def cyclic(self):
        self.scans += 1
        keep = self.scans % KEPT == 0
        for i, unit in enumerate(self.units):
            at = self.channels[i].bahn_state.dist_prog_start
            unit(start_position=at, length=50_000.0)
            if unit.done:
                self.done[i] += 1
                if keep:
                    found = unit.blocks
                    self.answers[i].append((
                        unit.answer_request.start_position,
                        found["start_position"].tolist(),
                        found["length"].tolist(),
                    ))

    def finished(self):
        return all(ch.decoder_state.program_end_r for ch in self.channels)

    def result(self):
        return {"scans": self.scans, "done": self.done, "answers": self.answers}
"""


def program(seed: int, seconds: float) -> list[float]:
    """Lengths of the motions, mm: about so many seconds at 6 m/min."""
    draw, lengths = random.Random(seed), []
    while sum(lengths) < seconds * 100.0:
        lengths.append(draw.choice((0.5, 1.0, 2.0, 4.0)) * (1 + seed % 3))
    return lengths


def text_of(lengths: list[float]) -> str:
    """A line to and fro along X with these lengths, tangential all the way."""
    x, lines = 0.0, []
    for i, length in enumerate(lengths, 1):
        x += length
        lines.append(f"N{i} G1 X{x!r} F6000")
    return "\n".join([*lines, "M30"]) + "\n"


def cell_of(count: int) -> str:
    """Channels with one axis each."""
    tables = [f"[channels.c{i}.axes.X]\n" for i in range(count)]
    return "".join(tables) if count > 1 else "[axes.X]\n"


def wrong_answers(lengths: list[float], answers: list[Any]) -> int:
    """How many answers do not hold exactly the motions in their range.

    The motion in which the range begins comes first; the last begins inside it.
    """
    starts, at = [], 0.0
    for length in lengths:
        starts.append(at)
        at += length * 1e4
    wrong = 0
    for asked, begins, found in answers:
        expected = [
            (start, length * 1e4)
            for start, length in zip(starts, lengths, strict=True)
            if start + length * 1e4 > asked + 0.5
            and start < asked + AHEAD - 0.5
        ]
        near = len(begins) >= len(expected) > 0 or not expected
        for (start, length), begin, is_long in zip(
            expected, begins, found, strict=False
        ):
            near &= abs(start - begin) < 2.0 and abs(length - is_long) < 2.0
        wrong += not near
    return wrong


@dataclass(frozen=True)
class Run:
    """One run: its result and the CPU time of both processes, s."""

    result: RunResult
    cpu_s: float
    programs: list[list[float]]


def run(count: int, seconds: float, kept: int) -> Run:
    """A run with so many channels, in processes of its own."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "plc.py").write_text(PLC.replace("@KEPT@", str(kept)))
        (place / "cell.toml").write_text(cell_of(count))
        programs = [program(seed, seconds) for seed in range(count)]
        files = []
        for i, lengths in enumerate(programs):
            files.append(place / f"c{i}.nc")
            files[-1].write_text(text_of(lengths))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        with Cell(place / "cell.toml") as cell:
            options = RunOptions(out=place / "out")
            result = cell.run_with(options, files, place / "plc.py").check()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = sum(
        getattr(after, name) - getattr(before, name)
        for name in ("ru_utime", "ru_stime")
    )
    return Run(result, cpu_s, programs)


def measured(count: int, seconds: float, kept: int) -> dict[str, Any]:
    """One row; a short run beside the long one takes out what starting costs."""
    short, long = run(count, SHORT_S, kept), run(count, seconds, kept)
    cycles = long.result.cycles - short.result.cycles
    told = long.result.plc["result"]
    return {
        "channels": count,
        **worked(count),
        "cycles": long.result.cycles,
        "realtime_factor": long.result.realtime_factor,
        "cpu_us_per_cycle": (long.cpu_s - short.cpu_s) / cycles * 1e6,
        "answers": sum(told["done"]),
        "checked": sum(map(len, told["answers"])),
        "wrong": sum(map(wrong_answers, long.programs, told["answers"])),
    }


def worked(count: int, cycles: int = 2000) -> dict[str, float]:
    """CPU time per cycle, us, of the CNC's cycles and of the PLC's requests,
    both in this process: what the waits of two processes cost is left out.
    """
    sys.path.insert(0, str(ROOT / "tests"))
    from support.channels import Channels  # noqa: PLC0415

    texts = [text_of(program(seed, 12.0)) for seed in range(count)]
    cell = "".join(f"[channels.c{i}.axes.X]\n" for i in range(count))
    spent = [0, 0, 0]
    with (
        tempfile.TemporaryDirectory() as folder,
        Channels(Path(folder), texts, cell) as cnc,
    ):
        areas = [cnc.hli.gpCh[i] for i in range(count)]
        units = [ContourLookahead(area) for area in areas]
        cnc.run(300)
        began = time.process_time_ns()
        cnc.run(cycles)
        spent[2] = time.process_time_ns() - began
        for _ in range(cycles):
            began = time.process_time_ns()
            for unit, area in zip(units, areas, strict=True):
                at = area.bahn_state.dist_prog_start
                unit(start_position=at, length=AHEAD)
            asked = time.process_time_ns()
            cnc.run(1)
            spent[0] += asked - began
            spent[1] += time.process_time_ns() - asked
    names = ("plc_us", "cnc_us", "cnc_alone_us")
    return {
        name: ns / cycles / 1e3 for name, ns in zip(names, spent, strict=True)
    }


def in_real_time(count: int, seconds: float) -> dict[str, float]:
    """What the GEO cycle of all channels takes in real time, us."""
    sys.path.insert(0, str(ROOT / "tests"))
    from support.channels import Channels  # noqa: PLC0415

    texts = [text_of(program(seed, seconds + 2.0)) for seed in range(count)]
    cell = "".join(f"[channels.c{i}.axes.X]\n" for i in range(count))
    cycles = int(seconds * 1e3)
    with (
        tempfile.TemporaryDirectory() as folder,
        Channels(Path(folder), texts, cell, clock="realtime") as cnc,
    ):
        times = cnc.group.first.time_cycles(cycles)[0]
        for channel in cnc.channels:
            channel.engine.start()
        while cnc.group.first.timed < cycles:
            event, who = cnc.group.wait(0.1)
            cnc.channels[who].handle(event)
        for channel in cnc.channels:
            channel.engine.stop()
        found = np.asarray(times)[:cycles] / 1e3
    p50, p99 = np.quantile(found, (0.5, 0.99))
    return {"channels": count, "p50_us": float(p50), "p99_us": float(p99)}


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def of_lockstep(rows: Sequence[dict[str, Any]]) -> str:
    """The table of docs/channels.md, and what the answers were worth."""
    heads = (
        "Channels",
        "CNC without requests",
        "CNC with a request a channel",
        "PLC in Python, its requests",
        "Times real time",
    )
    names = ("cnc_alone_us", "cnc_us", "plc_us")
    cells = [
        [
            str(row["channels"]),
            *(f"{row[name]:.1f}" for name in names),
            f"{row['realtime_factor']:.1f}",
        ]
        for row in rows
    ]
    told = [sum(row[name] for row in rows) for name in ("answers", "checked")]
    wrong = sum(row["wrong"] for row in rows)
    return (
        f"{table(heads, cells)}\n\n{told[0]} answers, {told[1]} compared,"
        f" {wrong} wrong"
    )


def of_real_time(rows: Sequence[dict[str, Any]]) -> str:
    """The table of docs/channels.md on real time."""
    heads = ("Channels", "GEO cycle p50, us", "p99, us")
    return table(
        heads,
        [
            [
                str(row["channels"]),
                f"{row['p50_us']:.1f}",
                f"{row['p99_us']:.1f}",
            ]
            for row in rows
        ],
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=10.0)
    parser.add_argument("--kept", type=int, default=10)
    parser.add_argument("--counts", default=",".join(map(str, COUNTS)))
    parser.add_argument("--cores", type=int, choices=(1, 2), default=1)
    parser.add_argument("--realtime", action="store_true")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    counts = [int(text) for text in args.counts.split(",")]
    began = time.monotonic()
    if args.realtime:
        rows = [in_real_time(count, args.seconds) for count in counts]
    else:
        cores = sorted(os.sched_getaffinity(0))[: args.cores]
        os.sched_setaffinity(0, cores)
        print(f"both processes on {len(cores)} core(s)", file=sys.stderr)
        rows = [measured(count, args.seconds, args.kept) for count in counts]
    if args.json:
        print(json.dumps({"rows": rows, "seconds": time.monotonic() - began}))
    else:
        print((of_real_time if args.realtime else of_lockstep)(rows))


if __name__ == "__main__":
    main()
