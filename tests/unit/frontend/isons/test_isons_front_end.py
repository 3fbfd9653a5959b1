"""The IsoNs front end: text, errors with their places, macros and events,
files, origins, planes, parameters.
"""

import math

import numpy as np
import pytest

from cnc_core.blocks import (
    CIRCULAR,
    EXACT_STOP,
    FLUSH,
    PATH_MODE,
    STANDSTILL,
    M,
    S,
)
from cnc_core.config import parse_config
from cnc_core.errors import CncError, ConfigError
from cnc_core.frontend import create
from cnc_core.frontend.port import OfflinePort, Wait
from cnc_core.program import Program
from support.isons_programs import CELL, exact_cell, run
from support.programs import error_of


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("G0X1\nLOOP 2.5\nEND_LOOP\n", 909105, 2),
        ("$N=2.5\nLOOP $N\nEND_LOOP\n", 909105, 2),
        ("G0X1\nGOTO NOWHERE\n", 907023, 2),
        ("GOSUB @77\n", 907023, 1),
        ("GOTO IN\nLOOP 2\n@IN\nG0X1\nEND_LOOP\n", 907024, 1),
        ("@A\n@A\n", 907025, 2),
        ("IF 1\nG0X1\n", 907021, 1),
        ("LOOP 2\nIF 1\nEND_LOOP\nEND_IF\n", 907020, 3),
        ("RETURN\n", 909123, 1),
        ("GOSUB A\nEND_PROGRAM\n@A\nG0X1\n", 909123, 4),
        ("DIM $A[5]\n$A[5]=1\n", 907014, 2),
        ("$B=$A[1]\n", 907010, 1),
        ("DIM $A[5]\n$B=$A\n", 909103, 2),
        ("G0X5Y5\nG2X5Y5R4\n", 900007, 2),
        ("G0X0Y0\nG2X10Y0I5.02J0\n", 900007, 2),
        ("G2X10\n", 900008, 1),
        ("HM1 5\n", 909124, 1),
        ('READ_PARMAC "VJOGX" $A\n', 909122, 1),
        ('WRITE_PARMAC "FEEDRES" 0\n', 900012, 1),
        ("$_Q0=5\n", 907016, 1),
        ("$A=$_Q9\n", 907014, 1),
        ("$A=$_Z1\n", 909101, 1),
        ("G1X$A\n", 900004, 1),
        ("G1X[$A\n", 900013, 1),
        ("FOO 5\n", 900001, 1),
        ("G7\n", 20131, 1),
        ("G1X5 (remark)\n", 900001, 1),
        ("G0X1X2\n", 900005, 1),
        ("G0X1DX2\n", 900005, 1),
        ("G0G1X1\n", 900011, 1),
        ("G0X1P5\n", 908001, 1),
        ("G0X\n", 900004, 1),
        ("G54 [256] X\n", 909110, 1),
        ("USER_ZERO -1\n", 909110, 1),
        ("M99\n", 900009, 1),
        ("D5\nG41\nD6\n", 906003, 3),
        ("D5\nG41\nG94X1\n", 906003, 3),
        ("D5\nG41\nG18\n", 906003, 3),
        ("G36 X1X\n", 909113, 1),
        ("G70 XA\nG1X5\nG2X9A9R9\n", 909115, 3),
        ("G1051 I2 J3\nG2X5Y5R9\n", 909116, 2),
        ("G48 X\n", 909114, 1),
        ("ERROR 12\n", 909130, 1),
        ("OPT M_FOO 1\n", 909120, 1),
        ("LOAD_VAR \"no.txt\"\n", 901001, 1),
        ("SAVE_VAR \"../no.txt\"\n", 907053, 1),
        ("IMPORT \"no.isons\"\n", 901001, 1),
        ("PA[9] 5\n", 909140, 1),
        ("$A=1/0\n", 900012, 1),
        ("$A=SQR(0-1)\n", 900012, 1),
        ("$A=" + "(" * 60 + "\n", 20927, 1),
        ("G1 F0 X1\n", 900006, 1),
    ],
)  # fmt: skip
def test_wrong_programs_are_refused(tmp_path, text, code, line):
    """Number and line of the error."""
    error = error_of(run, tmp_path, text)
    assert (error.code, error.place.line) == (code, line), str(error)


