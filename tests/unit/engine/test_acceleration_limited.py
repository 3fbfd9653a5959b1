"""Acceleration-limited programs: as fast as the limits of the axes allow, by
passes over a fine grid of their own.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig, parse_config
from cnc_core.engine import Engine
from cnc_core.planning import PlanResult, plan_program
from cnc_core.planning.picture import plan_picture
from cnc_core.program import Program
from support.drive import drive, line_rows
from support.limits import ratios

V, A = 300.0, 3000.0


def plan_of(path: Path, samples: bool = False) -> PlanResult:
    return plan_program(
        Program(path, CellConfig(), "isg"),
        window=120,
        jerk=False,
        keep_samples=samples,
    )


def fastest_circle(radius: float, feed: float, n: int = 20000) -> float:
    """Time of a full circle from rest to rest: the largest and least path
    acceleration at every knot, first order.
    """
    angle, h = np.linspace(0, 2 * np.pi, n + 1), 2 * np.pi * radius / n
    d1 = np.abs(np.column_stack([np.sin(angle), np.cos(angle)])) + 1e-9
    sign = np.sign(np.column_stack([-np.sin(angle), np.cos(angle)]) + 1e-12)
    d2 = -np.column_stack([np.cos(angle), np.sin(angle)]) / radius

    def bound(k: int, x: float, way: int) -> float:
        return float(((A - way * sign[k] * d2[k] * x) / d1[k]).min())

    cap = np.minimum(feed**2, (V / d1).min(axis=1) ** 2)
    x = cap.copy()
    for order, way in ((range(n, 0, -1), -1), (range(n), 1)):
        x[order[0]] = 0.0
        for k in order:
            x[k + way] = min(
                x[k + way],
                x[k] + 2 * h * max(bound(k, x[k], way), -x[k] / (2 * h)),
            )
    return float((2 * h / (np.sqrt(x[1:]) + np.sqrt(x[:-1]))).sum())


@pytest.mark.ci
@pytest.mark.parametrize(
    ("radius", "feed"),
    [(1000.0, 100.0), (50.0, 100.0), (8.0, 100.0), (8.0, 150.0)],
)
def test_a_circle_takes_the_shortest_time(
    program: Callable[..., Path], radius: float, feed: float
) -> None:
    """Gentle, where stretches are many ramps long, and as tight as the axes can follow."""
    path = program(f"F{60 * feed:g}\nG2 I{radius:g} J0\nM30\n")
    result = plan_of(path)
    assert result.motion_time_s <= 1.01 * fastest_circle(radius, feed)
    assert result.max_ratio["acceleration"] <= 1.01
    assert result.infeasible == 0


def hardest_stop(
    angle: float, way: int, radius: float, v: float, h: float = 0.005
) -> float:
    """Way to rest on a circle from speed v at an angle (way: 1, -1): the least
    path acceleration at every place.
    """
    x, s = v * v, 0.0
    while x > 0 and s < 10 * radius:
        c, n = (
            np.cos(angle + way * s / radius),
            np.sin(angle + way * s / radius),
        )
        d1, d2 = way * np.array([-n, c]), -np.array([c, n]) / radius
        x += (
            2
            * h
            * float((-(A + np.sign(d1) * d2 * x) / (np.abs(d1) + 1e-12)).max())
        )
        s += h
    return s


@pytest.mark.ci
@pytest.mark.parametrize("seed", range(6))
def test_a_hold_on_a_circle_takes_the_shortest_way(
    program: Callable[..., Path], seed: int
) -> None:
    """From the second cycle behind the hold on: at most 1.05 of braking as hard
    as the axes allow at every place.
    """
    rng = np.random.default_rng(seed)
    radius, moment, side = (
        float(rng.uniform(5, 30)),
        50 * int(rng.integers(3, 12)),
        int(rng.choice([2, 3])),
    )
    feed = float(rng.uniform(0.3, 0.9)) * np.sqrt(A * radius)
    path = program(
        f"F{60 * feed:g}\n" + f"G{side} I{radius:g} J0\n" * 4 + "M30\n"
    )
    calls = iter(range(100_000))

    def live(engine: Engine) -> None:
        k = 50 * (next(calls) + 1)
        engine.set_override(1.0, moment <= k < moment + 600)

    result = plan_program(
        Program(path, CellConfig(), "isg"),
        window=60,
        jerk=False,
        live=(50, live),
        keep_samples=True,
    )
    assert result.samples is not None
    q = result.samples["pos"][:, :2] - np.array([radius, 0.0])
    angle = np.unwrap(np.arctan2(q[:, 1], q[:, 0]))
    s = np.abs(angle - angle[0]) * radius
    at = moment + 2
    v, way = (
        float(s[at + 1] - s[at - 1]) / 0.002,
        1 if angle[-1] > angle[0] else -1,
    )
    stop = float(s[moment + 590] - s[at])
    assert v > 0.5 * feed
    assert s[moment + 500] == s[moment + 590]
    assert stop <= 1.05 * hardest_stop(angle[at], way, radius, v)
    assert result.max_ratio["acceleration"] <= 1.01


def test_unequal_axes_keep_their_speeds_between_knots(tmp_path: Path) -> None:
    """A circle at the speed limits: V / |q'| bends much where the slow axis takes over."""
    cell = CellConfig(
        axes={"X": {"v_max_mm_s": 60.0}, "Y": {"v_max_mm_s": 240.0}, "Z": {}}
    )  # type: ignore[dict-item]
    (tmp_path / "a.nc").write_text("F60000\nG2 I30 J0\nM30\n")
    result = plan_program(
        Program(tmp_path / "a.nc", cell, "isg"), window=30, jerk=False
    )
    assert 0.99 <= result.max_ratio["velocity"] <= 1.003


