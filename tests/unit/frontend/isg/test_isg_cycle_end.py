"""The end of a cycle: G functions, circle data and feed of the caller are in force
again. G functions with values and # commands keep their effect.
"""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core.blocks import COMPENSATION, SPLINE
from support.programs import Rows, ended_program, rows_of

CELL = """
[axes.X]
[axes.Y]
[axes.Z]
[tools.1]
radius_mm = 5.0
[zero_offsets.1]
X = 100.0
[zero_offsets.2]
X = 200.0
"""


def rows(folder, cycle: str, before: str, behind: str) -> Rows:
    """Rows of what stands behind a call of the cycle, in the main program."""
    text = (
        f"%L C\n{cycle}\nM17\n%MAIN\n{before}\nLL CYCLE [NAME=C]\nN7 {behind}"
    )
    found = rows_of(ended_program(folder, text, CELL))
    return found[np.nonzero(found["n"] == 7)[0][0] :]


@pytest.mark.parametrize(
    ("before", "cycle", "behind"),
    [
        ("", "G21", "G01 X10 Y10"),
        ("G22", "G20", "G01 X10 Y10"),
        ("", "G54", "G01 X10"),
        ("G54", "G53", "G01 X10"),
        ("G159=2", "G54", "G01 X10"),
        ("", "G51", "G01 X10"),
        ("G51", "G52", "G01 X10"),
        ("", "G164", "G02 X10 Y10 I5 J5.4"),
        ("T1 D1", "G26", "G41 G01 X10\nX20 Y-10\nG40 X30"),
        ("T1 D1", "G138 G11", "G41 G01 X10\nG02 X20 Y10 R10\nG40 G01 X30"),
        ("", "G151", "G01 X10\nX20 Y5\nX30"),
        ("S60 M3", "G33 Z-1 K1\nZ0", "Z50"),
        ("S60 M3\nG33 Z-1 K1", "G01 Z-2", "Z-5"),
        ("G00 X1", "G331 Z-5 K1 S60\nG332 Z0", "X50"),
        ("G00 X50\nG96 S100", "G97 S100", "G01 X25"),
        ("", "G91 G18 G70 G161 G95", "G01 X10"),
    ],
)
def test_functions_come_back(tmp_path, before, cycle, behind):
    """The path goes on as behind a cycle that does nothing."""
    start = f"F600\n{before}"
    got, wanted = (
        found[~np.isin(found["type"], [COMPENSATION, SPLINE])]
        for found in (
            rows(tmp_path, cycle, start, behind),
            rows(tmp_path, "M00", start, behind),
        )
    )
    assert got["end"][:, :3] == pytest.approx(wanted["end"][:, :3], nan_ok=True)
    assert got["feed"] == pytest.approx(wanted["feed"])
    assert list(got["type"]) == list(wanted["type"])


@pytest.mark.parametrize(
    ("cycle", "end"),
    [
        ("G159=2", 210),
        ("G351 X-1", -10),
        ("G92 X7", 17),
        ("#CS ON [3,0,0,0,0,0]", 13),
    ],
)
def test_functions_with_values_keep_their_effect(tmp_path, cycle, end):
    """G159=, G351, G92 and commands act on behind the cycle."""
    assert rows(tmp_path, cycle, "F600", "G01 X10")["end"][0, 0] == end


def test_compensation_of_a_cycle_ends_with_it(tmp_path):
    """The caller's G40 deselects on its next motion, as if programmed there."""
    contour = "G41 G01 X10\nY10"
    ends = [
        rows(tmp_path, cycle, "T1 D1 F600", behind)["end"][:, :3]
        for cycle, behind in (
            (contour, "G01 X30"),
            (f"{contour}\nG40", "G01 X30"),
        )
    ]
    assert ends[0] == pytest.approx(ends[1], nan_ok=True)
