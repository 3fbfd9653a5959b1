"""Corners of contours that nearly turn back: the tips of their curves have radii
down to nanometres. They cost no more than the corner itself does.
"""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from support.programs import program_of


def axes(scale: float, limits: dict[str, tuple[int, int, int]]) -> str:
    """The cell of a machine with limits of speed, acceleration, jerk."""
    return "".join(
        f"[axes.{name}]\nv_max_mm_s = {v * scale}\na_max_mm_s2 = {a * scale}\n"
        f"j_max_mm_s3 = {j * scale}\n"
        for name, (v, a, j) in limits.items()
    )


USUAL = {
    "X": (300, 3000, 40000),
    "Y": (200, 2000, 30000),
    "Z": (100, 1000, 20000),
}
QUICK = {
    "X": (1000, 10000, 1000000),
    "Y": (1000, 10000, 1000000),
    "Z": (500, 5000, 500000),
}


def contour(
    seed: int, count: int, reach: float, scale: float, mode: str
) -> str:
    """A random path of lines and arcs up to ``reach`` mm, times ``scale``."""
    random = Random(seed)
    lines = [f"F{6000 * scale:.10g}", *([mode, "G261"] if mode else [])]
    x = y = 0.0
    for _ in range(count):
        x += random.uniform(-reach, reach)
        y += random.uniform(-reach, reach)
        arc = random.random() < 0.3
        code = f"G0{random.choice([2, 3])}" if arc else "G01"
        radius = f" R{2 * reach * scale:.12f}" if arc else ""
        lines.append(f"{code} X{x * scale:.12f} Y{y * scale:.12f}{radius}")
    return "\n".join([*lines, *(["G260"] if mode else []), "M30", ""])


def time_s(folder: Path, text: str, cell: str) -> float:
    """Motion time of a program."""
    return plan_program(
        program_of(folder, text, parse_config(cell))
    ).motion_time_s


@pytest.mark.parametrize("seed", [0, 3, 5])
def test_contours_of_a_tenth_take_as_long(tmp_path, seed):
    """On a machine a tenth as large, with a tolerance of a tenth."""
    large, small = (
        time_s(
            tmp_path,
            contour(
                seed,
                30,
                30,
                scale,
                f"#CONTOUR MODE [DEV PATH_DEV={0.1 * scale}]",
            ),
            axes(scale, USUAL),
        )
        for scale in (1.0, 0.1)
    )
    assert small == pytest.approx(large, rel=2e-3)


@pytest.mark.parametrize(
    ("seed", "reach", "scale", "limits"),
    [(22, 3, 0.1, USUAL), (120, 0.3, 1, QUICK)],
)
def test_a_tip_of_nanometres_does_not_stop_the_machine(
    tmp_path, seed, reach, scale, limits
):
    """POS with distances near the blocks' lengths: the motion went on, but for
    minutes at a micrometre per second. Bound: four times exact corners.
    """
    cell = axes(scale, limits)
    distance = 2 * scale
    mode = f"#CONTOUR MODE [POS PRE_DIST={distance} POST_DIST={distance}]"
    exact = time_s(tmp_path, contour(seed, 40, reach, scale, ""), cell)
    rounded = time_s(tmp_path, contour(seed, 40, reach, scale, mode), cell)
    assert rounded < 4 * exact
