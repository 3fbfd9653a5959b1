"""Programs of odd shapes through ``plan``: they end, in a sensible time, within
the limits, on the programmed end.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cnc_core.config import parse_config
from cnc_core.planning import PlanResult
from support.drive import drive, line_rows
from support.limits import ratios
from support.programs import planned, program_of

CELL = """
[axes.X]
v_max_mm_s = 60
a_max_mm_s2 = 3000
j_max_mm_s3 = 60000
[axes.Y]
v_max_mm_s = 60
a_max_mm_s2 = 3000
j_max_mm_s3 = 60000
[axes.Z]
v_max_mm_s = 60
a_max_mm_s2 = 3000
j_max_mm_s3 = 60000
[axes.A]
kind = "rotary"
v_max_mm_s = 60
a_max_mm_s2 = 3000
j_max_mm_s3 = 60000
"""


def shape(
    folder: Path, text: str, tolerance: float, window: int = 30
) -> PlanResult:
    """The program on the machine X Y Z A, with samples."""
    return planned(
        program_of(folder, text, CELL, tolerance=tolerance), window=window
    )


def test_rotary_axis_outruns_a_tiny_way(tmp_path: Path) -> None:
    """Degrees of a rotary axis over microns, smoothed: no crawl through
    millions of tiny intervals.
    """
    text = """G0 X0 Y0 Z0 A0
    N10 G1 X0.001 Y0.0015 A4.5 F6900
    N20 G1 X0.25 Y0.29 Z0.32 A9
    N30 G1 X0.251 Y0.291 Z0.32 A14
    N40 G1 X0.2515 Y0.31 Z0.35 A12
    N50 G1 X2
    M30
    """
    exact, smooth = shape(tmp_path, text, 0.0), shape(tmp_path, text, 0.01)
    assert smooth.motion_time_s < 3 * exact.motion_time_s
    assert smooth.samples is not None
    pos = smooth.samples["pos"]
    assert np.abs(pos[-1] - [2, 0.31, 0.35, 12]).max() < 1e-9
    assert np.abs(np.diff(pos, n=3, axis=0)).max() / 0.001**3 <= 60000 * 1.02


@pytest.mark.parametrize("jerk", [50_000, 80_000, 1e7, 1.5e9])
def test_a_line_whose_last_phase_is_shorter_than_rounding(
    tmp_path: Path, jerk: float
) -> None:
    """So little acceleration that the jerk lasts a microsecond or less: the line is
    ended once (it was ended twice, and the process died).
    """
    cell = "".join(
        f"[axes.{name}]\na_max_mm_s2 = 760\nj_max_mm_s3 = {jerk}\n"
        for name in "XYZ"
    )
    text = "#VECTOR LIMIT ON [ACC=500]\nG1 X0.1 Y0.05 Z0.02 F6000\nX1\nM30\n"
    result = planned(program_of(tmp_path, text, cell), window=30)
    assert result.samples is not None
    assert result.samples["pos"][-1] == pytest.approx([1.0, 0.05, 0.02])
    assert max(result.max_ratio.values()) <= 1.02


@pytest.mark.parametrize("blocks", [2, 5, 400])
@pytest.mark.parametrize("jerk", [2000.0, 50000.0, 5e5])
def test_a_line_in_blocks_takes_as_long_as_one(
    tmp_path: Path, jerk: float, blocks: int
) -> None:
    """Also where the jerk reaches the acceleration within a cycle: two blocks took twice as long
    as one.
    """
    cell = f"[axes.X]\na_max_mm_s2 = 300\nj_max_mm_s3 = {jerk}\n"
    times = []
    for count in (1, blocks):
        ends = np.linspace(0.0, 2000.0, count + 1)[1:]
        text = "G1 F18000\n" + "".join(f"X{x}\n" for x in ends)
        times.append(planned(program_of(tmp_path, text, cell)).motion_time_s)
    assert times[1] == pytest.approx(times[0], rel=1e-3)


@pytest.mark.parametrize("seed", [4, 5, 6, 7])
def test_axes_that_outrun_a_curve(tmp_path: Path, seed: int) -> None:
    """A rotary axis turns degrees over arcs of hundredths of a mm, smoothed: what
    the place on the curve is off by it has a thousandfold, and short cycles show
    it as jerk (1.05 to 6.5 of the limit once).
    """
    rng = np.random.default_rng(seed)
    lines = []
    for turn in rng.uniform(-12.0, 12.0, 12):
        i, j = rng.normal(size=2) * 0.02
        way = f"X{i + j:.6f} Y{j - i:.6f} A{turn:.4f}"
        lines.append(f"G3 {way} I{i:.6f} J{j:.6f}")
    text = "\n".join(["G91 F3000", *lines, "M30"])
    cell = CELL.replace("60000", "6000")
    program = program_of(
        tmp_path, text, "cycle_s = 0.00025\n" + cell, tolerance=0.01
    )
    assert planned(program, window=60).max_ratio["jerk"] <= 1.02


def test_a_way_that_begins_with_nanometres(tmp_path: Path) -> None:
    """Axes move 15 mm over arcs of micrometres: behind a standstill the path is
    driven by nanometres at first (once the planner found no plan, for ever).
    """
    limits = {
        "X": (2.7473804392355965, 91.99758330730333, 4722.546388734488),
        "Y": (28.794520292158392, 29.833171992992735, 7596.0111788272025),
        "Z": (287.8506159581171, 301.5713682880803, 1906.060005626326),
        "U": (1057.3559699283746, 7850.054897776322, 1257453.0820507477),
        "V": (274.0917877544649, 64.26236516454128, 683688.2731748219),
        "W": (89.3160308202939, 1983.6685696252796, 4419.562851246905),
    }
    cell = "cycle_s = 0.01\n" + "".join(
        f"[axes.{n}]\nv_max_mm_s = {v}\na_max_mm_s2 = {a}\nj_max_mm_s3 = {j}\n"
        for n, (v, a, j) in limits.items()
    )
    text = """F3000 G0 X5.922672 Y5.05175 Z-0.137413 U28.979454 V10.617012 W5.662508
    G3 X5.922477 Y5.057819 I-0.047008 J0.001531 U46.621203 V25.023854 W-7.763157
    G3 X5.91422 Y5.032034 I0.008764 J-0.017021 F2855.07
    G1 X5.657116 Y4.706906 F4557.01
    G3 X5.664876 Y4.727203 Z-0.093821 I0.010543 J0.007601 U28.506642 V13.655766
    M30
    """
    program = program_of(tmp_path, text, cell, tolerance=0.01)
    result = planned(program, window=120)
    assert max(result.max_ratio.values()) <= 1.02


@pytest.mark.parametrize("seed", [3, 4, 7, 72, 124, 135])
def test_corners_a_few_cycles_apart(seed: int) -> None:
    """Blocks of 0.025 mm rounded to 0.001 at a slow cycle: what several corners
    show in the same samples adds up.  Where the speed changes at a corner its
    axes' accelerations jump, which shows a cycle and a half away.
    """
    rng = np.random.default_rng(seed)
    angle = np.cumsum(rng.normal(size=149) * 0.05)
    steps = 0.025 * np.stack([np.cos(angle), np.sin(angle)], 1)
    points = np.round(np.vstack([[0.0, 0.0], np.cumsum(steps, 0)]), 3)
    axes = [
        f"[axes.{n}]\nv_max_mm_s = 150\na_max_mm_s2 = 3000\nj_max_mm_s3 = {j}"
        for n, j in (("X", 7e5), ("Y", 12600))
    ]
    cell = parse_config("cycle_s = 0.004\n" + "\n".join(axes))
    pos, _ = drive(line_rows(points, 20.0), cell, window=30)
    assert max(ratios(pos, cell)) <= 1.02
    assert np.abs(pos[-1] - points[-1]).max() < 1e-9


@pytest.mark.parametrize("cycle_s", [0.00025, 0.001, 0.004])
def test_two_bends_within_a_cycle(tmp_path: Path, cycle_s: float) -> None:
    """Arcs to either side with a line of a micrometre between: both jumps of the curvature are in
    the same samples, which had 1.15 of the jerk.
    """
    text = """G1 F6000 X-0.048054 Y11.193369
    X1.810399 Y10.454347
    G2 X1.880279 Y10.405730 I-0.069178 J-0.173965
    G1 X1.880949 Y10.404987
    G3 X2.135886 Y10.376833 I0.143287 J0.129160
    G1 X3.766857 Y11.534388
    """
    cell = f"cycle_s = {cycle_s}\n"
    result = planned(program_of(tmp_path, text, cell))
    assert max(result.max_ratio.values()) <= 1.02


@pytest.mark.parametrize("seed", [85, 397, 490, 641, 880])
def test_corners_to_and_fro_within_cycles(seed: int) -> None:
    """Corners that turn to and fro about a cycle apart add up to twice the jerk of
    one: 1.03 to 1.15 of the limit before.
    """
    rng = np.random.default_rng(seed)
    cycle_s = float(rng.choice([0.001, 0.002, 0.004]))
    step = float(rng.choice([0.005, 0.01, 0.025, 0.06]))
    feed, window = (
        float(rng.choice([5, 20, 60])),
        int(rng.choice([10, 30, 120])),
    )
    turns = rng.normal(size=149) * rng.choice([0.01, 0.03, 0.05, 0.1])
    angle = np.cumsum(turns)
    steps = step * np.stack([np.cos(angle), np.sin(angle)], 1)
    points = np.vstack([[0.0, 0.0], np.cumsum(steps, 0)])
    points = np.round(points, int(rng.choice([3, 4])))
    jerk, acc = 10 ** rng.uniform(4, 5.9, 2), 10 ** rng.uniform(2.9, 4, 2)
    axes = [
        f"[axes.{n}]\nv_max_mm_s = 150\na_max_mm_s2 = {acc[i]:.1f}\n"
        f"j_max_mm_s3 = {jerk[i]:.1f}"
        for i, n in enumerate("XY")
    ]
    cell = parse_config(f"cycle_s = {cycle_s}\n" + "\n".join(axes))
    pos, _ = drive(line_rows(points, feed), cell, window=window)
    assert max(ratios(pos, cell)) <= 1.02


def test_the_deviation_of_a_steep_helix_is_the_nearest_distance(
    tmp_path: Path,
) -> None:
    """What `plan` states is the distance to the nearest place of the contour,
    not to the place at the same angle.
    """
    text = (
        "G0 X0 Y0 Z0\nG1 F3000 X-10\nX0\nG2 X10 Y0 Z40 I5 J0\nG1 X20 Z40\nM30\n"
    )
    result = shape(tmp_path, text, 0.05)
    angle = np.linspace(np.pi, 0.0, 400_001)
    helix = np.column_stack(
        [5 + 5 * np.cos(angle), 5 * np.sin(angle), np.linspace(0, 40, 400_001)]
    )
    lines = np.vstack(
        [
            np.linspace(a, b, 200_001)
            for a, b in [((-10, 0, 0), (0, 0, 0)), ((10, 0, 40), (20, 0, 40))]
        ]
    )
    assert result.samples is not None
    off, _ = cKDTree(np.vstack([helix, lines])).query(
        result.samples["pos"][:, :3]
    )
    assert result.path_deviation_mm == pytest.approx(off.max(), abs=1e-4)
    assert 0.01 < off.max() <= 0.05
