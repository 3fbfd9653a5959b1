"""``bench``: what this machine does, each figure beside a raw reference taken
in the same run.

Rounds are interleaved, because shared machines drift.  Nothing here asserts;
tests do not time.
"""

from __future__ import annotations

import functools
import os
import secrets
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hli import bench as raw
from hli import layout
from hli.handshake import ContourUnit
from hli.segment import create
from hli.view import BLOCK_DTYPE

from ..config import CellConfig
from ..engine import Engine, Event, bare_loop
from ..planning import Feeder, plan_program
from ..process.options import CncOptions, RunOptions
from ..program import Program
from .workloads import (
    HOSTILE,
    WORKLOADS,
    Workload,
    contour_points,
    write_program,
)

# elements an answer carries: 64 x 72 bytes, about the 4.4 KB of published
# comparisons
N_BLOCKS = 64
ROUNDS = 3
# marked elements of the benchmark program; with ON and OFF the whole default
# log
MARKED = 126
Ns = npt.NDArray[np.int64]


def quantiles_us(ns: Ns) -> dict[str, float]:
    """p50, p99, p999 and max in us."""
    if not len(ns):
        return {"p50": 0.0, "p99": 0.0, "p999": 0.0, "max": 0.0}
    p50, p99, p999 = (
        float(q) / 1000.0 for q in np.quantile(ns, [0.5, 0.99, 0.999])
    )
    return {
        "p50": p50,
        "p99": p99,
        "p999": p999,
        "max": float(ns.max()) / 1000.0,
    }


def _marked_program(folder: Path) -> Path:
    lines = ["#CONTOUR LOOKAHEAD LOG ON [PARAM=1]", "F1000"]
    lines += [f"N{i + 1} G1 X{0.01 * (i + 1):.2f}" for i in range(MARKED)]
    path = folder / "marked.nc"
    path.write_text(
        "\n".join([*lines, "#CONTOUR LOOKAHEAD LOG OFF [PARAM=2]", "M30", ""])
    )
    return path


@contextmanager
def _running_cnc(service: str, core: int) -> Iterator[Any]:
    """A CNC process in real time with the marked program executed; yields the
    connected PLC side.
    """
    from plc_client import connect  # noqa: PLC0415

    with tempfile.TemporaryDirectory(prefix="hli-cosim-bench-") as folder:
        name = f"hli-bench-{os.getpid()}-{secrets.token_hex(4)}"
        options = CncOptions(
            _marked_program(Path(folder)),
            name,
            RunOptions(clock="realtime", service=service),
            core=core,
        )
        command = [
            sys.executable,
            "-P",
            "-m",
            "cnc_core.process",
            options.as_json(),
            "--parent",
            str(os.getpid()),
        ]
        # Ctrl-C is for the benchmark, which ends this process
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, start_new_session=True
        )
        try:
            hli = connect(name, wait_s=20.0)
            while hli.phase != layout.HLI_PHASE_ENDED:
                time.sleep(0.01)
            yield hli
            hli.close()
        finally:
            process.terminate()
            process.wait(10.0)


def _verified(unit: ContourUnit, seconds: float) -> tuple[Ns, int]:
    """(durations, wrong answers) of mode 1 requests that each leave N_BLOCKS
    entries or one more, all compared.
    """
    whole = unit.exchange(0.0, 0.0).copy()
    first = len(whole) - N_BLOCKS - 1
    starts = (first, first + 1)
    expected = {float(i): whole[i:].tobytes() for i in starts}
    memory = memoryview(unit.rows).cast("B")  # type: ignore[arg-type]

    def right(n: int, start: float) -> bool:
        answer = expected[start]
        return (
            n * BLOCK_DTYPE.itemsize == len(answer)
            and memory[: len(answer)] == answer
        )

    return raw.exchange_loop(unit, list(expected), 0.0, right, seconds)


def _periods(hli: Any, seconds: float) -> Ns:
    """Times between successive cycles of a running CNC, as the PLC sees them."""
    times, cycle = [], hli.cycle
    for _ in range(int(seconds / hli.cycle_s)):
        cycle += 1
        hli.wait_cycle(cycle)
        times.append(time.perf_counter_ns())
    return np.diff(np.array(times))


