"""Which dialect a program is read as when nobody says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core import frontend


@pytest.mark.parametrize(
    ("name", "text", "dialect"),
    [
        ("a.nc", "G1 X1 F10\n", "isg"),
        ("a.ngc", "G1 X1 F10\n", "iso"),
        ("a.tap", "", "iso"),
        ("a.xyz", "G1\n", "isg"),
        ("a.ngc", "N10 #CONTOUR LOOKAHEAD LOG ON\n", "isg"),
        ("a.nc", "G90 G94 G17 G49\nM6 T1\nG43 H1 Z5\n", "iso"),
        ("a.nc", "#1=5\nG1 X#1\n", "iso"),
        ("a.isons", "G1 X1\n", "isons"),
        ("a.isons", "G49 XYZ\nG43 X10.3 Z+\n", "isons"),
        ("a.nc", "$A=5\nG1X[$A]\n", "isons"),
        ("a.nc", "G1X5\nLOOP 5\nG1DX5\nEND_LOOP\n", "isons"),
        ("a.nc", "$FOR P1 = 1, 5, 1\nX[P1]\n$ENDFOR\n", "isg"),
        ("a.nc", "#<r> = 2\n", "iso"),
        ("a.nc", "(G43 H1)\nG1 X1 F1 ; #<x>\n", "isg"),
        ("a.nc", "G431\n", "isg"),
        ("a.nc", "xg43\nG1 X1\n", "isg"),
        ("a.nc", "n10 g43 h1\n", "iso"),
        ("a.nc", "x1 v.a.abs.x\n", "isg"),
        ("a.nc", "(hsm, as the machine has it)\nG1 X1\n", "isg"),
        ("a.ngc", "G1 X1 (MSG, #CONTOUR)\n", "iso"),
        ("a.nc", "%\nO1001\nG0 X1\n%\n", "iso"),
        ("a.nc", "(a)\nO0001 (PART 7)\nG0 X1\n", "iso"),
        ("a.nc", "%part\nG0 X1\n", "isg"),
        ("a.nc", "%\nG0 X1\nO1001\n", "isg"),
    ],
)
def test_signs_of_one_dialect_count_more_than_the_name(
    tmp_path: Path, name: str, text: str, dialect: str
) -> None:
    """What only one dialect can say decides, comments apart; else the extension."""
    path = tmp_path / name
    path.write_text(text)
    assert frontend.detect(path) == dialect


def test_a_missing_file_is_judged_by_its_name(tmp_path: Path) -> None:
    """The reader reports the missing file."""
    assert frontend.detect(tmp_path / "no.ngc") == "iso"
