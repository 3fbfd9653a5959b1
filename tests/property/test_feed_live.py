"""Programmed feeds under steps of the override and feed holds: no way down
drives faster than a block allows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.engine import Engine
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.seeds import few

OVERRIDES = (0.0, 0.1, 0.3, 0.5, 0.8, 0.9, 0.95, 1.0, 1.0)
FEEDS = (600, 1500, 6000, 9000, 12000, 18000)


def _program(rng: np.random.Generator, kind: int) -> str:
    """Corners, gentle bends in short blocks, a tangential chain of arcs, or a
    straight line, at many feeds.
    """
    lines, p, heading = [f"G90 G71 G17 F{rng.choice(FEEDS)}"], np.zeros(3), 0.0
    for _ in range(30):
        if rng.random() < 0.3:
            lines.append(f"F{rng.choice(FEEDS)}")
        if kind == 0:
            p = p + rng.normal(size=3) * rng.choice([0.5, 3.0, 15.0])
        elif kind == 1:
            heading += rng.normal() * 0.15
            p = p + rng.choice([0.2, 0.8, 3.0]) * np.array(
                [np.cos(heading), np.sin(heading), 0.0]
            )
        elif kind == 2:
            radius, side = rng.uniform(2.0, 20.0), rng.choice([-1, 1])
            centre = p[:2] + side * radius * np.array(
                [-np.sin(heading), np.cos(heading)]
            )
            heading += side * rng.uniform(0.1, 1.5)
            i, j = centre - p[:2]
            p = np.append(
                np.round(
                    centre
                    - side
                    * radius
                    * np.array([-np.sin(heading), np.cos(heading)]),
                    6,
                ),
                0.0,
            )
            lines.append(
                f"G{3 if side > 0 else 2} X{p[0]:.6f} Y{p[1]:.6f} I{i:.6f} J{j:.6f}"
            )
            continue
        else:
            p = p + np.array([rng.choice([0.05, 0.5, 5.0]), 0.0, 0.0])
        lines.append(f"G1 X{p[0]:.4f} Y{p[1]:.4f} Z{p[2]:.4f}")
    return "\n".join([*lines, "M30", ""])


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("seed", "jerk"),
    few(
        [
            (1, True),
            (2, False),
            (0, True),
            (2, True),
            (3, True),
            (8, True),
            (0, False),
        ],
        2,
    ),
)
def test_a_lower_feed_ahead_holds_on_the_way_down(
    seed: int, jerk: bool, tmp_path: Path
) -> None:
    """While it brakes for a reduced override or a hold the path enters no block above its feed."""
    rng = np.random.default_rng(seed)
    path = tmp_path / "part.nc"
    path.write_text(_program(rng, seed % 4))

    def operator(engine: Engine) -> None:
        engine.set_override(
            float(rng.choice(OVERRIDES)), bool(rng.random() < 0.2)
        )

    program = Program(
        path, CellConfig(), "isg", tolerance=0.01 if jerk else 0.0
    )
    live = (int(rng.choice([23, 60, 150])), operator)
    ratio = plan_program(
        program, window=int(rng.choice([12, 30, 120])), jerk=jerk, live=live
    ).as_json()["max_ratio"]
    assert ratio["feed"] <= 1.005
    assert ratio["acceleration"] <= 1.02
    assert not jerk or ratio["jerk"] <= 1.02


@pytest.mark.ci
@pytest.mark.parametrize("seed", range(6))
def test_feeds_of_blocks_far_shorter_than_the_tolerance(
    seed: int, tmp_path: Path
) -> None:
    """Their points are left out where the path is smoothed, their feeds are not."""
    rng = np.random.default_rng(seed)
    lines, p = ["G90"], np.zeros(3)
    for _ in range(40):
        p = p + rng.normal(size=3) * rng.choice(
            [3e-4, 3e-3, 0.02, 1.0], p=[0.2, 0.3, 0.2, 0.3]
        )
        lines.append(
            "G1 X{:.6f} Y{:.6f} Z{:.6f} F{}".format(
                *p, rng.choice([20, 60, 600, 6000])
            )
        )
    path = tmp_path / "part.nc"
    path.write_text("\n".join([*lines, "M30", ""]))
    for jerk in (True, False):
        program = Program(
            path,
            CellConfig(),
            "isg",
            tolerance=float(rng.choice([0.02, 0.1, 0.5])),
        )
        ratio = plan_program(program, window=120, jerk=jerk).as_json()[
            "max_ratio"
        ]
        assert ratio["feed"] <= 1.005
        assert ratio["acceleration"] <= 1.02
        assert not jerk or ratio["jerk"] <= 1.02
