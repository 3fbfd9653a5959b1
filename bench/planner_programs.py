"""Acceleration-limited programs through the engine beside TOPP2: ``python
bench/planner_programs.py [--cases 8]``.

Random chains of arcs, helices and curves sampled to lines, planned as
``hli-cosim plan --no-jerk`` does; the optimum is taken by toppra and by COPP in
the same run over the path as it was meant, not as it was planned.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import toppra

from cnc_core.benchmarks.jerk_paths import Knots, by_length
from cnc_core.config import CellConfig
from cnc_core.engine.jerk_planner import FloatArray
from cnc_core.planning import plan_program
from cnc_core.program import Program
from planner_oracles import topp2_time

WINDOWS = (30, 120, 190)
TOLERANCE_MM = 0.01
STEP_RAD = 0.02


def toppra_time(
    path: Knots, feed: float, v: FloatArray, a: FloatArray
) -> float:
    """The path length is one more axis, whose speed is the feed."""
    q = np.column_stack([path.q, path.s])
    spline = toppra.SplineInterpolator(path.s, q)
    limits = [np.append(v, feed), np.append(a, 1e9)]
    speed, accel = (np.column_stack([-x, x]) for x in limits)
    constraints = [
        toppra.constraint.JointVelocityConstraint(speed),
        toppra.constraint.JointAccelerationConstraint(accel),
    ]
    solver = toppra.algorithm.TOPPRA(
        constraints,
        spline,
        gridpoints=path.s,
        parametrizer="ParametrizeConstAccel",
    )
    return float(solver.compute_trajectory(0, 0).duration)


def arcs(rng: np.random.Generator, helix: bool) -> tuple[str, Knots]:
    """A tangential chain of arcs of random radius and angle; helices climb at a
    constant slope.
    """
    at, heading, z = 0j, float(rng.uniform(0, 6)), 0.0
    lines = []
    slope = 0.3 if helix else 0.0
    s, q = [np.zeros(1)], [np.zeros((1, 3))]
    d1, d2 = [], []
    for _ in range(60):
        r, turn, side = (
            float(np.exp(rng.normal(1.5, 0.8))),
            float(rng.uniform(0.2, 2.5)),
            int(rng.choice([-1, 1])),
        )
        centre = at + 1j * side * r * np.exp(1j * heading)
        t = np.linspace(0.0, turn, int(turn / STEP_RAD) + 2)
        w = (at - centre) * np.exp(1j * side * t)
        climb, length = slope * r * t, r * t * np.hypot(1.0, slope)
        tangent, normal = 1j * side * w / r, -w / r
        scale = np.hypot(1.0, slope)
        one = (
            np.column_stack(
                [tangent.real, tangent.imag, np.full_like(t, slope)]
            )
            / scale
        )
        two = np.column_stack([normal.real, normal.imag, np.zeros_like(t)]) / (
            r * scale**2
        )
        first = 0 if not d1 else 1
        s.append(s[-1][-1] + length[1:])
        place = centre + w
        points = np.column_stack([place.real, place.imag, z + climb])
        q.append(points[1:])
        d1.append(one[first:])
        d2.append(two[first:])
        end, ij, z = (
            complex(centre + w[-1]),
            complex(centre - at),
            float(z + climb[-1]),
        )
        height = f" Z{z:.9f}" if helix else ""
        code = "G3" if side > 0 else "G2"
        lines.append(
            f"{code} X{end.real:.9f} Y{end.imag:.9f}{height}"
            f" I{ij.real:.9f} J{ij.imag:.9f}"
        )
        at, heading = end, heading + side * turn
    d1_all = np.vstack(d1)
    return "\n".join(lines), Knots(
        np.concatenate(s),
        np.vstack(q),
        d1_all,
        np.vstack(d2),
        np.zeros_like(d1_all),
    )


def curve(rng: np.random.Generator) -> tuple[str, Knots]:
    """A sum of waves in three axes, sampled to blocks of 0.1 to 0.4 mm with
    four decimals.
    """
    amplitude, rate, phase = (
        rng.uniform(2, 15, (3, 4)),
        rng.uniform(0.2, 3, (3, 4)),
        rng.uniform(0, 6, (3, 4)),
    )

    def waves(t: FloatArray, order: int) -> FloatArray:
        turn = order * np.pi / 2
        angle = rate[None] * t[:, None, None] + phase[None] + turn
        value = (amplitude * rate**order * np.sin(angle)).sum(axis=2)
        return np.asarray(
            value - (amplitude * np.sin(phase)).sum(axis=1)
            if order == 0
            else value
        )

    rough = by_length(waves, np.linspace(0.0, 6.0, 4000))
    n = int(rough.length / rng.uniform(0.1, 0.4))
    points = waves(
        np.interp(
            np.linspace(0, rough.length, n + 1),
            rough.s,
            np.linspace(0.0, 6.0, 4000),
        ),
        0,
    )
    return "\n".join(
        f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in points[1:]
    ), rough


def plan(
    text: str, feed: float, window: int, tolerance: float
) -> tuple[float, dict[str, float | None], float]:
    """(motion time, largest ratios, blocks a second)."""
    with tempfile.TemporaryDirectory(prefix="hli-cosim-bench-") as folder:
        path = Path(folder) / "a.nc"
        path.write_text(f"G90 G17 F{60 * feed:g}\n{text}\nM30\n")
        out = plan_program(
            Program(path, CellConfig(), "isg", tolerance=tolerance),
            window=window,
            jerk=False,
        ).as_json()
    return out["motion_time_s"], out["max_ratio"], out["blocks_per_s"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    v, a = np.full(3, 300.0), np.full(3, 3000.0)
    kinds: dict[
        str, tuple[Callable[[np.random.Generator], tuple[str, Knots]], float]
    ] = {
        "arcs": (lambda rng: arcs(rng, helix=False), 0.0),
        "helices": (lambda rng: arcs(rng, helix=True), 0.0),
        "curve": (curve, TOLERANCE_MM),
    }
    for name, (make, tolerance) in kinds.items():
        for case in range(options.cases):
            rng = np.random.default_rng(options.seed + case)
            text, path = make(rng)
            feed = float(rng.choice([50.0, 100.0, 300.0]))
            best, copp = (
                toppra_time(path, feed, v, a),
                topp2_time(path, feed, v, a),
            )
            row = [
                f"{name} {case}, F{feed:.0f}: toppra {best:.4f} s, COPP {copp:.4f} s"
            ]
            for window in WINDOWS:
                time, ratio, speed = plan(text, feed, window, tolerance)
                measured = (
                    f"a {ratio['acceleration']:.3f}, {speed / 1e3:.0f} k/s"
                )
                row.append(f"W{window} {time / best:.4f} ({measured})")
            print("; ".join(row))


if __name__ == "__main__":
    main()
