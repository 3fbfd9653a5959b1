"""Feed hold with a planner thread: it stops the path also where a cycle is
longer than the planner's reserve.
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from cnc_core.engine import Event
from support.inside import Inside


def _turn(cnc: Inside, seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if cnc.engine.wait(0.005) is Event.NEED_BLOCKS:
            cnc.preparation.pump()


SPEED = 200.0
THREADS_CYCLES = 3  # under way, about to be driven, taken back
LATE_CYCLES = 2  # a thread that gets no time on a busy machine


@pytest.mark.ci
@pytest.mark.parametrize("cycle_s", [0.02, 0.05])
def test_a_hold_stops_within_cycles_and_its_braking_distance(
    cycle_s: float, tmp_path: Path
) -> None:
    """The stop begins where a thread can still change it: in the third cycle
    behind the command, then it brakes at once.
    """
    with Inside(
        tmp_path, "N10 G1 X500 F12000\n", f"cycle_s = {cycle_s}\n"
    ) as cnc:
        cnc.engine.start()
        _turn(cnc, 0.6)
        before = cnc.engine.state
        assert before.speed == pytest.approx(SPEED)
        cnc.level(cnc.bahn.feedhold, True)
        begin = float(cnc.engine.state.path)
        _turn(cnc, 1.0)
        cnc.engine.stop()
        state, x = cnc.engine.state, cnc.cell.axes["X"]
    ramp_s = SPEED / x.a_max_mm_s2 + x.a_max_mm_s2 / x.j_max_mm_s3
    on_the_way = SPEED * cycle_s * (THREADS_CYCLES + LATE_CYCLES)
    assert state.speed == 0.0
    assert state.path - begin <= on_the_way + 0.5 * SPEED * ramp_s
