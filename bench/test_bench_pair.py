"""The pair: how much faster than real time CNC and PLC run together, at 1 ms,
and the CNC with nothing attached.

``pytest bench/test_bench_pair.py --benchmark-enable``; figures stand in
``extra_info``. Nothing timed is asserted. In lockstep the two processes wait
for each other once a millisecond of machine time, spinning: two free cores are
needed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core import Cell
from plc_client.mock import line
from plc_client.runner import PlcRunner

README = Path(__file__).parents[1] / "README.md"
HEAD = "from plc_client import ContourAhead, Override, task\n@task(interval=0.001)\n"
PLC = {
    "empty": HEAD + "class Task:\n    def cyclic(self): pass\n",
    # mode 2 and override in every scan
    "readme": README.read_text().split("```python\n")[1].split("```")[0],
    "contract": (  # mode 2 in every scan, the radii looked at
        "from plc_client import ContourLookahead, task\n"
        "@task(interval=0.001)\n"
        "class OverrideFromContour:\n"
        "    def setup(self, hli):\n"
        "        self.ch = hli.gpCh[0]\n"
        "        self.clah = ContourLookahead(self.ch.contour_lookahead)\n"
        "    def cyclic(self):\n"
        "        self.clah(start_position=self.ch.bahn_state.dist_prog_start, length=50_000.0)\n"
        "        if self.clah.done:\n"
        "            radius = self.clah.blocks['compensated_radius']\n"
        "            percent = 600 if (radius > 0).any() else 1000\n"
        "            self.ch.bahn_mc_control.override.command_w = percent\n"
    ),
    "look_ahead": HEAD
    + (
        "class Task:\n"
        "    def setup(self, hli):\n"
        "        self.ahead, self.override = ContourAhead(hli.gpCh[0]), Override(hli.gpCh[0])\n"
        "    def cyclic(self):\n"
        "        arcs = self.ahead()['compensated_radius'] > 0\n"
        "        self.override(path=60.0 if arcs[:20].any() else 100.0)\n"
    ),
}


WAVE = f"import math\n{HEAD}" + (
    "class Task:\n"
    "    def setup(self, hli):\n"
    "        self.override, self.t = Override(hli.gpCh[0]), 0.0\n"
    "    def cyclic(self):\n"
    "        self.t += 0.001\n"
    "        self.override(path=60.0 + 40.0 * math.sin(9.0 * self.t))\n"
)
"""Another override in every scan."""


def contour(folder: Path, points: int) -> Path:
    """A wavy contour whose points are smoothed within 0.01 mm, F6000."""
    angle = 2 * np.pi * np.arange(points) / 2500
    radius = 40 + 8 * np.sin(7 * angle) + 2 * np.sin(31 * angle)
    lines = [
        f"X{r * np.cos(a):.4f} Y{r * np.sin(a):.4f}"
        for a, r in zip(angle, radius, strict=True)
    ]
    path = folder / "contour.nc"
    head = [
        f"G90 G00 {lines[0]}",
        "#HSC ON [BSPLINE PATH_DEV=0.01]",
        "G01 F6000",
    ]
    path.write_text("\n".join([*head, *lines[1:], "#HSC OFF", "M30", ""]))
    return path


def part(folder: Path, minutes: float) -> Path:
    """Lines of 100 mm at 100 mm/s."""
    path = folder / "part.nc"
    lines = [
        f"X{100 * (i % 2)} Y{i * 0.1:.1f}" for i in range(round(minutes * 60))
    ]
    path.write_text("\n".join(["G01 F6000", *lines, "M30", ""]))
    return path


@pytest.mark.parametrize("name", ["none", "acknowledge", *PLC])
def test_pair(benchmark: Any, tmp_path: Path, name: str) -> None:
    """Lockstep with a Python PLC; ``none``: nothing attached."""
    program = part(tmp_path, 1.0 if name != "none" else 20.0)
    plc: Any = (
        name
        if name == "none"
        else None
        if name == "acknowledge"
        else tmp_path / "plc.py"
    )
    if name in PLC:
        plc.write_text(PLC[name])

    def run() -> Any:
        with Cell() as cell:
            return cell.run(program, plc)

    result = benchmark.pedantic(run, rounds=1)
    assert result.end == "completed"
    tasks = result.plc.get("tasks", {})
    scans = {name: task["mean_us"] for name, task in tasks.items()}
    benchmark.extra_info.update(
        realtime_factor=result.realtime_factor,
        cycles=result.cycles,
        mean_scan_us=scans,
    )


@pytest.mark.parametrize("name", ["none", "empty", "wave"])
def test_contour(benchmark: Any, tmp_path: Path, name: str) -> None:
    """4000 smoothed points in lockstep: times real time, and what a cycle takes
    of the wall's time.  ``wave``: another override in every scan.
    """
    program, plc = contour(tmp_path, 4000), tmp_path / "plc.py"
    plc.write_text(WAVE if name == "wave" else PLC["empty"])

    def run() -> Any:
        with Cell() as cell:
            return cell.run(program, "none" if name == "none" else plc)

    result = benchmark.pedantic(run, rounds=3, warmup_rounds=1)
    assert result.end == "completed"
    benchmark.extra_info.update(
        realtime_factor=result.realtime_factor,
        us_per_cycle=1e6 * result.wall_time_s / result.cycles,
    )


class Empty:
    """What the runtime itself costs."""

    def cyclic(self) -> None:
        pass


def test_scan_cost(benchmark: Any) -> None:
    """One scan of an empty task: latch, schedule, statistics."""
    with PlcRunner.on_mock(Empty, [line(1)]) as plc:
        scanner = plc._scanner

        def scan() -> None:
            for program in scanner.programs:
                program.due = 0
            scanner.scan()

        benchmark(scan)
