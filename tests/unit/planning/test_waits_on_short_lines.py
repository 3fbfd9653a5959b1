"""Preparation waits for all that it has handed out, however short the last lines
are. Without jerk a corner there looks for the path behind it, which comes after
the wait only.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.config import CellConfig, parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program

Write = Callable[..., Path]
DEFAULT = CellConfig()
SLOW_CYCLE = parse_config(
    "cycle_s = 0.004\n"
    + "".join(
        f"[axes.{axis}]\nv_max_mm_s = 800.0\na_max_mm_s2 = 500.0\n"
        for axis in "XYZ"
    )
)
TWO_LINES = ["F143", "G1 X0.0341 Y0.0032", "G1 X0.0683 Y0.0044"]
SIX_LINES = [
    "F500",
    "G1 X-0.3276 Y0.2482",
    "G1 X-0.6718 Y0.4727",
    "G1 X-3.4233 Y0.5687",
    "G1 X-3.7885 Y0.3802",
    "G1 X-4.1437 Y0.1734",
    "G1 X-4.4962 Y-0.0379",
]


class EndlessError(Exception):
    """Too many looks at a program that is planned in a few."""


def at_most(looks: int) -> Callable[[Any], None]:
    """Raises EndlessError at a look too many."""
    left = looks

    def look(_feeder: Any) -> None:
        nonlocal left
        left -= 1
        if left < 0:
            raise EndlessError

    return look


@pytest.mark.parametrize(
    "wait", ["#FLUSH WAIT", "#CHANNEL INIT [CMDPOS]", '#MSG SYN ["x"]']
)
@pytest.mark.parametrize(
    ("cell", "lines"), [(DEFAULT, TWO_LINES), (SLOW_CYCLE, SIX_LINES)]
)
def test_wait_behind_short_lines_ends(
    program: Write, cell: CellConfig, lines: list[str], wait: str
) -> None:
    """The lines ahead of the wait are driven to their end, then the line behind
    it; no acceleration is above its limit.
    """
    path = program("\n".join([*lines, wait, "G1 X0 Y0", "M30", ""]))
    result = plan_program(
        Program(path, cell, "isg"),
        jerk=False,
        look=at_most(60),
        keep_samples=True,
    )
    assert result.samples is not None
    assert np.asarray(result.samples["pos"])[-1] == pytest.approx(0.0)
    assert result.infeasible == 0
    assert result.max_ratio["acceleration"] <= 1.02
