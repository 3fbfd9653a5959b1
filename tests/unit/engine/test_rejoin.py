"""A planner that was late: GEO drives the stopping tail, and the planner goes
on from a place of it, not from rest.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.engine import Event
from support.commanded import NO_JERK, config, drive, program
from support.inside import FloatArray, Inside
from support.limits import legal

CIRCLES = "F6000\n" + "G2 X0 Y0 I30 J0\n" * 4 + "G1 X50\n"
FEED = 100.0
STOP_MM = 4.67  # from the feed to rest: v/2 (v/a + a/j) with 3000 mm/s2 and 50000 mm/s3


def _stalled(cnc: Inside, cycles: int) -> None:
    """All that is committed is driven, and some of the tail."""
    cnc.run(800)
    cnc.engine.stall_planner(True)
    cnc.run(cycles)


def _speeds(cnc: Inside) -> FloatArray:
    """Path speed, mm/s, from cycle to cycle."""
    return np.asarray(
        np.linalg.norm(np.diff(cnc.pos, axis=0), axis=1) / cnc.cell.cycle_s
    )


@pytest.mark.parametrize("cycles", [25, 35, 60, 150])
def test_the_path_keeps_its_feed_when_the_planner_is_late(
    tmp_path: Path, cycles: int
) -> None:
    """Without a planner for 25 to 150 ms, with a tail of 300 ms: nothing of it
    shows in the motion.
    """
    with Inside(tmp_path, CIRCLES) as cnc:
        _stalled(cnc, cycles)
        cnc.engine.stall_planner(False)
        cnc.run(1200)
        assert _speeds(cnc)[500:].min() > 0.999 * FEED
        cnc.end()
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize("cycles", [25, 60])
def test_a_feed_hold_acts_on_the_tail(tmp_path: Path, cycles: int) -> None:
    """It brakes a few cycles behind the command, not where the tail comes to
    rest some 20 mm later.
    """
    with Inside(tmp_path, CIRCLES) as cnc:
        _stalled(cnc, cycles)
        cnc.level(cnc.bahn.feedhold, True)
        cnc.engine.stall_planner(False)
        cnc.run(400)
        way = float(_speeds(cnc)[800 + cycles :].sum() * cnc.cell.cycle_s)
        assert way < 1.1 * STOP_MM + 6 * FEED * cnc.cell.cycle_s
        cnc.level(cnc.bahn.feedhold, False)
        cnc.end()
        legal(cnc.pos, cnc.cell)


def test_a_tail_that_is_nearly_over_is_driven_to_its_end(
    tmp_path: Path,
) -> None:
    """The planner comes back when GEO brakes at the end of the tail: from rest it goes on."""
    with Inside(tmp_path, CIRCLES) as cnc:
        _stalled(cnc, 25)
        cnc.until(
            lambda: (
                float(np.linalg.norm(cnc.pos[-1] - cnc.pos[-2]))
                < 2.0 * cnc.cell.cycle_s
            )
        )
        cnc.engine.stall_planner(False)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([50.0, 0.0, 0.0], abs=1e-9)
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize("speed", [95.0, 75.0, 60.0, 45.0])
def test_without_jerk_it_goes_on_from_the_tail_too(
    tmp_path: Path, speed: float
) -> None:
    """There the tail brakes from its beginning on, 3 mm/s in a cycle: five
    cycles behind the planner's return the speed that is left is kept.
    """
    with Inside(tmp_path, CIRCLES, NO_JERK) as cnc:
        _stalled(cnc, 2)
        cnc.until(
            lambda: (
                float(np.linalg.norm(cnc.pos[-1] - cnc.pos[-2]))
                < speed * cnc.cell.cycle_s
            )
        )
        cnc.engine.stall_planner(False)
        cnc.run(1200)
        assert _speeds(cnc)[500:].min() > speed - 5 * 3.0
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([50.0, 0.0, 0.0], abs=1e-9)
        legal(cnc.pos, cnc.cell)


CASES = [
    (0, "", 0.05),
    (1, "f", 0.05),
    (2, "c", 0.05),
    (3, "", 0.05),
    (4, "n", 0.05),
    (5, "", 0.05),
]
CASES += [(6, "n", 0.05), (7, "nc", 0.05), (8, "nf", 0.05), (9, "n", 0.05)]
CASES += [
    (24, "n", 0.1)
]  # a brake that ends within rounding of the end of a commit


@pytest.mark.parametrize(("seed", "options", "share"), CASES)
@pytest.mark.ci_cases
def test_random_commands_and_a_planner_that_is_often_late(
    tmp_path: Path, seed: int, options: str, share: float
) -> None:
    """Every command of the HLI, and now and then up to 60 cycles without the
    planner: all is legal, nothing is lost.
    """
    rng, late = np.random.default_rng(seed), np.random.default_rng(seed + 1000)
    with Inside(tmp_path, program(rng), config(rng, options)) as cnc:

        def cycles(n: int, _turn: int) -> Event:
            cnc.engine.stall_planner(bool(late.random() < share))
            event = cnc.engine.run(n + int(late.integers(0, 60)))
            cnc.engine.stall_planner(False)
            return event

        pos, way = drive(cnc, rng, cycles)
        legal(pos, cnc.cell)
        assert way > 1e-3
