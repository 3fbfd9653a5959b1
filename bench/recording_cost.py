"""What recording costs the GEO cycle, with and without in the same run.

``python bench/recording_cost.py [SECONDS]``: real-time cycles of the contour
workload, in turns without a recording, with all columns, and with v alone.
Prints medians in ns, the least of them, and ratios to the rounds without.
The least ones matter where something else runs beside.
"""

from __future__ import annotations

import json
import os
import secrets
import sys
import tempfile
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from cnc_core.benchmarks.workloads import contour_points, write_program
from cnc_core.config import CellConfig
from cnc_core.engine import Engine, Event
from cnc_core.planning import Feeder
from cnc_core.program import Program
from cnc_core.recording.recorder import Recorder
from hli.segment import create

VARIANTS: dict[str, tuple[str, ...] | None] = {
    "without": None,
    "all columns": (),
    "v alone": ("v",),
}
ROUND_CYCLES = 500


def timed(path: Path, folder: Path, only: Sequence[str] | None) -> float:
    """Median of a round's cycles, ns; ``only`` None: nothing is recorded."""
    cell = CellConfig()
    program = Program(path, cell, "isg")
    rows = 16_384 if only is not None else 0
    name = f"hli-bench-{os.getpid()}-{secrets.token_hex(4)}"
    with (
        create(name, 1, len(cell.axes)) as segment,
        closing(
            Engine(cell, segment=segment, clock=2, record_rows=rows)
        ) as engine,
    ):
        recorder = None
        if only is not None:
            file = folder / "cost.arrow"
            recorder = Recorder(engine, file, cell, b"{}", tuple(only))
        feeder = Feeder(program, engine, lambda _batch: None)
        feeder.fill()
        times = engine.time_cycles(ROUND_CYCLES)
        engine.start()
        while engine.timed < ROUND_CYCLES:
            if engine.wait(0.01) is Event.NEED_BLOCKS:
                feeder.fill()
        engine.stop()
        if recorder is not None:
            recorder.close()
        return float(np.median(times[0]))


def main(seconds: float) -> None:
    """Rounds in turns, so that what else runs hits all of them alike."""
    found: dict[str, list[float]] = {name: [] for name in VARIANTS}
    rounds = max(3, int(seconds / len(VARIANTS) / (ROUND_CYCLES * 1e-3)))
    with tempfile.TemporaryDirectory(prefix="hli-cosim-bench-") as name:
        folder = Path(name)
        path = write_program(
            folder / "contour.nc", contour_points(20_000), 6000.0
        )
        for _ in range(rounds):
            for variant, only in VARIANTS.items():
                found[variant].append(timed(path, folder, only))
    base = np.array(found["without"])
    print(
        json.dumps(
            {
                variant: {
                    "cycle_ns": float(np.median(values)),
                    "least_ns": min(values),
                    "ratio": float(np.median(values) / np.median(base)),
                    "least_ratio": min(values) / float(base.min()),
                }
                for variant, values in found.items()
            }
            | {"rounds": rounds, "cycles": ROUND_CYCLES}
        )
    )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
