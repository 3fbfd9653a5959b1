"""Speeds that the PLC commands, far above the programmed feed, come and go at
random: samples within the limits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hli
from cnc_core.blocks import BlockBatch
from cnc_core.config import CellConfig
from cnc_core.engine import Engine, Event
from hli.areas import Areas
from support.curve_pieces import cell_of, pieces, spline
from support.drive import FloatArray, curve_rows, line_rows
from support.fake_cnc import unique_name
from support.limits import ratios

pytestmark = pytest.mark.sanitize("engine")


def corners(rng: np.random.Generator) -> FloatArray:
    """Short lines at angles, and a wave in small steps."""
    if rng.random() < 0.5:
        steps = rng.normal(size=(150, 3)) * rng.lognormal(-1, 1, (150, 1)) + [
            0.8,
            0,
            0,
        ]
        return np.cumsum(np.vstack([np.zeros(3), steps]), axis=0)
    t = np.linspace(0.0, 60.0, 400)
    return np.column_stack([t, 5 * np.sin(0.5 * t), 3 * np.sin(0.21 * t)])


def drive_commanded(
    rng: np.random.Generator, rows: Any, pool: FloatArray, cell: CellConfig
) -> FloatArray:
    """Positions (n, axes) with a speed commanded, taken back, overridden or
    held every few cycles.
    """
    segment = hli.create(unique_name(), 1, len(cell.axes))
    engine = Engine(
        cell, window=30, record_rows=400_000, jerk=False, segment=segment
    )
    try:
        channel = Areas(segment).gpCh[0]
        channel.head.plc_present_w = True
        speed, valid = (
            channel.bahn_mc_control.ext_command_speed,
            channel.bahn_mc_control.ext_command_speed_valid,
        )
        assert engine.push(BlockBatch(rows, pool)) == len(rows)
        engine.finish()
        speed.enable_w = valid.enable_w = True
        while (event := engine.run(17)) is not Event.PROGRAM_END:
            assert event in (Event.DONE, Event.NEED_BLOCKS)
            speed.command_w = int(rng.choice([3, 10, 30, 100, 300])) * 1000
            valid.command_w = bool(rng.random() < 0.5)
            engine.set_override(
                float(rng.choice([0.3, 1.0, 2.0])), bool(rng.random() < 0.1)
            )
        assert engine.state.infeasible == 0
        return engine.take_samples().pos
    finally:
        engine.close()
        segment.close()
        segment.unlink()


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", [0, 1, 3, 4, 9, 10, 12, 15])
def test_commanded_speed_keeps_the_limits_without_jerk(seed: int) -> None:
    """Jumps at corners and stretches of polynomials hold at any speed that may
    come (they held to twice the feed).
    """
    rng = np.random.default_rng(seed)
    cell = cell_of(rng)
    feed = float(rng.choice([2.0, 5.0, 10.0]))
    if seed % 2:
        rows, pool = curve_rows(*pieces(spline(rng)), feed)
    else:
        rows, pool = line_rows(corners(rng), feed), np.empty(0)
    velocity, acceleration = ratios(
        drive_commanded(rng, rows, pool, cell), cell, False
    )
    assert velocity <= 1.0
    assert acceleration <= 1.01
