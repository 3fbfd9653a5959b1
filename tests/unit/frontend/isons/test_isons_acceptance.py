"""The numeric acceptance cases of the IsoNs specification (section 23), by their numbers."""

import math

import numpy as np
import pytest

from cnc_core.blocks import CIRCULAR, DWELL, LINEAR
from support.isons_programs import run
from support.programs import error_of

SQUARE = "G0 X100 Y100\nG1 X150 Y100\nX150 Y50\nX100 Y50\nX100 Y100\n"


def near(values, tolerance=1e-3):
    return pytest.approx(np.array(values), abs=tolerance)


def test_t01_absolute_and_incremental(tmp_path):
    """T-01."""
    out = run(tmp_path, "G90 G1X100Y100\nG91 X5Y-3\nG90 X0Y0\n")
    assert out.xy == near([[100, 100], [105, 97], [0, 0]])


@pytest.mark.parametrize(
    ("word", "code"), [("USER_ZERO", "G94"), ("USER_OFFSET", "G93")]
)
def test_t02_slots(tmp_path, word, code):
    """T-02: origins and offsets by slot."""
    text = f"{word} 0 {code}X20Y20\n{word} 1 {code}X50Y50\n{word} 2 {code} X150Y100\n"
    text += "".join(f"{word} {slot}\nG1X10Y10\n" for slot in range(3))
    assert run(tmp_path, text).xy == near([[30, 30], [60, 60], [160, 110]])


def test_t03_origin_file(tmp_path):
    """T-03: G55, G54 [2] and OX take axes from slots, the active index stays."""
    slots = "".join(
        f"[isons.origins.{i}]\nX = {10 * i + 1}\nY = {10 * i + 2}\nZ = {10 * i + 3}\n"
        for i in range(4)
    )
    text = (
        "USER_ZERO 1\nG92 XYZ\nG55\nG0 X0 Y0 Z0\nG54 [2] XYZ\nX0Y0Z0\n"
        "$A=$_X1\nOX0 OY1 OZ3\nX0Y0Z0\n"
    )
    out = run(tmp_path, text, slots)
    assert out.ends[:, :3] == near([[0, 12, 0], [21, 22, 23], [1, 12, 33]])
    assert out.variable("A") == 1


def test_t04_expressions_in_words(tmp_path):
    """T-04."""
    assert run(
        tmp_path, "$VAR=1\n$VAR1=2\nG1X[$VAR+$VAR1*SQR(18)]\n"
    ).xy == near([[9.4853, 0]])


def test_t05_bits_and_rounding(tmp_path):
    """T-05."""
    text = "$VAR=5\n$A=$VAR|1\n$B=$VAR&1\n$C=$VAR<<3\nIF $VAR & 4\n$D=1\nELSE\n$D=2\nEND_IF\n"
    text += "$E=INT(35.14)\n$F=FIX(35.14)\n$G=INT(35.6)\n$H=FIX(35.6)\n"
    out = run(tmp_path, text)
    assert [out.variable(name) for name in "ABCDEFGH"] == [
        5,
        1,
        40,
        1,
        35,
        35,
        36,
        35,
    ]


def test_t06_marker_loop(tmp_path):
    """T-06."""
    text = (
        'MARKER $SINC "restart here"\n$VAR=0\nLOOP 10\n$SINC=$SINC+1\n'
        "G1X200\n$VAR=$VAR+50\nG0X0Y[$VAR]\nEND_LOOP\n"
    )
    out = run(tmp_path, text)
    assert out.variable("SINC") == 10
    assert out.xy[-1] == near([0, 500])
    assert len(out.moves) == 20


def test_t07_arrays(tmp_path):
    """T-07."""
    text = "DIM $ARR[10]\n$VAR=2\n$I=0\nLOOP 10\n$ARR[$I]=$VAR*$I\n$I=$I+1\nEND_LOOP\n"
    assert run(tmp_path, text).array("ARR") == [2.0 * i for i in range(10)]
    error = error_of(run, tmp_path, text + "$A=$ARR[10]\n")
    assert (error.code, error.place.line) == (907014, 8)


