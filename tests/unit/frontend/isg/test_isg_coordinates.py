"""#CS, #ACS, #ROTATION, #MCS, #TRAFO, #PTP and their kin: what programs reach,
and what is refused with its number.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cnc_core.blocks import PIECE, blocks
from cnc_core.config import CellConfig, load_config, parse_config
from cnc_core.program import Program
from support.paths import FIVE_AXIS

CELL = parse_config(
    "[axes.X]\n[axes.Y]\n[axes.Z]\n[zero_offsets.1]\nX=100.0\nY=50.0\n[zero_offsets.2]\nX=200.0\n"
    "[tools.1]\nlength_mm=40.0\nradius_mm=2.0\n"
)


class Shown:
    """Blocks, errors and warnings of a program."""

    def __init__(self, tmp_path, text: str, cell: CellConfig = CELL) -> None:
        path = tmp_path / "a.nc"
        path.write_text(text)
        program = Program(path, cell, "isg", collect=True, programmed=True)
        start = cell.axis_values("start_mm")
        self.blocks = [
            block.as_json()
            for batch in program.batches()
            for block in blocks(batch, start, cell.axis_names, cell.main_axes)
        ]
        self.codes = [
            (error.code, error.place.line) for error in program.errors
        ]
        self.warned = [
            (warning.code, warning.place.line)
            for warning in program.reader.warnings
        ]

    def ends(self, axes: str = "XYZ") -> list[list[float]]:
        return [
            [block["end"][a] for a in axes]
            for block in self.blocks
            if "end" in block
        ]


def reached(tmp_path, text: str, *points, cell: CellConfig = CELL) -> None:
    shown = Shown(tmp_path, text, cell)
    assert shown.codes == []
    assert np.abs(np.array(shown.ends()) - np.array(points)).max() < 1e-9


S30, C30 = 0.5, np.sqrt(0.75)


@pytest.mark.parametrize(
    ("text", "points"),
    [
        # shift and turn; distances turn too
        (
            "#CS ON [10,20,30,0,0,90]\nG00 X5 Y0 Z0\nG91 X5\nG90\n#CS OFF\nX1",
            [(10, 25, 30), (10, 30, 30), (1, 30, 30)],
        ),
        # first about Z, then the new Y, then the newest X
        ("#CS ON [0,0,0,0,30,90]\nG00 X10 Y0 Z0", [(0, 10 * C30, -10 * S30)]),
        ("#CS ON [0,0,0,90,0,90]\nG00 X0 Y10 Z0", [(0, 0, 10)]),
        # other sequences, fixed axes
        (
            "#CS MODE ON [ROTATION_SEQUENCE=XYZ]\n#CS ON [0,0,0,90,0,90]\n"
            "G00 X0 Y10 Z0",
            [(-10, 0, 0)],
        ),
        (
            "#CS MODE ON [ROTATION_MODE_FIXED]\n#CS ON [0,0,0,90,0,90]\n"
            "G00 X10 Y0 Z0\n#CS OFF\n#CS MODE OFF\n"
            "#CS ON [0,0,0,90,0,90]\nX10 Y0 Z0",
            [(0, 0, 10), (0, 10, 0)],
        ),
        # short and empty fields
        ("#CS ON [1,2]\nG00 X0 Y0 Z0", [(1, 2, 0)]),
        ("#CS ON [,,10,,,90]\nG00 X1 Y0 Z0", [(0, 1, 10)]),
        # stored ones, the one defined last, nested
        (
            "#CS DEF [2][1,2,3]\n#CS DEF [3][0,0,0,0,0,90]\n#CS ON [2]\n"
            "#CS ON\nG00 X1 Y0 Z0",
            [(1, 3, 3)],
        ),
        (
            "#CS DEF [2][1,2,3]\n#CS ON [2]\n#CS ON [3][10,0,0]\n#CS OFF\n"
            "#CS ON [3]\nG00 X0 Y0 Z0\n#CS OFF ALL\nX0Y0Z0",
            [(11, 2, 3), (0, 0, 0)],
        ),
        # expressions, inch
        ("P1=45\n#CS ON [P1/9,0,0,0,0,2*P1]\nG00 X1 Y0", [(5, 1, 0)]),
        ("G70\n#CS ON [1,0,0]\nG00 X1", [(50.8, 0, 0)]),
        # the workpiece lies where the offsets put it; inside they begin at 0 and end with the frame
        (
            "G54 G00 X0 Y0\n#CS ON [10,0,0,0,0,90]\nX1 Y0\nG55 X0\n#CS OFF\nX0 Y0",
            [(100, 50, 0), (110, 51, 0), (110, 250, 0), (100, 50, 0)],
        ),
        (
            "#CS ON [0,0,0,0,0,90]\nG92 X5\nG00 X0\n#CS OFF\nX1",
            [(0, 5, 0), (1, 5, 0)],
        ),
        # tool length along the machine's Z
        (
            "T1 D1\n#CS ON [0,0,0,0,90,0]\nG00 X10\n#CS OFF\nZ1",
            [(0, 0, 30), (0, 0, 41)],
        ),
        (
            "T1 D1\nG00 Z0\n#CS ON [0,0,0,0,90,0]\nX10\nD0\nX20",
            [(0, 0, 40), (0, 0, 30), (0, 0, -20)],
        ),
        ("T1 D1\n#CS ON [1,0,0]\nG18\nG00 Y0 Z7", [(0, 40, 7)]),
        # a clamping correction lies outside of everything
        (
            "G54\n#ACS ON [0,0,0,0,0,90]\nG00 X0 Y0\n#CS ON [10,0,0]\nX0\n#ACS OFF\nX1",
            [(-50, 100, 0), (-50, 110, 0), (111, 110, 0)],
        ),
        # contour rotation: the offsets keep their directions
        (
            "#ROTATION ON [ANGLE=90 CENTER1=10 CENTER2=0]\nG00 X20 Y0\n"
            "G54 X20 Y0\n#ROTATION OFF\nX0 Y0",
            [(10, 10, 0), (110, 60, 0), (100, 50, 0)],
        ),
        (
            "G54 G00 X0 Y0\n#ROTATION ON [ANGLE=90]\nX1\nG91 X1",
            [(100, 50, 0), (100, 51, 0), (100, 52, 0)],
        ),
        ("G68 R90 X10 Y0\nG00 X20 Y0\nG69\nX20 Y0", [(10, 10, 0), (20, 0, 0)]),
        ("G00 X10\nG68 R90\nX20", [(10, 0, 0), (10, 10, 0)]),
        ("#CS ON [0,0,0,90,0,0]\nG68 R90\nG00 X1\n", [(0, 0, 1)]),
        ("G18\nG68 R90\nG00 Z1\n", [(1, 0, 0)]),
        # the named stack of the manual
        (
            "#CS ADD [ICS] [10,10,0,0,0,90]\n#CS ADD [WCS][15,20,0]\n#CS ADD [PCS] [1,2,3]\n"
            "#CS SELECT[WCS]\nG00 X0 Y0 Z0\n"
            "#CS SELECT [PCS]\nX0 Y0 Z0\n#CS DEL\nX0 Y0 Z0\n"
            "#CS SET [ICS][0,0,0]\nX0 Y0 Z0\n#CS SELECT [MCS]\nX0 Y0 Z0",
            [(-10, 25, 0), (-12, 26, 3), (-10, 25, 0), (15, 20, 0), (0, 0, 0)],
        ),
        # machine coordinates: everything off; what is selected inside ends with them
        (
            "G54 T1 D1\n#CS ON [0,0,5,0,30,0]\nG00 X0 Y0 Z0\n#MCS ON\n"
            "X1 Y1 Z1\nG55 X0\nD1 Z0\n#MCS OFF\nX1 Y0 Z0",
            [
                (100, 50, 45),
                (1, 1, 1),
                (200, 1, 1),
                (200, 1, 40),
                (100 + C30, 50, 45 - S30),
            ],
        ),
        (
            "T1\n#MCS ON [EX TOOL]\nD1\nG00 Z1\n#MCS OFF\nZ1",
            [(0, 0, 1), (0, 0, 41)],
        ),
        # scale: words, distances, radius and centre, not the offsets
        (
            "G54 G00 X0 Y0\n#SCALE ON [X2 Y=2,Z2]\nX5 Y1\nG91 X1\nG90\n#SCALE OFF\nX5",
            [(100, 50, 0), (110, 52, 0), (112, 52, 0), (105, 52, 0)],
        ),
        (
            "#SCALE ON [Y3]\nG00 X1 Y1\nP1=V.A.ABS.Y\nZ[P1]",
            [(1, 3, 0), (1, 3, 1)],
        ),
        # for one block
        (
            "T1 D1\n#CS ON [1,0,0]\n#SUPPRESS OFFSETS [TOOL] G00 Z5\nZ6\nZ7",
            [(0, 0, 5), (0, 0, 46), (0, 0, 47)],
        ),
        (
            "#CS ON [1,0,0,0,0,90]\nG92 X3\nG00 X0\n#SUPPRESS OFFSETS X0\nX1",
            [(0, 3, 0), (0, 0, 0), (0, 4, 0)],
        ),
        # mirroring comes first
        ("G21\n#CS ON [10,0,0,0,0,90]\nG00 X1 Y0", [(10, -1, 0)]),
    ],
)
def test_programs_reach_these_points(tmp_path, text, points):
    """Machine coordinates, worked out by hand."""
    reached(tmp_path, text, *points)


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("#CS ON [9]", [(20821, 1)]),
        ("#CS ON", [(20821, 1)]),
        ("#CS ON [1,2,3]\n#CS OFF\n#CS ON", [(20821, 3)]),
        ("#ACS ON [4]", [(20821, 1)]),
        ("#CS OFF [1]", [(900010, 1)]),
        ("#CS ON [1][1,2,3,4,5,6,7]", [(900010, 1)]),
        ("#CS ON [1,2][3]", [(900010, 1)]),
        ("#CS ON [", [(900013, 1)]),
        ("#CS DEF", [(900010, 1)]),
        ("#CS DEF [1][2000000000]", [(900012, 1)]),
        ('#CS ON ["A"][1]', [(900012, 1)]),
        (
            "".join(f"#CS DEF [{i}][1]\n" for i in range(1, 8)),
            [(910109, 6), (910109, 7)],
        ),
        (
            "#CS ADD [ABCDEFGHI][1]\n#CS ADD [MCS][1]\n#CS ADD [A][1]\n#CS ADD [A][1]",
            [(900004, 1), (900004, 2), (900005, 4)],
        ),
        ("#CS SELECT [A]\n#CS SET [A][1]", [(21601, 1), (21601, 2)]),
        (
            "#CS MODE ON\n#CS MODE ON [ROTATION_SEQUENCE=ZXZ]\n#CS MODE ON [FIXED]",
            [(900010, 1), (900003, 2), (900010, 3)],
        ),
        (
            "T1 D1 F100 G41\n#CS ON [1,1]\n#MCS ON\n#TRAFO ON\n#PTP ON\nG68 R3\n#TOOL ORI CS",
            [
                (20802, 2),
                (20802, 3),
                (906003, 4),
                (21525, 5),
                (906003, 6),
                (906003, 7),
            ],
        ),
        ("#CS ON [1,1]\nT1 D1 F100 G41 G01 X9\nD0", [(906003, 3)]),
        (
            "#MCS ON\n#CS ON [1,1]\n#ACS DEF [1,1]\n#TRAFO ON\n#CS OFF\n#MCS OFF",
            [(910107, 2), (910107, 3), (910107, 4)],
        ),
        (
            "#SCALE ON [X2 Y3]\nG02 X1 I5 F100\n#SCALE ON [X0]\n#SCALE ON [A2]\n#SCALE ON",
            [(910113, 2), (900012, 3), (900010, 4), (900010, 5)],
        ),
        ("G68 R30 Z5", [(22156, 1)]),
        ("#ROTATION ON [ANGEL=3]", [(900010, 1)]),
        ("#TRAFO ON", [(292005, 1)]),
        ("#KIN ID[9]\n#TRAFO ON\n#RTCP ON", [(292005, 2), (292005, 3)]),
        (
            "#PTP ON\n#TOOL ORI CS\n#KIN ID 3",
            [(21527, 1), (292005, 2), (900010, 3)],
        ),
        ("#ORI MODE [VECTOR_IJK]\n#ORI MODE", [(900003, 1), (900010, 2)]),
        (
            "#TRAFO [1,2,3]\n#TRAFO [ON,ON]\n#TRAFO [ON,3]\n#TRAFO",
            [(900010, 1), (900003, 2), (900003, 3), (900010, 4)],
        ),
        (
            "#RT WHILE\nG01 X1 F100\n#CS ON [1,1]\n#RT ENDWHILE",
            [(22073, 3), (50991, 4)],
        ),
    ],
)
def test_wrong_programs_are_refused(tmp_path, text, codes):
    """Every mistake by its own number and line."""
    assert Shown(tmp_path, text).codes == codes


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        (
            "#TRAFO ON\n#PTP ON\n#CS ON [1,1]\n#MCS ON\n#TRAFO OFF\n#TRAFO ON\n#ACS ON [1,1]",
            [(21550, 3), (21531, 4), (21552, 5), (21552, 6), (21550, 7)],
        ),
        ("#KIN ID [3]\n#TRAFO ON", [(292005, 2)]),
        (
            "#TRAFO ON\n#KIN ID [3]\n#TRAFO [4]\n#KIN ID\n#TRAFO OFF\n"
            "#KIN ID[0]\n#TRAFO ON",
            [(20687, 2), (20687, 3)],
        ),
        ("#TRAFO ON\n#CS ON [0,0,0,0,120,0]\n#TOOL ORI CS", [(910102, 3)]),
        ("#TRAFO ON\n#PTP ON\nF100 G00 X0 Y0\nG02 X10 I5", [(910105, 4)]),
        ("#TRAFO ON\nG01 F1000 X900", [(903001, 2)]),
    ],
)
def test_refused_on_a_machine_with_kinematics(tmp_path, text, codes):
    """#PTP excludes changes of coordinates, directions and positions have to be in reach."""
    assert (
        Shown(tmp_path, text, load_config(FIVE_AXIS / "head_table.toml")).codes
        == codes
    )