@pytest.mark.parametrize("tolerance", [0.003, 0.01, 0.05])
@pytest.mark.parametrize("turn", [20, 45, 90, 120])
def test_blended_corners_take_no_longer_than_exact_ones(
    turn: int, tolerance: float, tmp_path: Path
) -> None:
    """Long lines and a small blend: rounding at their joints is no corner
    beside which its curvature counts twice.
    """
    at = np.radians(turn)
    (tmp_path / "a.nc").write_text(
        f"G1 X7 F6000\nX{7 + 7 * np.cos(at):.5f} Y{7 * np.sin(at):.5f}\nM30\n"
    )
    exact, blended = (
        plan_program(
            Program(tmp_path / "a.nc", CellConfig(), "isg", tolerance=t),
            window=120,
            jerk=False,
        )
        for t in (0.0, tolerance)
    )
    assert blended.motion_time_s <= exact.motion_time_s * 1.0001


@pytest.mark.parametrize(
    ("cycle", "size"),
    [(0.00025, 1e-6), (0.00025, 1e-3), (0.001, 1e-4), (0.001, 0.01)],
)
@pytest.mark.parametrize("run", [1, 5])
def test_tiny_blocks_at_corners_leave_the_acceleration_to_them(
    cycle: float, size: float, run: int
) -> None:
    """Corners of 0.01 rad, behind each of them blocks shorter than a cycle:
    what lies beyond counts too.
    """
    points, heading = [np.zeros(3)], 0.0
    for _ in range(60):
        heading += 0.01
        along = np.array([np.cos(heading), np.sin(heading), 0.0])
        for length in [0.3, *[size] * run]:
            points.append(points[-1] + length * along)
    cell = parse_config(f"cycle_s = {cycle}\n")
    pos, _ = drive(line_rows(np.array(points), 100.0), cell, jerk=False)
    assert ratios(pos, cell, jerk=False)[1] <= 1.01


@pytest.mark.ci
def test_picture_has_a_curve_of_the_jerk(
    program: Callable[..., Path], tmp_path: Path
) -> None:
    """Path with its colour bar, speed, acceleration, jerk."""
    import matplotlib.pyplot as plt  # noqa: PLC0415

    plan_picture(
        tmp_path / "p.png",
        plan_of(program("G1 X5 F6000\nG2 I3\nM30\n"), samples=True).samples
        or {},
    )
    titles = [axes.get_title() for axes in plt.gcf().axes]
    assert any("jerk" in title for title in titles)
