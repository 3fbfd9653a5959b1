"""Interpolation modes, corner rules and filters of the IsoNs dialect, with the
numbers of the specification.
"""

import math

import numpy as np
import pytest

from cnc_core.blocks import EXACT_STOP, LINEAR, POLYNOMIAL
from cnc_core.errors import CncError
from support.isons_programs import run

# T-24
N = np.array(
    [
        *[
            (107.16, 130.27),
            (100.59, 131.18),
            (100.14, 129.37),
            (96.74, 130.73),
            (95.38, 129.14),
            (92.66, 130.5),
        ],
        *[
            (89.95, 128.46),
            (86.55, 131.41),
            (82.24, 129.14),
            (77.71, 132.31),
            (72.95, 128.91),
            (67.97, 132.31),
        ],
        *[(62.98, 129.37), (57.55, 133.45), (52.34, 129.59)],
    ]
)


def path(points, head):
    text = f"G60F1\nG0X{points[0][0]}Y{points[0][1]}\n{head}\nG1\n"
    return text + "".join(f"X{x}Y{y}\n" for x, y in points[1:])


def filtered(folder, head, points=N):
    """Vertices behind the rapid, and the program's reports."""
    path_text = path(points, head)
    file = folder / "program.isons"
    out = run(folder, path_text, programmed=True)
    assert file.is_file()
    return out.xy


def length(xy):
    return float(np.hypot(*np.diff(xy, axis=0).T).sum())


@pytest.mark.parametrize(
    ("code", "factor"), [(63, 1), (64, 7071.07), (65, 1), (67, 1), (75, 1)]
)
def test_t22_what_the_feed_counts_along(tmp_path, code, factor):
    """T-22: in G64 along the plane, in G63 along all axes."""
    row = run(tmp_path, f"G60 G{code}\nG17 F1\nG1X0.001Y0.001Z10\n").moves[0]
    speed_z = row["feed"] * 10 / row["length"]
    assert speed_z == pytest.approx(factor * 1000 / 60, rel=1e-5)
    assert bool(row["flags"] & EXACT_STOP) == (code == 67)


def test_g64_without_motion_in_the_plane_counts_all_axes(tmp_path):
    """A motion of Z alone, of Z and A, of A alone."""
    rows = run(tmp_path, "G60\nF6\nG1Z3\nZ6A4\nA10\nG18\nX3Z10Y7\n").moves
    assert rows["feed"][0] == pytest.approx(100)
    assert rows["feed"][1] * 5 / rows["length"][1] == pytest.approx(
        100
    )  # 3 mm and 4 degrees
    assert rows["feed"][2] == pytest.approx(100)
    assert rows["feed"][3] * 5 / rows["length"][3] == pytest.approx(
        100
    )  # X 3, Z 4


def test_g68_transports_the_other_axes(tmp_path):
    """Out-of-plane axes are ignored for the speed, until the tangential axis would be too fast."""
    text = "G60\nG69X200 A\nG68X{}\nF6\nG1X3A4\n"
    feed = [
        run(tmp_path, text.format(limit)).moves["feed"][0]
        for limit in (0, 10, 1)
    ]
    assert feed == pytest.approx([100, 100, 60])
    with pytest.raises(CncError) as caught:
        run(tmp_path, "G68X0\n")
    assert caught.value.code == 909117


def test_g68_without_a_tangential_axis_limits_every_transported_one(tmp_path):
    """G69 names none: X holds for whichever axis outside the plane is moved; -1
    transports none, 0 all.
    """
    text = "G60\nG69X200\nG68X{}\nF6\nG1X3{}4\n"
    for axis in "ZA":
        feed = [
            run(tmp_path, text.format(limit, axis)).moves[0]
            for limit in (0, 10, 1, -1)
        ]
        along = [
            row["feed"] * (5 / row["length"] if axis == "Z" else 1.0)
            for row in feed
        ]
        fast = 100 * 5 / 3 if axis == "Z" else 100
        assert along == pytest.approx(
            [fast, fast, 100, 100] if axis == "Z" else [100, 100, 60, 60]
        )


def test_g48_tells_its_name_once(tmp_path):
    """The text of an error begins with what it is about."""
    with pytest.raises(CncError) as caught:
        run(tmp_path, "G48X\n")
    assert caught.value.text == "G48: the axis lies in the plane (X)"


def corner(folder, degrees, config=""):
    """The first of two motions with this turn between them."""
    turn = math.radians(degrees)
    text = f"G60F1\nG1X10\nX{10 + 10 * math.cos(turn):.9f}Y{10 * math.sin(turn):.9f}\n"
    return run(folder, text, config).moves[0]


