"""Hashes of everything that moves, to show that a change moves nothing else.

Planned samples of the seeded workloads and of the examples, recordings of the
examples with their PLC programs.  Two trees whose files are equal drive every
axis with the same bits:

    python bench/identity.py now.json
    python bench/identity.py --against before.json now.json

The command line of the active environment runs the programs of this tree.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cnc_core.benchmarks import workloads

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
BLOCKS = {
    "contour": 2000,
    "raster": 2000,
    "collinear": 2000,
    "corners": 4000,
    "arcs": 300,
    "five-axis": 600,
}
PLANS = (
    (),
    ("--tolerance", "0.01"),
    ("--no-jerk",),
    ("--no-jerk", "--tolerance", "0.01"),
    ("--lookahead", "30"),
)
PARTS = {
    "part.nc": "cell.toml",
    "dispenser/part.nc": "dispenser/cell.toml",
    "laser_power/part.nc": "laser_power/cell.toml",
    "sharp_tangents/part.nc": "sharp_tangents/cell.toml",
    "spark_erosion/part.nc": "spark_erosion/cell.toml",
    "pocket_pattern/pockets.nc": "pocket_pattern/cell.toml",
    "osai/part.osai": "osai/cell.toml",
    "five_axis/tilted_plane.nc": "five_axis/head_table.toml",
    "five_axis/tilted_plane_a.nc": "five_axis/table_table.toml",
}
PLCS = {
    "part.nc": ("override_from_contour.py", "read_marked_log.py"),
    "dispenser/part.nc": ("dispenser/with_lookahead.py",),
    "laser_power/part.nc": ("laser_power/with_lookahead.py",),
    "sharp_tangents/part.nc": ("sharp_tangents/with_lookahead.py",),
    "spark_erosion/part.nc": ("spark_erosion/with_lookahead.py",),
}


@dataclass(frozen=True)
class Job:
    """One command; ``keep`` is the option that names the file of samples."""

    name: str
    arguments: tuple[str, ...]
    keep: str


def digest(path: Path) -> str:
    """The hash of all arrays of a .npz: names, types, bytes."""
    found = hashlib.sha256()
    with np.load(path) as arrays:
        for name in sorted(arrays.files):
            values = np.ascontiguousarray(arrays[name])
            found.update(f"{name} {values.dtype}".encode())
            found.update(values.tobytes())
    return found.hexdigest()[:24]


def workload_jobs(folder: Path) -> Iterator[Job]:
    """Plans of the seeded workloads, written to the folder."""
    for name, blocks in BLOCKS.items():
        work = workloads.WORKLOADS[name]
        program = work.write(folder / f"{name}.nc", blocks)
        config: tuple[str, ...] = ()
        if name == "five-axis":
            cell = folder / "five-axis.toml"
            cell.write_text(workloads.FIVE_AXIS_CELL)
            config = ("--config", str(cell))
        for options in PLANS:
            title = " ".join((f"plan {name}", *options))
            arguments = ("plan", str(program), *config, *options)
            yield Job(title, arguments, "--samples")


def example_jobs() -> Iterator[Job]:
    """Plans and runs of the examples."""
    for part, cell in PARTS.items():
        files = (str(EXAMPLES / part), "--config", str(EXAMPLES / cell))
        yield Job(f"plan {part}", ("plan", *files), "--samples")
        yield Job(f"run {part}", ("run", *files), "--record")
        for plc in PLCS.get(part, ()):
            arguments = ("run", *files, "--plc", str(EXAMPLES / plc))
            yield Job(f"run {part} {plc}", arguments, "--record")


def outcome(job: Job, folder: Path) -> str:
    """The hash of what the command has recorded, or how it has failed."""
    target = folder / "samples.npz"
    target.unlink(missing_ok=True)
    command = [sys.executable, "-P", "-m", "cnc_core.cli", *job.arguments]
    done = subprocess.run(
        [*command, job.keep, str(target)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if target.exists():
        return digest(target)
    return f"exit {done.returncode}: no samples"


def hashes() -> dict[str, str]:
    """The outcome of every job by its name."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        jobs = [*workload_jobs(folder), *example_jobs()]
        return {job.name: outcome(job, folder) for job in jobs}


def main() -> int:
    """Write the hashes; 1 if they differ from those of another tree."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", type=Path)
    parser.add_argument("--against", type=Path)
    given = parser.parse_args()
    found = hashes()
    given.target.write_text(json.dumps(found, indent=1) + "\n")
    if given.against is None:
        return 0
    before = json.loads(given.against.read_text())
    names = before.keys() | found.keys()
    wrong = sorted(n for n in names if before.get(n) != found.get(n))
    print("\n".join(wrong) if wrong else f"{len(names)} outcomes are equal")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
