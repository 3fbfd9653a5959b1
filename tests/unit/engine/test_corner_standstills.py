"""A corner is passed with a jump of velocity only where that is faster than
standing in it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.planning import PlanResult, plan_program
from cnc_core.program import Program
from support.inside import Inside
from support.limits import legal

FEED, ACCEL, LIMIT = 100.0, 3000.0, 300.0
RATIOS = ("velocity", "acceleration", "jerk")


def exact_stops(points: np.ndarray) -> float:
    """Time for straight lines from rest to rest, each axis within its limits."""
    way = np.diff(points, axis=0)
    length = np.linalg.norm(way, axis=1)
    share = np.abs(way).max(axis=1) / length
    accel, top = ACCEL / share, np.minimum(FEED, LIMIT / share)
    peak = np.minimum(top, np.sqrt(accel * length))
    return float((2 * peak / accel + (length - peak**2 / accel) / peak).sum())


@pytest.mark.parametrize("cycle_s", [0.0005, 0.001, 0.004, 0.008])
@pytest.mark.parametrize("step", [1.0, 10.0])
def test_corners_are_never_slower_than_exact_stops(
    step: float, cycle_s: float, program: Callable[..., Path]
) -> None:
    """Without jerk, random directions in space: what a jump uses up of the
    acceleration must not cost more than it saves.
    """
    rng = np.random.default_rng(3)
    points = np.vstack(
        [np.zeros((1, 3)), np.cumsum(rng.normal(size=(60, 3)) * step, axis=0)]
    ).round(4)
    path = program(
        "G90 F6000\n"
        + "".join(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}\n" for x, y, z in points[1:])
        + "M30\n"
    )
    result = plan_program(
        Program(path, CellConfig(cycle_s=cycle_s)), jerk=False
    )
    assert result.motion_time_s <= exact_stops(points) * 1.002
    assert result.max_ratio["acceleration"] <= 1.002


@pytest.mark.parametrize("cycle_s", [0.001, 0.004])
def test_a_small_joint_beside_a_corner_costs_nothing(
    cycle_s: float, program: Callable[..., Path]
) -> None:
    """Without jerk: a line in two parts, the second of which ends a tenth of a
    micrometre off, is driven as one.  It took 1.38 times as long at 4 ms.
    """

    def seconds(*between: str) -> float:
        lines = ["F18000", "G1 X0.3", *between, "G1 X0.3 Y0.3", "M30\n"]
        source = Program(program("\n".join(lines)), CellConfig(cycle_s=cycle_s))
        return plan_program(source, jerk=False).motion_time_s

    assert seconds("G1 X0.3001 Y0.1002") <= seconds() * 1.01


@pytest.mark.parametrize(("cycle_s", "length"), [(0.001, 0.3), (0.004, 1.0)])
def test_lines_in_parts_are_never_slower_than_exact_stops(
    cycle_s: float, length: float, program: Callable[..., Path]
) -> None:
    """Without jerk: random sharp corners, each line in up to three parts with
    rounded ends, beside the same with exact stops at the corners.
    """
    for seed in range(12):
        rng = np.random.default_rng(seed)
        at, heading, parts = np.zeros(2), 0.0, ["F6000"]
        for _ in range(int(rng.integers(3, 12))):
            heading += rng.choice([0.5, 1, 1.5, 2.5]) * rng.choice([-1, 1])
            count = int(rng.integers(1, 4))
            way = np.array([np.cos(heading), np.sin(heading)])
            way *= length * rng.uniform(0.4, 1.5)
            ends = [
                np.round(at + way * part / count, 4)
                for part in range(1, count + 1)
            ]
            parts += [f"G1 X{x:.4f} Y{y:.4f}" for x, y in ends]
            parts[-1] += " G60"
            at = ends[-1]
        text = "\n".join([*parts, "M30\n"])
        times = [
            plan_program(
                Program(program(one), CellConfig(cycle_s=cycle_s)), jerk=False
            )
            for one in (text.replace(" G60", ""), text)
        ]
        driven, stopped = (result.motion_time_s for result in times)
        assert driven <= stopped * 1.005, seed
        assert times[0].max_ratio["acceleration"] <= 1.02


def test_small_corners_of_a_soft_machine_are_driven_through(
    program: Callable[..., Path],
) -> None:
    """A zigzag of 1.5 degrees in lines of 0.05 mm: each corner may be passed at
    0.5 mm/s, a stand takes longer where there is little jerk.  It took 0.684 s
    either way.
    """
    axis = AxisConfig(v_max_mm_s=30.0, a_max_mm_s2=300.0, j_max_mm_s3=5000.0)
    cell = CellConfig(cycle_s=0.004, axes={"X": axis, "Y": axis})
    turns = np.radians(1.5) * (np.arange(10) % 2)
    ways = 0.05 * np.column_stack([np.cos(turns), np.sin(turns)])
    ends = np.cumsum(ways, axis=0)

    def driven(stop: str) -> PlanResult:
        lines = [f"G1 X{x:.7f} Y{y:.7f}{stop}\n" for x, y in ends]
        return plan_program(Program(program(f"F600\n{''.join(lines)}"), cell))

    through, stopped = driven(""), driven(" G60")
    assert through.motion_time_s < 0.85 * stopped.motion_time_s
    assert max(through.max_ratio[x] for x in RATIOS) <= 1.02


@pytest.mark.parametrize("cycle_s", [0.001, 0.002])
@pytest.mark.parametrize(
    ("accel", "jerk"),
    [(3000.0, 3e5), (9000.0, 89490.0), (7169.0, 810300.0), (40000.0, 4e5)],
)
@pytest.mark.parametrize("turn", [0.02, 0.05, 0.1, 0.2, 0.8])
def test_corners_with_jerk_cost_little_more_than_exact_stops(
    turn: float,
    accel: float,
    jerk: float,
    cycle_s: float,
    program: Callable[..., Path],
) -> None:
    """Without a tolerance: at most 1 ms more. A corner of 0.2 rad that is passed
    at 5 mm/s took up to 4.9 ms more, since its jump leaves half of the jerk.
    """
    heading = 0.6 + np.where(np.arange(9) % 2, turn, 0.0)
    points = 5 * np.cumsum(
        np.column_stack([np.cos(heading), np.sin(heading)]), axis=0
    )
    axis = AxisConfig(v_max_mm_s=300.0, a_max_mm_s2=accel, j_max_mm_s3=jerk)
    cell = CellConfig(cycle_s=cycle_s, axes=dict.fromkeys("XYZ", axis))

    def time_with(word: str) -> float:
        lines = "".join(f"{word} X{x:.6f} Y{y:.6f}\n" for x, y in points)
        path = program(f"G1 F6000\n{lines}M30\n")
        return plan_program(Program(path, cell, tolerance=0.0)).motion_time_s

    assert time_with("G1") <= time_with("G60 G1") + 8 * 0.001


@pytest.mark.parametrize("seed", [0, 26, 33, 5, 17, 93, 124])
def test_stops_that_come_and_go_behind_corners_leave_the_state_legal(
    seed: int, tmp_path: Path
) -> None:
    """Corners are settled by whole blocks; behind a stop that stays the path
    begins at rest: the state stays legal.
    """
    rng = np.random.default_rng(seed)
    cycle_s = float(rng.choice([0.001, 0.002, 0.004]))
    cell = f"cycle_s = {cycle_s}\n" + "".join(
        f"[axes.{a}]\nj_max_mm_s3 = 0\n" for a in "XY"
    )
    at, heading, lines = (
        np.zeros(2),
        0.0,
        [f"G1 F{rng.choice([3000, 6000, 12000])}"],
    )
    for _ in range(12):
        heading += rng.normal() * 0.5
        at = at + rng.choice([0.5, 2.0, 6.0]) * np.array(
            [np.cos(heading), np.sin(heading)]
        )
        lines.append(f"X{at[0]:.3f} Y{at[1]:.3f}")
    with Inside(tmp_path, "\n".join(lines) + "\nM30\n", cell) as cnc:
        unit = cnc.bahn.insert_cmd
        for k in range(12):
            cnc.run(int(rng.integers(1, 10)))
            unit.command_w.dist_or_pos = (
                float(cnc.engine.state.path) + rng.uniform(0, 4)
            ) * 1e4
            unit.command_w.rel_abs_mode = 1
            unit.command_w.axis_nr = unit.command_w.m_function_nr = 0
            unit.enable_w = unit.command_semaphor_rw = True
            cnc.run(int(rng.integers(1, 10)))
            unit.command_w.dist_or_pos, unit.command_w.rel_abs_mode = 0.0, 2
            unit.command_semaphor_rw = True
            cnc.level(cnc.bahn.continue_machining, k % 2 == 0)
        assert cnc.engine.state.infeasible == 0
        legal(cnc.pos, cnc.cell)