def handshake(
    seconds: float = 10.0, tick: Callable[[float], None] = lambda _share: None
) -> dict[str, Any]:
    """The contract's handshake object. ``tick`` is told the share done, 0..1."""
    ns: dict[str, list[Ns]] = {
        "raw": [],
        "python": [],
        "immediate": [],
        "cyclic": [],
        "period": [],
    }
    torn, pinned, share = 0, True, seconds / ROUNDS
    client, server = raw.cores()
    before = os.sched_getaffinity(0)
    for turn in range(ROUNDS):
        for name, measure, part in (
            ("raw", raw.measure_raw, 0.15),
            ("python", raw.measure_python_both, 0.45),
        ):
            got = measure(N_BLOCKS, max(0.2, share * part))
            ns[name].append(got.ns)
            torn, pinned = torn + got.torn, pinned and got.pinned
        for service in ("immediate", "cyclic"):
            with _running_cnc(service, server) as hli:
                raw.pin(client)
                unit = ContourUnit(hli.gpCh[0].contour_lookahead)
                durations, wrong = _verified(unit, max(0.3, share * 0.2))
                if service == "cyclic":
                    ns["period"].append(_periods(hli, max(0.2, share * 0.05)))
            os.sched_setaffinity(0, before)
            ns[service].append(durations)
            torn += wrong
        tick((turn + 1) / ROUNDS)
    joined = {name: np.concatenate(parts) for name, parts in ns.items()}
    out: dict[str, Any] = {
        f"{name}_us": quantiles_us(values) for name, values in joined.items()
    }
    reference = out["raw_us"]["p50"]
    return out | {
        "payload_bytes": N_BLOCKS * BLOCK_DTYPE.itemsize,
        "n": sum(len(v) for k, v in joined.items() if k != "period"),
        "torn_reads": torn,
        "pinned": pinned,
        "immediate_over_raw": out["immediate_us"]["p50"] / reference,
        "python_over_raw": out["python_us"]["p50"] / reference,
    }


# ------------------------------------------------------------------------------------------------
# cycle
def _timed_cycles(program: Program, rows: int) -> tuple[tuple[Ns, ...], bool]:
    """``Engine.time_cycles`` of real-time cycles with a segment attached, and
    whether with SCHED_FIFO.
    """
    name = f"hli-bench-{os.getpid()}-{secrets.token_hex(4)}"
    with (
        create(name, 1, len(program.cell.axes)) as segment,
        # its threads end before the memory goes, whatever happens
        closing(Engine(program.cell, segment=segment, clock=2)) as engine,
    ):
        feeder = Feeder(program, engine, lambda _batch: None)
        feeder.fill()
        times = engine.time_cycles(rows)
        fifo = engine.start()
        while engine.timed < rows:
            if engine.wait(0.01) is Event.NEED_BLOCKS:
                feeder.fill()
        engine.stop()
        return times, fifo


def cycle(seconds: float = 10.0) -> dict[str, Any]:
    """Cost of a GEO cycle on the contour workload and how late it begins,
    beside a bare loop in the same run.

    A cycle begins at its time and ends when all is published; GEO wakes before
    and rehearses, told on its own.
    """
    rows = int(max(200, seconds / 2 / ROUNDS / 0.001))
    rounds, bare = [], []
    fifo = False
    with tempfile.TemporaryDirectory(prefix="hli-cosim-bench-") as folder:
        path = write_program(
            Path(folder) / "contour.nc", contour_points(100_000), 6000.0
        )
        for _ in range(ROUNDS):
            times, fifo = _timed_cycles(
                Program(path, CellConfig(), "isg"), rows
            )
            rounds.append(times)
            bare.append(bare_loop(0.001, rows))
    took, late, rehearsed = (
        quantiles_us(np.concatenate(column))
        for column in zip(*rounds, strict=True)
    )
    return {
        "cycle_ns": {k: v * 1000.0 for k, v in took.items()},
        "rehearsal_ns": {k: v * 1000.0 for k, v in rehearsed.items()},
        "wakeup_late_us": late,
        "bare_nanosleep_late_us": quantiles_us(np.concatenate(bare)),
        "period_us": 1000.0,
        "n": rows * ROUNDS,
        "sched_fifo": fifo,
    }


# ------------------------------------------------------------------------------------------------
# planner, parser of the jerk-limited runs: driven exactly, a polyline has to
# stand at most of its points
TOLERANCE_MM = 0.01
HOSTILE_MM = 0.02
STEP_CYCLES = 97  # between two changes of override or hold
WAVE_CYCLES = 10  # between two overrides of a wave: about a commit
WAVE_PERIOD = 700  # cycles
OVERRIDES = (0.0, 0.1, 0.3, 0.6, 0.9, 1.0, 1.0)


def _blocks_that_fit(seconds: float, per_second: float) -> int:
    return int(min(100_000, max(2_000, seconds * per_second)))


def _operator(seed: int) -> Callable[[Engine], None]:
    """Steps of the override, one turn in eight a feed hold."""
    rng = np.random.default_rng(seed)

    def change(engine: Engine) -> None:
        engine.set_override(
            float(rng.choice(OVERRIDES)), bool(rng.random() < 0.125)
        )

    return change


