"""The osai front end: programs, setups, the three input formats, and everything
that is refused, with its place.
"""

import re

import numpy as np
import pytest

from cnc_core.blocks import EXACT_STOP, LINEAR, POLYNOMIAL, RAPID
from cnc_core.config import parse_config
from cnc_core.errors import CncError
from cnc_core.frontend import detect
from cnc_core.frontend.osai.front_end import ARCS
from cnc_core.frontend.port import OfflinePort
from support.osai_programs import (
    CELL_5,
    SETUP_3,
    SETUP_5,
    Workshop,
    changed,
    curves,
    value,
)
from support.programs import rows_of

POL = changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,POL)")
BSP = changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,BSP)")
CUBE = "X0Y0Z0F1000\nX1\nX2\n"


def refusal(program):
    """(number, line, column, file name) of the first error; ``check`` must report the same."""
    with pytest.raises(CncError) as caught:
        list(program.batches())
    place = caught.value.place
    return (
        caught.value.code,
        place.line,
        place.column,
        place.file.rpartition("/")[2],
    )


# programs


def test_inline_profile(shop):
    """G61 .. G60 inline: curves through the points, standstill at its end, then
    the G functions of before.
    """
    program = shop.program(
        "G1 X5 F600\nG91\n(HSM,CONFIG1)\nG61\nX5Y0Z0\nX6\nX7Y1\nG60\nX1 Y-1\n"
    )
    rows = rows_of(program)
    assert rows["type"].tolist() == [LINEAR, POLYNOMIAL, POLYNOMIAL, LINEAR]
    assert rows["flags"][2] & EXACT_STOP
    assert rows["end"][3][:2].tolist() == [8.0, 0.0]  # incremental again


def test_g60_restores_rapid(shop):
    """A motion behind G60 without a G function is what it was before G61."""
    rows = rows_of(shop.program(f"G0 X1\n(HSM,CONFIG1)\nG61\n{CUBE}G60\nX9\n"))
    assert rows["flags"][-1] & RAPID


def test_profile_is_one_block(shop):
    """Single step and the machine logic see one block: all rows have one block count."""
    rows = rows_of(shop.profile("X0Y0Z0F1000\nX1\nX2Y1\nG00X5\nG1X6"))
    assert len(set(rows["count"].tolist())) == 1
    assert rows["line"].tolist() == [4, 5, 6, 7]


def test_called_profile(shop):
    """(CLS,name) calls a subprogram that holds the whole profile."""
    (shop.folder / "PROFILO1").write_text(f"G61\n{CUBE}G60\n")
    rows = rows_of(shop.program("(HSM,CONFIG1)\n(CLS,PROFILO1)\nG1 X0 F600\n"))
    assert rows["type"].tolist() == [POLYNOMIAL, POLYNOMIAL, LINEAR]
    assert refusal(shop.program("(CLS,NOBODY)\n"))[:3] == (907030, 1, 1)


def test_variables(shop):
    """E and L variables in points and setups; a setup takes the values of each G61."""
    setup = changed(SETUP_3, THR="(THR,0.01,0,L2,0,0.05)")
    text = (
        "E1=2*(1+0.5)\nL2=0\n(HSM,CONFIG1)\nG61\nXE1Y-E1Z0F1000\nX5\n"
        "G60\nL2=10\nG61\nX0Y0Z0\nX1\nG60\n"
    )
    ends = rows_of(shop.program(text, setup))["end"][:, :3]
    assert ends[0] == pytest.approx([3.0, -3.0, 0.0])
    assert ends[-1] == pytest.approx([10.0, 0.0, 0.0])


def test_incremental_points(shop):
    """G91 counts from the point before."""
    rows = rows_of(shop.profile("X1Y1Z0F1000\nG91X1\nX1Y2\nG90X0"))
    assert rows["end"][1:, :2] == pytest.approx(
        np.array([[2.0, 1.0], [3.0, 3.0], [0.0, 3.0]])
    )


def test_packed_words_and_numbers(shop):
    """Words need no blanks; N belongs to its line; lines of other words than
    points make no point.
    """
    rows = rows_of(
        shop.profile(
            "N002 G1 X0Y0Z0F6000\n\n; nothing\nN10X1.5Y-.5\nN002X2.\nF1200\nX3"
        )
    )
    assert rows["end"][:, 0] == pytest.approx([1.5, 2.0, 3.0])
    assert rows["n"].tolist() == [10, 2, 2]
    assert rows["feed"].tolist() == [100.0, 100.0, 20.0]


