"""A window may begin where the speed rises as steeply as the jerk allows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program


@pytest.mark.ci
def test_a_window_that_begins_in_a_rise_is_found(
    program: Callable[..., Path],
) -> None:
    """Lines of all lengths: W120 begins one behind a corner that W190 plans
    through (it took 1.006 of its time).
    """
    rng = np.random.default_rng(388)
    jerk, acc = 10 ** rng.uniform(4, 5.5), 10 ** rng.uniform(3, 4.1)
    v = rng.uniform(100, 500)
    cell = parse_config(
        "".join(
            f"[axes.{n}]\nv_max_mm_s={v:.3f}\na_max_mm_s2={acc:.2f}\n"
            f"j_max_mm_s3={jerk:.1f}\n"
            for n in "XYZ"
        )
    )
    feed = float(rng.choice([1000, 3000, 6000, 12000, 20000]))
    tolerance = float(rng.choice([0.005, 0.01, 0.02, 0.05, 0.1]))
    rng.uniform()  # the program that was found has this draw between
    at, text = np.zeros(3), f"F{feed:g}\n"
    for _ in range(50):
        at = at + rng.normal(size=3) * rng.choice([0.4, 2, 6])
        text += "G1 X{:.4f} Y{:.4f} Z{:.4f}\n".format(*at)
    source = program(text + "M30\n")
    near, far = (
        plan_program(
            Program(source, cell, "isg", tolerance=tolerance), window=window
        ).motion_time_s
        for window in (120, 190)
    )
    assert near <= 1.001 * far