def test_check_sees_branches_that_are_not_taken(tmp_path):
    """`check` reports errors in both branches of a condition, each once."""
    text = (
        "LOOP 3\nIF 1\nG0X1\nELSE\nFOO\nEND_IF\nEND_LOOP\nIF 0\nJUMP\nEND_IF\n"
    )
    assert [
        (e.code, e.place.line) for e in run(tmp_path, text, collect=True).errors
    ] == [(900001, 5), (900001, 9)]


def test_remarks_and_spelling(tmp_path):
    """Three kinds of remarks, lower case, no blanks, quotes keep signs."""
    text = (
        "n5g0x1y2 // one\nG0X2 ; two\nG0X3 ' three\n"
        ' MARKER $M "a;b\'c//d" // x\n@end // label\n'
    )
    out = run(tmp_path, text)
    assert out.xy.tolist() == [[1, 2], [2, 2], [3, 2]]
    assert out.moves["n"].tolist() == [5, 0, 0]


def test_block_numbers_are_targets(tmp_path):
    """GOTO @num finds the block with that N; 1 starts the program again."""
    text = "$A=$A+1\nIF $A=3\nGOTO @0200\nEND_IF\nGOTO 1\nN20 G0X9\nN200 G0X5\n"
    out = run(tmp_path, text)
    assert out.variable("A") == 3
    assert out.xy.tolist() == [[5, 0]]


def test_angles(tmp_path):
    """Radians, degrees behind DRG, RAD again; constants too."""
    out = run(
        tmp_path, "$A=SIN(1)\nDRG\n$B=SIN(30)\n$C=ATAN(1)\nRAD\n$D=ACOS(0)\n"
    )
    want = [math.sin(1), 0.5, 45, math.pi / 2]
    assert [out.variable(n) for n in "ABCD"] == pytest.approx(want)


def test_precedence(tmp_path):
    """Power from the right, unary before power, shifts below sums, & before XOR before |."""
    text = "$A=2^3^2\n$B=-2^2\n$C=1<<2+1\n$D=1|6 XOR 2&3\n$E=1+2*3=7\n$F=!5\n$G=1=2 || 3>2 AND 1\n"
    out = run(tmp_path, text)
    assert [out.variable(n) for n in "ABCDEFG"] == [512, 4, 8, 5, 1, -6, 1]


def test_macros_have_their_own_variables_and_labels(tmp_path):
    """Locals and labels are private, GLOBAL shares, a macro wins over an M function of the CN."""
    macro = "GLOBAL $G\n$A=99\n$G=$G+1\nGOTO L\nG0X77\n@L\nG1 DX5\n"
    text = "GLOBAL $G\n$G=1\n$A=3\nM3\nLOOP 2\nM3\nEND_LOOP\n@L\nG0Y[$A]\n"
    out = run(tmp_path, text, files={"M3.isons": macro})
    assert out.reader.store.common.values["G"] == 4
    assert out.variable("A") == 3
    assert out.xy[-1].tolist() == [15, 3]
    assert not (out.rows["type"] == M).any()


def test_macro_arguments(tmp_path):
    """Constants, variables and brackets, negative too; a missing one is an error with its place."""
    files = {
        "HM4.isons": "GLOBAL $S\nGET $B\nGET $A\n$S=$A*10+$B\n",
        "HM5.isons": "G0X1\nGET $A $B\n",
    }
    out = run(tmp_path, "GLOBAL $S\n$V=4\nHM4 $V -3\n", files=files)
    assert out.reader.store.common.values["S"] == 37
    error = error_of(run, tmp_path, "HM5 1\n", files=files)
    assert (error.code, error.place.line, error.place.file[-9:]) == (
        909121,
        2,
        "HM5.isons",
    )
    assert error_of(run, tmp_path, "GET $A\n").code == 909121


