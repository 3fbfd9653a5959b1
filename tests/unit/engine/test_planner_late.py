"""A planner that is late is told: how often, and for how many cycles."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.commanded import NO_JERK
from support.inside import Inside

pytestmark = pytest.mark.sanitize("engine")

PART = "G1 F6000\n" + "X80 Y40\nX0 Y0\n" * 6 + "G4 0.2\nM30\n"


@pytest.mark.parametrize("config", ["", NO_JERK])
def test_standing_behind_a_release_is_told(tmp_path: Path, config: str) -> None:
    """A feed hold is released, and the planner has no time: each stand counts
    once, with its cycles, and the HLI shows it.
    """
    with Inside(tmp_path, PART, config) as cnc:
        cnc.run(300)
        for stands in (1, 2):
            cnc.level(cnc.bahn.feedhold, True)
            cnc.run(600)
            before = int(cnc.engine.state.planner_late_cycles)
            cnc.engine.stall_planner(True)
            cnc.level(cnc.bahn.feedhold, False)
            cnc.run(500)
            cnc.engine.stall_planner(False)
            cnc.run(100)
            state = cnc.engine.state
            assert int(state.planner_late) == stands
            assert 480 <= int(state.planner_late_cycles) - before <= 503
            assert cnc.side.stats.planner_late == stands
            assert (
                cnc.side.stats.planner_late_cycles == state.planner_late_cycles
            )
        cnc.end()


@pytest.mark.parametrize("config", ["", NO_JERK])
def test_what_was_ordered_is_not_late(tmp_path: Path, config: str) -> None:
    """Holds, override 0, single block, a dwell, the program's end."""
    with Inside(tmp_path, PART, config) as cnc:
        for round_ in range(6):
            cnc.run(150 + 37 * round_)
            cnc.level(cnc.bahn.feedhold, True)
            cnc.run(300)
            cnc.level(cnc.bahn.feedhold, False)
            cnc.run(100)
            cnc.level(cnc.bahn.override, 0)
            cnc.level(cnc.bahn.override_valid, True)
            cnc.run(300)
            cnc.level(cnc.bahn.override, 1000)
        cnc.end()
        cnc.run(300)
        assert int(cnc.engine.state.planner_late) == 0
