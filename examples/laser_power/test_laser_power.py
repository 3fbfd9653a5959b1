"""The example's claim: look-ahead keeps the energy per length near the wanted one.

The deviation is several times smaller.
"""

import math
from pathlib import Path
from typing import Any

import pytest
from laser_process import HERE, compare, worst

from plc_client.mock import arc, line


@pytest.mark.ci
def test_energy_per_length_with_and_without_look_ahead(tmp_path: Path) -> None:
    """Same part, same laser: the deviation falls to less than a third."""
    percent = worst(compare(tmp_path))
    assert percent["without_lookahead"] > 3.0 * percent["with_lookahead"]


def test_power_falls_before_the_arc_does(plc: Any) -> None:
    """The power is already lower in front of the arc.

    The mock does not slow down at all.
    """
    runner = plc(
        HERE / "with_lookahead.py",
        script=[line(50), arc(2, math.pi / 2), line(50)],
        feed_mm_s=150,
    )
    runner.run_to_distance(300_000.0)
    assert runner.task.power_w == pytest.approx(20.0 * 150.0)
    runner.run_to_distance(490_000.0)
    assert runner.task.power_w < 0.7 * 20.0 * 150.0