def test_t08_get_is_in_reverse(tmp_path):
    """T-08."""
    macro = "GLOBAL $A $B $C $D\nGET $A $B $C $D\n"
    out = run(
        tmp_path,
        "GLOBAL $A $B $C $D\nHM7 10 20 30 40\n",
        files={"HM7.isons": macro},
    )
    assert [out.reader.store.common.values[name] for name in "ABCD"] == [
        40,
        30,
        20,
        10,
    ]


def test_t10_dwell_and_timers(tmp_path):
    """T-10: G4F2.5 rests for 2.5 s; a timer of 1500 ms stands at 0 after 1.5 s."""
    out = run(tmp_path, "$_T0=1500\nG4F1.2\n$A=$_T0\nG4F2.5\n$B=$_T0\n")
    assert out.rows["type"].tolist() == [DWELL, DWELL]
    assert out.rows["value"].tolist() == [1.2, 2.5]
    assert out.variable("A") == pytest.approx(300, abs=2)
    assert out.variable("B") == 0
    assert run(
        tmp_path, "$_T0=1500\n@W\nIF $_T0>0\nGOTO W\nEND_IF\nG0X1\n"
    ).xy == near([[1, 0]])


def test_t11_variable_list(tmp_path):
    """T-11."""
    text = (
        "DIM_VAR 10\nCOUNT_VAR $A\nADD_VAR 10.23\nCOUNT_VAR $B\n"
        "GET_VAR $C,10\nREMOVE_VAR 1\nCOUNT_VAR $D\n"
    )
    out = run(tmp_path, text + "CLEAR_VAR\nCOUNT_VAR $E\n")
    assert [out.variable(name) for name in "ABCDE"] == [10, 11, 10.23, 10, 0]
    assert error_of(run, tmp_path, text + "WRITE_VAR $A,10\n").code == 909106


@pytest.mark.parametrize(
    ("mode", "travels"), [(1, [45, -90]), (2, [45, 270]), (3, [-315, -90])]
)
def test_t12_rotary_modes(tmp_path, mode, travels):
    """T-12: which way round a rotary axis turns; G86 takes full turns off."""
    out = run(tmp_path, f"G36 X{mode}A\nG0A0\nA45\nA315\n")
    assert np.diff([0, *out.ends[:, 3]]).tolist() == pytest.approx(travels)
    out = run(tmp_path, "G0A1450\nG86A\n$A=$_Q3\n$B=$_Q103\n")
    assert (out.variable("A"), out.variable("B")) == (10, 10)


@pytest.mark.parametrize(
    ("start", "radius", "centre", "degrees", "length"),
    [
        ((100, 100), 150, (200, -11.8034), 83.6206, 218.918),
        ((100, 100), -150, (200, 211.8034), 276.3794, 723.560),
        ((100, -100), 150, (235.3553, -35.3553), 141.0576, 369.288),
        ((100, -100), -150, (164.6447, 35.3553), 218.9424, 573.190),
    ],
)
def test_t13_arcs_by_radius(tmp_path, start, radius, centre, degrees, length):
    """T-13."""
    row = run(
        tmp_path, f"G0X{start[0]}Y{start[1]}\nG2X300Y100R{radius}\n"
    ).moves[1]
    assert row["center"] == near(centre)
    assert math.degrees(row["angle"]) == pytest.approx(-degrees, abs=1e-3)
    assert row["length"] == pytest.approx(length, abs=1e-2)


def test_t14_mirrors_and_swap(tmp_path):
    """T-14."""
    square = np.array(
        [[100, 100], [150, 100], [150, 50], [100, 50], [100, 100]]
    )
    assert run(tmp_path, "G120\n" + SQUARE).xy == near(square * [1, -1])
    assert run(tmp_path, "G24\n" + SQUARE).xy == near(square * [-1, 1])
    assert run(tmp_path, "G26 YZ\nG0 Y5\n").ends[:, :3] == near([[0, 0, 5]])
    assert run(tmp_path, "G26 YZ\nG27\nG0 Y5\nG28 Y6").ends[:, :3] == near(
        [[0, 5, 0], [0, 5, 6]]
    )