@pytest.mark.ci
def test_many_lines_at_once(shop):
    """Plain lines read as columns give what the parser gives for the same lines one by one."""
    rng = np.random.default_rng(3)
    lines = [
        f"X{i / 7:.5f}Y{rng.normal():.5f}"
        + ("Z1" if i % 5 == 0 else "")
        + (" F900" if i % 9 == 0 else "")
        for i in range(300)
    ]
    text = "X0Y0Z0F600\n" + "\n".join(lines)
    fast = shop.profile(text)
    plain = rows_of(fast)
    slow = shop.profile(text.replace("\n", " ;\n"))
    assert (plain["end"] == rows_of(slow)["end"]).all()
    assert len(plain) >= 300


def test_detection(tmp_path):
    """A program is known by (HSM,..) or <*, and by its extension."""
    path = tmp_path / "a.nc"
    path.write_text("G1 X1\n (HSM,CONFIG1)\n")
    assert detect(path) == "osai"
    path.write_text("(HSM is not a comment here) G1 X1\n")
    assert detect(path) == "isg"


# refusals inside a profile


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        ("X0Y0Z0F100\nX(E1+E2)", (909227, 4, 2)),
        ("X0Y0Z0F100\nX5 Y-(E1)", (909227, 4, 5)),
        ("X0Y0Z0F100\nXE(E2)", (909227, 4, 2)),
        ("X0Y0F100", (909225, 3, 1)),
        ("G91X0Y0Z0F100", (909225, 3, 1)),
        ("X0Y0Z0", (900006, 3, 1)),
        ("X0Y0Z0F0", (900006, 3, 7)),
        ("X0Y0Z0F100\nX1 F-5", (900006, 4, 4)),
        ("X0Y0Z0F100\nx1", (909226, 4, 1)),
        ("X0Y0Z0F100\nX1U5", (909226, 4, 3)),
        ("X0Y0Z0F100\nX1X2", (900005, 4, 3)),
        ("X0Y0Z0F100\nX", (900004, 4, 1)),
        ("X0Y0Z0F100\nX1 M3", (909224, 4, 4)),
        ("X0Y0Z0F100\nX1 S300", (909226, 4, 4)),
        ("X0Y0Z0F100\nG2X1", (909224, 4, 1)),
        ("X0Y0Z0F100\nG0G1X1", (900011, 4, 3)),
        ("X0Y0Z0F100\nG62X1", (909228, 4, 1)),
        ("X0Y0Z0F100\nG60X1", (909220, 4, 1)),
        ("G66\nX0Y0Z0F100", (909228, 3, 1)),
        ("X0Y0Z0F100\nX5\nG62\nG63\nX9Y1", (909228, 6, 1)),
        ("X0Y0Z0F100\nG61", (909221, 4, 1)),
        ("X0Y0Z0F100\n(CLS,A)", (909224, 4, 1)),
        ("X0Y0Z0F100\nE1=5", (909224, 4, 1)),
        ("X0Y0Z0F100\n<*,1,1,1,1", (909224, 4, 1)),
        ("X0Y0Z0F100\nX1K5", (909226, 4, 3)),
        ("", (909225, 4, 1)),
    ],
)
def test_refused_in_points(shop, body, wanted):
    """Each wrong form has its own error, at its line and column."""
    assert refusal(shop.profile(body))[:3] == wanted


