"""Marks of the look-ahead in IsoNs programs: the same rows as from ISG programs."""

import pytest

from cnc_core.blocks import DISTANCE_RESET, MARKER
from cnc_core.errors import CncError
from cnc_core.frontend.port import OfflinePort
from cnc_core.program import Program
from support.isons_programs import CELL, exact_cell, run

ISONS = """G60 G63 F3
G1X10
N20 #CONTOUR LOOKAHEAD LOG ON [PARAM=2.5]
N30 G1X20Y5
#CONTOUR LOOKAHEAD LOG [PARAM={}]
N40 G2X30Y5R10
#CONTOUR LOOKAHEAD LOG OFF
#DISTANCE PROG START CLEAR
G1X50
#CONTOUR LOOKAHEAD LOG CLEAR
G1X60
"""


def test_the_same_rows_as_from_isg(tmp_path):
    """Kinds, actions, parameters, N numbers and geometry, row by row."""
    mine = run(tmp_path, "$A=3\n" + ISONS.format("$A*2")).rows
    path = tmp_path / "part.nc"
    path.write_text(
        "P1=3\n" + ISONS.replace("G60 G63 F3", "F3000").format("P1*2")
    )
    port = OfflinePort([0.0] * 4)
    theirs = [
        row
        for batch in Program(path, exact_cell(CELL), "isg", port).batches()
        for row in batch.rows
    ]
    names = ("type", "code", "value", "n", "line", "length", "angle", "radius")
    assert [[row[name] for name in names] for row in mine] == [
        [row[name] for name in names] for row in theirs
    ]
    assert [int(row["type"]) for row in mine].count(MARKER) == 4
    assert [int(row["type"]) for row in mine].count(DISTANCE_RESET) == 1


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("#CONTOUR LOOKAHEAD\n", 900010),
        ("#CONTOUR LOOKAHEAD LOG CLEAR [PARAM=1]\n", 900010),
        ("#CONTOUR LOOKAHEAD LOG ON X\n", 900010),
        ("#HSC ON\n", 900002),
        ("D5\nG41\nG1X5\n#CONTOUR LOOKAHEAD LOG CLEAR\n", 906003),
    ],
)
def test_wrong_marks(tmp_path, text, code):
    """What ISG refuses is refused; other commands with # are unknown."""
    with pytest.raises(CncError) as caught:
        run(tmp_path, text)
    assert caught.value.code == code
