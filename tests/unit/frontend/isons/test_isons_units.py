"""G20 and G21: everything that a program writes and reads is in the unit in force."""

from __future__ import annotations

import numpy as np
import pytest

from support.programs import motions_of, program_of, rows_of

CELL = "[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.A]\nkind = 'rotary'\n[isons.parameters]\nFEEDRES = 1\n"


def moved(folder, text: str) -> np.ndarray:
    """Motions of a program with F in mm/min."""
    return motions_of(rows_of(program_of(folder, text, CELL, "isons")))


@pytest.mark.parametrize(
    "position", ["$_Q0", "$_R0", "$_C0", "$_Q100 - $_Y0 - $_W0"]
)
def test_the_position_that_is_read_is_where_it_stands(tmp_path, position):
    """The pause recipe of the guide saves $_Q0 and drives to it again."""
    rows = moved(
        tmp_path,
        f"G20\nG94 X3\nG1 X5 A30 F100\nG62\nX7\nG62\n$A={position}\nX5\nX[$A]\nM30\n",
    )
    assert rows["end"][-1, :4] == pytest.approx(rows["end"][1, :4])


def test_rotary_positions_are_degrees(tmp_path):
    """Whatever the unit is."""
    rows = moved(
        tmp_path,
        "G20\nG1 A30 F100\nG62\nA10\nG62\nX[$_Q6+$_Q5+$_Q4+$_Q3]\nM30\n",
    )
    assert rows["end"][-1, 0] == pytest.approx(10 * 25.4)


def test_an_origin_moves_by_what_is_added(tmp_path):
    """G94 X[$_Y0+1] twice: two inches."""
    rows = moved(
        tmp_path, "G20\nG94 X[$_Y0+1]\nG94 X[$_Y0+1]\nG1 X0 F100\nM30\n"
    )
    assert rows["end"][-1, 0] == pytest.approx(2 * 25.4)


def test_limits_are_read_as_they_are_written(tmp_path):
    """$_N0 and $_S0."""
    text = "G1 X[$_N0] F6000\nX[$_S0]\nG20 X[$_N0]\nX[$_S0]\nM30\n"
    cell = "[axes.X]\nmin_mm=-100\nmax_mm=300\n[axes.Y]\n[axes.Z]\n"
    rows = motions_of(rows_of(program_of(tmp_path, text, cell, "isons")))
    assert rows["end"][:, 0] == pytest.approx([300, -100, 300, -100])


@pytest.mark.parametrize("block", ["G20 G1 X1 F100", "G1 X1 F100 G20"])
def test_the_unit_holds_for_the_feed_of_its_block(tmp_path, block):
    """Behind it, as in front of it: 100 inch per minute."""
    rows = moved(tmp_path, f"{block}\nM30\n")
    assert rows["end"][-1, 0] == pytest.approx(25.4)
    assert rows["feed"][-1] == pytest.approx(2540 / 60)