def test_check_reports_the_same(shop):
    """``check`` goes on behind an error and finds the next one."""
    program = shop.profile("X0Y0Z0F100\nx1\nX1\nX(E1)\nX2", collect=True)
    assert rows_of(program)["line"].tolist() == [5, 7]
    assert [(e.code, e.place.line) for e in program.errors] == [
        (909226, 4),
        (909227, 6),
    ]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("G61\n", (909201, 1, 1)),
        ("(HSM,NOBODY)\n", (909201, 1, 1)),
        ("(HSM)\n", (909201, 1, 1)),
        ("(HSM,CONFIG1)\nG61 X1\n", (909220, 2, 1)),
        ("(HSM,CONFIG1)\nG61 P6\n", (909229, 2, 5)),
        ("(HSM,CONFIG1)\nG61 P2.5\n", (909229, 2, 5)),
        ("(HSM,CONFIG1)\nG60\n", (909221, 2, 1)),
        ("(HSM,CONFIG1)\nG62\n", (909221, 2, 1)),
        ("<*,1,1,1,1\n", (909221, 1, 1)),
        ("(UPR,X,Y,Z)\n(HSM,CONFIG1)\nG61\n", (909223, 3, 1)),
        ("(UVP,X,Y)\n(HSM,CONFIG1)\nG61\n", (909223, 3, 1)),
        ("(UVC,X,Y)\n(HSM,CONFIG1)\nG61\n", (909223, 3, 1)),
        ("(TCP,1)\n(HSM,CONFIG1)\nG61\n", (909223, 3, 1)),
        ("G2 X1 Y1 R1 F100\n", (900003, 1, 1)),
        ("G95\n", (900003, 1, 1)),
        ("(ROT,30)\n", (900003, 1, 1)),
        ("X1 Q5\n", (909226, 1, 4)),
        ("XW03=1\n", (900003, 1, 1)),
        ("N10 XW03 = 1\n", (900003, 1, 5)),
        ("E1=2*XW03\n", (900003, 1, 6)),
        ("G1 XXW03\n", (900003, 1, 5)),
        ("XW031=1\n", (900004, 1, 1)),
        ("(HSM,CONFIG1)\nG61\nX0Y0Z0F100\nX1\n", (909222, 5, 1)),
    ],
)
def test_refused_outside(shop, text, wanted):
    """The main program: states of G61, codes that are not supported."""
    assert refusal(shop.program(text))[:3] == wanted


def test_the_word_of_the_machine_logic_is_refused_by_name(shop):
    """Everywhere with the same words; inside a profile, too."""
    for text in ("XW03=1\n", "E1=XW03\n", f"G61\n{CUBE}XW03=1\nG60\n"):
        program = shop.program(f"(HSM,CONFIG1)\n{text}")
        with pytest.raises(CncError) as caught:
            list(program.batches())
        assert caught.value.code == 900003
        assert "XW03 is not supported" in caught.value.text


def test_virtualisation_can_be_switched_off(shop):
    """A code without parameters ends the virtualisation; the profile may begin."""
    assert (
        len(
            rows_of(
                shop.program(f"(TCP,1)\n(TCP)\n(HSM,CONFIG1)\nG61\n{CUBE}G60\n")
            )
        )
        == 2
    )


# setups


@pytest.mark.parametrize(
    ("lines", "wanted"),
    [
        ({"PNT": None}, (909207, 1)),
        ({"VER": None}, (909207, 1)),
        ({"THR": None}, (909207, 1)),
        ({"PNT": "(PNT,CCP,AXI,QUI)"}, (909208, 10)),
        ({"PNT": "(PNT,CLP,CCP,QUI)"}, (909208, 10)),
        ({"PNT": "(PNT,AXI,CCP,QUI)"}, (909208, 10)),
        ({"PNT": "(PNT,AXI,,QUI)"}, (909204, 10)),
        ({"PNT": "(PNT,AXI,AXI,QUA)"}, (909205, 14)),
        ({"PNT": "(PNT,AXI,AXI,QUI,XYZ)"}, (909205, 18)),
        ({"PNT": "(PNT,AXI,AXI,QUI,PNT,5)"}, (909202, 22)),
        ({"PNT": "(POT,AXI,AXI,QUI,PNT,5)"}, (909203, 2)),
        ({"PNT": "PNT,AXI,AXI,QUI"}, (909202, 1)),
        ({"VER": "(VER,REL,PRG)"}, (909204, 13)),
        ({"VER": "(VER,REL,PRG,)"}, (909204, 14)),
        ({"JRK": "(JRK,,)"}, (909204, 6)),
        ({"JRK": "(JRK,ENA,,2.5)"}, (909205, 11)),
        ({"THR": "(THR,-0.01,0,0,0,0)"}, (909205, 6)),
        ({"THR": "(THR,abc,0,0,0,0)"}, (909205, 6)),
        ({"THR": "(THR,0.01,0,0,0)"}, (909204, 16)),
        ({"TOL": "(TOL,,5,6,-90,)"}, (909205, 9)),
        ({"TOD": "(TOD,0,0,0)"}, (909250, 6)),
        ({"CRV": "(CRV,1,6,G66)"}, (909205, 10)),
        ({"EDG": "(EDG,30,0,G62,1)"}, (909205, 11)),
        ({"EDG": "(EDG,30,0,G66)"}, (909204, 14)),
        ({"AXI_Y": "(AXI,Y,1,ORD,LI2)"}, (909209, 8)),
        ({"AXI_Y": "(AXI,Y,9,ORD,LI2)"}, (909209, 8)),
        ({"AXI_Y": "(AXI,Y,2,ABS,LI2)"}, (909209, 10)),
        ({"AXI_Y": "(AXI,Y,2,ORD,LI1)"}, (909209, 14)),
        ({"AXI_Y": "(AXI,Y,2,ORD,OTH)"}, (909209, 14)),
        ({"AXI_Y": "(AXI,X,2,ORD,LI2)"}, (909206, 6)),
        ({"AXI_Y": "(AXI,K,2,ORD,LI2)"}, (909209, 6)),
        ({"AXP_Z": "(AXP,W,0,,,)"}, (909209, 6)),
        ({"AXP_Z": "(AXP,Z,,,,)"}, (909204, 8)),
        ({"AXP_Z": "(AXP,Z,0,,5,5)"}, (909205, 11)),
        ({"DIN_Z": "(DIN,Z,-1)"}, (909205, 8)),
        ({"DIN_Z": "(DIN,W,1)"}, (909209, 6)),
        ({"THR2": "(THR,0.01,0,0,0,0)"}, (909206, 1)),
    ],
)
def test_refused_setups(shop, lines, wanted):
    """Each bad setup line has its own error, at its place in the setup file."""
    key, text = next(iter(lines.items()))
    setup = (
        SETUP_3 + "(THR,0.01,0,0,0,0)\n"
        if key == "THR2"
        else changed(SETUP_3, **lines)
    )
    number, line, column, name = refusal(shop.profile(CUBE, setup))
    assert (number, column, name) == (*wanted, "CONFIG1")
    if text and key != "THR2":
        assert setup.splitlines()[line - 1] == text