def test_macros_wait(tmp_path):
    """A macro call and G62 wait until everything before is executed; M functions stand still."""
    (tmp_path / "p.isons").write_text("G0X1\nM3\nG62\nHM4\nG0X2\n")
    (tmp_path / "HM4.isons").write_text("G0X5\n")
    reader = run(tmp_path, "").reader
    front_end = create(
        "isons",
        tmp_path / "p.isons",
        reader.channel.machine,
        OfflinePort(np.zeros(4)),
    )
    items = []
    while (item := front_end.read(10)) is not None:
        items += (
            [item]
            if isinstance(item, Wait)
            else [int(t) for t in item.rows["type"]]
        )
    assert items == [PATH_MODE, 1, M, Wait.DRAINED, Wait.DRAINED, 1, 1]


def test_m_rows(tmp_path):
    """M functions of the CN stand where they are written, before or behind the motion."""
    rows = run(tmp_path, "M3 G0X1\nG0X2 M5\nM30\nnonsense\n").rows
    assert rows["code"][rows["type"] == M].tolist() == [3, 5, 30]
    assert rows["type"].tolist() == [M, 1, 1, M, M]
    assert all(rows["flags"][rows["type"] == M] & STANDSTILL)


def test_events(tmp_path):
    """START and END macros run around the program, ERROR behind an error; OPT changes them."""
    files = {f"M{n}.isons": f"G0 X{n}\n" for n in (61, 62, 63, 64)}
    config = "[isons.events]\nM_START = 61\nM_END = 62\nM_ERROR = 63\n"
    assert run(tmp_path, "G0X5\n", config, files).xy[:, 0].tolist() == [
        61,
        5,
        62,
    ]
    assert run(
        tmp_path, "OPT M_END 64\nG0X5\nEND_PROGRAM\nX9\n", config, files
    ).xy[:, 0].tolist() == [61, 5, 64]
    assert run(tmp_path, "OPT M_END -1\nG0X5\nM2\n", config, files).xy[
        :, 0
    ].tolist() == [61, 5]
    ends = []
    path = tmp_path / "program.isons"
    path.write_text("G0X5\nGOSUB S\nG0X9\n@S\nERROR 7\n")
    program = Program(
        path, exact_cell(CELL + config), "isons", OfflinePort(np.zeros(4))
    )
    batches = program.batches()
    with pytest.raises(CncError) as caught:
        ends.extend(
            x for batch in batches for x in batch.rows["end"][:, 0].tolist()
        )
    assert caught.value.code == 909130
    assert ends == [61, 5, 63]


def test_imports(tmp_path):
    """An imported file shares the variables; END_IMPORT goes back early; places name the file."""
    (tmp_path / "lib").mkdir()
    files = {
        "lib/a.isons": '$A=$A+1\nIMPORT "b.isons"\nEND_IMPORT\n$A=1000\n',
        "lib/b.isons": "$A=$A*2\n",
    }
    files["bad.isons"] = "\nFOO\n"
    out = run(
        tmp_path,
        '$A=4\nIMPORT "lib/a.isons"\nIMPORT "$APPPATH/b.isons"\n',
        '[isons]\napp_path = "lib"\n',
        files,
    )
    assert out.variable("A") == 20
    error = error_of(run, tmp_path, 'IMPORT "bad.isons"\n', files=files)
    assert (error.code, error.place.line) == (900001, 2)
    assert error.place.file.endswith("bad.isons")
    assert (
        error_of(
            run,
            tmp_path,
            'IMPORT "me.isons"\n',
            files={"me.isons": 'IMPORT "me.isons"\n'},
        ).code
        == 907002
    )


def test_list_files(tmp_path):
    """SAVE_VAR writes into the folder of the run, LOAD_VAR finds it, or a file
    beside the program.
    """
    text = (
        'ADD_VAR 1.5\nADD_VAR -2\nSAVE_VAR "a.txt"\nCLEAR_VAR\n'
        'FILE_EXISTS $A,"a.txt"\nFILE_EXISTS $B "c.txt"\n'
        'LOAD_VAR "a.txt"\n'
    )
    out = run(
        tmp_path,
        text + 'GET_VAR $C,1\nLOAD_VAR "beside.txt"\nCOUNT_VAR $D\n',
        files={"beside.txt": "1\n2\n3\n"},
    )
    assert [out.variable(n) for n in "ABCD"] == [1, 0, -2, 3]
    assert out.port.texts == {"a.txt": "1.5\n-2.0\n"}
    assert (
        error_of(
            run, tmp_path, "LOAD_VAR bad.txt\n", files={"bad.txt": "x\n"}
        ).code
        == 909107
    )


