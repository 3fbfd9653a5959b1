"""What a step of an FMU costs above the cell's own step, in one run.

``python bench/fmu_step.py [STEPS]``: the FMU in fmpy against the same cell that
a PlcRunner steps in this process; medians and 99th percentiles in us.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from cnc_core.cell.stepping import start_plc
from cnc_core.fmu import export_fmu
from cnc_core.fmu.instance import Acknowledging

PART = "G1 F6000 X100\nG2 X120 Y20 R20\nG1 Y120\nX0\nY0\nM30\n"
ROUNDS = 5


def own(program: Path, steps: int) -> list[float]:
    """us of each step of the cell alone."""
    with start_plc(program, Acknowledging) as plc:
        return timed(plc.step, steps)


def fmu(file: Path, folder: Path, steps: int) -> list[float]:
    """us of each step of the FMU."""
    model = read_model_description(str(file))
    slave = FMU2Slave(
        guid=model.guid,
        unzipDirectory=str(folder),
        modelIdentifier=model.coSimulation.modelIdentifier,
        instanceName="bench",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    try:
        return timed(lambda: slave.doStep(0.0, 1e-3), steps)
    finally:
        slave.terminate()
        slave.freeInstance()


def timed(step: object, steps: int) -> list[float]:
    out = []
    for _ in range(steps):
        begin = time.perf_counter()
        step()  # type: ignore[operator]
        out.append((time.perf_counter() - begin) * 1e6)
    return out


def main() -> None:
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    with tempfile.TemporaryDirectory() as name:
        program = Path(name) / "part.nc"
        program.write_text(PART)
        file = export_fmu(program, Path(name) / "cell.fmu")
        folder = Path(extract(str(file), str(Path(name) / "fmu")))
        alone, over = [], []
        for _ in range(ROUNDS):
            alone += own(program, steps)
            over += fmu(file, folder, steps)
    for title, values in (("cell", alone), ("FMU", over)):
        middle, late = np.percentile(values, [50, 99])
        print(f"{title}: p50 {middle:.1f} us, p99 {late:.1f} us")
    print(f"above the cell: p50 {np.median(over) - np.median(alone):.1f} us")


if __name__ == "__main__":
    main()