@pytest.mark.parametrize(
    ("lines", "number"),
    [
        ({"MAC": None}, 909207),
        ({"MAC": "(MAC,TOL)"}, 909204),
        ({"MAC": "(MAC,ABC,B12)"}, 909205),
        ({"MAC": "(MAC,TOL,B13)"}, 909205),
        ({"CIN_t": None}, 909211),
        ({"CIN_B": None}, 909211),
        ({"CIN_B": "(CIN,B,0,0,0,-90,0)"}, 909204),
        ({"CIN_q": "(CIN,q,0,0,0,-90,0,0)"}, 909209),
        ({"AXI_B": "(AXI,B,6,OTH,WRK)"}, 909209),
        ({"AXI_A": "(AXI,A,5,ABS,LI2)"}, 909209),
        ({"AXI_Z": "(AXI,Z,4,OTH,TOL)"}, 909209),
    ],
)
def test_refused_five_axis_setups(shop, lines, number):
    """MAC and CIN of a machine with rotary axes."""
    assert (
        refusal(shop.profile(CUBE, changed(SETUP_5, **lines), cell=CELL_5))[0]
        == number
    )


def test_seven_axes(shop):
    """A profile has six axes at most."""
    cell = parse_config("".join(f"[axes.{name}]\n" for name in "XYZABCU"))
    extra = "".join(
        f"(AXI,{name},{i},OTH,OTH)\n" for i, name in enumerate("ABCU", 4)
    )
    assert refusal(shop.profile(CUBE, SETUP_3 + extra, cell=cell))[0] == 909210


def test_setup_forms(shop):
    """Blanks, comments, any order of the codes, trailing fields left out."""
    setup = "\n".join(reversed(SETUP_3.splitlines())).replace(
        "(PNT,AXI,AXI,QUI)", "  ( PNT , AXI,AXI , CUB )  ; why\n\n"
    )
    setup = setup.replace("(JRK,ENA,,,400,150,200)", "(JRK,DIS)").replace(
        "(DIN,X,,,,,,)", "(DIN,X)"
    )
    rows = rows_of(shop.profile(CUBE, setup))
    assert (rows["type"] <= 3).sum() == 2


def test_check_prints_the_setup(shop):
    """What was read comes back with every default in its place."""
    program = shop.profile(CUBE)
    rows_of(program)
    codes = {line["code"]: line for line in program.reader.setups[0]["codes"]}
    assert codes["PNT"] == {
        "code": "PNT",
        "line": 1,
        "Type": "AXI",
        "Param": "AXI",
        "Poly": "QUI",
        "Format": "PNT",
    }
    assert codes["TOL"]["OriginLen"] == 0.0
    assert program.reader.setups[0]["printed"][0] == "(PNT,AXI,AXI,QUI,PNT)"


