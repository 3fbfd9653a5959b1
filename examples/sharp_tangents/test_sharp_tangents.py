"""The example's claim: gentle braking keeps the swinging tool near the corner.

The tool brakes ahead of sharp tangents.
"""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from tangents_process import HERE, compare

from plc_client.mock import line


@pytest.mark.ci
def test_overshoot_with_and_without_look_ahead(tmp_path: Path) -> None:
    """Less than half the overshoot, less than half the speed beyond the corner."""
    found = compare(tmp_path)
    before, after = found["without_lookahead"], found["with_lookahead"]
    assert before[0].max() > 2.0 * after[0].max()
    assert before[1].max() > 2.0 * after[1].max()


def test_feed_falls_gently_before_the_tangent_on_the_mock(plc: Any) -> None:
    """sqrt(2 a d), not below the slowest, and up again gently behind the corner."""
    script = [line(100), line(100, tangent=math.pi / 2)]
    runner = plc(HERE / "with_lookahead.py", script=script, feed_mm_s=200)
    runner.run_to_distance(450_000.0)
    assert runner.task.percent == 100.0
    runner.run_to_distance(900_000.0)
    assert runner.task.percent < 65.0
    runner.watch("Feed.percent")
    runner.run_to_distance(1_200_000.0)
    percent = runner.trace()["Feed.percent"]
    assert percent.min() == 8.0
    assert max(b - a for a, b in pairwise(percent)) <= 0.5 + 1e-9
