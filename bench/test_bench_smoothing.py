"""Smoothing: CPU per block on seeded dense, coarse and cornered data.

``pytest bench --benchmark-enable``; figures stand in ``extra_info``. Nothing
timed is asserted.
"""

import time
from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import LINEAR, NC_BLOCK, BlockBatch
from cnc_core.geometry.stages.smoothing import Smoothing, SmoothingMachine

MACHINE = SmoothingMachine((0, 1, 2), 0, 3000.0, 100.0)


def contour(n: int) -> Any:
    angle = 2 * np.pi * np.arange(n) / 2500
    radius = (
        40
        + 8 * np.sin(7 * angle)
        + 2 * np.sin(31 * angle)
        + 0.05 * angle / (2 * np.pi)
    )
    return np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), 0 * angle]
    ).round(4)


def coarse(n: int) -> Any:
    t = np.cumsum(np.random.default_rng(1).uniform(0.01, 0.05, n))
    return np.column_stack(
        [
            20 * np.cos(3 * t) + 5 * np.cos(11 * t),
            20 * np.sin(2 * t),
            3 * np.sin(7 * t),
        ]
    ).round(3)


def corners(n: int) -> Any:
    return np.cumsum(
        np.random.default_rng(2).normal(size=(n, 3)), axis=0
    ).round(3)


def collinear(n: int) -> Any:
    return np.column_stack(
        [np.arange(n) * 0.02, np.zeros(n), np.zeros(n)]
    ).round(4)


@pytest.mark.parametrize(
    ("shape", "n"),
    [
        (contour, 50_000),
        (coarse, 5_000),
        (corners, 5_000),
        (collinear, 50_000),
    ],
)
def test_smoothing(benchmark: Any, shape: Any, n: int) -> None:
    """Microseconds a block, pieces a block, certified deviation at a tolerance
    of 0.01 mm.
    """
    points = shape(n)
    rows = np.zeros(n - 1, NC_BLOCK)
    rows["end"][:, :3] = points[1:]
    rows["type"], rows["feed"] = LINEAR, 100.0
    rows["length"] = rows["length_min"] = np.linalg.norm(
        np.diff(points, axis=0), axis=1
    )

    def run() -> dict[str, float]:
        stage, begin = Smoothing(points[0], MACHINE, 0.01), time.process_time()
        for i in range(0, len(rows), 4096):
            stage.push(BlockBatch(rows[i : i + 4096]))
        stage.drain()
        cpu, report = time.process_time() - begin, stage.report
        return {
            "us_per_block": cpu / len(rows) * 1e6,
            "pieces_per_block": report.pieces / len(rows),
            "solves_per_window": report.solves / max(report.windows, 1),
            "fallbacks": report.fallbacks,
            "deviation_mm": report.deviation,
        }

    value = benchmark.pedantic(run, rounds=3)
    benchmark.extra_info.update(value)
    assert value["deviation_mm"] <= 0.01 * (1 + 1e-9)