def test_names_may_differ_from_the_machine(shop):
    """An axis is found by its ID; its name holds in the profile only."""
    setup = SETUP_3.replace(",X,", ",U,")
    rows = rows_of(shop.profile("U0Y0Z0F100\nU3\nU4Y1", setup))
    assert rows["end"][0][:3] == pytest.approx([3.0, 0.0, 0.0])


def test_scale_and_diameter(shop):
    """Scale acts on linear axes; a diameter axis moves half of what is programmed."""
    setup = changed(
        SETUP_3, THR="(THR,0.01,0,2,0,0.05)", AXI_X="(AXI,X,1,ABS,LI1,ENA)"
    )
    assert rows_of(shop.profile("X0Y0Z0F100\nX3Y1", setup))["end"][0][
        :2
    ] == pytest.approx([3.0, 2.0])


# polynomials

GROUP = (
    "<*,{s},{n},3000,{t}\n<X,{x},1,0,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0\n"
)


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        (
            GROUP.format(s=1, n=1, t=0, x=0)
            + GROUP.format(s=1, n=2, t=0, x=1.1),
            (909233, 7),
        ),
        ("<*,1,1,3000,0\n<X,0,1,0,0,0,0\n<Y,0,0,0,0,0,0\n", (909231, 3)),
        ("<*,1,1,3000,0\n<X,0,1,0,0,0\n", (909230, 4)),
        ("<*,0,1,3000,0\n", (909232, 3)),
        ("<*,1,1,0,0\n", (900006, 3)),
        ("<*,1,1,3000\n", (909232, 3)),
        ("<*,1,1.5,3000,0\n", (909232, 3)),
        ("<X,0,1,0,0,0,0\n", (909232, 3)),
        ("<*,1,1,3000,0\n<W,0,1,0,0,0,0\n", (909226, 4)),
        ("<*,1,1,3000,0\n<X,0,1,0,0,0,0\n<X,0,1,0,0,0,0\n", (900005, 5)),
        ("<*,1,1,3000,0\n<X,0,abc,0,0,0,0\n", (900004, 4)),
        (GROUP.format(s=1, n=1, t=0, x=0) + "G66\n", (909224, 7)),
        (GROUP.format(s=1, n=1, t=0, x=0) + "X5\n", (909224, 7)),
        ("", (909225, 4)),
    ],
)
def test_refused_polynomials(shop, body, wanted):
    """POL: coefficients, lines, header, continuity; no G functions between."""
    assert refusal(shop.profile(body, POL))[:2] == wanted


def test_gap_is_a_warning_where_the_dialect_is_lenient(shop):
    """Not strict: the gap is told, and closed by the machine's own corner rule."""
    body = GROUP.format(s=1, n=1, t=0, x=0) + GROUP.format(
        s=1, n=2, t=0, x=1.000002
    )
    program = shop.profile(body, POL, lenient=True)
    assert len(rows_of(program)) >= 2
    assert 909233 in [w.code for w in program.reader.warnings]


def test_polynomials_exactly(shop):
    """Coefficients, length of the parameter, labels and ends come through as written."""
    body = (
        "<*,4.0e+001,3,3000,1\n<X,-3.8e+002,0,-4.4e-016,1.8e-017,-5e-019,"
        "1.3e-021\n<Y,1,0,0,0,0,0\n<Z,2e2,-1,0,0,0,0"
    )
    ((coef, span, row),) = curves(shop.profile(body, POL))
    assert coef[0].tolist() == [-380.0, 0.0, -4.4e-16, 1.8e-17, -5e-19, 1.3e-21]
    assert (span, row["n"], row["degree"], row["feed"]) == (
        40.0,
        3,
        5,
        pytest.approx(50.0),
    )
    assert row["flags"] & EXACT_STOP


@pytest.mark.parametrize("degree", [3, 4, 5])
def test_degree_of_g61(shop, degree):
    """G61 P says how many coefficients a line has."""
    line = ",".join(["0", "1", *["0"] * (degree - 1)])
    body = f"<*,1,1,3000,0\n<X,{line}\n<Y,{line}\n<Z,{line}\n"
    assert (
        curves(shop.profile(body, POL, head=f"G61 P{degree}"))[0][2]["degree"]
        == degree
    )
    assert (
        refusal(
            shop.profile(
                body.replace("<Y,0,", "<Y,0,0,"), POL, head=f"G61 P{degree}"
            )
        )[0]
        == 909230
    )


# B-splines

