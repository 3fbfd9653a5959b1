"""The example's claim: the generator's sets change where the details begin and end."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from erosion_process import HERE, compare

from plc_client.mock import line


@pytest.mark.ci
def test_sets_with_and_without_look_ahead(tmp_path: Path) -> None:
    """A tenth of the wrong wall, and changes where they should lie.

    The corners, which slow the tool down, leave a small error.
    """
    found = compare(tmp_path)
    assert found["without_lookahead"][0] > 10.0 * found["with_lookahead"][0]
    assert np.abs(found["with_lookahead"][1]).max() < 0.2
    assert np.abs(found["without_lookahead"][1]).min() > 1.2


def test_the_scaled_length_decides_on_the_mock(plc: Any) -> None:
    """A long element whose length on the scaled contour is short is a detail."""
    script = [line(20), line(5, length_min_mm=0.5), line(20)]
    runner = plc(HERE / "with_lookahead.py", script=script, feed_mm_s=10)
    runner.run_until(lambda: runner.task.fine)
    assert abs(runner.distance - (200_000.0 - 12_000.0)) < 500.0
    runner.run_until(lambda: not runner.task.fine)
    assert abs(runner.distance - (250_000.0 - 12_000.0)) < 500.0
