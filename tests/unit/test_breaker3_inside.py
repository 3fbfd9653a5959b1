"""What a hostile PLC found: each test is the smallest program and sequence of commands that went wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from inside import Inside

LOOP = "#RT WHILE\nN30 G1 X10 F6000\nN40 Y10\nN50 X0 Y0\n#RT ENDWHILE\nN70 X-5\n"


def _passes(cnc: Inside, cycles: int) -> int:
    """How often N30 begins again."""
    count, before = 0, 0
    for _ in range(cycles):
        cnc.run(1)
        block = int(cnc.state.block_number_r)
        count += before == 50 and block == 30
        before = block
    return count


@pytest.mark.parametrize("ahead", ["", "N10 G1 F6000\n", "N10 G1 X1 F6000\nN20 X0\n"])
def test_a_loop_that_begins_the_program_is_repeated(tmp_path: Path, ahead: str) -> None:
    """isg_contour_lookahead 9, T3: the PLC sets the loop's condition; nothing has to stand ahead of the loop."""
    with Inside(tmp_path, ahead + LOOP) as cnc:
        cnc.level(cnc.bahn.rt_loop_enable, True)
        assert _passes(cnc, 1500) >= 2


@pytest.mark.parametrize("modulo", ["", " [MODULO]"])
def test_the_distance_is_continuous_where_a_loop_begins_again(tmp_path: Path, modulo: str) -> None:
    """isg_contour_lookahead 5.5 and 8: no whole pass too much while it stands at ENDWHILE in single block."""
    with Inside(tmp_path, LOOP.replace("#RT WHILE", "#RT WHILE" + modulo)) as cnc:
        cnc.level(cnc.bahn.rt_loop_enable, True)
        cnc.level(cnc.bahn.single_block, True)
        before, length = 0.0, 100_000 * (2 + np.sqrt(2))
        for k in range(3000):
            cnc.level(cnc.bahn.continue_machining, k % 200 > 100)
            cnc.run(1)
            now = float(cnc.state.dist_prog_start)
            step = now - before
            assert -1 <= step < 1100 or (modulo and abs(step + length) < 1100), (k, before, now)
            before = now
        assert modulo or before > 1.2 * length
