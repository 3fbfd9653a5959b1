"""Seeded programs that planner and reader are measured with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..config import CellConfig, parse_config

Points = npt.NDArray[np.float64]
ARC_MM = 4.0
FIVE_AXES = "XYZAC"
# A trunnion: the table C on the table A, the head moves in X Y Z (as
# examples/five_axis/table_table.toml).
FIVE_AXIS_CELL = """
name = "five-axis"
[axes.X]
[axes.Y]
[axes.Z]
[axes.A]
kind = "rotary"
v_max_mm_s = 180.0
a_max_mm_s2 = 1500.0
j_max_mm_s3 = 20000.0
[axes.C]
kind = "rotary"
v_max_mm_s = 360.0
a_max_mm_s2 = 3000.0
j_max_mm_s3 = 40000.0
[tools.1]
radius_mm = 4.0
length_mm = 80.0
[kinematics.9]
type = "table-table"
rotary = ["C", "A"]
directions = { A = [-1.0, 0.0, 0.0], C = [0.0, 0.0, -1.0] }
points = { A = [0.0, 0.0, -50.0], C = [0.0, 0.0, 0.0] }
part = [0.0, 0.0, 0.0]
spindle = [0.0, 0.0, 0.0]
"""


def contour_points(n: int) -> Points:
    """(n + 1, 3) points of the contour workload: r = 40 + 8 sin 7t + 2 sin 31t
    mm, 2500 points a turn, 4 decimals.
    """
    t = np.arange(n + 1) / 2500.0 * 2.0 * np.pi
    r = (
        40.0
        + 8.0 * np.sin(7.0 * t)
        + 2.0 * np.sin(31.0 * t)
        + 0.05 * t / (2.0 * np.pi)
    )
    x, y = r * np.cos(t), r * np.sin(t)
    points = np.column_stack([x, y, np.zeros_like(t)])
    return np.asarray(np.round(points, 4), np.float64)


def raster_points(n: int) -> Points:
    """(n + 1, 3) points of the raster workload: 100 mm lines 0.25 mm apart over
    z = 3 sin(x/7) cos(y/5), 4 decimals.
    """
    per_line = 333
    k = np.arange(n + 1)
    line, step = k // (per_line + 1), k % (per_line + 1)
    x = np.where(line % 2 == 0, step, per_line - step) * 100.0 / per_line
    y = line * 0.25
    z = 3.0 * np.sin(x / 7.0) * np.cos(y / 5.0)
    points = np.column_stack([x, y, z])
    return np.asarray(np.round(points, 4), np.float64)


def collinear_points(n: int) -> Points:
    """(n + 1, 3) points of a straight line in blocks of 0.02 mm."""
    x = 0.02 * np.arange(n + 1)
    return np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])


def corner_points(n: int) -> Points:
    """(n + 1, 3) points of a random walk with steps of some millimetres: every
    block ends in a corner.
    """
    rng = np.random.default_rng(5)
    steps = rng.normal(size=(n // 20 + 1, 3)) * 4.0
    points = np.cumsum(steps, axis=0)
    return np.asarray(np.round(points, 4), np.float64)


def five_axis_points(n: int) -> Points:
    """(n + 1, 5) tip and angles of A and C on a spiral over a dome, in blocks
    of about 0.3 mm.
    """
    t = 0.012 * np.arange(n + 1)
    r = 20.0 + 12.0 * np.sin(0.02 * t)
    height = 30.0 - r * r / 120.0
    x, y = r * np.cos(t), r * np.sin(t)
    tip = np.column_stack([x, y, height])
    tilt, turn = 15.0 + 8.0 * np.sin(3.0 * t), 25.0 * np.sin(t)
    return np.asarray(
        np.round(np.column_stack([tip, tilt, turn]), 4), np.float64
    )


def saw_points(n: int, step_mm: float, height_mm: float) -> Points:
    """(n + 1, 3) points up and down, a tooth in two blocks."""
    k = np.arange(n + 1)
    points = np.column_stack([step_mm * k, height_mm * (k % 2), 0.0 * k])
    return np.asarray(np.round(points, 4), np.float64)


def write_program(
    path: Path,
    points: Points,
    feed_mm_min: float,
    axes: str = "XYZ",
    head: str = "",
) -> Path:
    """A plain G1 program through the points, the first one in rapid."""

    def words(row: Points) -> str:
        return " ".join(
            f"{axis}{value:.4f}" for axis, value in zip(axes, row, strict=True)
        )

    with path.open("w") as file:
        file.write(f"{head}G0 {words(points[0])}\nG1 F{feed_mm_min:g}\n")
        file.writelines(f"{words(row)}\n" for row in points[1:])
        file.write("M30\n")
    return path


def write_arcs(path: Path, n: int, feed_mm_min: float) -> Path:
    """A tangential chain of n arcs of 4 mm, radius 3 to 12 mm, to either side."""
    rng, at, heading = np.random.default_rng(7), 0j, 0.0
    with path.open("w") as file:
        file.write(f"G90 G17 F{feed_mm_min:g}\n")
        for _ in range(n):
            radius, side = (
                float(rng.uniform(3.0, 12.0)),
                int(rng.choice([-1, 1])),
            )
            to_centre = 1j * side * radius * np.exp(1j * heading)
            heading += side * ARC_MM / radius
            end = at + to_centre - 1j * side * radius * np.exp(1j * heading)
            ij = complex(to_centre)
            code = 3 if side > 0 else 2
            file.write(
                f"G{code} X{end.real:.7f} Y{end.imag:.7f}"
                f" I{ij.real:.7f} J{ij.imag:.7f}\n"
            )
            at = complex(round(end.real, 7), round(end.imag, 7))
        file.write("M30\n")
    return path


def write_feeds(path: Path, n: int) -> Path:
    """A random walk in n blocks; every other one is 10 to 100 times slower."""
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal(size=(n, 3)) * 2.0, axis=0)
    with path.open("w") as file:
        for k, (x, y, z) in enumerate(points):
            feed = 6000.0 * (10.0 ** -rng.uniform(1.0, 2.0) if k % 2 else 1.0)
            file.write(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} F{feed:.2f}\n")
        file.write("M30\n")
    return path


@dataclass(frozen=True)
class Workload:
    """A program for n blocks of the densest workload, and its cell.

    ``plain``: lines that the reader scans in C.
    """

    write: Callable[[Path, int], Path]
    cell: Callable[[], CellConfig] = CellConfig
    plain: bool = True


def _through(points: Callable[[int], Points], feed_mm_min: float) -> Workload:
    return Workload(lambda path, n: write_program(path, points(n), feed_mm_min))


def _five_axis(path: Path, n: int) -> Path:
    head = "T1 D1 M06\n#KIN ID[9]\n#TRAFO ON\n"
    return write_program(path, five_axis_points(n), 3000.0, FIVE_AXES, head)


def _five_axis_cell() -> CellConfig:
    return parse_config(FIVE_AXIS_CELL, "five-axis")


WORKLOADS = {
    "contour": _through(contour_points, 6000.0),
    "raster": _through(raster_points, 6000.0),
    "collinear": _through(collinear_points, 18000.0),
    "corners": _through(corner_points, 6000.0),
    "arcs": Workload(
        lambda path, n: write_arcs(path, n // 10, 6000.0), plain=False
    ),
    "five-axis": Workload(
        lambda path, n: _five_axis(path, n // 10),
        lambda: parse_config(FIVE_AXIS_CELL, "five-axis"),
        plain=False,
    ),
}

# Jerk limits 138 times apart
UNEQUAL_CELL = """
name = "unequal"
[axes.X]
v_max_mm_s = 1076.0
a_max_mm_s2 = 11660.0
j_max_mm_s3 = 8558.0
[axes.Y]
v_max_mm_s = 81.57
a_max_mm_s2 = 20620.0
j_max_mm_s3 = 1.18e6
[axes.Z]
v_max_mm_s = 1046.0
a_max_mm_s2 = 2028.0
j_max_mm_s3 = 23230.0
"""


def _saw(step_mm: float, height_mm: float) -> Workload:
    """Saw-teeth on a machine with very unequal jerk limits."""
    return Workload(
        lambda path, n: write_program(
            path, saw_points(n // 50, step_mm, height_mm), 9928.9
        ),
        lambda: parse_config(UNEQUAL_CELL, "unequal"),
    )


HOSTILE = {
    "saw-teeth": _saw(1.4909, 2.4849),
    "flat saw-teeth": _saw(1.0, 0.3),
    "fine saw-teeth": _saw(0.2, 0.05),
    "feeds": Workload(lambda path, n: write_feeds(path, n // 50)),
}
"""Programs for which planning is dearest."""
