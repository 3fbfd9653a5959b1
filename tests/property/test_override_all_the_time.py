"""An override that changes more often than motion is committed, in all ways: no
limit is exceeded on any sample.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.engine import Engine
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.seeds import few

STEPS = (0.0, 0.1, 0.3, 0.5, 0.8, 1.0, 1.0, 2.0)
FEEDS = (1500, 6000, 18000)
CYCLES = 5  # between two changes; motion is committed each 10 cycles
LIVE_CHANGES = 100


def _program(rng: np.random.Generator, bends: bool) -> str:
    """Blends of a polyline within a tolerance, or a curve in chords."""
    lines, p, heading = [f"G90 G71 G17 F{rng.choice(FEEDS)}"], np.zeros(3), 0.0
    for _ in range(10):
        if rng.random() < 0.3:
            lines.append(f"F{rng.choice(FEEDS)}")
        if bends:
            heading += rng.normal() * 0.2
            p = p + np.array([np.cos(heading), np.sin(heading), 0.0])
        else:
            p = p + rng.normal(size=3) * rng.choice([0.5, 3.0])
        lines.append(f"G1 X{p[0]:.4f} Y{p[1]:.4f} Z{p[2]:.4f}")
    return "\n".join([*lines, "M30", ""])


def _operator(
    rng: np.random.Generator, kind: int
) -> tuple[Callable[[Engine], None], list[float]]:
    """A wave, steps with holds, a random walk, or noise; 100 % in the end. And
    all overrides so far.
    """
    set_so_far = [1.0]

    def next_one() -> float:
        k = len(set_so_far)
        if k > LIVE_CHANGES:
            return 1.0
        if kind == 0:
            return float(0.6 + 0.4 * np.sin(0.15 * k))
        if kind == 1:
            return float(rng.choice(STEPS))
        if kind == 2:
            walk = set_so_far[-1] + 0.05 * rng.normal()
            return float(np.clip(walk, 0.02, 2.0))
        return float(rng.uniform(0.01, 2.0))

    def change(engine: Engine) -> None:
        override = next_one()
        set_so_far.append(override)
        hold = len(set_so_far) <= LIVE_CHANGES and rng.random() < 0.03
        engine.set_override(override, bool(hold))

    return change, set_so_far


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(40), 3))
def test_limits_hold_while_the_override_changes_all_the_time(
    seed: int, tmp_path: Path
) -> None:
    """Velocity, acceleration and jerk of every axis, and the feed times the largest override."""
    rng = np.random.default_rng(seed)
    path = tmp_path / "part.nc"
    path.write_text(_program(rng, bool(seed // 4 % 2)))
    operator, overrides = _operator(rng, seed % 4)
    program = Program(path, CellConfig(), "isg", tolerance=0.01)
    ratio = plan_program(
        program, window=int(rng.choice([12, 120])), live=(CYCLES, operator)
    ).as_json()["max_ratio"]
    assert ratio["velocity"] <= 1.02
    assert ratio["acceleration"] <= 1.02
    assert ratio["jerk"] <= 1.02
    assert ratio["feed"] <= 1.005 * max(overrides)