def test_rotation_is_warned_of(tmp_path):
    """It ends with the plane, and cycles do not expect it."""
    (tmp_path / "c.nc").write_text("G00 X1\nM17\n")
    text = (
        "#ROTATION ON [ANGLE=90]\nG00 X1\nG18\nX2 Z0 Y0\n"
        "#ROTATION ON [ANGLE=9]\nL CYCLE [NAME=c.nc @P1=1]\n"
    )
    shown = Shown(tmp_path, text)
    assert (shown.codes, shown.warned) == ([], [(910110, 3), (910111, 6)])
    assert (
        np.abs(np.array(shown.ends()[:2]) - [(0, 1, 0), (2, 0, 0)]).max()
        < 1e-12
    )


def test_old_names_of_the_transformation(tmp_path):
    """#RTCP ON is #TRAFO ON, with a warning."""
    shown = Shown(
        tmp_path,
        "#RTCP ON\n#RTCP OFF\n",
        load_config(FIVE_AXIS / "head_table.toml"),
    )
    assert shown.codes == []
    assert {code for code, _ in shown.warned} == {907040}


def test_variables_tell_the_state(tmp_path):
    """V.G.CS_*, ACS_*, ROT_*, V.A.ABS in the frame, V.A.ACT_POS of the axis."""
    text = """#CS ON [10,0,0,0,0,90]
#ACS ON [1,0,0]
#ROTATION ON [ANGLE=30 CENTER1=2 CENTER2=3]
P1=V.G.CS_ACTIVE P2=V.G.CS_COUNT P3=V.G.ACS_ACTIVE P4=V.G.ACS_COUNT
P5=V.G.ROT_ACTIVE P6=V.G.ROT_ANGLE
P7=V.G.ROT_CENTER1 P8=V.G.ROT_CENTER2
#ROTATION OFF
#CS OFF
#ACS OFF
G00 X[P1*10000+P2*1000+P3*100+P4*10+P5] Y[P6] Z[P7*10+P8]
#CS ON [10,0,0,0,0,90]
G00 X0 Y0 Z0
P1=V.A.ABS.X P2=V.A.ACT_POS.X
G00 X5
P3=V.A.ABS.X P4=V.A.ACT_POS.Y
#CS OFF
G00 X[P1] Y[P2] Z[P3*10+P4]
"""
    shown = Shown(tmp_path, text)
    assert shown.codes == []
    assert (
        np.abs(
            np.array(shown.ends())[[0, 3]] - [(11111, 30, 23), (0, 10, 55)]
        ).max()
        < 1e-9
    )


