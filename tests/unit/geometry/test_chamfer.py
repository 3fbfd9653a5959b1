"""G301, G302, #CHR, #CHF, #RND: new elements between blocks, against
constructions of a few lines.
"""

import math

import numpy as np
import pytest

from cnc_core.blocks import CIRCULAR, LINEAR
from cnc_core.blocks.pool import joined
from cnc_core.config import load_config
from cnc_core.program import Program
from support.programs import ended_program, motions_of, rows_of


def corners(tmp_path, text, size=4096):
    """Motion rows, read in batches of a size."""
    return motions_of(rows_of(ended_program(tmp_path, text), size))


@pytest.mark.parametrize("size", [1, 2, 4096])
@pytest.mark.parametrize(
    "corner", ["G301 I2", "#CHR=2", "#CHF=2.8284271247461903"]
)
def test_a_chamfer_cuts_the_corner(tmp_path, corner, size):
    """Both blocks are shortened by the distance; the new block has the number of its own."""
    rows = corners(tmp_path, f"N10 G01 X10 F1000\nN15 {corner}\nN20 Y10", size)
    assert rows["n"].tolist() == [10, 15, 20]
    assert rows["end"][:, :2] == pytest.approx(
        np.array([[8, 0], [10, 2], [10, 10]])
    )
    assert rows["length"] == pytest.approx([8, math.sqrt(8), 8])


def test_the_size_is_modal_and_the_word_may_stand_in_the_block(tmp_path):
    """G301 without I takes the last one; #RND before or behind the words means the same."""
    rows = corners(tmp_path, "G01 X10 F1000\nG302 I1\nY10\nG302\nX0")
    assert rows["type"].tolist() == [LINEAR, CIRCULAR, LINEAR, CIRCULAR, LINEAR]
    for text in ("G01 X10 #RND=1 F1000\nY10", "#RND = 1 G01 X10 F1000\nY10"):
        assert corners(tmp_path, text)["type"].tolist() == [
            LINEAR,
            CIRCULAR,
            LINEAR,
        ]


def test_a_rounding_between_lines(tmp_path):
    """Tangential arc; the feed of #FRC holds on it alone."""
    rows = corners(tmp_path, "G01 X10 F1200 #RND=3 #FRC=600\nX20 Y10")
    setback = 3 * math.tan(math.pi / 8)
    assert rows["end"][0, :2] == pytest.approx([10 - setback, 0])
    assert rows["end"][1, :2] == pytest.approx(
        np.array([10, 0]) + setback * math.sqrt(0.5)
    )
    assert rows["angle"][1] == pytest.approx(math.pi / 4)
    assert rows["center"][1] == pytest.approx([10 - setback, 3])
    assert rows["feed"].tolist() == [20, 10, 20]


@pytest.mark.parametrize(
    "text",
    [
        "G01 X10 F1000\n{}\nG02 X20 Y10 I10 J0",
        "G01 X10 Y4 F1000\n{}\nG03 X20 Y14 I0 J10",
        "G03 X10 Y10 I0 J10 F1000\n{}\nG01 X20",
        "G02 X10 Y0 I5 J0 F1000\n{}\nG02 X20 Y0 I5 J0",
        "G03 X10 Y0 I5 J0 F1000\n{}\nG02 X16 Y-6 I0 J-6",
    ],
)
def test_roundings_with_arcs_are_tangential(tmp_path, text):
    """Direction is continuous at both ends, and the path has no gap."""
    rows = corners(tmp_path, text.format("G302 I1.5"))
    assert len(rows) == 3
    at, before = np.zeros(2), None
    for row in rows:
        end = row["end"][:2]
        if row["type"] == CIRCULAR:
            d0, d1 = at - row["center"], end - row["center"]
            assert (
                np.hypot(*d0)
                == pytest.approx(np.hypot(*d1))
                == pytest.approx(row["radius"])
            )
            s = np.sign(row["angle"])
            first, last = (
                s * np.array([-d0[1], d0[0]]),
                s * np.array([-d1[1], d1[0]]),
            )
            turned = math.atan2(d0[0] * d1[1] - d0[1] * d1[0], d0 @ d1)
            assert math.cos(turned) == pytest.approx(math.cos(row["angle"]))
            assert row["length"] == pytest.approx(
                abs(row["angle"]) * row["radius"]
            )
        else:
            first = last = end - at
            assert row["length"] == pytest.approx(np.hypot(*first))
        first, last = first / np.hypot(*first), last / np.hypot(*last)
        if before is not None:
            assert first == pytest.approx(before, abs=1e-7)
        at, before = end, last
    assert rows["radius"][1] == pytest.approx(1.5)


def test_a_chamfer_on_an_arc_is_a_chord(tmp_path):
    """I is the distance of the point on the arc from the corner."""
    rows = corners(tmp_path, "G01 X10 Y4 F1000\nG301 I2\nG03 X20 Y14 I0 J10")
    corner = np.array([10, 4])
    assert [
        np.hypot(*(rows["end"][i, :2] - corner)) for i in (0, 1)
    ] == pytest.approx([2, 2])


def test_tangential_blocks_get_nothing(tmp_path):
    """A straight on, an arc that goes on."""
    assert len(corners(tmp_path, "G01 X10 F1000\nG302 I1\nX20")) == 2


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("G301 I2\nG01 X10 F1000", 20351),
        ("G01 X10 F1000\nG301 I20\nY5", 911004),
        ("G01 X10 F1000\nG302 I5\nG01 Y4", 911004),
        ("G01 X10 F1000\nG301 I1", 911005),
        ("G01 X10 F1000\nG301 I1\nY5 Z1", 911005),
        ("G01 X10 F1000\nG301\nY5", 900012),
        ("G01 X10 F1000\nG301 I-1\nY5", 900012),
        ("G01 X10 F1000\nG301 I1 X5", 900010),
        ("G01 X10 F1000 #RND\nY5", 900004),
    ],
)
def test_errors(tmp_path, text, code):
    """By number, at the block of the corner."""
    program = ended_program(tmp_path, text, collect=True)
    list(program.batches())
    assert [e.code for e in program.errors] == [code]


def test_compensation_sees_the_new_elements(tmp_path):
    """The arc of a rounding is compensated as a programmed one."""
    (tmp_path / "cell.toml").write_text(
        "[axes.X]\n[axes.Y]\n[axes.Z]\n[tools.1]\nradius_mm = 1.0\n"
    )
    (tmp_path / "a.nc").write_text(
        "G41 D1 G01 X10 F1000\nX20\nG302 I3\nY20\nX0\nG40 X-5\nM30\n"
    )
    program = Program(tmp_path / "a.nc", load_config(tmp_path / "cell.toml"))
    rows = joined(list(program.batches())).rows
    arcs = rows[rows["type"] == CIRCULAR]
    assert arcs["programmed_radius"][0] == pytest.approx(3)
    assert arcs["radius"][0] == pytest.approx(2)
