"""A feed hold acts from the next cycle on, whatever has begun the path anew before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support.commanded import NO_JERK
from support.inside import Inside


@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "no jerk"])
def test_a_hold_behind_backward_motion_brakes_in_the_next_cycle(
    tmp_path: Path, jerk: bool
) -> None:
    """The path has been fed anew at a standstill, as at the beginning of a
    program under ``run``.
    """
    with Inside(
        tmp_path, "G1 X300 F9000\nM30\n", "" if jerk else NO_JERK
    ) as cnc:
        cnc.run(300)
        cnc.level(cnc.bahn.feedhold, True)
        cnc.run(300)
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.run(20)
        cnc.level(cnc.bahn.backward_motion, False)
        cnc.run(20)
        cnc.level(cnc.bahn.feedhold, False)
        cnc.run(300)
        cnc.level(cnc.bahn.feedhold, True)
        cnc.run(4)
        steps = np.diff(cnc.pos[-8:, 0])
        assert steps[0] == pytest.approx(0.15)
        assert steps[-1] < 0.15 - 1e-5
