"""Seeded property of the planner without jerk: blocks much shorter than a
cycle, at corners of lines and arcs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cnc_core.blocks import CIRCULAR, LINEAR, NC_BLOCK
from cnc_core.config import AxisConfig, CellConfig
from cnc_core.engine import Engine
from support.drive import FloatArray, drive
from support.limits import ratios
from support.seeds import few


class Walk:
    """Rows of a path in the plane: where it is, and where it points to."""

    def __init__(self) -> None:
        self.rows: list[Any] = []
        self.at = np.zeros(2)
        self.heading = np.array([1.0, 0.0])

    def line(self, along: FloatArray, length: float) -> None:
        self._add(
            self.at + length * along / np.linalg.norm(along), length, LINEAR
        )

    def arc(self, radius: float, sweep: float) -> None:
        side = (
            radius
            * np.sign(sweep)
            * np.array([-self.heading[1], self.heading[0]])
        )
        c, s = np.cos(sweep), np.sin(sweep)
        turn, centre = np.array([[c, -s], [s, c]]), self.at + side
        self._add(centre - turn @ side, radius * abs(sweep), CIRCULAR)
        row = self.rows[-1]
        row["center"][:2], row["angle"], row["radius"], row["plane"] = (
            centre,
            sweep,
            radius,
            17,
        )
        self.heading = turn @ self.heading

    def _add(self, end: FloatArray, length: float, kind: int) -> None:
        row = np.zeros(1, NC_BLOCK)[0]
        row["end"][:2], row["type"], row["line"] = end, kind, len(self.rows) + 1
        row["length"] = row["length_min"] = length
        self.rows.append(row)
        self.at = end


def tiny_blocks(rng: np.random.Generator) -> npt.NDArray[Any]:
    """Lines and arcs of one scale, gentle or sharp corners, runs of tiny blocks
    in any direction at these.
    """
    walk, scale, size = (
        Walk(),
        float(rng.lognormal(rng.uniform(-4, 2))),
        10 ** rng.uniform(-7, -1),
    )
    turn, arcs = rng.choice([0.01, 0.1, 0.5, 3.0]), rng.random() < 0.4
    for _ in range(int(rng.integers(5, 60))):
        length = scale * float(rng.lognormal(0, rng.choice([0, 0.3, 1.5])))
        if arcs and rng.random() < 0.5:
            radius = length * float(rng.lognormal()) + 1e-3
            walk.arc(
                radius, float(rng.choice([-1, 1])) * min(length / radius, 6.0)
            )
        else:
            walk.line(walk.heading, length)
        for _ in range(int(rng.choice([0, 1, 1, 2, 5, 30]))):
            way = rng.choice(
                [1.0, -1.0], p=[0.8, 0.2]
            ) * walk.heading + rng.choice([0.0, 0.3, 3.0]) * rng.normal(size=2)
            walk.line(
                way, size if rng.random() < 0.7 else 10 ** rng.uniform(-7, -1)
            )
        walk.heading = walk.heading + turn * rng.normal(size=2)
        walk.heading /= np.linalg.norm(walk.heading)
    return np.array(walk.rows)


def any_cell(rng: np.random.Generator) -> CellConfig:
    accel = (
        rng.choice([300.0, 3000.0, 20000.0], 2)
        if rng.random() < 0.5
        else [3000.0, 3000.0]
    )
    axes = {
        name: AxisConfig(a_max_mm_s2=float(a), j_max_mm_s3=0.0)
        for name, a in zip("XY", accel, strict=True)
    }
    return CellConfig(
        cycle_s=float(rng.choice([0.00025, 0.0005, 0.001, 0.004])),
        axes={**axes, "Z": AxisConfig(j_max_mm_s3=0.0)},
    )


@pytest.mark.parametrize("seed", few([316, *range(32)], 17))
@pytest.mark.parametrize(
    "live", [False, True], ids=["steady", "override steps"]
)
def test_tiny_blocks_at_corners_keep_to_the_limits(
    seed: int, live: bool
) -> None:
    """What cycles show: 1.02 of velocity and acceleration, 1.005 of the feed,
    whatever lies beside a corner.
    """
    rng = np.random.default_rng(seed)
    rows, cell = tiny_blocks(rng), any_cell(rng)
    feed = rows["feed"] = max(
        10 ** rng.uniform(-1, 3), float(rows["length"].sum()) / 10
    )
    highest = 1.0

    def change(_k: int, engine: Engine) -> None:
        nonlocal highest
        override = float(rng.choice([0.1, 0.5, 1.0, 1.3, 2.0]))
        highest = max(highest, override)
        engine.set_override(override, False)

    pos, state = drive(
        rows,
        cell,
        int(rng.choice([30, 120])),
        *((37, change) if live else ()),
        jerk=False,
    )
    velocity, acceleration = ratios(pos, cell, jerk=False)
    assert velocity <= 1.02
    assert acceleration <= 1.02
    assert (
        float(np.linalg.norm(np.diff(pos, axis=0), axis=1).max()) / cell.cycle_s
        <= 1.005 * highest * feed
    )
    assert np.abs(pos[-1] - rows["end"][-1][:3]).max() <= 1e-7
    assert state.infeasible == 0