def test_t15_rotation(tmp_path):
    """T-15."""
    out = run(
        tmp_path,
        f"$ROT=0\nLOOP 24\n{SQUARE}$ROT=$ROT+15\nG50 X100 Y50 Z[$ROT]\nEND_LOOP\n{SQUARE}",
    )
    passes = {}
    points = [tuple(p) for p in out.xy]
    assert points[:5] == [
        tuple(p)
        for p in [(100, 100), (150, 100), (150, 50), (100, 50), (100, 100)]
    ]
    passes[2] = out.xy[5:10]
    assert passes[2][:4] == near(
        [
            [87.0590, 98.2963],
            [135.3553, 111.2372],
            [148.2963, 62.9410],
            [100, 50],
        ]
    )
    assert out.xy[-4:] == near([[150, 100], [150, 50], [100, 50], [100, 100]])


PATH = (
    "G0X75.45Y157.46\n{}\nG1X107.84Y167.43\nX108.3Y142.73\n"
    "X117.36Y150.44\nX126.2Y139.34\nX140.92Y142.51\n"
)


def test_t16_fillets(tmp_path):
    """T-16: corners 1, 2, 4; the third does not fit any more."""
    rows = run(tmp_path, PATH.format("G30 R5 A20")).moves
    arcs = rows[rows["type"] == CIRCULAR]
    assert np.degrees(arcs["angle"]) == near([-106.042, 129.3306, 63.6195])
    assert arcs["center"] == near(
        [[102.9645, 160.6978], [113.1025, 153.3823], [128.1792, 144.8808]]
    )
    assert arcs["end"][:, :2] == near(
        [[107.9636, 160.7909], [116.3429, 149.5745], [129.2318, 139.9929]]
    )
    starts = rows["end"][np.flatnonzero(rows["type"] == CIRCULAR) - 1, :2]
    assert starts == near(
        [[101.4936, 165.4765], [108.1034, 153.2892], [124.2680, 141.7660]]
    )
    for off in ("G30 R5 A130", "G30 R0 A20", "G30 R5 A20\nG31"):
        rows = run(tmp_path, PATH.format(off)).moves
        assert rows["type"].tolist() == [LINEAR] * 6


def test_t17_bevels(tmp_path):
    """T-17: all four fit."""
    out = run(tmp_path, PATH.format("G33 R5 A20"))
    want = [
        (103.8678, 166.2073),
        (107.9174, 163.2746),
        (108.1912, 148.5714),
        (112.7494, 146.5164),
    ]
    want += [
        (114.6226, 148.1105),
        (119.5993, 147.6283),
        (124.3673, 141.6412),
        (129.0759, 139.9593),
    ]
    assert out.xy[1:9] == near(want)


def test_t18_scaling(tmp_path):
    """T-18."""
    path = "G0X10Y10\nG1X10Y20\nX20Y20\nX20Y10\n"
    out = run(tmp_path, f"G1051 X15Y15I0.5J0.5\n{path}G0X0Y0")
    assert out.xy == near(
        [[12.5, 12.5], [12.5, 17.5], [17.5, 17.5], [17.5, 12.5], [7.5, 7.5]]
    )
    assert run(tmp_path, f"G1051 X15Y15I2J2\n{path}").xy == near(
        [[5, 5], [5, 25], [25, 25], [25, 5]]
    )
    text = "G1051 X30Y20I0.5J0.5\nG1X10Y10\nX10Y20\nX20Y30\nG3X40Y30R10\nG1X50Y20\nX50Y10\nX0Y0\n"
    out = run(tmp_path, text)
    assert out.xy == near(
        [[20, 15], [20, 20], [25, 25], [35, 25], [40, 20], [40, 15], [15, 10]]
    )
    arc = out.moves[3]
    assert arc["radius"] == pytest.approx(5)
    assert arc["center"] + [0, -5] == near([30, 20])


T19 = "D5\n{}\nG0X30Y40\nG1X10Y10\nX50Y30\nG2X80Y30R15\nG1X90Y25\nX110Y25\nX130Y20\n"


def test_t19_compensation_left(tmp_path):
    """T-19, G41: mitres at shallow corners."""
    out = run(tmp_path, T19.format("G41"))
    want = [
        (30, 40),
        (8.8820, 12.2361),
        (47.5715, 31.5809),
        (82.4285, 31.5809),
        (90.5902, 27.5),
        (110.3078, 27.5),
    ]
    assert out.xy == near([*want, (130.6063, 22.4254)])
    assert out.moves["radius"][3] == pytest.approx(17.5)


