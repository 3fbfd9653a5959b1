"""The monitor's page in Chromium: frame time, CPU time, memory over a while.

    python bench/monitor_browser.py [--seconds 60]
    python bench/monitor_browser.py --seconds 3600 --log memory.jsonl [--cycle 0.01]

The bundled part runs in real time at cycles of 1 ms, or of ``--cycle`` seconds,
beside the demo's PLC.  The
page has the scope and ten watched symbols.  Prints one JSON object: mean, p99
and longest time between two frames that the page draws (ms), shares of one
processor, and what server and page hold at even times.

Memory is looked at 20 times, or once a minute.  ``--log`` writes each look as a
line at once.  ``growth_mib_an_hour`` is the slope of a straight line through the
second half of the looks.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from cnc_core.commands.demo_run import CONFIG, demo_program
from monitor_pages import WATCHED, cpu_s

PATIENCE_S = 300.0  # for the browser, beside much else
ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from support.browser import Browser, Tab  # noqa: E402 (found by the path above)

PASS_S = 5.0  # less than the machine time of a pass
LOOKS = 20  # at memory, or more
LOOK_S = 60.0  # between two of them at the most
COUNTED = ("Nodes", "Documents", "JSEventListeners")  # that the page holds
FRAMES = """window.gaps = new Float64Array(100000); window.frame = 0;
window.before = performance.now();
(function each() { const now = performance.now();
gaps[frame++ % gaps.length] = now - before; before = now;
requestAnimationFrame(each); })()"""
COUNT = """machine.samples = 0; machine.took = machine.path.take;
machine.path.take = function (frame) { machine.samples += (frame.trail || []).length;
machine.took.call(this, frame); }"""
NOTED = "[...gaps.slice(0, Math.min(frame, gaps.length))]"


def children_of(pid: int) -> list[int]:
    """A process and all below it."""
    found = [pid]
    for each in found:
        tasks = Path(f"/proc/{each}/task")
        for task in tasks.iterdir() if tasks.exists() else ():
            found += map(int, (task / "children").read_text().split())
    return found


def resident_mib(pid: int) -> float:
    """Memory of a process, its share of what several hold together."""
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1024
    return 0.0


def looked(tab: Tab, server: int, browser: list[int]) -> dict[str, float]:
    """What page and server hold: MiB, nodes, listeners, open files."""
    tab.do("HeapProfiler.collectGarbage")
    heap = tab.do("Runtime.getHeapUsage")["usedSize"] / 2**20
    metrics = tab.do("Performance.getMetrics")["metrics"]
    return {
        "page_heap_mib": round(heap, 2),
        "browser_mib": round(sum(map(resident_mib, browser)), 1),
        "server_mib": round(resident_mib(server), 2),
        "server_files": len(os.listdir(f"/proc/{server}/fd")),
        "samples": tab.js("machine.samples"),
        "drawn": tab.js("frame"),
        **{
            each["name"]: each["value"]
            for each in metrics
            if each["name"] in COUNTED
        },
    }


def looks(
    tab: Tab, server: int, browser: int, seconds: float, log: TextIO | None
) -> Iterator[dict[str, float]]:
    """Memory at even times until the end."""
    count = max(LOOKS, round(seconds / LOOK_S))
    begin = time.monotonic()
    for k in range(1, count + 1):
        time.sleep(max(0.0, begin + k * seconds / count - time.monotonic()))
        try:
            found = looked(tab, server, children_of(browser))
        except TimeoutError:  # the machine is busy with something else
            continue
        row = {"s": round(time.monotonic() - begin, 1), **found}
        if log is not None:
            log.write(json.dumps(row) + "\n")
            log.flush()
        yield row


def growth(rows: list[dict[str, float]]) -> dict[str, float]:
    """Slopes over the second half, MiB an hour."""
    late = rows[len(rows) // 2 :]
    hours = [row["s"] / 3600 for row in late]
    names = [name for name in late[0] if name.endswith("_mib")]
    return {
        name: round(
            float(np.polyfit(hours, [row[name] for row in late], 1)[0]), 2
        )
        for name in names
    }


def frames(tab: Tab) -> dict[str, float]:
    """Times between two frames, ms."""
    gaps = sorted(tab.js(NOTED))
    return {
        "mean": sum(gaps) / len(gaps),
        "p99": gaps[int(0.99 * len(gaps))],
        "max": gaps[-1],
        "n": len(gaps),
    }


def prepare(tab: Tab) -> None:
    """Watch ten symbols, and note the frames."""
    tab.until("machine.path && machine.path.trail.length > 20", PATIENCE_S)
    tab.js(COUNT)
    tab.js("".join(f"machine.watch.add('{path}');" for path in WATCHED))
    tab.js(FRAMES)
    for domain in ("HeapProfiler", "Performance"):
        tab.do(f"{domain}.enable")


def measured(
    tab: Tab, server: int, browser: int, args: argparse.Namespace
) -> Any:
    """What the page costs while it is open."""
    prepare(tab)
    shares = {"server": [server], "browser": children_of(browser)}
    before = {k: sum(map(cpu_s, v)) for k, v in shares.items()}
    begin = time.monotonic()
    rows = list(looks(tab, server, browser, args.seconds, args.log))
    took = time.monotonic() - begin
    return {
        "seconds": took,
        "frame_ms": frames(tab),
        "cpu": {
            k: (sum(map(cpu_s, v)) - before[k]) / took
            for k, v in shares.items()
        },
        "growth_mib_an_hour": growth(rows),
        "memory": rows,
        "status": tab.text("#status"),
        "console": tab.said,
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--cycle", type=float, default=0.001)
    parser.add_argument("--log", type=argparse.FileType("w"))
    args = parser.parse_args()
    seconds = args.seconds
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        part = folder / "part.nc"
        part.write_text(demo_program(int(seconds / PASS_S) + 20))
        cell = f"hli-bench-{os.getpid()}"
        cli = [sys.executable, "-P", "-m", "cnc_core.cli"]
        plc = "-P -m plc_client --builtin demo --name"
        slower = folder / "cell.toml"
        told = f"cycle_s = {args.cycle}"
        slower.write_text(CONFIG.read_text().replace("cycle_s = 0.001", told))
        config = "--config", str(slower)
        clock = "--clock", "realtime"
        words = (
            [*cli, "cnc", str(part), *config, "--name", cell, *clock],
            [sys.executable, *plc.split(), cell],
            [*cli, "monitor", cell, "--port", "0"],
        )
        processes = [
            subprocess.Popen(
                each,
                stdout=subprocess.PIPE if "monitor" in each else None,
                stderr=subprocess.DEVNULL,
                text=True,
            )
            for each in words
        ]
        server = processes[-1]
        browser = Browser(folder / "profile")
        try:
            assert server.stdout is not None
            tab = browser.tab()
            tab.answer_s = PATIENCE_S
            tab.size(1400, 1500)
            tab.go(server.stdout.readline().strip())
            found = measured(tab, server.pid, browser.pid, args)
            sys.stdout.write(json.dumps(found) + "\n")
        finally:
            browser.close()
            for process in processes[::-1]:
                process.terminate()
                process.wait()


if __name__ == "__main__":
    main()
