"""Six realistic jobs, three in each of two dialects: machining time beside what
length over feed and the turnarounds make.

``python bench/dialect_jobs.py [FOLDER]`` writes programs and cells into the
folder, plans them, and prints a table.  docs/measurements/dialect_jobs.md has
its figures.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cnc_core.config import CellConfig, load_config
from cnc_core.planning import plan_program
from cnc_core.program import Program
from cnc_core.units import FloatArray

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
JERK, ACC = 50_000.0, 3000.0  # of the built-in machine
SETUP_3 = """(PNT,AXI,AXI,QUI)
(VER,REL,PRG,PRG)
(JRK,ENA,,,400,150,200)
(THR,0.01,0.0001,0,0.0,0.05)
(TOL,,,0,-90,)
(TOD,0,0,1)
(CRV,1,6,G63)
(EDG,30,0,G66,1)
(AXI,X,1,ABS,LI1)
(AXP,X,0,,,)
(DIN,X,,,,,,)
(AXI,Y,2,ORD,LI2)
(AXP,Y,0,,,)
(DIN,Y,,,,,,)
(AXI,Z,3,VRT,LI3)
(AXP,Z,0,,,)
(DIN,Z,,,,,,)
"""


@dataclass(frozen=True)
class Job:
    """``estimate``: s, length over feed and turnarounds."""

    name: str
    path: Path
    cell: CellConfig
    estimate: float


def rest_to_rest(length: float, feed: float) -> float:
    """s over a line from rest to rest, one axis, mm and mm/s."""
    full = ACC / JERK
    v = min(feed, 0.5 * ACC * (np.sqrt(full**2 + 4 * length / ACC) - full))
    if v < ACC * full:  # no constant acceleration
        v = min(feed, (0.5 * length * np.sqrt(JERK)) ** (2.0 / 3.0))
        ramp = np.sqrt(v / JERK)
        return float(4 * ramp + (length - 2 * v * ramp) / v)
    return float(length / v + v / ACC + full)


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _words(names: str, row: FloatArray) -> str:
    return "".join(f"{n}{v:.5f}" for n, v in zip(names, row, strict=True))


def finishing(folder: Path) -> Iterator[Job]:
    """160 passes of 125 points over a wavy surface, 6000 mm/min."""
    x = np.linspace(0.0, 100.0, 125)
    passes = [
        np.stack(
            [
                x if i % 2 == 0 else x[::-1],
                np.full(125, 0.5 * i),
                3
                * np.sin((x if i % 2 == 0 else x[::-1]) / 15)
                * np.cos(i / 24),
            ],
            1,
        )
        for i in range(160)
    ]
    points = np.concatenate(passes)
    stop = rest_to_rest(100.0, 100.0) - 1.0
    estimate = sum(_length(one) / 100.0 + stop for one in passes)
    estimate += 159 * rest_to_rest(0.5, 100.0)
    lines = [_words("XYZ", row) for row in points]
    isons = folder / "finishing.isons"
    isons.write_text(
        "\n".join(["G60", "F6", *("G1" + line for line in lines)]) + "\n"
    )
    yield Job("3-axis finishing, IsoNs", isons, CellConfig(), estimate)
    (folder / "CONFIG3").write_text(SETUP_3)
    osai = folder / "finishing.osai"
    head = ["G1X0Y0Z0F6000", "(HSM,CONFIG3)", "G61", lines[0] + "F6000"]
    osai.write_text("\n".join([*head, *lines[1:], "G60"]) + "\n")
    yield Job("3-axis finishing, OSAI", osai, CellConfig(), estimate)


def tipped(folder: Path) -> Iterator[Job]:
    """A spiral of 12 turns over a dome, the tool sways; 2000 mm/min."""
    share = np.linspace(0.0, 1.0, 4000)
    phi = 24 * np.pi * share
    r = 15 + 15 * share
    tip = np.stack(
        [r * np.cos(phi), r * np.sin(phi), np.sqrt(1600 - r * r) - 40], 1
    )
    lean, turn = 10 + 5 * np.cos(phi), 40 * np.sin(phi)
    estimate = _length(tip) / (2000.0 / 60.0)
    rows = np.column_stack([tip, lean, turn])
    path = folder / "spiral.isons"
    lines = ["G1" + _words("XYZBC", row) for row in rows[1:]]
    start = "G0" + _words("XYZBC", rows[0])
    path.write_text(
        "\n".join(["T1", "G60", "F2", "G104", start, *lines, "G105"]) + "\n"
    )
    cell = load_config(EXAMPLES / "five_axis" / "head_head.toml")
    yield Job("5-axis RTCP, IsoNs", path, cell, estimate)
    osai = EXAMPLES / "osai"
    setup = (osai / "CONFIG1").read_text()
    (folder / "CONFIG5").write_text(setup)
    d = np.column_stack(
        [
            np.sin(np.radians(lean)) * np.cos(np.radians(turn)),
            np.sin(np.radians(lean)) * np.sin(np.radians(turn)),
            np.cos(np.radians(lean)),
        ]
    )
    body = [_words("XYZijk", row) for row in np.column_stack([tip, d])]
    path = folder / "spiral.osai"
    begin = _words(
        "XYZAB", np.array([*(tip[0] + 346.5 * d[0]), turn[0], lean[0]])
    )
    head = [f"G0{begin}", "(HSM,CONFIG5)", "G61", body[0] + "F2000"]
    path.write_text("\n".join([*head, *body[1:], "G60"]) + "\n")
    yield Job(
        "5-axis RTCP, OSAI", path, load_config(osai / "cell.toml"), estimate
    )


def laser(folder: Path) -> Iterator[Job]:
    """120 rings of 72 chords at 4000 mm/min; a macro (a profile) for each."""
    (folder / "M60.isons").write_text("$_O1=1\n")
    (folder / "M61.isons").write_text("$_O1=0\n")
    (folder / "CONFIG3").write_text(SETUP_3)
    angle = np.linspace(0.0, 2 * np.pi, 73)
    feed = 4000.0 / 60.0
    ring = np.stack([4 * np.cos(angle), 4 * np.sin(angle)], 1)
    isons, osai = ["G60", "F4"], ["G1X0Y0Z0F4000", "(HSM,CONFIG3)"]
    estimate, here = 0.0, np.zeros(2)
    for i in range(120):
        centre = np.array([12.0 * (i % 10), 12.0 * (i // 10)])
        points = ring + centre
        way = np.abs(points[0] - here)
        estimate += max(rest_to_rest(w, 300.0) for w in way if w > 0)
        estimate += rest_to_rest(_length(points), feed)
        here = points[-1]
        lines = [_words("XY", row) for row in points]
        isons += ["G0" + lines[0], "M60", *("G1" + s for s in lines[1:]), "M61"]
        osai += [
            f"G0{lines[0]}",
            "G61",
            lines[0] + "Z0F4000",
            *lines[1:],
            "G60",
        ]
    for name, text in (("laser.isons", isons), ("laser.osai", osai)):
        (folder / name).write_text("\n".join(text) + "\n")
    yield Job("laser, IsoNs", folder / "laser.isons", CellConfig(), estimate)
    yield Job("laser, OSAI", folder / "laser.osai", CellConfig(), estimate)


def main(folder: Path) -> None:
    """Plan all jobs and print the table."""
    print("| Job | estimate, s | planned, s | ratio | largest of the limits |")
    print("|---|---|---|---|---|")
    for kind in (finishing, tipped, laser):
        for job in kind(folder):
            result = plan_program(Program(job.path, job.cell))
            most = max(v for v in result.max_ratio.values() if v is not None)
            print(
                f"| {job.name} | {job.estimate:.1f} | {result.motion_time_s:.1f}"
                f" | {result.motion_time_s / job.estimate:.3f} | {most:.3f} |",
                flush=True,
            )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as made:
            main(Path(made))
