"""Threads, tapping, constant cutting speed, software limits, feed groups: feeds
against closed formulas.
"""

import math
from functools import partial

import numpy as np
import pytest

from cnc_core.blocks import LINEAR, POLYNOMIAL, S
from support.programs import ended_program, rows_of

CELL = (
    "[axes.X]\nmin_mm = -200\nmax_mm = 200\n[axes.Y]\n[axes.Z]\n"
    "[axes.U]\n[axes.C]\nkind = 'rotary'\n"
)
program_of = partial(ended_program, cell=CELL)


def feeds(tmp_path, text):
    """mm/s of the motions."""
    rows = rows_of(program_of(tmp_path, text))
    return rows["feed"][rows["type"] <= POLYNOMIAL].tolist()


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("S600 G33 Z-10 K2", [20]),
        (
            "S600 G33 Z-10 K-2\nZ-20\nX5 Z-30",
            [20, 20, 20 * math.hypot(10, 5) / 10],
        ),
        ("S600 G33 X10 I1", [10]),
        ("S600 G33 Z-10 K2\nG01 Z0 F600\nZ5", [20, 10, 10]),
        ("F300 S100\nG63 Z-5 F150\nG01 Z0", [2.5, 2.5]),
        ("G331 Z-10 K1.5 S400\nG332 Z0", [10, 10]),
        ("G331 Z-10 K1.5 S400\nG332 Z0 S800", [10, 20]),
        ("G70 S60 G33 Z1 K0.5", [12.7]),
    ],
)
def test_feed_is_speed_times_pitch(tmp_path, text, wanted):
    """Pitch words are modal and unsigned; another motion function ends the thread."""
    assert feeds(tmp_path, text) == pytest.approx(wanted)


def test_plain_lines_of_a_thread_are_not_taken_for_g01(tmp_path):
    """The scanner leaves them to the parser."""
    assert feeds(
        tmp_path, "F60 S600 G33 Z-10 K2\nN20 Z-20\nN30 Z-30\nG01 Z0"
    ) == pytest.approx([20, 20, 20, 1])


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("G63 Z-5 F100", 20007),
        ("S100 G95 F1 G63 Z-5", 20635),
        ("G00 X10\nG96 S100\nG63 Z-5 F100", 20636),
        ("S100 M5 G63 Z-5 F100", 907070),
        ("S100 M3\nG63 Z-5 F100", 907071),
        ("G33 Z-5 K1", 900019),
        ("S100 G33 Z-5", 900004),
        ("G196", 900004),
        ("G98", 900004),
        ("G98 X300", 21649),
        ("#HSC ON\nS100 G33 Z-5 K1", 120433),
        ("#HSC ON\nG96 S100", 120433),
        ("#FGROUP [X]\nG02 X10 I5 F100", 21209),
        ("#FGROUP []", 900010),
        ("#FGROUP ROT", 900003),
        ("#TANGFEED [RMIN=-1]", 900012),
    ],
)
def test_errors(tmp_path, text, code):
    """By number."""
    program = program_of(tmp_path, text, collect=True)
    list(program.batches())
    assert [e.code for e in program.errors] == [code]


def test_cutting_speed_follows_the_diameter(tmp_path):
    """S = v / (pi d), bounded by G196, not in G00; G97 keeps the last speed."""
    text = "G00 X50\nG196 S2000\nG96 S100\nG01 X25 F100\nG00 X10\nG01 X1\nG97\nX2\nS500 X3"
    rows = rows_of(program_of(tmp_path, text))
    speeds = rows["value"][rows["type"] == S]
    assert speeds == pytest.approx(
        [1e5 / (math.pi * 100), 1e5 / (math.pi * 50), 2000, 500]
    )


def test_feed_per_turn_uses_the_speed_of_the_block(tmp_path):
    """G95 with G96."""
    wanted = 0.1 * 1e5 / (math.pi * 40) / 60
    assert feeds(tmp_path, "G00 X50\nG96 S100\nG95 F0.1 G01 X20")[
        1
    ] == pytest.approx(wanted)


def test_software_limits_of_the_program(tmp_path):
    """G98, G99 hold from their block on; above the machine's own: warning and the machine's."""
    program = program_of(
        tmp_path, "G01 X-150 F1000\nG98 X-100\nX-90\nX-110", collect=True
    )
    list(program.batches())
    assert [(e.code, e.place.line) for e in program.errors] == [(903001, 4)]
    program = program_of(
        tmp_path,
        "G99 X500\nP1 = V.A.+SWE.X\nP2 = V.A.+SWE_MDS.X\nG91 G99 X-20\n"
        "P3 = V.A.+SWE.X\nG90 X=P3 F1 G01",
    )
    list(program.batches())
    assert [w.code for w in program.reader.warnings] == [21648]
    rows = rows_of(
        program_of(tmp_path, "G91 G99 X-20\nG90 G01 X=V.A.+SWE.X F100")
    )
    assert rows["end"][0, 0] == 180
    assert rows["type"].tolist()[0] == LINEAR


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("G01 X30 Y40 F600", 10),
        ("#FGROUP [X]\nG01 X30 Y40 F600", 10 * 50 / 30),
        ("#FGROUP [X, Y, Z]\nG01 X30 Y40 F600", 10),
        ("#FGROUP [U]\nG01 X30 Y40 U10 F600", 50),
        ("#FGROUP [Z]\nG01 X30 Y40 F600", 10),
        ("#FGROUP [X]\n#FGROUP [X,Y,Z]\nG01 X30 Y40 F600", 10),
        ("#FGROUP [X,Y,Z,U]\nG02 X10 I5 F600", 10),
        ("#TANGFEED [RMIN=20]\nG02 X10 I5 F600", 2.5),
        ("#TANGFEED [RMIN=4]\nG02 X10 I5 F600", 10),
        ("#SET TANGFEED RMIN[20]\nG02 X10 I5 F600", 2.5),
    ],
)
def test_what_f_refers_to(tmp_path, text, wanted):
    """The path is as fast as the group's axes want it."""
    assert feeds(tmp_path, text) == pytest.approx([wanted])
    assert np.isfinite(wanted)
