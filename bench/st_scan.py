"""A PLC program in Structured Text that looks ahead: time of its scan, and how fast
the pair runs in lockstep beside other PLCs and the CNC alone.

``python bench/st_scan.py [ROUNDS]``; the rounds alternate, the best of each counts, so
the ratios hold on a busy machine, too.

An order that changes with the speed makes the planner plan anew in each of those cycles.
That time belongs to the CNC, whoever orders.  So there are two pairs of equal jobs:
with such an order, in Structured Text and in Python; and without one, in Structured Text
and the built-in PLC, which only acknowledges.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from cnc_core import Cell

ZONES = 40
HEAD = """PROGRAM MAIN
VAR
  clah : ContourLookahead;
  feed : FeedControl;
  timer : ARRAY [1..8] OF TON;
  level : ARRAY [1..40] OF LREAL;
  i, arcs : INT;
  percent : LREAL := 100.0;
  feed_now : LREAL;
END_VAR
clah(start_position := gpCh[0]^.bahn_state.dist_prog_start, length := 50_000.0);
IF clah.done THEN
  arcs := 0;
  FOR i := 0 TO clah.count - 1 DO
    IF clah.blocks[i].compensated_radius > 0.0 THEN
      arcs := arcs + 1;
    END_IF
  END_FOR
END_IF
percent := SEL(arcs > 0, 100.0, 60.0);
feed_now := TO_LREAL(gpCh[0]^.bahn_state.active_feed_r);
"""
ORDER = "feed(override := percent);"
NO_ORDER = "feed(override := 100.0);"
EMPTY = "PROGRAM MAIN\nVAR n : INT; END_VAR\nEND_PROGRAM\n"


PYTHON = """
from plc_client import TON, ContourLookahead, FeedControl, task

@task(interval=0.001)
class Task:
    def setup(self, hli):
        self.ch = hli.gpCh[0]
        self.clah = ContourLookahead(self.ch.contour_lookahead)
        self.feed = FeedControl(self.ch.bahn_mc_control)
        self.level = [0.0] * 41
        self.timer = [TON() for _ in range(9)]
        self.arcs = 0

    def cyclic(self):
        self.clah(start_position=self.ch.bahn_state.dist_prog_start, length=50_000.0)
        if self.clah.done:
            self.arcs = int((self.clah.blocks["compensated_radius"] > 0.0).sum())
        percent = 60.0 if self.arcs else 100.0
        feed, level = float(self.ch.bahn_state.active_feed_r), self.level
        for k in range(1, 41):
            level[k] = 0.9 * level[k] + 0.1 * feed / k
            if level[k] > k * 100.0 and not self.arcs:
                percent = min(percent, 120.0 - k)
        for k in range(1, 9):
            self.timer[k](level[k] > 10.0, k * 0.001)
        self.feed(override=percent)
"""


def program(order: str = ORDER) -> str:
    """About 200 lines, all of them executed."""
    lines = []
    for k in range(1, ZONES + 1):
        lines += [
            f"level[{k}] := 0.9 * level[{k}] + 0.1 * feed_now / {k}.0;",
            f"IF level[{k}] > {k}00.0 AND arcs = 0 THEN",
            f"  percent := MIN(percent, {120 - k}.0);",
            "END_IF",
        ]
    lines += [
        f"timer[{k}](IN := level[{k}] > 10.0, PT := T#{k}ms);"
        for k in range(1, 9)
    ]
    return "\n".join([HEAD, *lines, order, "END_PROGRAM", ""])


def part(folder: Path, seconds: int) -> Path:
    """Lines of 100 mm at 100 mm/s."""
    path = folder / "part.nc"
    lines = [f"X{100 * (i % 2)} Y{i * 0.1:.1f}" for i in range(seconds)]
    path.write_text("\n".join(["G01 F6000", *lines, "M30", ""]))
    return path


def run(nc: Path, plc: Path | str | None) -> tuple[float, dict[str, Any]]:
    """(times real time, statistics of the task)."""
    with Cell() as cell:
        result = cell.run(nc, plc)
    assert result.end == "completed", result.errors
    tasks = (result.plc or {}).get("tasks", {})
    return result.realtime_factor, next(iter(tasks.values()), {})


def main() -> None:
    """Print a table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        nc = part(folder, 30)
        (folder / "order.st").write_text(program())
        (folder / "order.py").write_text(PYTHON)
        (folder / "ahead.st").write_text(program(NO_ORDER))
        (folder / "empty.st").write_text(EMPTY)
        plcs: dict[str, Path | str | None] = {
            "ST, looks, orders": folder / "order.st",
            "Python, the same": folder / "order.py",
            "ST, looks ahead": folder / "ahead.st",
            "ST, empty": folder / "empty.st",
            "built-in": None,
            "CNC alone": "none",
        }
        found: dict[str, list[tuple[float, dict[str, Any]]]] = {}
        for _ in range(rounds):
            for key, plc in plcs.items():
                found.setdefault(key, []).append(run(nc, plc))
    count = program().count("\n")
    print(f"{count} lines; best of {rounds}")
    for key, rows in found.items():
        speed = max(row[0] for row in rows)
        best = min((row[1] for row in rows), key=lambda t: t.get("mean_us", 0))
        told = ", ".join(
            f"{k} {best[k]:.2f}" for k in ("min_us", "mean_us") if k in best
        )
        print(f"{key:18} {speed:8.0f} times real time  {told}")


if __name__ == "__main__":
    main()
