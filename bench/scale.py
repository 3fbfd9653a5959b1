"""What a cell costs where many run at once: the table of docs/scale.md.

``python bench/scale.py [CELLS ..]``: so many cells (1 2 4 8 16 64), each by
``hli-cosim run`` in processes of its own, all at once.  CPU time and memory are
those of the cells alone, so that they hold on a busy machine; the wall time
does not.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

CELLS = (1, 2, 4, 8, 16, 64)
# 0 times and so often: the difference is what the cycles cost
ROUNDS = 6
ROUND = "G1 X30 Y0\nG2 X40 Y10 R10\nG1 Y30\nG3 X30 Y40 R10\nG1 X0\nY0\n"
LOOK_S = 0.2  # between two looks at the memory


@dataclass(frozen=True)
class Cost:
    """Of all cells together."""

    wall_s: float
    cpu_s: float
    memory_mib: float  # most at once; what is shared counts once
    cell_s: float  # time of the cells


def run(cells: int, program: Path, folder: Path) -> Cost:
    """Start so many cells at once and wait for all."""
    words = [sys.executable, "-P", "-m", "cnc_core", "run", str(program)]
    reports = [folder / f"{i}.json" for i in range(cells)]
    begin = time.monotonic()
    running = []
    for report in reports:
        with report.open("w") as out:
            running.append(
                subprocess.Popen(
                    [*words, "--json"],
                    stdout=out,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,
                )
            )
    sessions = {one.pid for one in running}
    most, cpu = 0.0, 0.0
    while sessions:
        most = max(most, memory_mib({one.pid for one in running}))
        time.sleep(LOOK_S)
        for pid in list(sessions):
            ended, _, used = os.wait4(pid, os.WNOHANG)
            if ended:
                sessions.discard(pid)
                cpu += used.ru_utime + used.ru_stime
    wall = time.monotonic() - begin
    told = [json.loads(report.read_text()) for report in reports]
    return Cost(wall, cpu, most, sum(one["sim_time_s"] for one in told))


def memory_mib(sessions: set[int]) -> float:
    """PSS of all processes of these sessions."""
    total = 0.0
    for place in Path("/proc").glob("[0-9]*"):
        try:
            words = (place / "stat").read_text().rpartition(")")[2].split()
            if int(words[3]) not in sessions:
                continue
            for line in (place / "smaps_rollup").read_text().splitlines():
                if line.startswith("Pss:"):
                    total += int(line.split()[1]) / 1024
        except (OSError, IndexError):
            continue
    return total


def main() -> None:
    numbers = [int(word) for word in sys.argv[1:]] or list(CELLS)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        empty, part = folder / "empty.nc", folder / "part.nc"
        empty.write_text("G1 F6000 X0.01\nM30\n")
        part.write_text(f"F6000\n{ROUND * ROUNDS}M30\n")
        print(
            "| Cells | CPU of a start, s | CPU of a second of the cell, ms"
            " | Memory of a cell, MiB | Cell seconds a CPU second |"
        )
        print("|---|---|---|---|---|")
        for cells in numbers:
            idle = run(cells, empty, folder)
            cost = run(cells, part, folder)
            start = idle.cpu_s / cells
            second = (cost.cpu_s - idle.cpu_s) / (cost.cell_s - idle.cell_s)
            print(
                f"| {cells} | {start:.2f} | {second * 1e3:.1f}"
                f" | {cost.memory_mib / cells:.0f} | {1.0 / second:.0f} |",
                flush=True,
            )
            print(
                f"{cells} cells: {cost.wall_s:.1f} s of the wall for"
                f" {cost.cell_s / cells:.1f} s of each cell",
                file=sys.stderr,
            )


if __name__ == "__main__":
    main()
