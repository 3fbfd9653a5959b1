"""Coarse data on a machine with limited jerk: the curve is chosen for the time
that its motion takes, inside the same certified tolerance.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import RAPID, BlockBatch
from cnc_core.config import CellConfig, parse_config
from cnc_core.engine import Engine, Event
from cnc_core.planning import plan_program
from cnc_core.planning.measure import TrajectoryCheck
from cnc_core.program import Program
from support.drive import FloatArray, line_rows
from support.smoothed_paths import (
    FIVE_AXES,
    MACHINE,
    distance,
    executed,
    judge,
    rounded_curve,
    sampled,
    smooth,
)

pytestmark = pytest.mark.sanitize("stages/smoothing")

JERK = 50000.0
FAST = replace(MACHINE, jerk=JERK)


def coarse(seed: int, turn: float, count: int = 24) -> FloatArray:
    """Chords of 0.5 to 3 mm in the plane, turns up to so many degrees."""
    rng = np.random.default_rng(seed)
    angle = np.cumsum(rng.uniform(-1.0, 1.0, count)) * np.radians(turn)
    length = rng.uniform(0.5, 3.0, count)
    steps = np.column_stack(
        [length * np.cos(angle), length * np.sin(angle), 0.0 * angle]
    )
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]).round(4)


def driven(
    batch: BlockBatch, cell: CellConfig | None = None
) -> tuple[float, TrajectoryCheck]:
    """Motion time, and the check of all samples."""
    cell = cell or CellConfig()
    engine, check, first = (
        Engine(cell, record_rows=65536),
        TrajectoryCheck(cell),
        0,
    )
    check.table.add(batch.rows, batch.pool)
    while (event := engine.run(1_000_000)) in (
        Event.NEED_BLOCKS,
        Event.RECORD_FULL,
    ):
        if event is Event.NEED_BLOCKS:
            first += engine.push(batch, first)
            if first == len(batch.rows):
                engine.finish()
        check.add(engine.take_samples())
    check.add(engine.take_samples())
    check.finish()
    time = float(engine.state.motion_time_s)
    engine.close()
    return time, check


@pytest.mark.ci_cases
@pytest.mark.parametrize(("turn", "gain"), [(25, 0.03), (60, 0.06), (90, 0.08)])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_machine_with_limited_jerk_is_faster(
    turn: int, gain: float, seed: int
) -> None:
    """The motion takes less time than over the curve that knows no jerk, within
    the same tolerance and within all limits on every sample.
    """
    points = coarse(seed, turn)
    rows = line_rows(points, 100.0)
    plain, _ = smooth(rows, points[0], 0.01)
    chosen, report = smooth(rows, points[0], 0.01, machine=FAST)
    judge(rows, points[0], 0.01, chosen)
    assert report.deviation <= 0.01 * (1 + 1e-9)
    assert report.irregular == report.fallbacks == 0
    before, _ = driven(plain)
    time, check = driven(chosen)
    assert time < (1.0 - gain) * before
    assert check.ratio["velocity"] <= 1.0
    assert check.ratio["acceleration"] <= 1.02
    assert check.ratio["jerk"] <= 1.02
    assert check.ratio["feed"] <= 1.005
    assert check.deviation <= 0.01 + 1e-9


# tolerance, feed, seconds of the fastest motion of any kind (bench/tube_oracle),
# points: each was slower by 6 to 18 % once, for the reason that is its name
SLOW_ONCE = {
    "a first law that is far off": (
        0.01,
        100.0,
        0.3392,
        "0,0 0.6537,0.0269 3.4584,0.469 5.4702,0.5511 7.9052,0.5594 "
        "10.6616,0.6102 13.5246,0.4321 16.1837,0.4505 17.5946,0.3911 "
        "20.3216,0.1122 21.0827,0.1166 22.945,0.1924 24.5924,0.1625",
    ),
    "few spans for each point": (
        0.02,
        200.0,
        0.2580,
        "0,0,0 0.5985,0,0 1.8497,-0.0372,-0.06 3.8233,-0.0698,-0.0397 "
        "4.4593,-0.0945,-0.0152 6.2071,-0.1552,0.0403 7.094,-0.2942,0.1493 "
        "9.8639,-0.7325,0.5217 11.7207,-1.1727,0.9954 "
        "14.4778,-1.7949,1.5702 16.7713,-2.3733,2.0979 "
        "17.8393,-2.7797,2.2183 19.0399,-3.2605,2.2848",
    ),
    "a hump at the edge of what the certificate looks at": (
        0.02,
        100.0,
        0.8229,
        "0,0 0.9245,0 2.3529,0.7278 1.3066,2.7812 3.2498,3.7713 "
        "3.8547,4.2108 2.8264,5.6261 0.1704,6.9794 -0.3192,6.0186 "
        "-0.3192,4.2699 1.8687,4.2699 3.668,5.1866 4.4484,3.6551 "
        "6.2346,2.3574 9.0786,1.9069",
    ),
    "right angles between lines": (
        0.01,
        200.0,
        1.0461,
        "0,0 2.3251,0 2.3251,2.3251 4.6502,2.3251 4.6502,4.6502 "
        "6.9754,4.6502 6.9754,6.9754 9.3005,6.9754 9.3005,9.3005 "
        "11.6256,9.3005 11.6256,11.6256 13.9507,11.6256 13.9507,13.9507",
    ),
    "right angles of chords": (
        0.02,
        50.0,
        0.6273,
        "0,0 0.8097,0 0.8097,0.8259 -0.0324,0.8259 -0.0324,-0.0324 "
        "0.8421,-0.0324 0.8421,0.8583 -0.0648,0.8583 -0.0648,-0.0648 "
        "0.8745,-0.0648 0.8745,0.8907 -0.0972,0.8907 -0.0972,-0.0972",
    ),
    "jerk that a sum of fourth powers leaves unused": (
        0.05,
        200.0,
        0.5332,
        "0,0 -0.5006,1.8099 -1.8601,3.1054 -3.6921,3.5182 "
        "-5.4758,2.9309 -6.7042,1.5106 -7.0282,-0.3392 -6.3556,-2.0925 "
        "-4.8777,-3.2511 -3.0145,-3.4855 -1.2956,-2.7292 "
        "-0.2097,-1.1971 -0.0653,0.6752 -0.9036,2.3556 -2.4862,3.3665",
    ),
    "less than a span for each point": (
        0.05,
        200.0,
        0.2587,
        "0,0 1.0668,-0.1091 2.22,-0.0929 4.0975,0.1092 5.8036,0.2265 "
        "8.1008,0.2354 10.5394,0.4487 12.009,0.3218 14.0792,0.1768 "
        "15.6802,0.002 18.1791,0.0398 18.8324,0.0743 20.6095,0.1443",
    ),
    "a window that does not go on as the one before": (
        0.01,
        200.0,
        1.0483,
        "0,0 2.6466,-0.0031 4.995,-0.0252 7.0805,-0.0753 7.8307,-0.0064 "
        "10.1521,0.34 11.4097,0.6766 12.3935,0.8201 15.2853,1.407 "
        "16.9867,1.5299 17.7522,1.4606 18.9053,1.2064 21.1568,0.8018 "
        "22.4581,0.7785 25.2655,0.6281 27.3541,0.2727 28.6745,-0.026 "
        "31.2206,-0.6656 32.5259,-0.8926 34.0652,-0.9218 34.65,-0.9947 "
        "35.9777,-1.2219 38.7241,-2.0512 39.9583,-2.6281 40.7183,-2.858 "
        "42.9096,-3.2546 45.4719,-3.7961 46.2507,-4.0886 "
        "47.2729,-4.4953 49.8087,-5.7201 51.3961,-6.5233 "
        "52.3535,-7.1164 54.6282,-8.0871 56.1105,-8.8611 "
        "57.3989,-9.4739 58.2486,-9.732 58.8585,-9.8794 "
        "59.4625,-10.0131 60.3036,-10.0709 62.8007,-10.5848 "
        "65.6602,-11.1191 67.4054,-11.6802 68.1404,-11.9598 "
        "70.5212,-13.0006 72.0945,-13.5281",
    ),
}


@pytest.mark.parametrize("reason", SLOW_ONCE)
def test_the_motion_is_close_to_the_fastest_of_any_kind(reason: str) -> None:
    """At most 5 % more time than the fastest motion inside the tolerance."""
    tolerance, feed, seconds, text = SLOW_ONCE[reason]
    flat = [[float(v) for v in point.split(",")] for point in text.split()]
    points = np.zeros((len(flat), 3))
    points[:, : len(flat[0])] = flat
    rows = line_rows(points, feed)
    machine = replace(FAST, feed=300.0)
    batch, report = smooth(rows, points[0], tolerance, machine=machine)
    judge(rows, points[0], tolerance, batch)
    assert report.deviation <= tolerance * (1 + 1e-9)
    time, check = driven(batch)
    assert time <= 1.05 * seconds
    assert check.ratio["jerk"] <= 1.02


@pytest.mark.parametrize(("feed", "blends"), [(5.0, 1), (50.0, 1), (200.0, 0)])
def test_a_corner_is_cut_where_the_blend_passes_at_the_feed(
    feed: float, blends: int
) -> None:
    """Then nothing is faster than the shorter way; at more feed it swings out."""
    points = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]])
    rows = line_rows(points, feed)
    machine = replace(FAST, feed=300.0)
    batch, report = smooth(rows, points[0], 1.0, machine=machine)
    judge(rows, points[0], 1.0, batch)
    assert report.corners == blends


def test_a_curve_that_knows_the_quick_axes_is_faster() -> None:
    """A zigzag where X may jerk a tenth of Y: with the limits of both the motion
    is at least 3 % faster than with the lower one for both.
    """
    points = np.array([[2.0 * i, 0.8 * (i % 2), 0.0] for i in range(12)])
    rows = line_rows(points, 200.0)
    limit = f"v_max_mm_s = {FAST.feed}\na_max_mm_s2 = {FAST.accel}\n"
    jerks = (0.1 * FAST.jerk, FAST.jerk, FAST.jerk)
    cell = parse_config(
        "".join(
            f"[axes.{name}]\n{limit}j_max_mm_s3 = {jerk}\n"
            for name, jerk in zip("XYZ", jerks, strict=True)
        ),
        "cell.toml",
    )
    times = []
    for each in ((), jerks):
        machine = replace(FAST, jerk=jerks[0], axis_jerk=each)
        batch, _ = smooth(rows, points[0], 0.02, machine=machine)
        judge(rows, points[0], 0.02, batch)
        time, check = driven(batch, cell)
        assert check.ratio["jerk"] <= 1.02
        times.append(time)
    assert times[1] <= 0.97 * times[0]


@pytest.mark.ci_cases(4)
@pytest.mark.parametrize("seed", range(24))
def test_every_coarse_path_stays_within_the_tolerance(seed: int) -> None:
    """Random sections of many windows in space, with changes of feed, whatever
    the tolerance and the jerk: both ways within it, smooth, to the exact end.
    """
    rng = np.random.default_rng(seed)
    tolerance = float(rng.choice([0.003, 0.01, 0.05]))
    machine = replace(MACHINE, jerk=float(10.0 ** rng.uniform(3.0, 6.5)))
    points = np.cumsum(
        rng.normal(size=(60, 3)) * rng.uniform(0.1, 1.0) + [1.0, 0.0, 0.0],
        axis=0,
    ).round(3)
    points = points - points[0]
    rows = line_rows(points, 100.0)
    rows["feed"] = rng.choice([20.0, 200.0], size=6).repeat(10)[: len(rows)]
    batch, report = smooth(rows, points[0], tolerance, machine=machine)
    judge(rows, points[0], tolerance, batch)
    assert report.deviation <= tolerance * (1 + 1e-9)
    assert report.irregular == 0


@pytest.mark.parametrize("chunk", [1, 7])
def test_batches_do_not_matter_for_coarse_data(chunk: int) -> None:
    """The same rows come out, whatever the batches were."""
    points = coarse(3, 60, count=60)
    rows = line_rows(points, 100.0)
    whole, _ = smooth(rows, points[0], 0.01, machine=FAST)
    parts, _ = smooth(rows, points[0], 0.01, chunk, machine=FAST)
    assert whole.rows.tobytes() == parts.rows.tobytes()
    assert (whole.pool == parts.pool).all()


@pytest.mark.parametrize("way", [0.1, 17.3, 4321.7])
def test_a_section_does_not_depend_on_the_way_ahead_of_it(way: float) -> None:
    """Behind two rapids of any length the curve is the same to the last bit: restarts find it."""
    points = coarse(3, 60)
    rows = line_rows(points, 100.0)
    there = np.array([[0.0, 0.0, 0.0], [way, 0.0, 0.0], [0.0, 0.0, 0.0]])
    rapids = line_rows(there, 0.0)
    rapids["flags"] |= RAPID
    alone, _ = smooth(rows, points[0], 0.01, machine=FAST)
    behind, _ = smooth(
        np.concatenate([rapids, rows]), points[0], 0.01, machine=FAST
    )
    assert (alone.pool == behind.pool).all()
    own, other = executed(alone), executed(behind)[2:]
    assert (own["end"] == other["end"]).all()


def test_dense_data_do_not_change() -> None:
    """Where there is nothing to gain the machine's jerk makes no difference."""
    points = rounded_curve(np.random.default_rng(4), 600, 0.2)
    rows = line_rows(points, 100.0)
    plain, _ = smooth(rows, points[0], 0.01)
    fast, _ = smooth(rows, points[0], 0.01, machine=FAST)
    assert plain.rows.tobytes() == fast.rows.tobytes()
    assert (plain.pool == fast.pool).all()


