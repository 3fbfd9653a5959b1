"""Long lines are handed out in many parts: what each part rounds does not add up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.engine.jerk_planner import (
    INTERVAL,
    JerkPlanner,
    Limits,
)
from cnc_core.units import AnyArray
from support.programs import ended_program, planned

V, A, J = 1000.0, 500.0, 300.0
CELL = f"""
cycle_s = 0.0005
[axes.X]
v_max_mm_s = {V}
a_max_mm_s2 = {A}
j_max_mm_s3 = {J}
min_mm = -1e7
max_mm = 1e7
"""


@pytest.mark.parametrize("length", [1000, 2000, 5000, 10000])
def test_the_samples_keep_the_jerk_towards_rest(
    tmp_path: Path, length: int
) -> None:
    """A nanometre that was lost on the way would show at half a millisecond."""
    text = f"F200000\nG01 X{length}\nX0\nX{length}\nX0"
    result = planned(ended_program(tmp_path, text, CELL))
    assert result.max_ratio["jerk"] <= 1.002


@pytest.mark.parametrize("part_s", [0.0005, 0.004, 0.0105])
def test_the_way_to_rest_is_one_law_however_it_is_cut(part_s: float) -> None:
    """Its jerk stays, and it ends where the line does, at rest."""
    laws = laws_of(2000.0, part_s)
    last = laws[laws["s0"] > 2000 - V * V / A / 8]
    last = last[last["jerk"] > 0]
    assert last["jerk"] == pytest.approx(last["jerk"][0], rel=1e-5)
    ends = last["a0"] + last["jerk"] * last["time"]
    assert ends[:-1] == pytest.approx(last["a0"][1:], abs=1e-6)
    assert abs(ends[-1]) < 1e-6


def test_a_cruise_ends_where_the_next_phase_begins() -> None:
    """A thousand seconds of one speed, cut 100 000 times."""
    laws = laws_of(1e6, 0.01)
    ends = laws["s0"] + laws["time"] * laws["v0"]
    even = (laws["a0"] == 0.0) & (laws["jerk"] == 0.0)
    cruise = np.flatnonzero(even)
    assert len(cruise) > 90_000
    assert np.abs(ends[cruise] - laws["s0"][cruise + 1]).max() < 1e-9


def laws_of(length: float, part_s: float) -> AnyArray:
    """All laws of a line, handed out so many seconds at a time."""
    line = np.zeros(1, INTERVAL)
    line["length"] = length
    line["d1"][:, :, 0] = 1
    line["feed"] = V
    line["blocks"] = 1
    planner = JerkPlanner(Limits([V], [A], [J]))
    planner.push(line)
    planner.finish()
    found = []
    while len(laws := planner.take(part_s)):
        found.append(laws)
        planner.tail()  # as the engine asks for it behind every commit
    return np.concatenate(found)
