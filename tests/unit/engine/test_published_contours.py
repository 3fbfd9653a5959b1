"""The look-ahead's acceptance programs and the vendor's two loop examples."""

from pathlib import Path
from typing import Any

import pytest

from support.inside import Inside

pytestmark = pytest.mark.sanitize("engine")

START = "[axes.X]\nstart_mm = -5\n[axes.Y]\n[axes.Z]\n"
T1 = """N10 G00 X0 Y0
N20 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]
N30 G01 X30 Y0 F1000
N40 X30 Y40
N50 G03 X10 Y60 I-20 J0
N60 #CONTOUR LOOKAHEAD LOG [PARAM=5.5]
N70 G02 X0 Y70 I0 J10
N80 G01 X-20 Y70
N90 #CONTOUR LOOKAHEAD LOG OFF [PARAM=2]
"""
# type, N, start, length, radius, angle, turn
T1_LOG = [
    (3, 20, 0.0, 1.0, 0, 0.0, 0.0),
    (1, 30, 0.0, 300000.0, 0, 0.0, 0.0),
    (1, 40, 300000.0, 400000.0, 0, 0.0, 1.570796),
    (2, 50, 700000.0, 314159.265359, 200000, 1.570796, 0.0),
    (4, 60, 1014159.265359, 5.5, 0, 0.0, 0.0),
    (2, 70, 1014159.265359, 157079.632679, 100000, -1.570796, 0.0),
    (1, 80, 1171238.898038, 200000.0, 0, 0.0, 1.570796),
    (5, 90, 1371238.898038, 2.0, 0, 0.0, 0.0),
]
BODY = """N080 G1 X4 Y4
N090 X8 Y4
N100 X8 Y0
N110 X4 Y-3
N120 X0 Y0
"""
T3 = f"""N010 G00 X-5 Y0            ; zero length: machine already there
N020 G01 X0 Y0 F1000
N060 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]
N070 #RT WHILE
{BODY}N130 #RT ENDWHILE
N140 #CONTOUR LOOKAHEAD LOG OFF [PARAM=8]
N150 G1 X0 Y10
"""
LENGTHS = [56568.542495, 40000.0, 40000.0, 50000.0, 50000.0]
TURNS = [0.785398, 0.785398, 1.570796, 0.927295, 1.287002]
# the vendor's two examples close the area by LOG ON [PARAM=8]
INSIDE = f"""N010 G00 X-5 Y0
N020 G01 X0 Y0 F1000
N060 #RT WHILE
N070 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]
{BODY}N130 #CONTOUR LOOKAHEAD LOG ON [PARAM=8]
N140 #RT ENDWHILE
"""
OUTSIDE = T3.replace("LOG OFF [PARAM=8]", "LOG ON [PARAM=8]")


def row(entry: dict[str, Any]) -> tuple[float, ...]:
    assert entry["programmed_radius"] == entry["compensated_radius"]
    return (
        entry["block_type"],
        entry["block_number"],
        entry["start_position"],
        entry["length"],
        entry["programmed_radius"],
        entry["circle_angle"],
        entry["tangent_variation"],
    )


def test_mixed_contour(tmp_path: Path) -> None:
    """T1: the log, one index on, a range, behind the end, and what is known."""
    config = "[axes.X]\n[axes.Y]\n[axes.Z]\n"
    with Inside(tmp_path, T1, config) as cnc:
        entries = [row(e) for e in cnc.request(0, 0)]
        assert len(entries) == len(T1_LOG)
        for mine, due in zip(entries, T1_LOG, strict=True):
            assert mine == pytest.approx(due, abs=1e-6)
        assert [row(e) for e in cnc.request(5, 0)] == entries[5:]
        assert [row(e) for e in cnc.request(5, 0)] == entries[5:]
        found = cnc.request(800000, 400000)
        assert [e["block_number"] for e in found] == [50, 70, 80]
        assert cnc.request(1371238.9, 1) == []
        state = cnc.clah.state
        assert state.count_logged_blocks == 8
        assert not state.f_log_is_active
        assert state.max_dist_prog_start == pytest.approx(1371238.898038)


@pytest.mark.parametrize(
    ("side", "radius", "length"),
    [("G41", 150000, 235619.449019), ("G42", 250000, 392699.081699)],
)
def test_radius_compensation(
    tmp_path: Path, side: str, radius: float, length: float
) -> None:
    """T2: a quarter arc of 20 mm, tool radius 5 mm, on both sides."""
    config = "[axes.X]\n[axes.Y]\n[axes.Z]\n[tools.1]\nradius_mm = 5.0\n"
    text = (
        f"N10 D1 {side} G138 G01 X20 Y0 F1000\nN20 Y20\n"
        "N30 G03 X0 Y40 I-20 J0\nN40 G01 X-20\nN50 G40 X-40\n"
    )
    with Inside(tmp_path, text, config) as cnc:
        arcs = [e for e in cnc.request(0, 1e9) if e["block_number"] == 30]
        assert [e["block_type"] for e in arcs] == [2]
        assert arcs[0]["programmed_radius"] == pytest.approx(200000)
        assert arcs[0]["compensated_radius"] == pytest.approx(radius)
        assert arcs[0]["length"] == pytest.approx(length, abs=1e-6)


@pytest.mark.parametrize("text", [T3, OUTSIDE], ids=["OFF", "ON"])
def test_loop_inside_the_area(tmp_path: Path, text: str) -> None:
    """T3: three copies between the markers, whichever word closes the area."""
    with Inside(tmp_path, text, START) as cnc:
        entries = cnc.request(0, 0)
        assert [e["block_type"] for e in entries] == [3, *[1] * 15, 5]
        assert [entries[0]["length"], entries[-1]["length"]] == [1, 8]
        start = 50000.0
        for copy in range(3):
            part = entries[1 + 5 * copy : 6 + 5 * copy]
            assert [e["length"] for e in part] == pytest.approx(LENGTHS)
            assert part[0]["start_position"] == pytest.approx(start, abs=1e-5)
            turns = TURNS if copy == 0 else [1.712693, *TURNS[1:]]
            told = [e["tangent_variation"] for e in part]
            assert told == pytest.approx(turns, abs=1e-6)
            start += sum(LENGTHS)


def test_area_inside_the_loop(tmp_path: Path) -> None:
    """The vendor's example: once, as the entering pass sees it."""
    with Inside(tmp_path, INSIDE, START) as cnc:
        entries = cnc.request(0, 0)
        assert [e["block_type"] for e in entries] == [3, *[1] * 5, 5]
        told = [e["tangent_variation"] for e in entries[1:6]]
        assert told == pytest.approx(TURNS, abs=1e-6)
        assert entries[-1]["length"] == 8
        assert entries[-1]["block_number"] == 130