def test_layers_add(tmp_path):
    """Origin, offset, head and length add; each can be suspended; G940 leaves
    the origin out for its block.
    """
    config = "[isons.heads.3]\noffset = { X = 1000.0 }\nsensor = { Y = 5.0 }\n"
    text = (
        "G94X1\nG93X10DY7\nH3\nG43X100X+\nG0X0\nG98\nX0\nG96\nX0\nG87\n"
        "X0\nG44\nX0\nG99G97\nG940 X0\nX0\nG88\nX0\n$A=$_H0\n$B=$_H10\n"
    )
    out = run(tmp_path, text, config)
    assert out.ends[:, 0].tolist() == [1111, 1110, 1100, 100, 0, 10, 11, 1011]
    assert (out.variable("A"), out.variable("B")) == (1000, 5)


def test_origins_from_positions(tmp_path):
    """G92 and G95 make axes read 0; G82 and G85 put the sensor offset there; D
    words add; G89 presets.
    """
    config = "[isons.heads.0]\nsensor = { X = 5.0 }\n"
    text = "G0X7Y8\nG92X\n$A=$_Q0\n$B=$_Q1\n$C=$_Y0\nG95XY\n$D=$_Q1\n$E=$_W1\nG94DX1\n$F=$_Y0\n"
    out = run(tmp_path, text)
    assert [out.variable(n) for n in "ABCDEF"] == [0, 8, 7, 0, 8, 8]
    assert run(tmp_path, "H0\nG0X7\nG82X\nG0X0\n", config).xy[
        :, 0
    ].tolist() == [7, 12]
    out = run(tmp_path, "G94X5\nG0X10\nG89X100\n$A=$_Q0\n$B=$_Q100\nG0X101\n")
    assert (out.variable("A"), out.variable("B")) == (100, 100)
    assert out.xy[:, 0].tolist() == [15, 16]


def test_planes(tmp_path):
    """I belongs to the first axis of the plane, J to the second, also of a
    plane named the other way round.
    """
    arc = run(tmp_path, "G18\nG3 Z10 X0 I5 J0\n").moves[0]
    assert arc["plane"] == 18
    assert arc["center"].tolist() == [5, 0]
    for word in ("I5J0", "R5"):
        arc = run(tmp_path, f"G70 XZ\nG3 X10 Z0 {word}\n").moves[0]
        assert (arc["plane"], arc["angle"]) == (18, pytest.approx(-math.pi))
        assert arc["center"].tolist() == pytest.approx([0, 5])


def test_centres_absolute_or_relative(tmp_path):
    """ARC_REL decides under G90; under G91 they count from the start."""
    for config, line in (
        ("", "G2X20I15J0"),
        ("[isons]\nARC_REL = 1\n", "G2X20I5J0"),
        ("", "G91\nG2X10I5J0"),
    ):
        arc = run(tmp_path, f"G0X10\n{line}\n", config).moves[1]
        assert arc["center"].tolist() == [15, 0], line


@pytest.mark.parametrize(
    "mirrors", [["G24"], ["G24", "G120"], ["G22"], ["G22", "G24"]]
)
def test_arcs_flip_under_mirrors(tmp_path, mirrors):
    """An odd number of mirrors and swaps turns an arc's sense; by centre as by radius."""
    rows = [
        run(tmp_path, "\n".join([*mirrors, "G0X10", f"G2X20Y0{word}"])).moves
        for word in ("I15J0", "R5")
    ]
    assert rows[0]["center"] == pytest.approx(rows[1]["center"])
    assert np.sign(rows[0]["angle"][1]) == (-1) ** (len(mirrors) + 1)


