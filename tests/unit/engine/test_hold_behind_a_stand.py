"""Feed hold in the first cycles behind a stand: the planner goes back to where GEO is cut."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support.inside import Inside
from support.limits import legal

LENGTHS = [1.0 + 0.0063 * k for k in range(16)]
"""mm: the stand comes at every share of a cycle."""


def _begins(folder: Path, text: str) -> int:
    """The first cycle in which Y moves."""
    with Inside(folder, text) as cnc:
        cnc.run(300)
        return int(np.flatnonzero(cnc.pos[:, 1] > 0.0)[0])


@pytest.mark.parametrize("length_mm", LENGTHS)
def test_a_hold_just_behind_a_stand_moves_nothing_back(
    length_mm: float, tmp_path: Path
) -> None:
    """The first moments behind a stand are too short a way for the planner to
    begin in.  A hold then acts a cycle later, from where the path is.
    """
    text = f"N10 G1 X{length_mm:.4f} F6000\nN20 Y1\n"
    begins = _begins(tmp_path, text)
    for held in range(begins - 3, begins + 3):
        with Inside(tmp_path, text) as cnc:
            cnc.run(held)
            cnc.level(cnc.bahn.feedhold, True)
            cnc.run(100)
            cnc.level(cnc.bahn.feedhold, False)
            cnc.run(300)
            assert np.diff(cnc.pos, axis=0).min() >= 0.0
            assert cnc.pos[-1, 1] == pytest.approx(1.0)
            legal(cnc.pos, cnc.cell)
