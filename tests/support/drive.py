"""Drive rows through an engine and judge the samples, for tests of planner and interpolator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import LINEAR, NC_BLOCK, POLYNOMIAL, BlockBatch
from cnc_core.config import CellConfig
from cnc_core.engine import Engine, Event
from support.limits import FloatArray


def line_rows(points: FloatArray, feed: float) -> npt.NDArray[Any]:
    """G1 rows through the points (n, axes) behind the first one; repeated points give no row."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    keep = length > 0
    rows = np.zeros(int(keep.sum()), NC_BLOCK)
    rows["end"][:, : points.shape[1]] = points[1:][keep]
    rows["length"] = rows["length_min"] = length[keep]
    rows["feed"], rows["type"], rows["line"] = (
        feed,
        LINEAR,
        np.arange(len(rows)) + 1,
    )
    return rows


def curve_rows(
    coef: FloatArray, ends: FloatArray, lengths: FloatArray, feed: float
) -> tuple[Any, FloatArray]:
    """(rows, pool) of polynomials: coef (n, axes, order) ascending over
    0..ends[i], of the given lengths in mm.
    """
    n, axes, order = coef.shape
    rows = np.zeros(n, NC_BLOCK)
    powers = ends[:, None] ** np.arange(order)
    rows["end"][:, :axes] = (coef * powers[:, None, :]).sum(axis=2)
    rows["length"] = rows["length_min"] = lengths
    rows["angle"], rows["feed"], rows["type"], rows["degree"] = (
        ends,
        feed,
        POLYNOMIAL,
        order - 1,
    )
    rows["pool"], rows["line"] = np.arange(n) * axes * order, np.arange(n) + 1
    return rows, coef.ravel()


def drive(
    rows: npt.NDArray[Any],
    cell: CellConfig,
    window: int = 120,
    step: int = 1_000_000,
    each_step: Callable[[int, Engine], None] = lambda _k, _e: None,
    limit: int = 3_000_000,
    pool: FloatArray | None = None,
    jerk: bool = True,
) -> tuple[FloatArray, Any]:
    """(positions at the cycle (n, axes), final engine state); ``each_step`` is
    called every ``step`` cycles.

    ``pool``: coefficients of the polynomials among the rows.  ``jerk`` False:
    the acceleration-limited planner.
    """
    coefficients = np.empty(0) if pool is None else pool
    engine = Engine(cell, window=window, record_rows=65536, jerk=jerk)
    first, parts, k, finished = 0, [], 0, False
    while True:
        event = engine.run(step)
        if event is Event.NEED_BLOCKS:
            if first < len(rows):
                first += engine.push(
                    BlockBatch(rows[first : first + 20_000], coefficients)
                )
            elif not finished:
                engine.finish()
                finished = True
        elif event is Event.RECORD_FULL:
            parts.append(engine.take_samples().pos)
        elif event is Event.DONE:
            each_step(k, engine)
            k += 1
            assert k * step < limit, "the program does not end"
        else:
            assert event is Event.PROGRAM_END, event
            break
    parts.append(engine.take_samples().pos)
    state = engine.state
    engine.close()
    return np.concatenate(parts), state