def test_feeds_and_speeds(tmp_path):
    """m/min, mm/min by FEEDRES, inch, FEEDDEF, bounds of F and S."""
    assert run(tmp_path, "G1X5F1.2\n").moves["feed"].tolist() == pytest.approx(
        [20]
    )
    assert run(tmp_path, "G1X5F1200\n", "[isons]\nFEEDRES = 1\n").moves[
        "feed"
    ].tolist() == pytest.approx([20])
    assert run(tmp_path, "G1X5\n", "[isons]\nFEEDDEF = 600.0\n").moves[
        "feed"
    ].tolist() == pytest.approx([10])
    bounds = "[isons]\nFEEDMAX = 6000\nFEEDMIN = 60\nSPEEDMAX = 100\nSPEEDMIN = 10\nWR_SPD = 1\n"
    out = run(
        tmp_path,
        "G1X5F1\nX6F100\nX[7]\nX8F0.001\nX[9]\nG0X0\nS500\n$A=$_K9\nS5\n$B=$_X0\n",
        bounds,
    )
    assert out.moves["feed"].tolist() == pytest.approx(
        [1000 / 60, 100, 100, 1, 1, 0]
    )
    assert out.rows["value"][out.rows["type"] == S].tolist() == [100, 10]
    assert (out.variable("A"), out.variable("B")) == (100, 10)
    assert run(tmp_path, "G20\nG1X1Y[2]\n").xy.tolist() == [[25.4, 50.8]]


def test_exact_stop_is_the_default(tmp_path):
    """G61 holds until G60; USE_G60 changes that."""
    assert (
        run(tmp_path, "G1X1\nG60\nX2\nG61\nX3\n").moves["flags"] & EXACT_STOP
        > 0
    ).tolist() == [True, False, True]
    assert not (
        run(tmp_path, "G1X1\n", "[isons]\nUSE_G60 = 1\n").moves["flags"]
        & EXACT_STOP
    ).any()


def test_parameters_of_the_cell(tmp_path):
    """They set axes; they are read and written; wrong names and values are refused with a hint."""
    cell = parse_config(
        "[isons]\nVMAX_X = 6000\nACC_LAV = 100\nTAU = 5.0\n"
        "LIMITE_N_X = -5000\n2ND_LIMITE_N_X = -9000\n"
    )
    axis = cell.axes["X"]
    assert (axis.v_max_mm_s, axis.a_max_mm_s2, axis.min_mm) == (
        100,
        4000,
        -9,
    )  # T-28: ACC 100, TAU 5: 4 m/s2
    out = run(
        tmp_path,
        'READ_PARMAC "SGLR" $A\nWRITE_PARMAC "VJOG_X" 55\nREAD_PARMAC VJOG_X $B\n',
    )
    assert (out.variable("A"), out.variable("B")) == (10, 55)
    for text, hint in (
        ("VJOGX = 1", "VJOG_X"),
        ("FEEDRES = 0", "1..1000"),
        ('SGLR = "a"', "number"),
        ("FOO_Z = 1", "FOO_Z"),
    ):
        with pytest.raises(ConfigError, match=hint):
            parse_config(f"[isons]\n{text}\n")


def test_written_parameters_act(tmp_path):
    """FEEDMAX changed by the program bounds what follows."""
    out = run(
        tmp_path,
        'G1X5F1\nWRITE_PARMAC "FEEDMAX" 60\nX6\nWRITE_PARMAC "ARC_REL" 1\nG2X8I1J0\n',
    )
    assert out.moves["feed"].tolist() == pytest.approx([1000 / 60, 1, 1])
    assert out.moves["center"][2].tolist() == [7, 0]


def test_specials(tmp_path):
    """$_X tells modes, numbers and states."""
    text = "G91 G18\nT2 H3\nUSER_ZERO 4\nG96\nG43 X5 Z-\nF2\n" + "".join(
        f"$A{i}=$_X{i}\n" for i in range(14)
    )
    out = run(tmp_path, text)
    assert [out.variable(f"A{i}") for i in range(14)] == [
        0,
        4,
        0,
        1,
        0,
        3,
        2,
        0,
        2,
        1,
        1,
        -5,
        2,
        0,
    ]


