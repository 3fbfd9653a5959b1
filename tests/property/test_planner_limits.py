"""Seeded properties of planner and interpolator: limits at the cycle, end
point, live changes, late planner.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.engine import Engine
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.drive import FloatArray, drive, line_rows
from support.limits import ratios
from support.seeds import few

pytestmark = pytest.mark.sanitize("engine", "jerk")


def polyline(rng: np.random.Generator) -> FloatArray:
    """Random walks of all scales, smooth curves in short segments, noise,
    clusters, straight runs of tiny blocks.
    """
    n, kind = int(rng.integers(3, 700)), int(rng.integers(0, 5))
    if kind == 0:
        scale = rng.lognormal(rng.uniform(-5, 2), rng.uniform(0.1, 2.5), (n, 1))
        points = np.cumsum(rng.normal(size=(n, 3)) * scale, axis=0)
    elif kind == 1:
        t = np.cumsum(rng.uniform(0.0005, 0.05, n))
        points = np.column_stack(
            [30 * np.cos(t), 20 * np.sin(t * 1.3), 3 * np.sin(5 * t)]
        ).round(int(rng.integers(2, 5)))
    elif kind == 2:
        noise = rng.normal(size=(n, 2)) * rng.uniform(0, 0.05)
        points = np.cumsum(
            np.column_stack([rng.uniform(0, 0.3, n), noise]), axis=0
        )
    elif kind == 3:
        points = (
            np.repeat(rng.uniform(-20, 20, (n // 4 + 1, 3)), 4, axis=0)[:n]
            + rng.normal(size=(n, 3)) * 1e-3
        )
    else:
        x = np.where(np.arange(n) % 7 < 3, 0.001, rng.uniform(0.01, 5))
        points = np.cumsum(
            np.column_stack(
                [x, rng.choice([0, 0.0005, -0.002], n), np.zeros(n)]
            ),
            axis=0,
        )
    points[0] = 0.0
    return np.asarray(points)


def random_cell(rng: np.random.Generator) -> CellConfig:
    accel, speed = (
        rng.choice([300.0, 3000.0, 20000.0], 3),
        rng.choice([50.0, 300.0, 1000.0], 3),
    )
    axes = {
        n: AxisConfig(a_max_mm_s2=float(a), v_max_mm_s=float(v))
        for n, a, v in zip("XYZ", accel, speed, strict=True)
    }
    return CellConfig(axes=axes)


def _drive(
    seed: int, live: bool, step: int, jerk: bool
) -> tuple[float, float, bool, int]:
    """(velocity, acceleration) over their limits, whether the end is met
    exactly, infeasible states.
    """
    rng = np.random.default_rng(seed)
    points, cell = polyline(rng), random_cell(rng)
    rows = line_rows(points, float(rng.choice([5.0, 50.0, 300.0, 2000.0])))
    window = int(rng.choice([30, 120, 190]))

    def change(_k: int, engine: Engine) -> None:
        engine.set_override(
            float(rng.choice([0.0, 0.1, 0.5, 1.0, 1.3, 2.0])),
            bool(rng.random() < 0.15),
        )

    pos, state = drive(
        rows, cell, window, *((step, change) if live else ()), jerk=jerk
    )
    velocity, acceleration = ratios(pos, cell, jerk)
    return (
        velocity,
        acceleration,
        bool((pos[-1] == rows["end"][-1][:3]).all()),
        int(state.infeasible),
    )


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(24), 4))
@pytest.mark.parametrize(
    "live", [False, True], ids=["steady", "override and hold"]
)
def test_samples_respect_axis_limits(seed: int, live: bool) -> None:
    """Any polyline, machine, window and feed, with override steps and feed
    holds at random: every sample is legal.
    """
    velocity, acceleration, ends, infeasible = _drive(
        seed, live, 149, jerk=True
    )
    assert velocity <= 1.005
    assert acceleration <= 1.02
    assert ends
    assert infeasible == 0


@pytest.mark.parametrize("seed", [18, 182, 402])
def test_an_acceleration_is_largest_between_the_places_looked_at(
    seed: int,
) -> None:
    """Little acceleration and much jerk: where the path jerk changed its sign
    inside an interval, samples had 1.03 to 1.06 of the limit once.
    """
    velocity, acceleration, ends, _ = _drive(seed, True, 149, jerk=True)
    assert velocity <= 1.005
    assert acceleration <= 1.02
    assert ends


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(40), 6))
@pytest.mark.parametrize(
    "live", [False, True], ids=["steady", "override and hold"]
)
def test_without_jerk_samples_respect_axis_limits(
    seed: int, live: bool
) -> None:
    """The same of the acceleration-limited planner, with more changes."""
    velocity, acceleration, ends, infeasible = _drive(
        seed, live, 37, jerk=False
    )
    assert velocity <= 1.0001
    assert acceleration <= 1.02
    assert ends
    assert infeasible == 0


@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("seed", few(range(10), 5))
def test_a_late_planner_leads_to_the_stopping_tail(
    seed: int, jerk: bool
) -> None:
    """While the planner gets no turn the axes brake legally and stand;
    afterwards the path goes on exactly.
    """
    rng = np.random.default_rng(seed)
    points, cell = polyline(rng), random_cell(rng)
    rows = line_rows(points, 200.0)

    def stall(k: int, engine: Engine) -> None:
        engine.stall_planner(k % 3 == 1)

    pos, state = drive(rows, cell, 120, 61, stall, jerk=jerk)
    assert ratios(pos, cell, jerk)[1] <= 1.02
    assert (pos[-1] == rows["end"][-1][:3]).all()
    assert state.infeasible == 0


def arc_program(rng: np.random.Generator) -> str:
    """Lines, arcs and helices of all sizes, tangential and not, rapid and feed, dwells between."""
    lines, at, z = ["G90 G17 F6000"], 0j, 0.0
    for _ in range(150):
        if rng.random() < 0.45:
            at += complex(
                *(rng.normal(size=2) * rng.lognormal(0, 1.5)).round(4)
            )
            lines.append(
                f"{rng.choice(['G1', 'G1', 'G0'])} X{at.real:.4f} Y{at.imag:.4f} Z{z:.3f}"
            )
        else:
            radius, angle, sweep = (
                rng.lognormal(0.5, 1.5) + 0.01,
                rng.uniform(0, 2 * math.pi),
                rng.uniform(0.01, 6.2),
            )
            sign = rng.choice([-1, 1])
            centre = at - radius * np.exp(1j * angle)
            end = centre + radius * np.exp(1j * (angle + sign * sweep))
            height = ""
            if rng.random() < 0.3:
                z = round(z + float(rng.uniform(-2, 2)), 3)
                height = f" Z{z:.3f}"
            i, j = (centre - at).real, (centre - at).imag
            code = "G3" if sign > 0 else "G2"
            lines.append(
                f"{code} X{end.real:.7f} Y{end.imag:.7f}{height} I{i:.7f} J{j:.7f}"
            )
            at = complex(round(end.real, 7), round(end.imag, 7))
        if rng.random() < 0.03:
            lines.append("G4 X0.005")
    return "\n".join([*lines, "M30", ""])


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(8), 4))
def test_arcs_and_helices_are_driven_exactly_and_legally(
    seed: int, program: Callable[..., Path]
) -> None:
    """Measured by a check that did not plan: limits, feed and distance from the
    programmed contour.
    """
    path = program(arc_program(np.random.default_rng(seed)))
    result = plan_program(
        Program(path, CellConfig()), window=[30, 120, 190][seed % 3]
    )
    assert result.max_ratio["velocity"] <= 1.0001
    assert result.max_ratio["acceleration"] <= 1.02
    assert result.max_ratio["feed"] <= 1.005
    assert result.path_deviation_mm <= 1e-6
    assert result.infeasible == 0