def test_circles_in_planes_parallel_to_axes_stay_circles(tmp_path):
    """Quarter turns permute plane, centre and sense; a turn about the normal keeps the plane."""
    text = (
        "#CS ON [1,2,3,90,0,0]\nG00 X0 Y0 Z0\nG03 X10 Y10 I10 J0 F100\n#CS OFF\n"
        "#CS ON [0,0,0,0,0,30]\nG00 X0 Y0 Z0\nG02 X10 Y0 I5 J0"
    )
    arcs = [b for b in Shown(tmp_path, text).blocks if b["type"] == "circular"]
    assert (arcs[0]["plane"], arcs[0]["center"]) == (
        "ZX",
        {"Z": 3.0, "X": 11.0},
    )
    assert arcs[0]["angle"] == pytest.approx(-1.5 * np.pi, abs=1e-6)
    assert arcs[1]["plane"] == "XY"
    assert arcs[1]["center"] == pytest.approx({"X": 5 * C30, "Y": 2.5})
    assert arcs[1]["angle"] == pytest.approx(-np.pi)


def test_circles_in_tilted_planes_are_exact_quintics(tmp_path):
    """Helix and full circle: within 1e-6 mm of the circle, at constant speed
    along it, joined smoothly.
    """
    text = "#CS ON [5,6,7,10,20,30]\nG00 X0 Y0 Z0\nG02 X0 Y0 I50 J20 F1000\nG03 X30 Y0 Z12 I15 J0\n"
    shown = Shown(tmp_path, text)
    turn = Rotation.from_euler("ZYX", (30, 20, 10), degrees=True)
    for line, centre, radius, sweep, rise in (
        (3, (50, 20), np.hypot(50, 20), -2 * np.pi, 0),
        (4, (15, 0), 15, np.pi, 12),
    ):
        pieces = [b for b in shown.blocks if b["line"] == line]
        length = np.hypot(radius * sweep, rise)
        assert {p["type"] for p in pieces} == {"polynomial"}
        assert sum(p["length"] for p in pieces) == pytest.approx(
            length, abs=1e-9
        )
        done, first = 0.0, np.arctan2(-centre[1], -centre[0])
        for piece in pieces:
            s = np.linspace(0, piece["s"], 41)
            found = np.column_stack(
                [
                    np.polynomial.polynomial.polyval(s, piece["coeff"][a])
                    for a in "XYZ"
                ]
            )
            angle = first + sweep * (done + s) / length
            exact = np.column_stack(
                [
                    centre[0] + radius * np.cos(angle),
                    centre[1] + radius * np.sin(angle),
                    rise * (done + s) / length,
                ]
            )
            assert (
                np.abs(turn.inv().apply(found - (5, 6, 7)) - exact).max() < 1e-6
            )
            done += piece["s"]


