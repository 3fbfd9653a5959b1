"""An hour in real time: the cycle's and the handshake's times as histograms.

    python bench/realtime_hour.py [--seconds 3600] [--log hour.json]

The CNC process drives contours and functions at a cycle of 1 ms, without an end.  A
PLC in a process of its own asks for the contour ahead in every scan, acknowledges
the functions, changes the override and holds the path now and then.  Its
acknowledgements are counted on both sides.

Printed and logged: of each time the quantiles and a histogram (how many lay below
each power of two, us); cycles, requests, functions and scans; what the planner was
late; memory and descriptors of the CNC at the first and at the last minute.
"""

from __future__ import annotations

import argparse
import json
import os
import secrets
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.benchmarks import quantiles_us
from cnc_core.process.cnc_process import CncProcess
from cnc_core.process.options import CncOptions, RunOptions

MINUTE_S = 60.0
POWERS = range(16)
PROGRAM = """N10 G00 X0 Y0
N20 #HSC ON [BSPLINE PATH_DEV=0.01]
N30 $WHILE 1
N40 G01 X20 F6000
N50 G03 X20 Y20 J10
N60 M20
N70 G01 X10 Y21
N75 X5 Y19
N80 X0 Y20
N90 G03 X0 Y0 J-10
N100 M21
N110 $ENDWHILE
N120 M30
"""
CONFIG = '[channel]\n[channel.m_synch]\n20 = "MVS_SVS"\n21 = "MNS_SNS"\n'
PLC = """
from plc_client import AcknowledgeAll, ContourLookahead, FeedHold, Override, task

@task(interval=0.001)
class Hour:
    def setup(self, hli):
        channel = hli.gpCh[0]
        self.state = channel.bahn_state
        self.ahead = ContourLookahead(channel)
        self.override, self.hold = Override(channel), FeedHold(channel)
        self.all, self.functions = AcknowledgeAll(hli, self.keep), 0
        self.scans = self.answers = self.wrong = 0

    def keep(self, function):
        self.functions += function.kind == "M"

    def cyclic(self):
        self.scans += 1
        self.all()
        at = self.state.dist_prog_start
        self.ahead(start_position=at, length=50_000.0)
        if self.ahead.done:
            self.answers += 1
            asked, found = self.ahead.answer_request, self.ahead.blocks
            if len(found):
                first = found[0]
                end = first["start_position"] + first["length"]
                self.wrong += not end > asked.start_position - 0.5
        turn = self.scans % 5000
        self.override(100 if turn < 3000 else 60)
        self.hold(4000 < turn < 4100)

    def result(self):
        return {"scans": self.scans, "answers": self.answers,
                "wrong": self.wrong, "functions": self.functions}
"""
Ns = npt.NDArray[np.int64]


def histogram(ns: Ns) -> dict[str, int]:
    """How many lie below each power of two, us, and not below the one before."""
    limits = [0, *(1000 << k for k in POWERS), np.iinfo(np.int64).max]
    counts = np.histogram(ns, limits)[0]
    names = [*(f"<{1 << k}" for k in POWERS), f">={1 << POWERS[-1]}"]
    return {name: int(n) for name, n in zip(names, counts, strict=True) if n}


def held() -> dict[str, int]:
    """Memory in bytes and descriptors of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return {
        "memory": pages * os.sysconf("SC_PAGE_SIZE"),
        "descriptors": len(os.listdir("/proc/self/fd")),
    }


def drive(folder: Path, seconds: float) -> dict[str, Any]:
    """The CNC in this process, the PLC beside it."""
    for name, text in (
        ("part.nc", PROGRAM),
        ("plc.py", PLC),
        ("cell.toml", CONFIG),
    ):
        (folder / name).write_text(text)
    segment = f"hour-{os.getpid()}-{secrets.token_hex(4)}"
    options = CncOptions(
        folder / "part.nc",
        segment,
        RunOptions(clock="realtime", max_wall=seconds),
        config=folder / "cell.toml",
        report=folder / "cnc.json",
    )
    cnc = CncProcess(options)
    times = cnc.engine.time_cycles(int(seconds * 1000))
    for column in times:
        column.fill(0)  # this memory is ours, and there from the start
    looks: list[dict[str, int]] = []
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=(ended, looks))
    watcher.start()
    report = folder / "plc.json"
    words = ("--name", segment, "--file", "plc.py", "--once")
    plc = subprocess.Popen(
        [sys.executable, "-P", "-m", "plc_client", *words, "--report", report],
        cwd=folder,
    )
    try:
        cnc.run()
    finally:
        ended.set()
        watcher.join()
        plc.wait(60.0)
    timed = cnc.engine.timed
    return told(
        cnc.report(), json.loads(report.read_text()), times, timed, looks
    )


def watch(ended: threading.Event, looks: list[dict[str, int]]) -> None:
    """A look each minute, and one at the end."""
    while not ended.wait(MINUTE_S):
        looks.append(held())


def told(
    cnc: dict[str, Any],
    plc: dict[str, Any],
    times: tuple[Ns, ...],
    timed: int,
    looks: list[dict[str, int]],
) -> dict[str, Any]:
    """What is printed."""
    names = ("cycle_us", "late_us", "rehearsal_us")
    figures = {
        name: {**quantiles_us(ns[:timed]), "histogram": histogram(ns[:timed])}
        for name, ns in zip(names, times, strict=True)
    }
    late = ("planner_late", "planner_late_cycles", "planner_away_s")
    return {
        **figures,
        "handshake_ns": plc["handshake_ns"],
        "cycles": cnc["cycles"],
        "overruns": cnc["overruns"],
        "requests": cnc["requests"],
        "functions": cnc["channels"][0]["techno_functions"],
        "plc": plc["result"],
        "plc_overruns": plc["overruns"],
        **{name: cnc[name] for name in late},
        "planner_us_per_ms": cnc["planner_us_per_ms"],
        "first": looks[0] if looks else {},
        "last": looks[-1] if looks else {},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--log", type=Path)
    args = parser.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        found = drive(Path(folder), args.seconds)
    found["seconds"] = round(time.monotonic() - began, 1)
    text = json.dumps(found, indent=1)
    if args.log:
        args.log.write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