def test_t28_corner_stops(tmp_path):
    """T-28: SGLP 200 is 20 degrees, without slowing down before."""
    for degrees, stops in ((19, False), (21, True)):
        row = corner(tmp_path, degrees)
        assert bool(row["flags"] & EXACT_STOP) == stops
        assert row["end_speed"] == 0


@pytest.mark.parametrize(
    ("degrees", "factor"), [(4.5, 0), (10, 0.45), (20, 0.225), (45, 0.15)]
)
def test_t28_slow_corners(tmp_path, degrees, factor):
    """T-28: slowing down from SGLP_RED % of SGLP on, by at most MAX_RED %."""
    config = "[isons]\nSGLP = 450\nSGLP_RED = 10\nMAX_RED = 85\n"
    assert corner(tmp_path, degrees, config)["end_speed"] == pytest.approx(
        factor * 1000 / 60, rel=1e-6
    )
    assert corner(tmp_path, 46, config)["flags"] & EXACT_STOP


def test_t28_arcs(tmp_path):
    """T-28: ACC_RAGGIO_MAX 109 counts as 0.9; speed on arcs is the root of
    acceleration times radius.
    """
    for value, accel in ((109, 0.9), (108, 0.8), (1, 1.0)):
        row = run(
            tmp_path,
            "G60F60\nG2X10R5\n",
            f"[isons]\nACC_RAGGIO_MAX = {value}\n",
        ).moves[0]
        assert row["feed"] == pytest.approx(math.sqrt(accel * 1000 * 5))


def test_sgl3d_looks_at_each_axis(tmp_path):
    """G65: the change of direction of an axis in thousandths; G63 never stops; G61 always."""
    config = "[isons]\nSGL3D_X = 500\nSGL3D_Z = 90\n"
    for code, z, stops in ((65, 0.8, False), (65, 1.0, True), (63, 10, False)):
        row = run(tmp_path, f"G60G{code}F1\nG1X10\nX20Z{z}\n", config).moves[0]
        assert bool(row["flags"] & EXACT_STOP) == stops
    assert all(
        run(tmp_path, "G63F1\nG1X10\nX20Z10\n").moves["flags"] & EXACT_STOP
    )


def test_g75_judges_the_plane_by_angle_and_the_rest_by_axes(tmp_path):
    """In the plane SGLP, outside SGL3D."""
    config = "[isons]\nSGL3D_X = 2000\nSGL3D_Z = 2000\n"
    rows = run(tmp_path, "G60G75F1\nG1X10\nY10\nX0Z9\n", config).moves
    assert [bool(flag & EXACT_STOP) for flag in rows["flags"]] == [
        True,
        False,
        False,
    ]


def test_rows_between_motions_keep_their_place(tmp_path):
    """What stands behind a motion that is judged comes behind it; arcs have
    tangents at both ends.
    """
    out = run(tmp_path, "G60F1\nG1X10\nG4F1\nG2X20Y-10R10\nG1Y-20\nX30\nS5\n")
    assert out.rows["type"].tolist() == [1, 4, 2, 1, 1, 7]
    assert (out.moves["flags"] & EXACT_STOP).tolist() == [0, 0, 2, 0]


def test_t24_nurbs(tmp_path):
    """T-24: all segments, ends exact, length and the midpoint of an order 3 spline."""
    xy = filtered(tmp_path, "G69X200\nG72X1Y7")
    assert (xy[0].tolist(), xy[-1].tolist()) == (N[0].tolist(), N[-1].tolist())
    assert length(xy) == pytest.approx(58.95, abs=0.3)
    assert np.hypot(*(xy - [100.365, 130.275]).T).min() < 0.1
    assert np.hypot(*np.diff(xy, axis=0).T)[:-1] == pytest.approx(0.2, abs=0.01)
    assert length(filtered(tmp_path, "G69X200\nG72X1Y7Z5")) == pytest.approx(
        55.96, abs=0.02
    )
    assert filtered(tmp_path, "G69X200\nG72X1Y7Z1") == pytest.approx(N)
    assert length(filtered(tmp_path, "G69X200\nG72X1Y7Z2")) == pytest.approx(
        66.53, abs=0.5
    )


def test_t24_long_segments_stay(tmp_path):
    """T-24: G72 Y5 leaves segment 1 and segments 9 to 14."""
    xy = filtered(tmp_path, "G69X200\nG72X1Y5")
    assert xy[:2] == pytest.approx(N[:2])
    assert xy[-6:] == pytest.approx(N[-6:])
    assert len(xy) > 50


