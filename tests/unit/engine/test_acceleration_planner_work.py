"""What the planner without jerk leaves out: stretches, phases and windows that
change nothing of the motion.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hli._sync import ffi, lib

from cnc_core.benchmarks.workloads import WORKLOADS, write_arcs
from cnc_core.config import parse_config
from cnc_core.engine import Engine, Event
from cnc_core.planning import Feeder, plan_program
from cnc_core.program import Program
from hli.areas import Areas
from plc_client.blocks.program_flow import TechnoArray, techno_areas
from support.commanded import NO_JERK
from support.inside import Inside
from support.limits import legal


def _drive(
    path: Path, window: int, tolerance: float = 0.0, workload: str = "arcs"
) -> tuple[float, int, int]:
    """(motion time, committed phases, rows pushed), pumped on one thread."""
    cell = WORKLOADS[workload].cell()
    engine = Engine(cell, window=window, jerk=False)
    feeder = Feeder(
        Program(path, cell, "isg", tolerance=tolerance),
        engine,
        lambda batch: None,
    )
    try:
        while (event := engine.run(100_000)) is not Event.PROGRAM_END:
            assert event in (Event.NEED_BLOCKS, Event.DONE)
            feeder.fill()
        state = engine.state
        assert state.infeasible == 0
        return float(state.motion_time_s), int(state.phases), feeder.rows
    finally:
        engine.close()


def test_an_arc_at_its_feed_is_one_phase_however_far_the_commits_reach(
    tmp_path: Path,
) -> None:
    """At 50 mm/s arcs of 3 mm radius or more keep the feed: a phase an arc, and
    one more where a commit cuts it.
    """
    path = write_arcs(tmp_path / "a.nc", 200, 3000.0)
    time, phases, rows = _drive(path, 120)
    assert time == pytest.approx(200 * 4.0 / 50.0, rel=0.01)
    assert phases <= rows + time / 0.15 + 20


LINE_MM = 200.0
FEED = 100.0  # 2 s over the line
REACHED = 800  # cycles: far from the line's ends, at the feed


@pytest.mark.parametrize("later", range(0, 200, 37))
def test_an_override_acts_however_far_ahead_is_committed(
    tmp_path: Path, later: int
) -> None:
    """A fifth of a second is committed at once. Another override takes back
    what has not begun: the speed falls within 20 cycles.
    """
    with Inside(tmp_path, f"G1 X{LINE_MM} F6000\n", NO_JERK) as cnc:
        cnc.run(REACHED + later)
        assert cnc.pos[-1, 0] - cnc.pos[-2, 0] == pytest.approx(FEED * 1e-3)
        cnc.level(cnc.bahn.override_valid, True)
        cnc.level(cnc.bahn.override, 500)
        cnc.run(20)
        assert cnc.pos[-1, 0] - cnc.pos[-2, 0] < 0.9 * FEED * 1e-3
        cnc.end()
        assert cnc.pos[-1, 0] == pytest.approx(LINE_MM, abs=1e-9)
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize("later", range(0, 200, 37))
def test_single_block_stops_at_the_next_block_however_far_is_committed(
    tmp_path: Path, later: int
) -> None:
    """Blocks of 50 ms: at the second end behind the command the path stands."""
    blocks = "".join(f"G1 X{5 * k}\n" for k in range(1, 41))
    with Inside(tmp_path, "F6000\n" + blocks, NO_JERK) as cnc:
        cnc.run(REACHED + later)
        at = float(cnc.pos[-1, 0])
        cnc.level(cnc.bahn.single_block, True)
        cnc.run(200)
        stood = float(cnc.pos[-1, 0])
        assert cnc.pos[-1, 0] == cnc.pos[-2, 0]
        assert at < stood <= at + 10.0
        assert stood % 5.0 == pytest.approx(0.0, abs=1e-9)
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize("at", [172, 200, 250, 290])
def test_single_block_too_late_for_one_end_stops_at_the_next(
    tmp_path: Path, at: int
) -> None:
    """A weak axis cannot stop at the first end any more: it stands at the second
    one, and no corner on the way breaks a limit (before, 1.18 at the second).
    """
    ends = ((1.6352, -1.8558), (3.3190, -3.6678), (4.9909, -5.4908))
    axes = {"X": (800, 500), "Y": (50, 62.5), "Z": (800, 500)}
    cell = parse_config(
        "".join(
            f"[axes.{axis}]\nv_max_mm_s = {v}\na_max_mm_s2 = {a}\n"
            "j_max_mm_s3 = 0\n"
            for axis, (v, a) in axes.items()
        )
    )
    text = "F9222\n" + "".join(f"G1 X{x} Y{y}\n" for x, y in ends)
    with Inside(tmp_path, text + "G1 X6.7515 Y-7.2283\nM30\n", cell) as cnc:
        cnc.run(at)
        cnc.level(cnc.bahn.single_block, True)
        cnc.run(700)
        assert cnc.pos[-1, :2] == pytest.approx(ends[1], abs=1e-9)
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize(
    ("workload", "tolerance"),
    [("arcs", 0.0), ("arcs", 0.01), ("corners", 0.01), ("five-axis", 0.0)],
)
def test_windows_that_cover_the_braking_distance_give_the_same_motion(
    tmp_path: Path, workload: str, tolerance: float
) -> None:
    """Needs that a later window does not change are not looked at again: it
    shows only where commits cut steps.
    """
    path = WORKLOADS[workload].write(tmp_path / "a.nc", 1500)
    times = [
        _drive(path, window, tolerance, workload)[0]
        for window in (60, 120, 190)
    ]
    assert max(times) - min(times) <= 5e-6 * max(times)


@pytest.mark.parametrize("seed", [1, 2])
def test_five_axis_lines_keep_their_limits_under_override_steps_and_holds(
    tmp_path: Path, seed: int
) -> None:
    """Constant bounds of gentle pieces are made for an override; a larger one
    comes when that is legal.
    """
    path = WORKLOADS["five-axis"].write(tmp_path / "a.nc", 1200)
    rng = np.random.default_rng(seed)

    def change(engine: Engine) -> None:
        engine.set_override(
            float(rng.choice([0.0, 0.3, 1.0, 1.4, 2.0])),
            bool(rng.random() < 0.15),
        )

    cell = WORKLOADS["five-axis"].cell()
    result = plan_program(
        Program(path, cell, "isg"), window=120, jerk=False, live=(23, change)
    )
    assert result.infeasible == 0
    assert float(result.max_ratio["velocity"] or np.inf) <= 1.0005
    assert float(result.max_ratio["acceleration"] or np.inf) <= 1.005


AHEAD = """[channel.m_synch]
56 = "MEP_SVS"
[channel.m_pre_outp]
56 = 100000
"""  # 10 mm


@pytest.mark.parametrize("after", [10, 40, 60])
def test_a_gate_that_opens_in_time_is_passed_at_the_feed(
    tmp_path: Path, after: int
) -> None:
    """The function goes out 100 ms ahead of the block that waits for it; the
    brake to there takes 33 ms. Acknowledged before, it does not show.
    """
    blocks = "G1 X30\nM56 X40\nX80\nM30\n"
    with Inside(tmp_path, "F6000\n" + blocks, NO_JERK + AHEAD) as cnc:
        areas = techno_areas(Areas(cnc.segment))
        open_functions: list[tuple[TechnoArray, int]] = []

        def fetched() -> bool:
            open_functions.extend(
                (array, index)
                for area in areas
                for array, index, _ in area.fetch_all()
            )
            return bool(open_functions)

        lib.hs_plc_register(ffi.cast("void *", cnc.segment.base))
        cnc.until(fetched)
        out = len(cnc.pos)
        cnc.run(after)
        for array, index in open_functions:
            array.acknowledge(index)
        cnc.run(200)
        speeds = np.diff(cnc.pos[out:, 0])
        assert speeds.min() == pytest.approx(FEED * 1e-3)
        assert cnc.pos[-1, 0] > 40.0