def five_axis_points() -> FloatArray:
    """Main axes in coarse chords, both rotary axes to and fro with them."""
    main = coarse(5, 50)
    t = np.linspace(0.0, 3.0, len(main))
    rotary = np.column_stack(
        [4.0 * np.sin(5.0 * t), 6.0 * np.cos(7.0 * t) - 6.0]
    )
    return np.column_stack([main, rotary]).round(4)


def test_rotary_axes_keep_to_their_own_tolerance() -> None:
    """Linear and rotary deviation each within theirs, sampled from outside."""
    points = five_axis_points()
    rows = line_rows(points, 100.0)
    rows["length"] = rows["length_min"] = np.linalg.norm(
        np.diff(points[:, :3], axis=0), axis=1
    )
    machine: Any = replace(FIVE_AXES, jerk=JERK)
    batch, report = smooth(
        rows, points[0], 0.01, machine=machine, rotary_tolerance=0.05
    )
    path = sampled(batch, points[0]).reshape(-1, 5)
    assert report.curves > len(rows)
    assert distance(points[:, :3], path[:, :3]) <= 0.01
    assert distance(points[:, 3:], path[:, 3:]) <= 0.05


@pytest.mark.ci
@pytest.mark.parametrize(
    ("seed", "turn", "tolerance", "one_window_s"),
    [(2, 90, 0.05, 1.7543), (11, 60, 0.05, 1.3809), (9, 90, 0.02, 2.3502)],
)
def test_a_window_goes_on_at_the_speed_of_the_one_before(
    tmp_path: Path,
    seed: int,
    turn: float,
    tolerance: float,
    one_window_s: float,
) -> None:
    """Several windows take the time that one large window for all of the polyline
    takes. Found anew, at a speed that it does not know, a window makes these 1.08,
    1.05 and 1.03 times as long.
    """
    lines = [f"G1 X{x:.4f} Y{y:.4f}" for x, y, _ in coarse(seed, turn, 40)[1:]]
    path = tmp_path / "part.nc"
    path.write_text("\n".join(["G90 F6000", *lines, "M30"]))
    plan = plan_program(Program(path, CellConfig(), tolerance=tolerance))
    assert plan.motion_time_s <= 1.005 * one_window_s
    assert max(plan.max_ratio.values()) <= 1.02
