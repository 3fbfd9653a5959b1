"""The example's claim: the bead's ends lie where they are programmed.

The valve is slow.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dispenser_process import HERE, compare, errors_mm

from plc_client.mock import line, log_off, log_on, log_param


@pytest.mark.ci
def test_bead_ends_with_and_without_look_ahead(tmp_path: Path) -> None:
    """Within one scan at full speed instead of millimetres."""
    errors = errors_mm(compare(tmp_path))
    assert np.abs(errors["without_lookahead"]).max() > 3.0
    assert np.abs(errors["with_lookahead"]).max() <= 120.0 * 0.002


def test_valve_opens_ahead_on_the_mock(plc: Any) -> None:
    """35 ms before the mark at 100 mm/s: 3.5 mm."""
    script = [
        log_on(),
        line(20),
        log_param(1),
        line(20),
        log_param(0),
        line(20),
        log_off(),
    ]
    runner = plc(HERE / "with_lookahead.py", script=script, feed_mm_s=100)
    runner.run_until(lambda: runner.task.open)
    assert abs(runner.distance - 165_000.0) <= 3000.0
    runner.run_until(lambda: not runner.task.open)
    assert abs(runner.distance - 380_000.0) <= 3000.0