def test_t24_noise(tmp_path):
    """T-24: vertices behind short segments go, where the edge is sharp enough."""
    assert filtered(tmp_path, "G69X200\nG73X1Y45Z5") == pytest.approx(
        N[[0, 1, *range(9, 15)]]
    )
    assert filtered(tmp_path, "G69X200\nG73X1Y45Z3") == pytest.approx(
        N[[0, 1, 3, *range(5, 15)]]
    )
    assert filtered(tmp_path, "G69X200\nG73X1Y100Z5") == pytest.approx(N)
    assert filtered(tmp_path, "G69X20\nG73X1Y45Z5") == pytest.approx(N)


def test_t25_short_segments(tmp_path):
    """T-25: segments 2 and 4 go; with Y0 the limit is the way of one sample."""
    assert filtered(tmp_path, "G69X200\nG74X1Y2.5") == pytest.approx(
        N[[0, 1, 3, *range(5, 15)]]
    )
    points = [(0, 0), (10, 0), (10.4, 0), (20, 0), (20.6, 0), (30, 0)]
    assert filtered(tmp_path, "F6\nG69X200\nG74X1Y0", points)[
        :, 0
    ].tolist() == [10, 20, 20.6, 30]


def test_t26_smoothing(tmp_path):
    """T-26: four segments enter, the fifth flushes; level 1 changes nothing."""
    points = [
        (30.4845, 258.703),
        (36.1945, 260.416),
        (40.7625, 257.8465),
        (44.7595, 260.1305),
        (52.7535, 260.416),
    ]
    points.append((63.6025, 256.99))
    xy = filtered(
        tmp_path, "G69X200\nG106 [0] X1 A0.2 B8\nG106 [1] X1 A0.2", points
    )
    assert xy[1] == pytest.approx([31.6265, 259.0456])
    assert xy[-2:] == pytest.approx(np.array(points[-2:]))
    assert len(xy) == 6
    assert filtered(
        tmp_path, "G69X200\nG106 [0] X1 A1 B8", points
    ) == pytest.approx(np.array(points))


def test_t23_feed_control(tmp_path):
    """T-23: changes up to Z keep the feed before, A is the lowest feed; the
    limits of the axes hold at corners.
    """
    slow = (
        math.asin(0.5 / 1.3) * 2
    )  # a turn that 1.3 m/min passes with a step of 1 m/min
    x, y = math.cos(slow), math.sin(slow)
    text = f"G60F1.6\nG69X200\nG66X1{{}}\nG1Y10\nDX{10 * y:.9f}DY{10 * x:.9f}\nDX{y:.9f}DY{x:.9f}\n"
    config = f"[isons]\nSGLAFC_X = {1300 * y:.6f}\n"
    kept, changed = (
        run(tmp_path, text.format(dead), config).moves["feed"] * 0.06
        for dead in ("Z0.3", "Z0.2")
    )
    assert kept == pytest.approx([1.3, 1.3, 1.3])
    assert changed == pytest.approx([1.3, 1.3, 1.6])
    floor = run(
        tmp_path,
        "G60F1\nG69X200\nG66X1A0.1\nG1X10\nY10\n",
        "[isons]\nSGLAFC_X = 10\n",
    ).moves
    assert floor["feed"] * 0.06 == pytest.approx(0.1)
    assert floor["end_speed"][0] * 0.06 == pytest.approx(0.01)


def test_filters_are_off_at_program_start_and_need_g69(tmp_path):
    """A warning says so."""
    out = run(tmp_path, path(N, "G74X1Y2.5"))
    assert out.xy == pytest.approx(N)
    assert "907042" in out.port.messages[0]


def test_mild_rounds_corners(tmp_path):
    """G49: the smaller MILD, the more; G49 0 suspends, G49 1 resumes, G49 alone ends."""
    text = "G60F1\nG63\n{}\nG1X10\nY10\n"
    kinds, ways = {}, {}
    for mild in (200, 100, 1000):
        rows = run(
            tmp_path, text.format("G49 XY"), f"[isons]\nMILD_X = {mild}\n"
        ).moves
        kinds[mild] = (rows["type"] != LINEAR).sum()
        ways[mild] = rows["length"].sum()
    assert kinds == {200: 1, 100: 1, 1000: 0}
    assert ways[100] < ways[200]
    for words in ("G49 XY\nG49", "G49 XY\nG49 0"):
        assert all(
            run(tmp_path, text.format(words), "[isons]\nMILD_X = 200\n").moves[
                "type"
            ]
            == LINEAR
        )
    rows = run(
        tmp_path, text.format("G49 XY\nG49 0\nG49 1"), "[isons]\nMILD_X = 200\n"
    ).moves
    assert (rows["type"] != LINEAR).any()


CORNERS = "G60F1\nG63\n{}\nG1X10\nY10\nZ10\nX20\nY25\n"


