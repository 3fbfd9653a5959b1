"""A pattern of pockets milled in the co-simulation: the tool's path lies in the
pockets, the floors are exact.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapely import affinity, contains_xy
from shapely.geometry import box

from cnc_core import Cell
from support.paths import EXAMPLES

EXAMPLE = EXAMPLES / "pocket_pattern"
PLACES = [
    (100.0, 0.0, 0.0, 0.0),
    (100.0, 100.0, 5.0, 60.0),
    (0.0, 100.0, 10.0, 0.0),
]
PAT_1 = """T8 D8
M6
G54 G90 S6000 M03
#VAR
  V.CYC.PatternRetract = 100
  V.CYC.PatternID      = 1
  V.L.MaxIncrementXY  = V.G.WZ_AKT.R
#ENDVAR
# PATTERN BEGIN [ID=V.CYC.PatternID]
# AT [100, 0, 0]
# AT [100, 100, 5, 0, 0, 60]
# AT [0, 100, 10]
# PATTERN END
#CONTOUR MODE [DEV, PATH_DEV = V.G.WZ_AKT.R / 100]
G261
G00 Z60
G00 X50 Y50
L CYCLE [NAME=SysMillRectangularPocket.ecy \\
  @P1=0 @P2=50 @P3=2 @P4=12 @P5=4 @P6=V.L.MaxIncrementXY @P20=6000 @P21=4000 \\
  @P31=1 @P72=20 @P73=20 \\
  PATTERN_ID=V.CYC.PatternID PATTERN_RETRACT=V.CYC.PatternRetract \\
  ]
G260
M05
M30
"""


def milled(tmp_path, program, record):
    """(n, 3) positions of the tip at the cycle."""
    with Cell(EXAMPLE / "cell.toml") as cell:
        result = cell.run(
            program, plc="none", record=record, out=tmp_path / "out"
        )
    assert result.end == "completed", result.errors
    with np.load(record) as columns:
        return columns["pos"][:, :3].copy()


def edge(place, length, width, corner):
    """The pocket of a place as a polygon."""
    x, y, _, turn = place
    flat = box(
        corner - length / 2,
        corner - width / 2,
        length / 2 - corner,
        width / 2 - corner,
    )
    return affinity.translate(
        affinity.rotate(
            flat.buffer(corner, quad_segs=400), turn, origin=(0, 0)
        ),
        x,
        y,
    )


def uncut(wall, floor):
    """Share of the area that the tool (radius 5 mm, corners rounded within 0.05
    mm) has not covered, by a grid.
    """
    x0, y0, x1, y1 = wall.bounds
    grid = np.stack(
        np.meshgrid(np.arange(x0, x1, 0.1), np.arange(y0, y1, 0.1)), axis=-1
    ).reshape(-1, 2)
    inside = grid[contains_xy(wall, grid)]
    return float((cKDTree(floor[:, :2]).query(inside)[0] > 5.05 + 5e-3).mean())


@pytest.mark.parametrize("case", ["PAT-1", "example"])
@pytest.mark.ci
def test_pockets_are_milled_where_they_belong(tmp_path, case):
    """Everything below a place's surface lies in its pocket; every pocket is
    cleared down to its exact floor.
    """
    program, sizes = EXAMPLE / "pockets.nc", (30.0, 20.0, 6.0)
    if case == "PAT-1":
        program, sizes = tmp_path / "pat1.nc", (20.0, 20.0, 5.0)
        program.write_text(PAT_1)
    tip = milled(tmp_path, program, tmp_path / "r.npz") - [0.0, 0.0, 60.0]
    cut, done = tip[tip[:, 2] < 60.0], []
    for place in PLACES:
        near = cut[np.hypot(cut[:, 0] - place[0], cut[:, 1] - place[1]) < 40.0]
        below = near[near[:, 2] < place[2] - 1e-6]
        assert below[:, 2].min() == pytest.approx(place[2] - 12.0, abs=1e-6)
        wall = edge(place, *sizes)
        assert contains_xy(
            wall.buffer(-5.0 + 2e-3, quad_segs=400), below[:, :2]
        ).all()
        floor = below[below[:, 2] < place[2] - 12.0 + 1e-6]
        assert uncut(wall, floor) < 1e-4
        done.append(len(below))
    assert min(done) > 100
