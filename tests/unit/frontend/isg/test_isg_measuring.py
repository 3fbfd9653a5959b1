"""M functions of type MNE_SNS in ISG programs: at the simulated probe's
position in the block's motion.
"""

import numpy as np
import pytest

from cnc_core.blocks import M
from cnc_core.errors import CncError
from support.programs import program_of, rows_of

CELL = '[axes.X]\n[axes.Y]\n[axes.Z]\n[channel.m_synch]\n50 = "MNE_SNS"\n51 = "MNE_SNS"\n'


def probed(folder, text, probe="[probe]\nX = 30.0\n"):
    """Rows of a program on a cell with a simulated probe."""
    return rows_of(program_of(folder, "G90 F1000\n" + text, CELL + probe))


def test_the_function_stands_where_the_probe_trips(tmp_path):
    """The motion is parted there; lengths add up, feeds stay."""
    rows = probed(tmp_path, "G01 X40 Y20 M50\nG01 X0\n")
    assert rows["type"].tolist() == [1, M, 1, 1]
    assert rows["end"][0, :2].tolist() == [30, 15]
    assert rows["end"][2, :2].tolist() == [40, 20]
    assert rows["length"][0] + rows["length"][2] == pytest.approx(
        np.hypot(40, 20)
    )
    assert len(set(rows["line"][:3].tolist())) == 1


@pytest.mark.parametrize(
    ("text", "probe"),
    [("G01 X20 M50\n", "[probe]\nX = 30.0\n"), ("G01 X40 M50\n", "")],
)
def test_without_the_event_it_stands_behind_the_motion(tmp_path, text, probe):
    """The motion does not reach the probe, or there is none."""
    assert probed(tmp_path, text, probe)["type"].tolist() == [1, M]


def test_two_in_a_block(tmp_path):
    """Error 20156."""
    with pytest.raises(CncError) as caught:
        probed(tmp_path, "G01 X40 M50 M51\n")
    assert (caught.value.code, caught.value.place.line) == (20156, 2)
