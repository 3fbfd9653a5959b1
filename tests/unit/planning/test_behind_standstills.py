"""What follows a standstill is planned as at the start of a program."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from cnc_core.config import CellConfig, parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program

Write = Callable[..., Path]
Point = npt.NDArray[np.float64]


def cell(times: float) -> CellConfig:
    """Y has so many times less jerk than X."""
    return parse_config(
        f"[axes.X]\nj_max_mm_s3 = 4e5\na_max_mm_s2 = 5000.0\n"
        f"[axes.Y]\nj_max_mm_s3 = {4e5 / times}\na_max_mm_s2 = 3000.0\n"
    )


def walk(
    rng: np.random.Generator, count: int, at: Point, angle: float
) -> list[Point]:
    """Corners of a random walk in lines of 1 to 4 mm."""
    out = []
    for _ in range(count):
        way = rng.uniform(1, 4) * np.array([np.cos(angle), np.sin(angle)])
        at = np.round(at + way, 4)
        out.append(at)
        angle += rng.normal() * 0.5
    return out


def lines(points: Iterable[Point]) -> list[str]:
    return [f"G1 X{x:.4f} Y{y:.4f}" for x, y in points]


@pytest.mark.ci
@pytest.mark.parametrize(
    ("seeds", "times"), [(range(7, 13), 20.0), ([8], 1.0), ([9], 1.0)]
)
def test_behind_a_standstill_motion_is_as_fast_as_from_the_start(
    program: Write, seeds: Iterable[int], times: float
) -> None:
    """Within 0.05 % in the sum, within 0.3 % for each walk: a first plan over one line cost up to
    0.5 %. Rounding decides which curve is found, so a walk on unequal axes may differ by 0.25 %.
    """

    def seconds(blocks: list[str]) -> float:
        text = "\n".join(["F6000", *blocks, "M30\n"])
        source = Program(program(text), cell(times), "isg", tolerance=0.02)
        return plan_program(source).motion_time_s

    wholes, sums = [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        ahead = walk(rng, 8, np.zeros(2), 0.3)
        corner = ahead[-1]
        behind = walk(rng, 15, corner, rng.uniform(-3, 3))
        first, stop = lines(ahead[:-1]), lines([corner])
        wholes.append(seconds([*first, f"G60 {stop[0]}", *lines(behind)]))
        alone = seconds(lines(point - corner for point in behind))
        sums.append(seconds([*first, *stop]) + alone)
    assert sum(wholes) == pytest.approx(sum(sums), rel=5e-4)
    assert wholes == pytest.approx(sums, rel=3e-3)
