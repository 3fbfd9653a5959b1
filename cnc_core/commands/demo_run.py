"""``demo``: the main job on a bundled part, with a summary and a picture."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hli import bench as raw

from ..benchmarks import N_BLOCKS, quantiles_us
from ..cell import Cell, RunResult
from ..config import CellConfig, load_config
from ..planning import plan_program
from ..planning.demo_picture import demo_picture
from ..planning.picture import can_draw
from ..program import Program
from .console import err, say_run_errors
from .monitor import Beside, need_server, own_name, stay

PASS_S = 8.3  # one pass of the part with the PLC's override
SLOWER = 1.3  # the same, compared with the plan, which knows no PLC


@dataclass
class DemoResult:
    """What the demo shows: the run, the PLC's own account, the raw handshake
    reference, the files written.
    """

    run: RunResult
    plc: dict[str, Any]
    raw_us: dict[str, float]
    folder: Path
    drawn: bool = True
    told: str = ""  # what the picture shows

    def as_json(self) -> dict[str, Any]:
        out = self.run.as_json()
        plc = dict(self.run.plc)
        plc.pop("result", None)
        out["plc"] = plc
        keys = ("elements_followed", "log_entries", "lowest_override")
        return (
            out
            | {"raw_us": self.raw_us, "out": str(self.folder)}
            | {k: self.plc.get(k) for k in keys}
        )


def demo_program(passes: int, rest: int = 0) -> str:
    """A part with long lines, large and small arcs and sharp corners, marked
    for mode 1, driven ``passes`` times and then its first ``rest`` blocks.
    """
    head = [
        "%demo",
        "( bundled part of hli-cosim: lines, large and small radii, sharp corners )",
        "N10 G17 G90 G71",
    ]
    head += [
        "N20 G00 X0 Y0 Z5",
        "N30 T1 D1",
        "N40 S8000 M3",
        "N50 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]",
        "N60 G01 Z0 F3000",
    ]
    lines = list(head)
    for i in range(passes + (rest > 0)):
        lines += _one_pass(i)[: rest if i == passes else None]
        if i == 0:
            lines.append("#CONTOUR LOOKAHEAD LOG OFF [PARAM=2]")
    return "\n".join([*lines, "G00 Z20", "M5", "M30", ""])


def _one_pass(i: int) -> list[str]:
    z = -0.5 * (i + 1)
    out = [
        f"G01 Z{z:.2f} F2000",
        "G01 X60 Y0 F6000",
        "G03 X70 Y10 I0 J10",
        "G01 X70 Y40",
    ]
    out += [
        "G03 X66 Y44 I-4 J0",
        "G01 X50 Y44",
        f"#CONTOUR LOOKAHEAD LOG [PARAM={i + 10}]"
        if i == 0
        else "( next pass )",
    ]
    out += [
        "G02 X48 Y46 I0 J2",
        "G01 X48 Y58",
        "G03 X28 Y58 I-10 J0",
        "G01 X28 Y40",
        "X20 Y30",
        "X10 Y44",
        "X0 Y30",
    ]
    for k in range(1, 41):  # a wave of short blocks
        y = 30.0 - 30.0 * k / 40
        out.append(f"X{6.0 * math.sin(2.0 * math.pi * k / 20):.4f} Y{y:.4f}")
    return [*out, "X0 Y0"]


def timed_program(seconds: float, program: Path, cell: CellConfig) -> None:
    """Write a program that takes about ``seconds``, or as little as it can."""
    passes, rest_s = divmod(seconds, PASS_S)

    def too_long(blocks: int) -> bool:
        program.write_text(demo_program(0, blocks))
        planned = plan_program(Program(program, cell, "isg"))
        return planned.motion_time_s * SLOWER > rest_s

    blocks = range(1, len(_one_pass(0)) + 1)
    rest = bisect_left(blocks, True, key=too_long)
    if not passes:
        rest = max(rest, 1)
    program.write_text(demo_program(int(passes), rest))


CONFIG = Path(__file__).parents[1] / "data" / "cell.toml"
PAGE_S = 120.0  # how long the demo waits for somebody to open its page


def show_demo(seconds: float, folder: Path) -> None:
    """The same in real time with a page in the browser, which stays open."""
    need_server()
    program, recording = _files(seconds, folder)
    name = own_name()
    with Beside(name, program, CONFIG, recording) as page, Cell(CONFIG) as cell:
        err.print("open it: the machine starts then")
        page.wait_for_page(PAGE_S)
        result = cell.run(
            program,
            "builtin:demo",
            record=recording,
            clock="realtime",
            name=name,
        )
        say_run_errors(result)
        stay()


def _files(seconds: float, folder: Path) -> tuple[Path, Path]:
    """The program, which is written, and the recording."""
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / "demo.nc"
    timed_program(seconds, program, load_config(CONFIG))
    recording = folder / "demo.npz"
    recording.unlink(missing_ok=True)
    return program, recording


def run_demo(seconds: float, folder: Path) -> DemoResult:
    """Run both processes on the bundled part for about ``seconds`` of machine
    time; writes demo.nc, .npz and .png.
    """
    program, recording = _files(seconds, folder)
    with Cell(CONFIG) as cell:
        run = cell.run(program, "builtin:demo", record=recording)
    plc = dict(run.plc.get("result") or {})
    drawn = bool(plc and run.recorded) and can_draw()
    told = ""
    if drawn:
        with np.load(recording) as columns:
            told = demo_picture(folder / "demo.png", dict(columns), plc)
    return DemoResult(
        run,
        plc,
        quantiles_us(raw.measure_raw(N_BLOCKS, 0.5).ns),
        folder,
        drawn,
        told,
    )