SPLINE = """X0 Y0 Z0 K0 F3000
X0.7 Y2.3 Z0 K0
X3.8 Y2.6 Z0 K0
X2.3 Y-1.5 Z0 K0
X6.9 Y-1.5 Z0 K2.5
X6.1 Y1.2 Z0 K5
X8.4 Y1.5 Z0 K7.5
K10.
K10
K10
K10"""


def test_the_manuals_b_spline(shop):
    """Specification 12.2: four spans, all values and slopes of the table, power
    form of the first.
    """
    spans = curves(shop.profile(SPLINE, BSP, head="G61 P3"))
    assert [span for _, span, _ in spans] == [2.5] * 4
    assert spans[0][0][0] == pytest.approx([0, 0.84, 0.408, -0.12], abs=1e-12)
    assert spans[0][0][1] == pytest.approx(
        [0, 2.76, -1.032, 0.0890666667], abs=1e-9
    )
    table = [(0, 0, 0, 0.84, 2.76), (1.25, 1.453125, 2.011458333, 1.2975, 0.5975),
             (2.5, 2.775, 1.841666667, 0.63, -0.73),
             (5, 3.316666667, -0.816666667, 0.62, -0.82), (7.5, 5.933333333, -0.825, 0.68, 0.81),
             (8.75, 6.516666667, 0.478125, 0.62, 1.1025), (10, 8.4, 1.5, 2.76, 0.36)]  # fmt: skip
    for s, x, y, dx, dy in table:
        k = min(int(s / 2.5), 3)
        assert value(spans[k][0], s - 2.5 * k)[:2] == pytest.approx(
            [x, y], abs=1e-8
        )
        assert value(spans[k][0], s - 2.5 * k, 1)[:2] == pytest.approx(
            [dx, dy], abs=1e-8
        )
    assert sum(float(row["length"]) for _, _, row in spans) == pytest.approx(
        13.305466948, abs=1e-8
    )
    assert sum(
        span / float(row["feed"]) for _, span, row in spans
    ) == pytest.approx(0.2)  # ds/dt = F


@pytest.mark.parametrize(
    ("old", "new", "number"),
    [
        ("K10\nK10\nK10", "K10\nK10", 909240),
        ("K10\nK10\nK10", "K10\nK10\nK10\nK10", 909240),
        ("Z0 K0\nX6.9", "Z0 K1\nX6.9", 909241),
        ("K10.\n", "K9\n", 909241),
        ("K5\n", "K2\n", 909242),
        ("K7.5", "K7.5\nG63", 909245),
        ("F3000", "", 900006),
        ("X0 Y0 Z0", "X0 Y0", 909225),
        ("K5\n", "K5 G91\n", 909224),
        ("K5\n", "K5 M8\n", 909224),
        ("K7.5", "K7.5 W4", 909226),
    ],
)  # fmt: skip
def test_refused_b_splines(shop, old, new, number):
    """Knot count, clamping, order, words; 10 knots in the manual's example are refused."""
    assert (
        refusal(shop.profile(SPLINE.replace(old, new, 1), BSP, head="G61 P3"))[
            0
        ]
        == number
    )


def test_too_few_control_points(shop):
    """A spline of degree d needs d + 1 control points."""
    assert refusal(shop.profile(SPLINE, BSP, head="G61 P5"))[0] == 909240
    assert (
        refusal(
            shop.profile(
                "X0Y0Z0K0F100\nX1K0\nK0\nK1\nK1\nK1", BSP, head="G61 P3"
            )
        )[0]
        == 909243
    )


def test_two_b_splines(shop):
    """G66 stops between splines, the second begins with its own knots where the first one ends."""
    second = SPLINE.replace("X0 Y0 Z0", "X8.4 Y1.5 Z0")
    rows = rows_of(shop.profile(f"{SPLINE}\nG66\n{second}", BSP, head="G61 P3"))
    assert (rows["flags"] & EXACT_STOP > 0).tolist() == [False] * 3 + [True] + [
        False
    ] * 3 + [True]
    assert refusal(
        shop.profile(f"{SPLINE}\nG66\n{SPLINE}", BSP, head="G61 P3")
    )[:2] == (909244, 15)


@pytest.mark.parametrize("code", [*ARCS, 4, 9, 17, 40, 94, 95, 99])
def test_every_other_g_function_is_refused(shop, code):
    """By name."""
    assert refusal(shop.program(f"G{code} X1\n"))[0] == 900003