class Wave:
    """A new override at each call, 60 + 40 sin percent."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, engine: Engine) -> None:
        self.calls += 1
        turn = 2 * np.pi * self.calls * WAVE_CYCLES / WAVE_PERIOD
        engine.set_override(0.6 + 0.4 * float(np.sin(turn)), False)


FIGURES = (
    "planner",
    "blocks",
    "blocks_per_s",
    "motion_time_s",
    "planner_us_per_ms",
    "max_ratio",
    "path_deviation_mm",
)


def planner(seconds: float = 10.0) -> dict[str, Any]:
    """Blocks per second (planner alone), motion time and largest ratios per
    workload and look-ahead.

    "contour/120": jerk-limited, smoothed within ``TOLERANCE_MM``;
    "contour/120/no-jerk": acceleration-limited, exact;
    "contour/120/no-jerk/smooth": within ``TOLERANCE_MM``; "contour/120/live":
    jerk-limited, with steps of the override and feed holds all the time, over a
    tenth of the blocks; "contour/120/wave": with another override for each
    commit. ``planner_us_per_ms``: the planner's CPU time for each ms of motion.
    "saw-teeth/120/hostile": programs for which planning is dearest, with
    ``planning_over_motion``.
    """
    n = _blocks_that_fit(seconds, 4_000)
    out: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="hli-cosim-bench-") as folder:
        for name, work in WORKLOADS.items():
            path, short = (
                work.write(Path(folder) / f"{name}-{k}.nc", n // k)
                for k in (1, 10)
            )
            for window in (30, 120, 190):
                at = f"{name}/{window}"
                out[at] = _figures(work, path, TOLERANCE_MM, window)
                out[f"{at}/no-jerk"] = _figures(
                    work, path, 0.0, window, jerk=False
                )
            out[f"{name}/120/no-jerk/smooth"] = _figures(
                work, path, TOLERANCE_MM, 120, jerk=False
            )
            out[f"{name}/120/live"] = _figures(
                work, short, TOLERANCE_MM, 120, live=True
            )
            out[f"{name}/120/wave"] = _wave_figures(work, short)
            out[f"{name}/120/no-jerk/live"] = _figures(
                work, short, 0.0, 120, jerk=False, live=True
            )
        for name, work in HOSTILE.items():
            path = work.write(Path(folder) / f"{name}.nc", n)
            out[f"{name}/120/hostile"] = _hostile_figures(work, path)
    return out


def _figures(
    work: Workload,
    file: Path,
    tolerance: float,
    window: int,
    *,
    jerk: bool = True,
    live: bool = False,
) -> dict[str, Any]:
    """``FIGURES`` of one program, planned once."""
    program = Program(file, work.cell(), "isg", tolerance=tolerance)
    operator = (STEP_CYCLES, _operator(1)) if live else None
    result = plan_program(
        program, window=window, jerk=jerk, live=operator
    ).as_json()
    return {name: result[name] for name in FIGURES}


def _hostile_figures(work: Workload, file: Path) -> dict[str, Any]:
    """As ``_figures``, and what part of the motion time the planner takes."""
    program = Program(file, work.cell(), "isg", tolerance=HOSTILE_MM)
    result = plan_program(program, window=120).as_json()
    share = result["plan_cpu_s"] / result["motion_time_s"]
    figures = {name: result[name] for name in FIGURES}
    return figures | {"planning_over_motion": share}


def _wave_figures(work: Workload, file: Path) -> dict[str, Any]:
    """As ``_figures``, with an override that always changes."""
    program = Program(file, work.cell(), "isg", tolerance=TOLERANCE_MM)
    result = plan_program(program, window=120, live=(WAVE_CYCLES, Wave()))
    figures = result.as_json()
    return {name: figures[name] for name in FIGURES}


def _seconds_of(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def _count_lines(path: Path) -> int:
    return sum(1 for _ in path.open())


def _count_rows(path: Path) -> int:
    return sum(map(len, Program(path, CellConfig(), "isg").batches()))


def parser(seconds: float = 10.0) -> dict[str, Any]:
    """Lines per second from text to final rows per workload, beside reading the
    same file line by line in Python.
    """
    n, out = int(max(10_000, min(1_000_000, seconds * 50_000))), {}
    with tempfile.TemporaryDirectory(prefix="hli-cosim-bench-") as folder:
        for name, work in WORKLOADS.items():
            if not work.plain:
                continue
            path = work.write(Path(folder) / f"{name}.nc", n)
            lines = _count_lines(path)
            reading = _seconds_of(functools.partial(_count_lines, path))
            parsing = _seconds_of(functools.partial(_count_rows, path))
            out[name] = {
                "lines": lines,
                "lines_per_s": lines / parsing,
                "reading_lines_per_s": lines / reading,
            }
    return {
        "lines_per_s": {k: v["lines_per_s"] for k, v in out.items()},
        "workloads": out,
    }
