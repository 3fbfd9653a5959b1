"""Axes whose full acceleration is there within milliseconds or less."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.planning import PlanResult, plan_program
from cnc_core.program import Program


def machine(accel: float, rate: float, speed: float = 500.0) -> CellConfig:
    """Three equal axes; ``rate``: 1/s, jerk limit over acceleration limit."""
    axis = AxisConfig(
        v_max_mm_s=speed, a_max_mm_s2=accel, j_max_mm_s3=accel * rate
    )
    return CellConfig(axes=dict.fromkeys("XYZ", axis))


def planned(
    lines: list[str],
    cell: CellConfig,
    folder: Path,
    tolerance: float = 0.0,
    jerk: bool = True,
    window: int = 120,
) -> PlanResult:
    """The plan of these lines, its limits checked."""
    path = folder / "a.nc"
    path.write_text("\n".join([*lines, "M30"]))
    program = Program(path, cell, "isg", tolerance=tolerance)
    result = plan_program(program, window=window, jerk=jerk)
    assert result.max_ratio["feed"] <= 1.0015
    assert result.max_ratio["acceleration"] <= 1.0135
    assert not jerk or result.max_ratio["jerk"] <= 1.0125
    return result


def trapezoids(blocks: list[tuple[float, float]], accel: float) -> float:
    """Least time (s) over collinear blocks (mm, mm/s) from rest to rest without a
    limit of the jerk, if every block is long enough for its speed.
    """
    time = sum(length / v for length, v in blocks)
    speeds = [0.0, *(v for _, v in blocks), 0.0]
    for one, other in pairwise(speeds):
        slow, fast = sorted((one, other))
        ramp = (fast - slow) / accel
        time += ramp - (fast**2 - slow**2) / (2.0 * accel) / fast
    return time


@pytest.mark.parametrize("rate", [250.0, 1000.0, 2000.0, 1e5])
@pytest.mark.parametrize("accel", [100.0, 500.0, 2000.0])
def test_feeds_change_on_a_line(
    accel: float, rate: float, tmp_path: Path
) -> None:
    """Rapid and feed blocks of two meters: as fast as the acceleration allows, beside
    the time in which it builds up.
    """
    blocks = [(2000.0, 500.0), (2000.0, 100.0), (2000.0, 400.0)]
    ends = [2000, 4000, 6000]
    feeds = ["G0", "G1 F6000", "G1 F24000"]
    lines = [f"{code} X{x}" for code, x in zip(feeds, ends, strict=True)]
    took = planned(lines, machine(accel, rate), tmp_path).motion_time_s
    best = trapezoids(blocks, accel)
    assert 0.999 * best <= took <= 1.001 * best + 4.0 / min(rate, 1000.0)


def test_an_unfinished_plan_lowers_no_acceleration(tmp_path: Path) -> None:
    """A window that the solver gave up does not slow down the blocks in it: as fast
    as without the limit of the jerk, within 0.5 % (12 % slower before).
    """
    cell = machine(60.2039, 112008 / 60.2039, 1048.31)
    lines = [
        *("G1 X-6.139 F507", "G1 X10.545", "G1 X44.82", "G1 X45.524"),
        *("G1 X201.746 F47119", "G1 X449.588", "G0 X455.321"),
        "G1 X456.383 F8789",
    ]
    took = planned(lines, cell, tmp_path, 0.05, window=20).motion_time_s
    best = planned(lines, cell, tmp_path, 0.05, jerk=False).motion_time_s
    assert took <= 1.005 * best


def zigzag(turn: float, length: float, count: int) -> list[str]:
    """Lines (mm) that turn to and fro by so many degrees, at 30 m/min."""
    x = y = 0.0
    lines = ["G1 F30000"]
    for i in range(count):
        angle = math.radians(turn) * (0.5 if i % 2 else -0.5)
        x += length * math.cos(angle)
        y += length * math.sin(angle)
        lines.append(f"G1 X{x:.4f} Y{y:.4f}")
    return lines


@pytest.mark.parametrize(
    ("turn", "length", "tolerance", "accel"),
    [
        (5.7, 100.0, 0.05, 1000.0),
        (10.0, 8.0, 0.05, 1800.0),
        (3.0, 35.0, 0.01, 5700.0),
        (60.0, 11.0, 0.005, 569.0),
    ],
)
def test_more_jerk_is_not_slower(
    turn: float, length: float, tolerance: float, accel: float, tmp_path: Path
) -> None:
    """Blended corners: each step from 100 to 10000 times the acceleration per second
    takes no longer, within 1 % (up to 18 % before, and windows that failed).
    """
    lines = zigzag(turn, length, 16)
    times = [
        planned(lines, machine(accel, rate), tmp_path, tolerance).motion_time_s
        for rate in (100.0, 300.0, 1000.0, 2000.0, 10000.0)
    ]
    for one, other in pairwise(times):
        assert other <= 1.01 * one


def test_the_guess_leaves_acceleration_in_a_bend(tmp_path: Path) -> None:
    """Corners within 5 um between long lines: as fast as without the limit of the
    jerk, within 0.5 % (11 % slower before: the guess was too fast in the bends).
    """
    lines = [
        *("G1 X11.787 Y-8.7 F30000", "G1 X41.187 Y-7.427"),
        *("G1 X95.814 Y-19.874", "G1 X134.503 Y-67.371"),
        *("G1 X143.746 Y-79.158", "G1 X186.4 Y-80.467"),
        *("G1 X221.454 Y-125.838", "G1 X270.431 Y-143.02"),
        *("G1 X336.273 Y-143.513", "G1 X369.688 Y-199.074"),
        *("G1 X388.315 Y-215.755", "G1 X414.445 Y-229.856"),
        *("G1 X463.557 Y-238.795", "G1 X479.912 Y-240.921"),
        *("G1 X505.893 Y-250.571", "G1 X567.477 Y-240.205"),
    ]
    cell = machine(569.211, 1857.16)
    took = planned(lines, cell, tmp_path, 0.005).motion_time_s
    best = planned(lines, cell, tmp_path, 0.005, jerk=False).motion_time_s
    assert took <= 1.005 * best


TURN = 0.7  # rad, of every arc to and fro


def arcs_to_and_fro(radius: float, feed: float, count: int) -> list[str]:
    """Arcs (mm) to the right and to the left in turn, at mm/s."""
    lines, x, y = [f"G1 F{60.0 * feed}"], 0.0, 0.0
    for k in range(count):
        side = 1.0 if k % 2 else -1.0
        old, new = (-TURN, 0.0) if k % 2 else (0.0, -TURN)
        i, j = -side * radius * math.sin(old), side * radius * math.cos(old)
        x += i + side * radius * math.sin(new)
        y += j - side * radius * math.cos(new)
        code = "G3" if k % 2 else "G2"
        lines.append(f"{code} X{x:.7f} Y{y:.7f} I{i:.7f} J{j:.7f}")
    return lines


def fastest_arc(radius: float, feed: float, accel: float, jerk: float) -> float:
    """Time (s) over one such arc without a limit of the path jerk: a pass to and fro
    over the acceleration that both axes leave. At its ends the acceleration steps by
    2 v^2 / R, and the cycle of 1 ms shows three quarters of it as jerk, of which half
    is for steps. Both directions take the same time.
    """
    count = 1000
    ds = TURN * radius / count
    angles = [TURN * k / count for k in range(count + 1)]  # turned right

    def most(angle: float, x: float, sign: float) -> float:
        """Largest path acceleration, or deceleration with a sign below 0."""
        c, s = math.cos(angle), math.sin(angle)
        bend = sign * x / radius
        return min((accel + s * bend) / c, (accel - c * bend) / max(s, 1e-9))

    def cap(angle: float, ends: bool) -> float:
        """Largest squared speed."""
        share = max(math.sin(angle), math.cos(angle))
        bend = jerk * 1e-3 / 3.0 if ends else accel
        return min(feed**2, bend * radius / share)

    x = [cap(angle, angle in (0.0, TURN)) for angle in angles]
    for k in range(count):
        rise = 2.0 * ds * most(angles[k], x[k], 1.0)
        x[k + 1] = min(x[k + 1], x[k] + rise)
    for k in range(count, 0, -1):
        fall = 2.0 * ds * most(angles[k], x[k], -1.0)
        x[k - 1] = min(x[k - 1], x[k] + fall)
    v = [math.sqrt(square) for square in x]
    return sum(2.0 * ds / (one + other) for one, other in pairwise(v))


@pytest.mark.parametrize(
    ("accel", "rate", "radius", "feed", "above"),
    [
        (234.0, 187.0, 12.5, 88.0, 1.035),
        (300.0, 300.0, 20.0, 100.0, 1.03),
        (234.0, 187.0, 12.5, 30.0, 1.025),
        (267.0, 1000.0, 3.4, 5.1, 1.002),
    ],
)
def test_single_slow_knots_have_a_place_in_the_guess(
    accel: float,
    rate: float,
    radius: float,
    feed: float,
    above: float,
    tmp_path: Path,
) -> None:
    """Arcs to and fro: the bend steps where they meet, so only single knots are slow.
    As fast as the acceleration allows, beside the time in which it builds up (up to
    33 % longer before: windows failed).
    """
    count = 40
    lines = arcs_to_and_fro(radius, feed, count)
    took = planned(lines, machine(accel, rate, 300.0), tmp_path).motion_time_s
    best = count * fastest_arc(radius, feed, accel, accel * rate)
    assert 0.999 * best <= took <= above * best