def test_motion_behind_a_profile_goes_on_from_there(shop):
    """Behind G60 the axes that are not programmed stay where the profile has
    left them, tool length included.
    """
    cell = parse_config(
        "[axes.X]\n[axes.Y]\n[axes.Z]\n[tools.1]\nradius_mm=5.0\nlength_mm=100.0\n"
    )
    setup = changed(SETUP_3, PNT="(PNT,CLP,CLP,QUI)")
    text = (
        "T1 M6\nG1 X10Y10Z10F3000\n(HSM,CONFIG1)\nG61\nX10Y10Z10\nX20\n"
        "X30Y20Z10\nG60\nG1 X0\nZ5\n"
    )
    rows = rows_of(shop.program(text, setup, cell=cell))
    ends = rows["end"][rows["type"] <= POLYNOMIAL][:, :3]
    assert ends[0] == pytest.approx([10, 10, 110])
    assert ends[-2:] == pytest.approx(np.array([[0, 20, 110], [0, 20, 105]]))


def test_not_in_manual_data(shop):
    """G61 in MDI is refused; the motions of MDI are not."""
    port = OfflinePort(np.zeros(3))
    port.manual_data = True
    program = shop.program(
        f"G1 X5 F100\n(HSM,CONFIG1)\nG61\n{CUBE}G60\n", port=port
    )
    assert refusal(program)[:3] == (909219, 3, 1)


@pytest.mark.parametrize(
    "text",
    [
        "(HSM,CONFIG1)\nG61\nX(E1+E2)Y0Z0F100\nX1\nX2\nG60\n",
        "(HSM,CONFIG1)\nG61\nX0Y0F100\nX1\nG60\n",
        "(HSM,CONFIG1)\nG61\nX0Y0Z0\nX1\nG62\nX5\nG60\n",
        "(HSM,CONFIG1)\n(UPR,1)\nG61\nX0Y0Z0F100\nX1\nG60\n",
        "(HSM,NOTHING)\nG61\nX0Y0Z0F100\nX1\nG60\n",
        "(HSM,CONFIG1)\nG61 P7\nX0Y0Z0F100\nX1\nG60\n",
        "G61\nX0Y0Z0F100\nX1\nG60\n",
        "(HSN,CONFIG1)\nG61\nX0Y0Z0F100\nX1\nG60\n",
        "(HSM CONFIG1)\nG61\nX0Y0Z0F100\nX1\nG60\n",
    ],
)
def test_one_mistake_is_one_error(shop, text):
    """What only follows from an error is none of its own."""
    program = shop.program(text, collect=True)
    rows_of(program)
    assert len(program.errors) == 1


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("(HSN,CONFIG1)\n", "did you mean HSM?"),
        ("(CLX,PART)\n", "did you mean CLS?"),
        ("X1 Q5\n", "the words are F G N S T X Y Z"),
        ("(HSM,CONFIG1)\nG61\nX0Y0Z0F100\nx1\nG60\n", "did you mean X?"),
    ],
)
def test_a_foreign_word_has_a_hint(shop, text, hint):
    """What may have been meant, or what may stand there."""
    with pytest.raises(CncError, match=re.escape(hint)):
        list(shop.program(text).batches())


def test_one_mistake_in_a_polynomial_or_spline(shop):
    """A wrong coefficient, a missing line, a wrong knot: one error each; the
    rest of the profile is read.
    """
    good = [
        "<*,5,1,600,0",
        "<X,0,1,0,0,0,0",
        "<Y,0,0,0,0,0,0",
        "<Z,0,0,0,0,0,0",
    ]
    setup = changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,POL)")
    for wrong in (
        ["<X,0,1,0", *good[2:]],
        ["<X,0,q,0,0,0,0", *good[2:]],
        good[2:],
    ):
        body = "\n".join(
            [good[0], *wrong, "<*,5,2,600,0", "<X,5,1,0,0,0,0", *good[2:]]
        )
        program = shop.program(
            f"(HSM,CONFIG1)\nG61\n{body}\nG60\n", setup, collect=True
        )
        rows_of(program)
        assert len(program.errors) == 1
    setup = changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,BSP)")
    body = "X0Y0Z0K0F600\nX1K0\nX2K0\nX3K-1\nX4K5\nK5\nK5\nK5"
    program = shop.program(
        f"(HSM,CONFIG1)\nG61 P3\n{body}\nG60\n", setup, collect=True
    )
    rows_of(program)
    assert [e.code for e in program.errors] == [909242]


ROTARY = parse_config(
    "[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.C]\nkind = 'rotary'\n"
)


