"""What the look-ahead tells of overflow, helices, loops' copies, aborts and
ahead of a program.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support.inside import Inside

pytestmark = pytest.mark.sanitize("engine")
LOG = "#CONTOUR LOOKAHEAD LOG"


def test_a_full_log_keeps_the_entry_that_closes_the_area(
    tmp_path: Path,
) -> None:
    """T4 with an OFF: three entries, the last one is type 5 with its PARAM."""
    text = f"{LOG} ON\nG1 F6000 X1\nX2\nX3\n{LOG} OFF [PARAM=7]\nX4\n"
    config = "[channel]\ncontour_lookahead_log_max = 3\n"
    with Inside(tmp_path, text, config) as cnc:
        entries = cnc.request(0, 0)
        assert [e["block_type"] for e in entries] == [3, 1, 5]
        assert entries[2]["length"] == 7
        assert cnc.clah.state.count_logged_blocks == 3
        assert cnc.engine.state.log_dropped == 2


@pytest.mark.parametrize("sign", [1, -1])
def test_turns_of_a_helix_stand_beside_its_angle(
    tmp_path: Path, sign: int
) -> None:
    """circle_angle in [-2 pi, 0) or (0, 2 pi]; whole turns beyond it are told."""
    code = f"G1 F600 X10\nG{3 if sign > 0 else 2} X-10 Y0 Z5 I-10 J0 K2\n"
    with Inside(tmp_path, code) as cnc:
        helix = cnc.request(0, 1e9)[1]
        whole = helix["circle_angle"] + sign * 2 * np.pi * helix["circle_turns"]
        assert 0 < sign * helix["circle_angle"] <= 2 * np.pi + 1e-9
        assert np.hypot(10 * whole, 5) * 1e4 == pytest.approx(helix["length"])


def test_copies_of_a_loop_are_marked(tmp_path: Path) -> None:
    """Section 8: entering, loop to loop, last; 0 outside of the loop."""
    text = (
        f"G1 F6000 X1\n{LOG} ON\nX2\n#RT WHILE\nX3\nX2\n#RT ENDWHILE\nX4\n"
        f"{LOG} OFF\n"
    )
    with Inside(tmp_path, text) as cnc:
        passes = [e["rt_loop_pass"] for e in cnc.request(0, 0)]
        assert passes == [0, 0, 1, 1, 2, 2, 3, 3, 0, 0]


def test_nothing_is_announced_that_an_abort_has_left_out(
    tmp_path: Path,
) -> None:
    """5.3: max_dist_prog_start ends where the path stands."""
    with Inside(tmp_path, "G1 F6000 X50\nX100\n") as cnc:
        cnc.run(200)
        assert cnc.clah.state.max_dist_prog_start == 1_000_000
        cnc.engine.abort()
        cnc.end()
        state = cnc.state.dist_prog_start
        assert 0 < state < 500_000
        assert cnc.clah.state.max_dist_prog_start == pytest.approx(state)


def test_no_program_is_processed_ahead_of_the_first_one(
    tmp_path: Path,
) -> None:
    """hli_reference 4.1: program_end_r is TRUE then, too."""
    with Inside(tmp_path, "G1 F6000 X50\n") as cnc:
        cnc.run(1)
        assert not cnc.state.program_end_r
        cnc.engine.stand_by()
        cnc.engine.run(1)
        assert cnc.state.program_end_r
