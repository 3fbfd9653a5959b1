"""Cells with long interpolation cycles: the planner is ahead of GEO by whole
cycles, whatever these take.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program

TEXTS = {
    "a slow line": "G1 F100 X2\n",
    "a fast line": "G1 F12000 X100\n",
    "circles": "G1 F6000\nG2 I5 J0\nG2 I5 J0\n",
}


@pytest.mark.parametrize("cycle_s", [0.01, 0.05])
@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("name", TEXTS)
def test_the_cycle_does_not_change_the_motion_time(
    name: str, jerk: bool, cycle_s: float, program: Callable[..., Path]
) -> None:
    """A cycle as long as what is committed ahead is no reason to live on
    stopping tails: as fast as at 1 ms.
    """
    path = program(f"G90 G17\n{TEXTS[name]}M30\n")
    fine = plan_program(Program(path, CellConfig()), jerk=jerk)
    coarse = plan_program(
        Program(path, CellConfig(cycle_s=cycle_s)), jerk=jerk, keep_samples=True
    )
    assert coarse.motion_time_s <= 1.001 * fine.motion_time_s
    assert coarse.samples is not None
    moving = np.abs(np.diff(coarse.samples["pos"], axis=0)).max(axis=1) > 0
    assert moving.all()
    assert len(moving) == int(np.ceil(coarse.motion_time_s / cycle_s - 1e-6))