def test_corners_in_other_planes(tmp_path):
    """A fillet in ZX turns the same way as its lines, whichever way round the plane is named."""
    for plane in ("G18", "G70 XZ"):
        arc = run(tmp_path, f"{plane}\nG30 R2 A5\nG1 Z10\nX10\nZ20\n").moves[1]
        assert (arc["type"], arc["plane"]) == (CIRCULAR, 18)
        assert arc["center"].tolist() == pytest.approx([8, 2])
        assert arc["angle"] == pytest.approx(math.pi / 2)


def test_corners_let_nothing_slip(tmp_path):
    """What is held back comes out before M functions, waits, arcs, the end;
    scaling scales the radius.
    """
    rows = run(tmp_path, "G30 R2 A5\nG1 X10\nM3\nY10\nG62\nX0\n").rows
    assert rows["type"].tolist() == [1, M, 1, 1]
    rows = run(tmp_path, "G1051 P2\nG30 R2 A5\nG1 X10\nY10\n").moves
    assert rows["radius"][1] == pytest.approx(4)
    assert FLUSH not in rows["type"]


def test_compensation_ends_on_the_path(tmp_path):
    """Behind G40 the next motion leads back to the programmed path; T and its
    table give the radius.
    """
    tools = "[isons.tools.1]\ndiameter = 4.0\n"
    out = run(tmp_path, "T1\nG41\nG1X10\nX20\nY10\nG40\nX30\n", tools)
    assert out.xy == pytest.approx(
        np.array([[10, 2], [18, 2], [18, 10], [30, 10]])
    )


def test_outputs_and_generics(tmp_path):
    """Outputs hold 0 or 1, generic variables 32-bit integers; both stand in the shared area."""
    out = run(
        tmp_path,
        "$_O3=7\n$A=$_O3\n$_K2=-9.7\n$B=$_K2\n$_PARM_1=5\nM3\n$C=$_PARM_1\n$D=$_I200\n",
    )
    assert [out.variable(n) for n in "ABCD"] == [1, -9, 5, 0]
    assert out.port._external == {
        ("global", "ISONS_O", 3): 1,
        ("global", "ISONS_K", 2): -9,
        ("global", "ISONS_PARM_", 0): 5,
    }
    assert error_of(run, tmp_path, "$_K0=3000000000\n").code == 900012


def test_corners_come_out_before_a_wait(tmp_path):
    """A block that needs everything before to be executed gets it; a change of
    plane ends the corner too.
    """
    (tmp_path / "p.isons").write_text(
        "G30 R2 A5\nG1X10\n$A=$_R0\nG1Y10\nG18\nG1X0\n"
    )
    machine = run(tmp_path, "").reader.channel.machine
    front_end = create(
        "isons", tmp_path / "p.isons", machine, OfflinePort(np.zeros(4))
    )
    items = []
    while (item := front_end.read(10)) is not None:
        items.append(
            item
            if isinstance(item, Wait)
            else item.rows["end"][item.rows["type"] == 1, :2].tolist()
        )
    assert items == [[[10, 0]], Wait.DRAINED, [[10, 10], [0, 10]]]
    assert front_end.store.scope.values["A"] == 10


def test_slots_do_not_change_under_compensation(tmp_path):
    """Nor do heads."""
    for word in ("USER_ZERO 1", "USER_OFFSET 1", "H1"):
        assert (
            error_of(run, tmp_path, f"D5\nG41\nG1X5\n{word}\n").code == 906003
        )


def test_limits_hold_on_arcs(tmp_path):
    """Where an arc passes a limit between its ends."""
    text = "G90G2X10Y0I5J0\n"
    assert len(run(tmp_path, text, "[isons]\nLIMITE_P_Y = 5001\n").moves) == 1
    with pytest.raises(CncError, match="axis Y would reach 5, "):
        run(tmp_path, "X0\n" + text, "[isons]\nLIMITE_P_Y = 4000\n")