def test_t19_compensation_right(tmp_path):
    """T-19, G42: arcs of the tool radius at sharp outer corners."""
    out = run(tmp_path, T19.format("G42"))
    want = [
        (30, 40),
        (11.1180, 7.7639),
        (51.1180, 27.7639),
        (52.5, 30),
        (77.5, 30),
        (78.8820, 27.7639),
    ]
    assert out.xy == near(
        [*want, (89.4098, 22.5), (109.6922, 22.5), (129.3937, 17.5746)]
    )
    arcs = out.moves[out.moves["type"] == CIRCULAR]
    assert arcs["radius"].tolist() == pytest.approx([2.5, 12.5, 2.5])


def test_t20_compensation_at_once(tmp_path):
    """T-20: G47 X1, closed shape from a shifted start."""
    text = (
        "G0X-26.2332Y-26.1708\nG47 X1\nD3\nG42\nG1X-24.7332Y-26.1708\n"
        "X-24.7332Y-76.1708\nX-74.7332Y-76.1708\n"
    )
    out = run(tmp_path, text + "X-74.7332Y-26.1708\nX-24.7332Y-26.1708\n")
    want = [
        (-26.2332, -26.1708),
        (-26.2332, -74.6708),
        (-73.2332, -74.6708),
        (-73.2332, -27.6708),
    ]
    assert out.xy == near([*want, (-24.7332, -27.6708)])


def test_t21_tool_length(tmp_path):
    """T-21."""
    assert run(tmp_path, "G43 X10.3 Z+\nG0Z0\nG44\nZ0\n").ends[:, 2] == near(
        [10.3, 0]
    )
    tools = "[isons.tools.2]\nlength = 7.0\n"
    assert run(tmp_path, "T2\nG45 Z-\nG0Z0\nG46\nZ1\n", tools).ends[
        :, 2
    ] == near([-7, 1])


def test_t29_limits(tmp_path):
    """T-29: G81 X3 makes the negative secondary limit active, X1 the primary one."""
    limits = "[isons]\nLIMITE_N_X = -100000\n2ND_LIMITE_N_X = -50000\n"
    assert len(run(tmp_path, "G0X-90\n", limits).moves) == 1
    error = error_of(run, tmp_path, "G81 X3\nG0X-40\nX-90\n", config=limits)
    assert (error.code, error.place.line) == (903001, 3)
    out = run(tmp_path, "$A=$_S0\nG81 X3\n$B=$_S0\nG81X1\nG0X-90\n", limits)
    assert (out.variable("A"), out.variable("B")) == (-100, -50)


def test_t32_sdo_and_opt(tmp_path):
    """T-32."""
    node = '[isons.canopen.2]\n"0x6014:0" = 77\n'
    out = run(
        tmp_path,
        "SDO_UL 2,24596,0,4,$VAR1\n$A=-5\nSDO_DL 2,24596,0,2,$A\nSDO_UL 2 24596 0 2 $B\n",
        node,
    )
    assert (out.variable("VAR1"), out.variable("B")) == (77, -5)
    assert (
        error_of(run, tmp_path, "SDO_UL 3,24596,0,4,$A\n", config=node).code
        == 909142
    )
    assert run(
        tmp_path, "OPT M_STOP 10\nOPT M_ERROR -1\n"
    ).reader.macros.events == {"M_STOP": 10, "M_ERROR": -1}


def test_t33_positioners(tmp_path):
    """T-33: PA waits for its end, with par 0 it only starts."""
    out = run(tmp_path, "PA[0] 1000\n$A=$_PM[0,2]\n$B=$_PM[0]\n")
    assert (out.variable("A"), out.variable("B")) == (1000, 0)
    assert out.rows["value"].tolist() == pytest.approx([10.0])  # 6000 mm/min
    text = (
        "PA[0,0] 1000\n$A=$_PM[0,0]\nPS[0]\n$B=$_PM[0,0]\nPA[1,3] 0\n"
        "$C=$_PM[1,3]\nPA[1,3]=1\n$D=$_PM[1,3]\n"
    )
    out = run(tmp_path, text)
    assert [out.variable(name) for name in "ABCD"] == [1, 0, 0, 1]
    assert error_of(run, tmp_path, "PA[0,3] 0\nPA[0] 5\n").code == 909141
