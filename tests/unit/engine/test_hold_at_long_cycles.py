"""Feed hold with a planner thread: it stops the path also where a cycle is longer than the planner's reserve."""

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


@pytest.mark.parametrize("cycle_s", [0.02, 0.05])
def test_a_hold_stops_within_cycles_and_its_braking_distance(
    cycle_s: float, tmp_path: Path
) -> None:
    """What is taken back begins where a thread can still change it, not within the cycle that GEO is about to drive."""
    with Inside(
        tmp_path, "N10 G1 X500 F12000\n", f"cycle_s = {cycle_s}\n"
    ) as cnc:
        cnc.engine.start()
        _turn(cnc, 0.6)
        before = cnc.engine.state
        assert before.speed > 100.0
        cnc.level(cnc.bahn.feedhold, True)
        _turn(cnc, 1.0)
        cnc.engine.stop()
        state = cnc.engine.state
    assert state.speed == 0.0
    assert state.path < 400.0  # X500 is reached 1.9 s behind the hold