def test_limits_that_the_program_writes(tmp_path):
    """They make the cell's limits tighter; those of the cell file are told once."""
    for text, config in (
        ('WRITE_PARMAC "LIMITE_P_X" 4000\nG1X5F6\n', ""),
        ("G1X5F6\n", "[isons]\nLIMITE_P_X = 4000\n"),
        (
            'WRITE_PARMAC "LIMITE_P_X" 9000\nG1X5F6\n',
            "[isons]\nLIMITE_P_X = 4000\n",
        ),
    ):
        errors = run(tmp_path, text, config, collect=True).errors
        assert [error.code for error in errors] == [903001]


@pytest.mark.parametrize("name", ["JERK", "FEEDDEF", "SPEEDDEF", "USE_G60"])
def test_what_has_been_taken_over_is_told(tmp_path, name):
    """A parameter that acts at a start only: written later, a warning, once."""
    out = run(tmp_path, f'LOOP 2\nWRITE_PARMAC "{name}" 1\nEND_LOOP\n')
    assert [warning.code for warning in out.reader.warnings] == [907042]


def test_tolerance_of_arcs_that_the_program_writes(tmp_path):
    """SGLR acts from the next arc on: radii 4.9 and 5.1 mm."""
    arc = "G2X10Y0I4.9J0F6\n"
    for allowed, codes in ((100, [900007]), (300, [])):
        text = f'WRITE_PARMAC "SGLR" {allowed}\n{arc}'
        errors = run(tmp_path, text, collect=True).errors
        assert [error.code for error in errors] == codes


def test_mixed_bits_and_comparisons_warn(tmp_path):
    """A-07: bit operators bind tighter; without brackets a warning says so."""
    out = run(tmp_path, "$A=5 & 4 = 4\n$B=(5&4)=4\n$C=5&4 && 3=3\n")
    assert [out.variable(name) for name in "ABC"] == [1, 1, 1]
    assert [m.split(": ")[1] for m in out.port.messages] == ["909108"]


def test_modal_state_stays_from_program_to_program(tmp_path):
    """All but rotation and compensation; origins with their slots."""
    port, rows = OfflinePort(np.zeros(4)), []
    first = "G91\nUSER_ZERO 2 G94X10\nG60\nF2\nG50Z90\nG24\nG36X1A\nG18\nG43 X3 Z+\nD2\nG41\n"
    for name, text in (
        ("a", first),
        ("b", "G1X1\nX5\nG90X1A359\n$A=$_X1\n$B=$_X10\n$C=$_X11\n"),
    ):
        path = tmp_path / f"{name}.isons"
        path.write_text(text)
        program = Program(path, exact_cell(CELL), "isons", port)
        rows.append(
            [row.copy() for batch in program.batches() for row in batch.rows]
        )
    assert rows[0] == []
    assert [row["end"][[0, 3]].tolist() for row in rows[1]] == [
        [-1, 0],
        [-6, 0],
        [9, -1],
    ]
    assert rows[1][0]["feed"] == pytest.approx(2000 / 60)
    assert not rows[1][0]["flags"]
    assert [program.reader.store.scope.values[name] for name in "ABC"] == [
        2,
        1,
        3,
    ]


def test_g94_beside_user_offset_stores_an_offset(tmp_path):
    """A-20: the guide's example."""
    out = run(
        tmp_path,
        "USER_OFFSET 3 G94X5\nG1X0\n$A=$_W0\n$B=$_Y0\nUSER_OFFSET 0\nG1X1\n",
    )
    assert out.xy[:, 0].tolist() == [5, 1]
    assert (out.variable("A"), out.variable("B")) == (5, 0)


@pytest.mark.parametrize("text", ["G30R-1A0", "G81", "G93", "G94", "G89"])
def test_functions_without_what_they_need(tmp_path, text):
    """Negative radii, no axes."""
    assert error_of(run, tmp_path, text + "\n").place.line == 1


def test_parameters_that_the_cell_has_are_read_as_they_are(tmp_path):
    """VMAX and LIMITE that are not given: those of the axes."""
    text = 'READ_PARMAC "VMAX_X" $A\nREAD_PARMAC LIMITE_P_Y,$B\nREAD_PARMAC "SGLP" $C\n'
    out = run(tmp_path, text)
    assert (out.variable("A"), out.variable("B"), out.variable("C")) == (
        18000,
        1e8,
        200,
    )


