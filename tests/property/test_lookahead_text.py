"""The look-ahead against geometry that is made together with the program's text."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.contour_oracle import differences
from support.contour_text import WrittenContour
from support.inside import Inside
from support.seeds import few

pytestmark = pytest.mark.sanitize("engine")
CELL = """
[axes.X]
[axes.Y]
[axes.Z]
[channel]
interpolator_function = "FCT_LOOK_AHEAD_CUSTOM | FCT_CONTOUR_LAH"
lookahead_blocks_max = 1000
lookahead_blocks = 1000
contour_lookahead_log_max = 1000
"""


@pytest.mark.parametrize("seed", few(range(60), 2))
def test_every_member_is_what_was_written(tmp_path: Path, seed: int) -> None:
    """Planes, G91, inches, centres absolute or not, radii, whole circles, helices,
    mirrors and turned systems: every member within 1e-4 of its unit.
    """
    program = WrittenContour(seed)
    with Inside(tmp_path, program.text, CELL) as cnc:
        assert differences(cnc.request(-1.0, 1e12), program.due) == []
