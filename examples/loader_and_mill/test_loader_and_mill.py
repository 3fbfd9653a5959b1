"""The example's claim: parts change hands, and nobody gets in the way."""

import numpy as np
from over_time import run


def test_parts_are_handed_over():
    """Two parts: at each hand-over vice and gripper hold the part together,
    and the mill stays away while the loader is at the vice.
    """
    result, columns = run()
    assert result.plc["result"] == {"parts": 2}
    assert [one["end"] for one in result.channels] == ["completed"] * 2
    vice, gripper = (columns[name] > 0 for name in ("vice", "gripper"))
    at_vice = columns["loader_x"] < 100.0
    both = vice & gripper & at_vice
    assert np.count_nonzero(np.diff(both.astype(int)) == 1) == 2
    opens = np.diff(gripper.astype(int)) == -1
    assert vice[:-1][opens].all()
    loader_at_vice = (columns["loader_x"] < 100.0) & (
        columns["loader_z"] < -1.0
    )
    mill_cuts = columns["mill_z"] < 40.0
    assert loader_at_vice.any()
    assert mill_cuts.any()
    assert not (loader_at_vice & mill_cuts).any()