def test_a_loop_that_waits_for_an_input_ends_where_nobody_moves_it(tmp_path):
    """`check` says soon that the program does not come on."""
    assert (
        error_of(run, tmp_path, "@W\nIF $_I2=0\nGOTO W\nEND_IF\nG1X1\n").code
        == 907001
    )


@pytest.mark.ci
@pytest.mark.parametrize("mode", ["G60", "G61"])
def test_a_loop_that_waits_for_a_timer_ends(tmp_path, mode):
    """Time passes with every look, a minute too."""
    text = (
        f"{mode}\n$_T0=20000\n@W\nIF $_T0>0\nGOTO W\nEND_IF\nPA[0,0] 500\n"
        f"@V\nIF $_PM[0]=1\nGOTO V\nEND_IF\nG0X1\n"
    )
    assert run(tmp_path, text).xy[:, 0].tolist() == [1]


def test_functions_with_their_own_words_in_one_block(tmp_path):
    """The words belong to the function ahead of them, if they fit more than
    one; columns of errors stay.
    """
    out = run(
        tmp_path,
        "G94X1G93Y2\nG60G69X20G72X1Y7\nG4F0.5G1X5Y0F3\nG1X7G100X4\nG50X0Y0Z90G1X1Y0\n",
    )
    assert out.xy.tolist() == [[6, 2], [8, 2], pytest.approx([1, 3])]
    kinds = [int(row["type"]) for row in out.rows]
    assert kinds == [4, 1, 1, 14, 1]
    error = error_of(run, tmp_path, "G69X200G72X1Z9\n")
    assert (error.code, error.place.column) == (900012, 13)
    assert error_of(run, tmp_path, "G0G1X1\n").code == 900011
    assert error_of(run, tmp_path, "G1X5G1X6\n").code == 900011


def test_tools_of_a_machine_without_a_table(tmp_path):
    """Any T, diameter and length 0, and a warning; with a table its tools only."""
    out = run(tmp_path, "T999\n$A=$_X6\n$B=$_U0\nT7\n")
    assert (out.variable("A"), out.variable("B")) == (999, 0)
    assert [warning.code for warning in out.reader.warnings] == [907042]
    for table in (
        "[tools.1]\nradius_mm = 2.0\n",
        "[isons.tools.1]\ndiameter = 4.0\n",
    ):
        assert run(tmp_path, "T1\n$B=$_U0\nT0\n", table).variable("B") == 4
        with pytest.raises(CncError) as caught:
            run(tmp_path, "G1X1\nT999\n", table)
        assert (caught.value.code, caught.value.place.line) == (900014, 2)


def test_a_converter_of_imported_files_is_not_passed_over(tmp_path):
    """NsImportFile.dll would read the file: refused by name, beside the program
    and in the application's folder.
    """
    files = {"a.isons": "G1X1\n"}
    assert len(run(tmp_path, 'IMPORT "a.isons"\n', files=files).moves) == 1
    for place in (tmp_path, tmp_path / "app"):
        place.mkdir(exist_ok=True)
        (place / "NsImportFile.DLL").write_bytes(b"MZ")
        with pytest.raises(CncError, match="NsImportFile") as caught:
            run(
                tmp_path,
                'G1X2\nIMPORT "a.isons"\n',
                '[isons]\napp_path = "app"\n',
            )
        assert (caught.value.code, caught.value.place.line) == (900003, 2)
        (place / "NsImportFile.DLL").unlink()


def test_events_without_a_macro_are_warned_of(tmp_path):
    """OPT names a macro that is not there: told where it is programmed; -1 is none."""
    out = run(
        tmp_path,
        "G1X1\nOPT M_PAUSE 32\nOPT M_GOPAUSE 33\nOPT M_STOP -1\n",
        files={"M33.isons": "G4F1\n"},
    )
    assert [
        (warning.code, warning.place.line) for warning in out.reader.warnings
    ] == [(909124, 2)]
