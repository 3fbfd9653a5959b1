"""Lines and arcs that join tangentially are driven without a standstill."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.planning import plan_program
from cnc_core.program import Program


def _rounded_rectangle(
    length: float, width: float, radius: float, feed: float
) -> str:
    """Once around, from the end of one quarter arc."""
    right, top = length - radius, width - radius
    return "\n".join(
        [
            f"G90 G71 G17 F{feed}",
            f"G0 X{radius} Y0",
            f"G1 X{right} Y0",
            f"G3 X{length} Y{radius} I0 J{radius}",
            f"G1 Y{top}",
            f"G3 X{right} Y{width} I{-radius} J0",
            f"G1 X{radius}",
            f"G3 X0 Y{top} I0 J{-radius}",
            f"G1 Y{radius}",
            f"G3 X{radius} Y0 I{radius} J0",
            "M30",
            "",
        ]
    )


@pytest.mark.parametrize(
    ("length", "width", "radius", "feed", "window"),
    [
        (100.0, 200.0, 2.0, 6000.0, 12),
        (200.0, 20.0, 10.0, 12000.0, 120),
        (20.0, 100.0, 2.0, 6000.0, 120),
    ],
)
def test_a_rounded_rectangle_is_driven_without_a_standstill(
    length: float,
    width: float,
    radius: float,
    feed: float,
    window: int,
    tmp_path: Path,
) -> None:
    """A window that ended ahead of a joint does not make the tool stand there."""
    path = tmp_path / "part.nc"
    path.write_text(_rounded_rectangle(length, width, radius, feed))
    result = plan_program(
        Program(path, CellConfig(), "isg"), window=window, keep_samples=True
    )
    samples = result.samples
    assert samples is not None
    way, speed = np.asarray(samples["s"]), np.asarray(samples["v"])
    inside = (way > radius + 1.0) & (way < way[-1] - 1.0)
    assert speed[inside].min() > 1.0
