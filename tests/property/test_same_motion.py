"""What leaves the fastest motion as it is leaves its time as it is: axes that stand still, limits
that nothing comes near, and points that a program has more or less of.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.planning import PlanResult, plan_program
from cnc_core.program import Program
from support.drive import FloatArray

Writer = Callable[..., Path]


def _axis(v: float, a: float, j: float) -> AxisConfig:
    return AxisConfig(v_max_mm_s=v, a_max_mm_s2=a, j_max_mm_s3=j)


def _even(axis: AxisConfig) -> CellConfig:
    """Three equal axes."""
    return CellConfig(axes=dict.fromkeys("XYZ", axis))


def _planned(path: Path, cell: CellConfig, tolerance: float) -> PlanResult:
    return plan_program(
        Program(path, cell, tolerance=tolerance), keep_samples=True
    )


def _lines(
    x: FloatArray, y: FloatArray, decimals: int = 4, names: str = "XY"
) -> list[str]:
    """A line of a program for each point."""
    return [
        f"{names[0]}{a:.{decimals}f} {names[1]}{b:.{decimals}f}\n"
        for a, b in zip(x, y, strict=True)
    ]


def _contour(chord: float, waves: int) -> str:
    """A closed contour of that many waves, 200 mm long, in the plane."""
    t = 2 * np.pi * np.arange(1, round(200 / chord) + 1) * chord / 200
    r = 31.83 * (1 + 0.2 * np.cos(waves * t))
    points = "".join(_lines(r * np.cos(t) - 38.2, r * np.sin(t), 3))
    return f"G1 F9000\n{points}M30\n"


@pytest.mark.parametrize(
    "z",
    [
        _axis(10.0, 3000.0, 50000.0),
        _axis(50.0, 500.0, 5000.0),
        _axis(10.0, 100.0, 1000.0),
    ],
)
@pytest.mark.parametrize(("chord", "waves"), [(1.0, 11), (3.0, 3)])
def test_a_slow_axis_that_stands_still(
    z: AxisConfig, chord: float, waves: int, program: Writer
) -> None:
    """A screw-driven Z made contours in XY up to three times as long: curves were shaped for the
    speed of the slowest axis.
    """
    path = program(_contour(chord, waves))
    quick = _axis(300.0, 3000.0, 50000.0)
    slow_z = CellConfig(axes={"X": quick, "Y": quick, "Z": z})
    even = _planned(path, _even(quick), 0.02)
    slow = _planned(path, slow_z, 0.02)
    assert slow.samples is not None
    assert not slow.samples["pos"][:, 2].any()
    assert slow.motion_time_s == pytest.approx(even.motion_time_s, rel=0.01)


@pytest.mark.parametrize(("v", "j"), [(20.0, 5000.0), (30.0, 20000.0)])
def test_an_acceleration_that_is_not_reached(
    v: float, j: float, program: Writer
) -> None:
    """More of it made coarse polylines 1.27 times as long: a curve's way was counted as if the
    jerk built up all of it.
    """
    heading = np.cumsum(np.where(np.arange(40) % 2, 0.6, -0.5))
    points = np.cumsum(
        3.0 * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0
    )
    text = "".join(_lines(*points.T, 3))
    path = program(f"G1 F6000\n{text}M30\n")
    times = [
        _planned(path, _even(_axis(v, a, j)), 0.02).motion_time_s
        for a in (1000.0, 3000.0, 20000.0)
    ]
    assert times == pytest.approx([times[0]] * 3, rel=0.005)


@pytest.mark.parametrize("parts", [20, 50])
def test_lines_cut_into_collinear_blocks(parts: int, program: Writer) -> None:
    """Sides of 5 mm in 50 blocks took 1.10 times as long: a corner was rounded as far as the
    first block behind it reaches.
    """

    def sides(count: int) -> Path:
        k = np.arange(40)[:, None]
        ends = np.hstack(
            [
                5 * np.cos(k * np.pi / 3) - 5 + 0.5 * k,
                5 * np.sin(k * np.pi / 3),
            ]
        ).round(4)
        share = np.arange(1, count + 1)[None, :, None] / count
        points = (
            ends[:-1, None] + share * (ends[1:, None] - ends[:-1, None])
        ).reshape(-1, 2)
        text = "".join(_lines(*points.T))
        return program(f"G1 F6000\n{text}M30\n", f"sides_{count}.nc")

    whole = _planned(sides(1), CellConfig(), 0.02)
    cut = _planned(sides(parts), CellConfig(), 0.02)
    assert cut.motion_time_s == pytest.approx(whole.motion_time_s, rel=0.003)


@pytest.mark.parametrize("count", [20, 40, 80])
@pytest.mark.parametrize("decimals", [6, 7, 8])
def test_a_circle_in_rounded_arcs(
    count: int, decimals: int, program: Writer
) -> None:
    """Without a tolerance: arcs that meet at 1e-6 rad took up to 1.58 times as long as the whole
    circle. Their joints were taken to be passed at the axes' largest speed.
    """
    cell = _even(_axis(800.0, 800.0, 2500.0))

    def circle(parts: int) -> Path:
        angle = 2 * np.pi * np.arange(parts + 1) / parts - np.pi / 2
        ends = np.column_stack([20 + 2 * np.cos(angle), 2 + 2 * np.sin(angle)])
        arcs = "".join(
            f"G3 X{x:.{decimals}f} Y{y:.{decimals}f} "
            f"I{20 - x0:.{decimals}f} J{2 - y0:.{decimals}f}\n"
            for (x0, y0), (x, y) in pairwise(ends)
        )
        return program(f"G1 X20 F3000\n{arcs}G1 X40 Y0\nM30\n")

    whole = _planned(circle(1), cell, 0.0).motion_time_s
    assert _planned(circle(count), cell, 0.0).motion_time_s <= 1.02 * whole


def _unequal(*axes: tuple[float, float, float]) -> CellConfig:
    return CellConfig(
        axes={name: _axis(*of) for name, of in zip("XYZ", axes, strict=True)}
    )


def test_more_acceleration_on_a_trochoid(program: Writer) -> None:
    """Half circles with short lines between and jerk limits 13 times apart: with more acceleration
    of X they took up to 1.04 times as long. Intervals of 0.08 ms used up the work that motion
    earns, so what windows brake for was driven.
    """
    loops = "".join(
        f"G3 X{x:.3f} Y8 I0 J4 F6000\nG3 X{x:.3f} Y0 I0 J-4\nG1 X{x + 0.8:.3f}\n"
        for x in 0.8 * np.arange(12)
    )
    path = program(f"{loops}M30\n")
    times = [
        _planned(
            path,
            _unequal(
                (44.1, a, 3.02e6),
                (93.7, 5100.0, 2.28e5),
                (41.3, 3670.0, 2.14e6),
            ),
            0.0,
        ).motion_time_s
        for a in (2930.0, 3200.0, 3500.0, 3809.0, 4500.0, 6000.0, 9000.0)
    ]
    assert all(later < 1.0005 * time for time, later in pairwise(times))


def test_half_circles_between_lines(program: Writer) -> None:
    """One of four windows stopped next to a joint that it need not stop at: a plan made while it
    brakes began with a guess that did. Such a plan is not taken.
    """
    slots = "".join(
        f"G1 X{x:.3f} Y24.588 F15561\nG2 X{x + 4.41:.3f} I2.205 J0\n"
        f"G1 Y0\nG3 X{x + 8.82:.3f} I2.205 J0\n"
        for x in 8.82 * np.arange(6)
    )
    path = program(f"{slots}M30\n")
    cell = _unequal(
        (118.7, 2662.0, 25108.0),
        (244.5, 5749.0, 152577.0),
        (37.2, 1859.0, 821155.0),
    )
    times = [
        plan_program(
            Program(path, cell, tolerance=0.0), window=window
        ).motion_time_s
        for window in (40, 70, 120, 250)
    ]
    assert max(times) < 1.003 * min(times)


def test_more_acceleration_between_stands(program: Writer) -> None:
    """Half circles that run out into lines, with stands between. With more acceleration the last
    interval of each, over which the jerk is constant, became longer, and the time with it.
    """
    text = "".join(
        f"G3 X{x + 3.7:.1f} I1.85 J0 F12000\nG1 Y0.5\nG1 X{x + 5.7:.1f} Y0\n"
        for x in 5.7 * np.arange(4)
    )
    path = program(f"{text}M30\n")
    times = [
        _planned(path, _even(_axis(450.0, accel, 7600.0)), 0.0).motion_time_s
        for accel in (700.0, 1000.0, 1500.0, 2500.0, 5600.0, 20000.0)
    ]
    assert all(later < 1.0005 * time for time, later in pairwise(times))


def test_tolerance_for_segments_of_a_millimetre(program: Writer) -> None:
    """Within 0.05 mm they take less than two thirds of the time within 0.01 mm. Curves over points
    that are near beside the tolerance were not made faster.
    """
    rng = np.random.default_rng(3)
    heading = np.cumsum(np.radians(12) * rng.uniform(-1, 1, 200))
    points = np.cumsum(
        np.column_stack([np.cos(heading), np.sin(heading)]), axis=0
    )
    text = "".join(_lines(*points.T))
    path = program(f"G1 F6000\n{text}M30\n")
    fine, wide = (
        _planned(path, CellConfig(), tolerance).motion_time_s
        for tolerance in (0.01, 0.05)
    )
    assert wide < 0.66 * fine


def _wave(chord: float) -> str:
    """A closed curve of random waves, some 33 mm long, in chords."""
    rng = np.random.default_rng(2)
    t = np.linspace(0, 2 * np.pi, 20001)
    k = np.arange(1, 9)[:, None]
    waves = rng.normal(size=(4, 8, 1)) * 2.0 / k**1.3
    curve = np.column_stack(
        [
            (waves[i] * np.cos(k * t) + waves[i + 1] * np.sin(k * t)).sum(0)
            for i in (0, 2)
        ]
    )
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve.T)))])
    at = np.arange(0.0, way[-1], chord)
    x, y = (np.interp(at, way, values) for values in curve.T)
    return "".join(_lines(x, y, 3))


def test_more_points_of_a_curve(program: Writer) -> None:
    """The same curve in chords of 0.1 and of 0.3 mm. Points near beside the tolerance were fitted,
    but the curve was not made faster: 1.12 times the time.
    """
    many, few = (
        _planned(
            program(f"G1 F6000\n{_wave(step)}M30\n"), CellConfig(), 0.05
        ).motion_time_s
        for step in (0.1, 0.3)
    )
    assert many < 1.01 * few


def test_tolerance_for_a_circle_on_unequal_axes(program: Writer) -> None:
    """Each larger tolerance is worth something. Knots are closer at a standstill, where the speed
    rises at once: between those a millimetre apart the first one of a curve took longer.
    """
    a = np.arange(1, 102) * 0.06
    text = "".join(_lines(5 * np.sin(a), 5 - 5 * np.cos(a)))
    path = program(f"G1 F18000\n{text}M30\n")
    cell = _unequal(
        (300.0, 3000.0, 50000.0),
        (300.0, 3000.0, 5000.0),
        (300.0, 3000.0, 20000.0),
    )
    times = [
        _planned(path, cell, tolerance).motion_time_s
        for tolerance in (0.01, 0.02, 0.05, 0.1)
    ]
    assert all(later < 0.9995 * time for time, later in pairwise(times))


def test_tolerance_for_a_wavy_surface(program: Writer) -> None:
    """Each larger tolerance is worth something, though the axes are unequal. Steps of the law of
    motion overshot, and it was left as it was: up to 1.03 times the time.
    """
    x = 0.22 * np.arange(1, 56)
    z = 0.045 * np.sin(2 * np.pi * x / 2.2)
    there = _lines(x, z, names="XZ")
    path = program(
        "".join(["G1 F1260\n", *there, "Y0.4\n", *there[::-1], "M30\n"])
    )
    cell = _unequal(
        (350.0, 8800.0, 280000.0),
        (260.0, 7400.0, 13000.0),
        (130.0, 7300.0, 18000.0),
    )
    times = [
        _planned(path, cell, tolerance).motion_time_s
        for tolerance in (0.004, 0.0045, 0.005, 0.0055, 0.006, 0.007, 0.008)
    ]
    assert all(later < time for time, later in pairwise(times)), times


@pytest.mark.parametrize(
    ("before", "short"), [(40, 0.03), (40, 0.06), (100, 0.06)]
)
def test_a_corner_that_no_curve_passes(
    before: int, short: float, program: Writer
) -> None:
    """A corner of 119 degrees on a chord shorter than the tolerance, near the end: no slower than
    with a dwell in it. All points ahead of it were corners of their own, 2 to 4 times as long.
    """
    turns = np.zeros(before + 5)
    turns[1:] = 0.06
    turns[before], turns[before + 1] = np.radians(30), np.radians(119.4)
    lengths = np.full(before + 5, 0.09)
    lengths[before] = short
    heading = np.cumsum(turns)
    points = np.cumsum(
        lengths[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]),
        axis=0,
    )
    lines = _lines(*points.T)
    stops = [*lines[: before + 1], "G4 X0.001\nG1\n", *lines[before + 1 :]]
    through, stopping = (
        _planned(
            program(f"G1 F6000\n{''.join(body)}M30\n"), CellConfig(), 0.11
        ).motion_time_s
        for body in (lines, stops)
    )
    assert through < stopping


def _raster(length: float, step: float, lines: int) -> str:
    """Lines to and fro along X, each a step of Y from the last."""
    k = np.arange(2 * lines)
    x = length * ((k // 2 + 1) % 2)
    y = step * ((k + 1) // 2)
    return f"G1 F30000\n{''.join(_lines(x, y))}M30\n"


def _costs_nothing(times: list[float]) -> bool:
    """Each takes less than 1.01 of the one before."""
    return all(later < 1.01 * time for time, later in pairwise(times))


@pytest.mark.parametrize(
    ("limits", "raster", "tolerances"),
    [
        ((152, 11235, 1944965), (5.0, 0.1, 20), (0.008, 0.009, 0.01, 0.011)),
        ((152, 4708, 481000), (1.494, 0.092, 20), (0.0046, 0.0051, 0.0054)),
        ((100, 14047, 920000), (9.593, 0.0479, 20), (0.0061, 0.0063, 0.0067)),
        ((300, 3000, 50000), (20.0, 0.05, 10), (0.04, 0.08, 0.1, 0.15)),
        ((43, 1506, 154272), (0.3381, 0.0662, 10), (0.05, 0.08, 0.1, 0.25)),
        ((300, 3000, 50000), (3.7655, 0.0768, 10), (0.0162, 0.0166, 0.017)),
    ],
)
def test_tolerance_for_a_raster(
    limits: tuple[float, float, float],
    raster: tuple[float, float, int],
    tolerances: tuple[float, ...],
    program: Writer,
) -> None:
    """More of it never costs 1 %. The first three: windows were refused where an axis needs most of
    its jerk inside the first interval of a turn, and every second turn was a stop. The next two:
    curves sought in all of the tolerance went backwards along the steps, and turns became corners,
    up to 2.5 times as long. The last: a wall beyond the tolerance kept a curve slow, 1.2 times.
    """
    path = program(_raster(*raster))
    cell = _even(_axis(*limits))
    times = [_planned(path, cell, t).motion_time_s for t in tolerances]
    assert _costs_nothing(times), times


def test_tolerance_for_a_raster_without_jerk(program: Writer) -> None:
    """More of it never costs 1 %: turns that became corners took 1.5 times as long."""
    path = program(_raster(1.8151, 0.8691, 12))
    cell = _even(_axis(100.0, 5000.0, 166666.0))
    times = [
        plan_program(
            Program(path, cell, tolerance=share * 0.8691), jerk=False
        ).motion_time_s
        for share in (0.25, 0.3, 0.33, 0.36, 0.39, 0.48)
    ]
    assert _costs_nothing(times), times