def test_ptp_drives_lines_of_the_axes(tmp_path):
    """The end is the programmed one, the way between is straight for the axes,
    rapid or at F along them.
    """
    cell = load_config(FIVE_AXIS / "head_table.toml")
    path = tmp_path / "a.nc"
    path.write_text(
        "#TRAFO ON\nG00 X0 Y0 Z50\n#PTP ON\nG00 X40 Y10 B60 C90\n"
        "G01 B10 F600\n#PTP OFF\nG01 X41 F600\n"
    )
    program = Program(path, cell, "isg")
    rows = np.concatenate([b.rows for b in program.batches()])
    kin = cell.kinematic_machines[9]
    lines = rows[
        (rows["type"] == 1)
        & (rows["flags"] & PIECE == 0)
        & np.isin(rows["line"], (4, 5))
    ]
    assert len(lines) == 2
    tips = kin.forward(lines["end"][:, :5], 0.0).tip
    assert np.abs(tips - (40, 10, 50)).max() < 1e-9
    assert lines["length"][0] == pytest.approx(
        np.linalg.norm(lines["end"][0, :3] - rows[1]["end"][:3])
    )
    assert lines["feed"].tolist() == [0.0, 10.0]
    last = rows[rows["line"] == 7][-1]
    assert (
        np.abs(kin.forward(last["end"][:5], 0.0).tip - (41, 10, 50)).max()
        < 1e-9
    )