@pytest.mark.parametrize(
    ("pitch", "ends"), [("360", [0, 350, 370, 390]), ("", [0, 350, 10, 30])]
)
def test_rollover(shop, pitch, ends):
    """AXP Pitch: a programmed position is the equivalent nearest to the one
    before; without it the position itself.
    """
    setup = SETUP_3 + f"(AXI,C,4,OTH,OTH)\n(AXP,C,0,{pitch},,)\n"
    setup = changed(setup, CRV=None, EDG=None)
    body = "X0Y0Z0C0F1000\nX5C170\nX10C350\nX15C10\nX20C30"
    rows = rows_of(shop.profile(body, setup, cell=ROTARY))
    found = rows["end"][rows["type"] == 3][:, 3]
    assert found == pytest.approx([170, *ends[1:]])


def test_pitch_of_the_chain(shop):
    """A rotary axis of the chain comes round every 360 degrees."""
    assert (
        refusal(
            shop.profile(
                CUBE, changed(SETUP_5, AXP_A="(AXP,A,0,100,,)"), cell=CELL_5
            )
        )[0]
        == 909205
    )


@pytest.mark.parametrize("form", ["POL", "BSP"])
def test_versors_that_vanish(shop, form):
    """A tool direction of length zero somewhere on a polynomial or spline is
    refused with its line.
    """
    setup = changed(
        SETUP_5, PNT=f"(PNT,CLP,CLP,QUI,{form})", TOL="(TOL,100,0,0,-90,)"
    )
    rest = "\n".join(f"<{name},0,0,0,0,0,0" for name in "YZij")
    body = f"<*,10,1,600,0\n<X,0,1,0,0,0,0\n{rest}\n<k,1,-0.1,0,0,0,0"
    if form == "BSP":
        points = [
            f"X{x}Y0Z0i0j0k{k}K0" + "F600" * (not x)
            for x, k in ((0, 1), (1, 0), (2, 0), (3, 0))
        ]
        body = "\n".join([*points, "K5\nK5\nK5\nK5"])
    found = refusal(
        shop.profile(
            body, setup, cell=CELL_5, head="G61" if form == "POL" else "G61 P3"
        )
    )
    assert found[0] == 909250


@pytest.mark.parametrize("kind", ["CLP", "AXI"])
def test_edges_of_rotary_positions(shop, kind):
    """EDG VAngle looks at the tool direction, programmed as ijk or as rotary positions."""
    setup = changed(
        SETUP_5,
        PNT=f"(PNT,{kind},{kind},QUI)",
        EDG="(EDG,30,5,G66,1)",
        CRV=None,
        TOL="(TOL,100,0,0,-90,)",
    )
    body = "X0Y0Z0A0B0F1000\nX5B1\nX10B2\nX15B20\nX20B21\nX25B22"
    rows = rows_of(shop.profile(body, setup, cell=CELL_5))
    rows = rows[rows["type"] == 3]
    stops = rows["end"][(rows["flags"] & 2) != 0][:, 0]
    assert stops == pytest.approx([10.0, 25.0])


def test_setup_fields_of_unset_variables_warn(tmp_path):
    """A variable that nobody assigned is 0 with a warning at its field; one
    that the program assigned is no matter.
    """
    shop = Workshop(tmp_path)
    setup = changed(SETUP_3, THR="(THR,E1,0.0001,E2,0.001,0.05)")
    program = shop.program(
        "(HSM,CONFIG1)\nE2=1\nG61\nX0Y0Z0F100\nX1\nG60\n", setup
    )
    list(program.batches())
    line = next(
        i
        for i, text in enumerate(setup.splitlines(), 1)
        if text.startswith("(THR")
    )
    found = [
        (w.code, w.place.line, w.place.column)
        for w in program.reader.warnings
        if w.code == 909102
    ]
    assert found == [(909102, line, 6)]
    shop.close()


def test_one_virtualisation_ends_alone(tmp_path):
    """(TCP) ends TCP, not the UPR beside it: G61 is refused until that ends too."""
    shop = Workshop(tmp_path)
    body = "(HSM,CONFIG1)\nG61\nX0Y0Z0F100\nX1\nG60\n"
    for text in ("(UPR,1)\n(TCP,1)\n(TCP)\n", "(UPR,1)\n(UVC,0)\n"):
        with pytest.raises(CncError) as caught:
            list(shop.program(text + body, SETUP_3).batches())
        assert caught.value.code == 909223
    list(
        shop.program(
            "(UPR,1)\n(TCP,1)\n(TCP)\n(UPR)\n" + body, SETUP_3
        ).batches()
    )
    shop.close()
