"""The monitor's page in Chromium: frame time, CPU time, memory over a while.

    python bench/monitor_browser.py [--seconds 60]

The bundled part runs in real time at cycles of 1 ms beside the demo's PLC.  The
page has the scope and ten watched symbols.  Prints one JSON object: mean, p99
and longest time between two frames that the page draws (ms), shares of one
processor, and what server and page hold (MiB) at even times.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from cnc_core.commands.demo_run import CONFIG, demo_program
from monitor_pages import WATCHED, cpu_s

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from support.browser import Browser, Tab  # noqa: E402 (found by the path above)

PASS_S = 5.0  # less than the machine time of a pass
SAMPLES = 20
FRAMES = """window.gaps = []; window.before = performance.now();
(function each() { const now = performance.now(); gaps.push(now - before);
before = now; if (gaps.length > 100000) gaps.shift(); requestAnimationFrame(each); })()"""


def children_of(pid: int) -> list[int]:
    """A process and all below it."""
    found = [pid]
    for each in found:
        tasks = Path(f"/proc/{each}/task")
        for task in tasks.iterdir() if tasks.exists() else ():
            found += map(int, (task / "children").read_text().split())
    return found


def resident_mib(pid: int) -> float:
    """Memory of a process."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def measured(tab: Tab, server: int, browser: int, seconds: float) -> Any:
    """What the page costs while it is open."""
    watched = "".join(f"machine.watch.add('{path}');" for path in WATCHED)
    tab.until("machine.path && machine.path.trail.length > 20")
    tab.js(watched)
    tab.js(FRAMES)
    tab.do("HeapProfiler.enable")
    shares = {"server": [server], "browser": children_of(browser)}
    before = {k: sum(map(cpu_s, v)) for k, v in shares.items()}
    begin, memory = time.monotonic(), []
    for k in range(1, SAMPLES + 1):
        time.sleep(max(0.0, begin + k * seconds / SAMPLES - time.monotonic()))
        try:
            tab.do("HeapProfiler.collectGarbage")
            heap = tab.do("Runtime.getHeapUsage")["usedSize"] / 2**20
        except TimeoutError:  # the machine is busy with something else
            continue
        told = round(heap, 2), round(resident_mib(server), 1)
        memory.append([round(time.monotonic() - begin), *told])
    took = time.monotonic() - begin
    gaps = sorted(tab.js("gaps"))
    return {
        "seconds": took,
        "frame_ms": {
            "mean": sum(gaps) / len(gaps),
            "p99": gaps[int(0.99 * len(gaps))],
            "max": gaps[-1],
            "n": len(gaps),
        },
        "cpu": {
            k: (sum(map(cpu_s, v)) - before[k]) / took
            for k, v in shares.items()
        },
        "memory_s_page_server": memory,
        "status": tab.text("#status"),
        "console": tab.said,
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=60.0)
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        part = folder / "part.nc"
        part.write_text(demo_program(int(seconds / PASS_S) + 20))
        cell = f"hli-bench-{os.getpid()}"
        cli = [sys.executable, "-P", "-m", "cnc_core.cli"]
        plc = "-P -m plc_client --builtin demo --name"
        config = "--config", str(CONFIG)
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
            tab.size(1400, 1500)
            tab.go(server.stdout.readline().strip())
            found = measured(tab, server.pid, browser.pid, seconds)
            sys.stdout.write(json.dumps(found) + "\n")
        finally:
            browser.close()
            for process in processes[::-1]:
                process.terminate()
                process.wait()


if __name__ == "__main__":
    main()