def test_trafo_keeps_the_machine_where_it_stands(tmp_path):
    """On and off move nothing, the programmed position is the tip's; tool data
    act along the tool.
    """
    text = """T1
G00 X10 Y20 Z200 B40 C30
#TRAFO ON
P1=V.A.ABS.X P2=V.A.ABS.Z
G91 G01 X0.5 F1000
G90
D1
P3=V.A.ABS.Z P4=V.A.ACT_POS.Z
#TRAFO OFF
G01 X[P1] Y[P2] Z[P3+P4]
"""
    cell = load_config(FIVE_AXIS / "head_table.toml")
    shown = Shown(tmp_path, text, cell)
    assert shown.codes == []
    kin = cell.kinematic_machines[9]
    stood = np.array([10, 20, 200, 40, 30.0])
    tip = kin.forward(stood).tip[0]
    moved = kin.driven(np.array([*np.add(tip, (0.5, 0, 0)), 40, 30]), 0.0)[0]
    with_tool = kin.forward(moved, 80.0).tip[0]
    assert np.allclose(
        shown.ends()[-1],
        (tip[0], tip[2], with_tool[2] + moved[2] + 80),
        atol=1e-9,
    )
    assert np.allclose(shown.blocks[-1]["start"]["X"], moved[0])


def test_kinematic_programs_of_the_field(tmp_path):
    """The order of words as posts write it: KIN ID, CHANNEL INIT, ORI MODE,
    variables of the kinematic.
    """
    text = """%MAIN
N10 #KIN ID[9]
N20 V.G.KIN[9].PROGRAMMING_MODE=17 V.G.KIN[9].RTCP=1
N30 #CHANNEL INIT[CMDPOS]
N40 #ORI MODE[ANGLE]
N50 #TRAFO [9, OFF]
N60 G00 X[V.G.KIN[9].RTCP] Y0 Z50
N70 #TRAFO [OFF]
N80 #MCS ON
N90 G00 Z300
N100 #MCS OFF
M30
"""
    shown = Shown(tmp_path, text, load_config(FIVE_AXIS / "head_table.toml"))
    assert shown.codes == []
    assert len(shown.ends()) == 2


