"""Motion time of tangential lines and arcs without jerk beside the optimum,
which scipy's linear programming finds.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse import diags, vstack

from cnc_core.config import AxisConfig, CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.drive import FloatArray

Chain = list[
    tuple[float, float]
]  # (length, curvature) of each piece; to the left: positive
SPACING = 0.01  # rad or mm between knots of the oracle


def derivatives(
    chain: Chain, heading: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Lengths of intervals, q' and q'' in their middles, |q'| of both axes at all knots."""
    h, middle, knots, bend = [], [], [heading], []
    for length, curvature in chain:
        n = max(60, int(np.ceil(length * max(1.0, abs(curvature)) / SPACING)))
        turn = curvature * length * np.arange(n + 1) / n
        h.append(np.full(n, length / n))
        middle.append(heading + 0.5 * (turn[1:] + turn[:-1]))
        bend.append(np.full(n, curvature))
        knots.extend(heading + turn[1:])
        heading += curvature * length
    at, kappa = np.concatenate(middle), np.concatenate(bend)[:, None]
    d1, d2 = (
        np.column_stack([np.cos(at), np.sin(at)]),
        kappa * np.column_stack([-np.sin(at), np.cos(at)]),
    )
    return (
        np.concatenate(h),
        d1,
        d2,
        np.abs(np.column_stack([np.cos(knots), np.sin(knots)])),
    )


def optimum(
    chain: Chain, heading: float, feed: float, v: FloatArray, a: FloatArray
) -> float:
    """TOPP2: x = (ds/dt)^2 / feed^2 at knots is largest everywhere at once, so
    the sum of all x is too.
    """
    h, d1, d2, d1_at = derivatives(chain, heading)
    n = len(h)
    mean = diags([0.5, 0.5], [0, 1], shape=(n, n + 1))
    slope = diags(0.5 / h) @ diags([-1.0, 1.0], [0, 1], shape=(n, n + 1))
    rows = [
        (diags(d1[:, i]) @ slope + diags(d2[:, i]) @ mean) * feed**2 / a[i]
        for i in range(2)
    ]
    caps = np.minimum(
        1.0, ((v[:2] / np.maximum(d1_at, 1e-9)).min(axis=1) / feed) ** 2
    )
    caps[[0, -1]] = 0.0
    found = linprog(
        -np.ones(n + 1),
        A_ub=vstack([r * s for r in rows for s in (1, -1)]).tocsr(),
        b_ub=np.ones(4 * n),
        bounds=np.column_stack([np.zeros(n + 1), caps]),
        method="highs",
    )
    assert found.status == 0, found.message
    root = np.sqrt(np.maximum(found.x, 0.0))
    return float((2.0 * h / (root[1:] + root[:-1])).sum() / feed)


def write(path: Path, chain: Chain, heading: float, feed: float) -> Path:
    """The chain as a program of G1, G2, G3 in full digits."""
    at, lines = 0j, [f"G1 F{60 * feed:.9f}"]
    for length, curvature in chain:
        turn = curvature * length
        if curvature == 0.0:
            at += length * np.exp(1j * heading)
            lines.append(f"G1 X{at.real:.12f} Y{at.imag:.12f}")
        else:
            to_centre = 1j * np.exp(1j * heading) / curvature
            at += to_centre * (1.0 - np.exp(1j * turn))
            end = f"X{at.real:.12f} Y{at.imag:.12f} I{to_centre.real:.12f} J{to_centre.imag:.12f}"
            lines.append(f"G{3 if turn > 0 else 2} {end}")
        heading += turn
    path.write_text("\n".join([*lines, "M30"]) + "\n")
    return path


def driven(
    path: Path, cell: CellConfig, chain: Chain, heading: float, feed: float
) -> float:
    """Planned time over the optimum; limits are held."""
    result = plan_program(
        Program(write(path, chain, heading, feed), cell, "isg"),
        window=120,
        jerk=False,
    )
    assert result.max_ratio["acceleration"] is not None
    assert result.max_ratio["acceleration"] <= 1.01
    assert result.infeasible == 0
    v, a = cell.axis_values("v_max_mm_s"), cell.axis_values("a_max_mm_s2")
    return result.motion_time_s / optimum(chain, heading, feed, v, a)


def cell_of(v: tuple[float, float], a: tuple[float, float]) -> CellConfig:
    return CellConfig(
        axes={
            n: AxisConfig(v_max_mm_s=s, a_max_mm_s2=t)
            for n, s, t in zip("XYZ", (*v, 300.0), (*a, 3000.0), strict=True)
        }
    )


CASES: dict[
    str, tuple[tuple[float, float], tuple[float, float], float, float, Chain]
] = {
    "an arc, a gentle one": (
        (300, 300),
        (1000, 1000),
        -1.63,
        118.0,
        [(9.2, -0.314), (4.656, 0.0527)],
    ),
    "up along a wide arc, down along a line": (
        (300, 300),
        (10000, 1000),
        2.015,
        278.0,
        [
            (1.77, 0.1012),
            (0.12, 0),
            (12.44, 0.0708),
            (6.316, 0),
            (3.19, 0.0847),
        ],
    ),
    "S": (
        (300, 300),
        (3000, 3000),
        -0.0978,
        41.87,
        [(1.122, 1.3847), (1.5056, -1.3763)],
    ),
    "one axis ten times as quick": (
        (300, 300),
        (10000, 1000),
        2.357,
        58.0,
        [(0.433, 0.639), (1.54, 0.3015), (0.0929, 0), (0.0457, 0)],
    ),
    "one axis fifteen times as fast": (
        (300, 20),
        (3000, 3000),
        0.5,
        134.6,
        [(97.2, -0.02837), (91.6, 0.05776), (24.1, -0.03506)],
    ),
}


@pytest.mark.ci_cases
@pytest.mark.parametrize("case", CASES)
def test_arcs_with_ramps_take_the_shortest_time(
    case: str, tmp_path: Path
) -> None:
    """Ramps along arcs, where what the axes allow changes with the direction:
    within 1 % of the optimum.
    """
    v, a, heading, feed, chain = CASES[case]
    assert (
        0.995
        <= driven(tmp_path / "a.nc", cell_of(v, a), chain, heading, feed)
        <= 1.01
    )


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", range(12))
def test_random_chains_take_the_shortest_time(
    seed: int, tmp_path: Path
) -> None:
    """Lines and arcs of all radii, joined tangentially, axes of unequal limits:
    within 1 % of the optimum.
    """
    rng = np.random.default_rng(seed)
    chain: Chain = []
    for _ in range(int(rng.integers(2, 9))):
        radius = float(np.exp(rng.uniform(-1.0, 3.5)))
        turn = float(min(rng.uniform(0.05, 3.0), 30.0 / radius)) * float(
            rng.choice([-1, 1])
        )
        line = rng.random() < 0.3
        chain.append(
            (float(np.exp(rng.uniform(-2.0, 2.5))), 0.0)
            if line
            else (abs(turn) * radius, np.sign(turn) / radius)
        )
    speeds, accels = (
        rng.choice([60.0, 300.0], 2),
        rng.choice([1000.0, 3000.0], 2),
    )
    cell = cell_of(
        (float(speeds[0]), float(speeds[1])),
        (float(accels[0]), float(accels[1])),
    )
    feed = float(np.exp(rng.uniform(np.log(20), np.log(300))))
    assert (
        0.98
        <= driven(
            tmp_path / "a.nc", cell, chain, float(rng.uniform(0, 6.28)), feed
        )
        <= 1.01
    )