@pytest.mark.parametrize(
    ("axes", "rounded"),
    [("XYZ", 4), ("X", 3), ("Y", 3), ("Z", 2), ("XY", 4), ("", 0)],
)
def test_mild_rounds_the_corners_of_its_axes_only(tmp_path, axes, rounded):
    """The corners are XY, YZ, ZX and XY again: one in which no named axis
    changes its direction stays exact.
    """
    config = "[isons]\nMILD_X = 200\nMILD_Y = 200\nMILD_Z = 200\n"
    rows = run(tmp_path, CORNERS.format(f"G49 {axes}"), config).moves
    curves = rows["type"] == POLYNOMIAL
    assert curves.sum() == rounded


def test_an_axis_without_mild_rounds_nothing(tmp_path):
    """G49 XZ with MILD_Z alone: the XY corner stays where it is."""
    text = "G60F1\nG63\nG49 XZ\nG1X10\nY10\nZ10\n"
    rows = run(tmp_path, text, "[isons]\nMILD_Z = 20\n").moves
    assert rows["end"][0][:2].tolist() == [10, 0]
    assert (rows["type"] == POLYNOMIAL).sum() == 1


@pytest.mark.parametrize(
    "text",
    [
        "G72X2",
        "G72X1Z8",
        "G73X4",
        "G106X1",
        "G106[9]X1",
        "G69",
        "G69X2.5",
        "G49 2",
    ],
)
def test_wrong_words(tmp_path, text):
    """Values out of range, with their place."""
    with pytest.raises(CncError) as caught:
        run(tmp_path, text + "\n")
    assert caught.value.place.line == 1


def test_the_tangential_axis_follows_the_filtered_path(tmp_path):
    """G69 names it: its blocks are filtered too, and it turns with the new
    path; without a name they end the run.
    """
    t = np.arange(60) * 0.15 / 8
    angle = np.degrees(t)
    points = np.column_stack([8 * np.sin(t), 8 - 8 * np.cos(t)]).round(4)
    body = "G1\n" + "".join(
        f"X{x}Y{y}A{a:.3f}\n"
        for (x, y), a in zip(points[1:], angle[1:], strict=True)
    )
    plain = run(tmp_path, "G60\nG69X200\nG72X1Y1\n" + body, programmed=True)
    assert len(plain.moves) == 59
    out = run(
        tmp_path, "G60\nG69X200 A\nG72X1Y1A0.3Z4\n" + body, programmed=True
    )
    assert 25 < len(out.moves) < 35
    assert out.ends[-1] == pytest.approx([*points[-1], 0, angle[-1]], abs=1e-3)
    heading = np.degrees(np.arctan2(out.ends[:, 0], 8 - out.ends[:, 1]))
    assert out.ends[:, 3] == pytest.approx(heading, abs=0.05)


def test_filters_leave_no_motion_without_length(tmp_path):
    """A run that comes back to the vertex kept last has no row for that; homing
    and probing are no run.
    """
    out = run(
        tmp_path,
        "G60\nG69X200\nG74X1Y1\nG1X5\nX5.2\nX5\nM8\nG1X9\n",
        programmed=True,
    )
    assert out.xy[:, 0].tolist() == [5, 9]
    config = "[probe]\nX = 9.5\n"
    out = run(
        tmp_path,
        "G60\nG69X200\nG74X1Y3\nG1X9\nX9.1\nG102X20\nG1X20\n",
        config,
        programmed=True,
    )
    assert out.xy[:, 0].tolist() == [9, 9.1, 9.5, 20]


@pytest.mark.parametrize(
    ("first", "second", "stops"),
    [
        ("G64", "G63", False),
        ("G63", "G64", True),
        ("G64", 'WRITE_PARMAC "SGLP" 100', True),
        ('WRITE_PARMAC "SGLP" 100', 'WRITE_PARMAC "SGLP" 1000', False),
        ("G75", "G64", True),
        ("G64", "G62", True),
    ],
)
def test_a_corner_where_the_mode_changes_is_judged(
    tmp_path, first, second, stops
):
    """By what is in force at the motion behind it; a change of mode does not hide the corner."""
    flags = run(tmp_path, f"G60\n{first}\nG1X10F1\n{second}\nY10\nY20\n").moves[
        "flags"
    ]
    if second == "G62":
        assert not flags.any()  # it stands anyway, by the wait
    else:
        assert [bool(flag & EXACT_STOP) for flag in flags] == [
            stops,
            False,
            False,
        ]


def test_g49_takes_a_number_or_axes(tmp_path):
    """Both together are refused; the depth of G69 has no bound but that of whole numbers."""
    with pytest.raises(CncError) as caught:
        run(tmp_path, "G49 0 X\n")
    assert caught.value.code == 900004
    assert (
        len(
            run(
                tmp_path,
                "G60G69X2000000\nG66X1Y2\nG1X1F1\nX2\n",
                programmed=True,
            ).moves
        )
        == 2
    )