def test_length_correction_keeps_the_tip_on_its_path(tmp_path):
    """#TLC: axes programmed for one tool are driven for a longer one; in tilted
    motion the tip does not notice.
    """
    cell = load_config(FIVE_AXIS / "head_table.toml")
    path = tmp_path / "a.nc"
    text = "G00 X100 Y20 Z300 B20 C10\n#TLC ON [12]\nG01 X150 Y-30 Z280 F2000\n"
    text += "G01 X120 Z310 B70 C-50\n#TLC OFF\nG01 X0\n"
    path.write_text(text)
    rows = np.concatenate(
        [b.rows for b in Program(path, cell, "isg").batches()]
    )
    driven = rows[(rows["type"] <= 3) & (rows["flags"] & PIECE != 0)]
    kin = cell.kinematic_machines[9]
    for line, point in (
        (3, (150, -30, 280, 20, 10)),
        (4, (120, -30, 310, 70, -50)),
    ):
        end = driven[driven["line"] == line][-1]["end"][:5]
        tip = kin.forward(np.array(point, float), 50.0).tip
        assert np.abs(kin.forward(end, 62.0).tip - tip).max() < 1e-9
    assert Shown(tmp_path, text, cell).ends()[1:3] == [
        [150, -30, 280],
        [120, -30, 310],
    ]
    wrong = "#TLC ON [1]\n#TRAFO ON\n#TLC OFF\n#TRAFO ON\n#TLC ON [1]\n"
    assert Shown(tmp_path, wrong, cell).codes == [(20669, 2), (20669, 5)]
    assert Shown(tmp_path, "#TLC ON [1]\n#TLC ON\n").codes == [
        (292005, 1),
        (900010, 2),
    ]


def test_tool_orientation_without_a_transformation(tmp_path):
    """#TOOL ORI CS turns rotary axes alone; the linear axes stand, what follows
    is programmed in the frame.
    """
    cell = load_config(FIVE_AXIS / "head_head.toml")
    text = "G00 X10 Y20 Z30\n#CS ON [1,2,3,0,25,30]\n#TOOL ORI CS\nG00 X0 Y0 Z0\n#TOOL ORI CS\n"
    shown = Shown(tmp_path, text, cell)
    assert shown.codes == []
    assert len(shown.ends()) == 3
    assert np.allclose(shown.ends("XYZCB")[1], (10, 20, 30, 30, 25))
    assert np.allclose(shown.ends("XYZCB")[2], (1, 2, 3, 30, 25))


def test_tools_choose_their_kinematic(tmp_path):
    """P-TOOL-00011: D takes over the tool's kinematic, under another active one it is refused."""
    text = (
        FIVE_AXIS / "head_table.toml"
    ).read_text() + "[tools.2]\nkin_id = 4\n[kinematics.4]\n"
    cell = parse_config(text + 'type = "head-table"\nrotary = ["C", "B"]\n')
    assert Shown(
        tmp_path, "D2\n#TRAFO ON\n#TRAFO OFF\n#KIN ID[9]\n#TRAFO ON\nD2\n", cell
    ).codes == [(20990, 6)]


def test_a_machine_without_z_turns_in_its_plane(tmp_path):
    """Turns about Z need X and Y alone; others, and shifts along Z, are refused."""
    cell = parse_config("[axes.X]\n[axes.Y]\n[axes.C]\nkind='rotary'\n")
    text = "#CS ON [10,0,0,0,0,90]\nG00 X5 Y0\nG02 X15 I5 F100\n"
    text += (
        "#CONTOUR MODE [DEV PATH_DEV=0.1]\nG261\nG01 X20\nY10\nX0\n#CS OFF\n"
    )
    shown = Shown(tmp_path, text, cell)
    assert shown.codes == []
    assert np.allclose(shown.ends("XY")[:2], [(10, 5), (10, 15)])
    arc = shown.blocks[1]
    assert (arc["plane"], arc["center"]) == (
        "XY",
        pytest.approx({"X": 10.0, "Y": 10.0}),
    )
    curves = [b for b in shown.blocks if b["type"] == "polynomial"]
    assert len(curves) >= 4
    for curve in curves:
        first = [
            np.polynomial.polynomial.polyval(0.0, curve["coeff"][a])
            for a in "XY"
        ]
        assert np.allclose(first, [curve["start"][a] for a in "XY"], atol=1e-9)
    assert Shown(
        tmp_path, "#CS ON [0,0,1]\n#CS ON [0,0,0,90,0,0]\n", cell
    ).codes == [(900016, 1), (900016, 2)]


def test_scaled_circles(tmp_path):
    """Centre, radius and pitch grow with the words, in the scanner and in the
    parser; the tool radius does not.
    """
    text = (
        "#SCALE ON [X2 Y2 Z2]\nG00 X0 Y0 Z0\nG02 X10 Y0 I5 F100\nG03 X20 R5\n"
    )
    text += "P1=1 G02 X30 Y0 Z6 R[5*P1]\nG41 D1 G01 X40 Y0\nX50\nG40 X60\n"
    shown = Shown(tmp_path, text)
    assert shown.codes == []
    arcs = [b for b in shown.blocks if b["type"] == "circular"]
    assert [
        (b["radius"], b["center"]["X"], b["end"]["X"], b["end"]["Z"])
        for b in arcs
    ] == [
        (10, 10, 20, 0),
        (10, 30, 40, 0),
        (10, 50, 60, 12),
    ]
    assert [b["end"]["Y"] for b in shown.blocks[-3:-1]] == [2.0, 2.0]


def test_circles_scaled_in_their_plane_alone(tmp_path):
    """Radius, centre and end grow by the factor of both axes, the pitch by that of
    the third axis; in another plane the factors differ.
    """
    text = (
        "#SCALE ON [X2 Y2 Z3]\nG00 X0 Y0 Z0\nG02 X10 Y0 I5 F100\nG03 X20 R5\n"
        "G02 X20 Y0 I5 Z6 K2\nG18 G02 X30 Z6 R9\n"
    )
    shown = Shown(tmp_path, text)
    assert shown.codes == [(910113, 6)]
    arcs = [b for b in shown.blocks if b["type"] == "circular"]
    assert [(b["radius"], b["end"]["X"], b["end"]["Z"]) for b in arcs] == [
        (10, 20, 0),
        (10, 40, 0),
        (10, 40, 18),
    ]
    helix = np.hypot(18, 3 * 2 * np.pi * 10)
    assert arcs[2]["length"] == pytest.approx(helix)
