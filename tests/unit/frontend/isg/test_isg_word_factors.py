"""Mirror, #SCALE, inches and diameter programming act on every word that names
a place or a length of the contour, wherever it stands.
"""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core.errors import CncError
from support.programs import ended_program, motions_of, rows_of

TOOL = "[axes.X]\n[axes.Y]\n[axes.Z]\n[tools.1]\nradius_mm = 5.0\n"


def ends(folder, text: str, cell: str = "") -> np.ndarray:
    """(motions, 3) ends of the motions behind all stages, new corners included."""
    return motions_of(rows_of(ended_program(folder, text, cell)))["end"][:, :3]


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        ("G21", "X-20 Y5"),
        ("G22", "X20 Y-5"),
        ("G23", "X-20 Y-5"),
        ("#SCALE ON [X2 Y5]", "X10 Y1"),
        ("G51", "X40 Y5"),
        ("G70", f"X{20 / 25.4} Y{5 / 25.4}"),
        ("G51 G70 G22\n#SCALE ON [X2 Y5]", f"X{20 / 25.4} Y{-1 / 25.4}"),
    ],
)
@pytest.mark.parametrize(
    "rotation", ["G68 R{r} {words}", "#ROTATION ON [ANGLE={r} {words}]"]
)
def test_the_centre_of_a_rotation_is_a_place_like_any_other(
    tmp_path, factors, words, rotation
):
    """The axes do not move where the turned program goes to the named centre."""
    if rotation.startswith("#"):
        named = words.replace("X", "CENTER1=").replace("Y", "CENTER2=")
    else:
        named = words
    turn = rotation.format(r=30, words=named)
    text = f"G54 G00 X20 Y5\n{factors}\n{turn}\nG00 {words}"
    place = ends(tmp_path, text, "[zero_offsets.1]\nX=7.0\nY=3.0\n")
    assert place[-1] == pytest.approx([27, 8, 0])


def test_a_rotation_needs_both_axes_of_its_plane(tmp_path):
    """A lathe without Y has none in G17, and one in G18."""
    lathe = "[axes.X]\n[axes.Z]\n"
    turn = "#ROTATION ON [ANGLE=90 CENTER1=2]\nG00 X1"
    with pytest.raises(CncError) as caught:
        ends(tmp_path, turn, lathe)
    assert caught.value.code == 900016
    assert len(ends(tmp_path, f"G18\n{turn}", lathe)) == 1


@pytest.mark.parametrize(
    "factors", ["G21", "#SCALE ON [X2 Y5]", "G51", "G70", "G18 G70 G51"]
)
def test_programs_read_the_centre_as_they_write_it(tmp_path, factors):
    """V.G.ROT_CENTER1 and 2, when the centre was written under the same factors."""
    text = (
        f"{factors}\n#ROTATION ON [ANGLE=30 CENTER1=3 CENTER2=-2]\n"
        "P1=V.G.ROT_CENTER1 P2=V.G.ROT_CENTER2\n#ROTATION OFF\n"
        "G71 G52 G20\n#SCALE OFF\nG00 X[P1] Z[P2]"
    )
    assert ends(tmp_path, text)[-1] == pytest.approx([3, 0, -2])


@pytest.mark.parametrize(
    ("factors", "words", "corner"),
    [
        ("#SCALE ON [X2 Y5]", "X4.5 Y0.2", "X5\nY2"),
        ("G51", "X18 Y1", "X20\nY10"),
        ("G21", "X-9 Y1", "X-10\nY10"),
    ],
)
def test_the_interim_point_of_a_corner_is_a_place(
    tmp_path, factors, words, corner
):
    """#CONTOUR MODE [POS ..]: the curve passes the same place however it is written."""
    mode = "#CONTOUR MODE ON [POS PRE_DIST=2 POST_DIST=2 {}]\n"
    plain = ends(
        tmp_path, mode.format("X9 Y1") + "G01 F1000 X10\nY10\n#CONTOUR MODE OFF"
    )
    written = ends(
        tmp_path,
        f"{factors}\n{mode.format(words)}G01 F1000 {corner}\n#CONTOUR MODE OFF",
    )
    assert written == pytest.approx(plain)
    assert plain[1] == pytest.approx([9, 1, 0])


@pytest.mark.parametrize(
    "corner", ["#RND={}", "#CHR={}", "#CHF={}", "\nG301 I{}\n", "\nG302 I{}\n"]
)
def test_lengths_of_corners_are_scaled_with_their_contour(tmp_path, corner):
    """#SCALE by 3 gives the path of a contour three times as large."""
    contour = "G01 F1000 X{} {}\nY{}"
    scaled = ends(
        tmp_path,
        "#SCALE ON [X3 Y3]\n" + contour.format(10, corner.format(2), 10),
    )
    large = ends(tmp_path, contour.format(30, corner.format(6), 30))
    assert scaled == pytest.approx(large)
    assert len(scaled) == 3


@pytest.mark.parametrize("corner", ["#RND=2", "#CHR=2", "\nG302 I2\n"])
def test_corners_need_equal_factors(tmp_path, corner):
    """A rounding would not be round: refused with its place, as circles are."""
    with pytest.raises(CncError) as caught:
        ends(tmp_path, f"#SCALE ON [X3]\nG01 F1000 X10 {corner}\nY10")
    assert caught.value.code == 910113


def pocket(factors: str, scale: float) -> str:
    """A pocket of 40 mm by 24 mm, written ``scale`` times smaller."""
    values = {4: 5, 5: 2.5, 6: 4 / scale, 72: 40 / scale, 73: 24 / scale}
    words = " ".join(f"@P{number}={value}" for number, value in values.items())
    return (
        f"T1 D1 F600 G00 X0 Y0 Z30\n{factors}\n"
        f"L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=20 @P3=2 {words}]"
    )


def test_a_scaled_pocket_has_room_for_the_tool(tmp_path):
    """The tool keeps its radius: the pocket of half the numbers is the same pocket."""
    plain = ends(tmp_path, pocket("", 1), TOOL)
    scaled = ends(tmp_path, pocket("#SCALE ON [X2 Y2]", 2), TOOL)
    for extreme in (np.min, np.max):
        assert extreme(scaled, axis=0) == pytest.approx(extreme(plain, axis=0))


def test_a_pocket_needs_equal_factors(tmp_path):
    """The tool's circle would be none in programmed coordinates."""
    with pytest.raises(CncError) as caught:
        ends(tmp_path, pocket("#SCALE ON [X2]", 2), TOOL)
    assert caught.value.code == 910113


def test_a_pocket_begins_where_the_axis_stands(tmp_path):
    """Under G51 words are diameters: the middle of the pocket is no diameter."""
    plain, diameter = (
        ends(tmp_path, pocket(before, 1).replace("X0 Y0", x), TOOL)
        for before, x in (("", "X10 Y4"), ("G51", "X10 Y4"))
    )
    assert diameter == pytest.approx(plain)


def test_a_cycle_of_a_pattern_runs_as_if_called(tmp_path):
    """Under G51 its own words are diameters, too."""
    cycle = "%L U\nG90 G01 X20 Y0 F100\nM17\n%MAIN\n"
    pattern = "#PATTERN BEGIN [ID=1]\n#AT [0,0,0]\n#PATTERN END\nG51 F100\n"
    called, placed = (
        ends(tmp_path, f"{cycle}{pattern}LL CYCLE [NAME=U{keys}]")
        for keys in ("", " PATTERN_ID=1 PATTERN_RETRACT=10")
    )
    assert called[-1, 0] == placed[-1, 0] == 10


@pytest.mark.parametrize(
    ("factors", "vector", "points"),
    [
        ("G21", "X-1 Y0.5", "X-10 Y5\nX-20 Y0\nX-30 Y5"),
        ("G22", "X1 Y-0.5", "X10 Y-5\nX20 Y0\nX30 Y-5"),
        ("#SCALE ON [X2 Y5]", "X0.5 Y0.1", "X5 Y1\nX10 Y0\nX15 Y1"),
        ("G51", "X2 Y0.5", "X20 Y5\nX40 Y0\nX60 Y5"),
    ],
)
def test_directions_of_splines_are_programmed_as_points_are(
    tmp_path, factors, vector, points
):
    """#AKIMA STARTVECTOR and ENDVECTOR: the same curve however it is written."""

    def lengths(before: str, direction: str, path: str) -> np.ndarray:
        text = (
            f"{before}\n#AKIMA TRANS [START=USER END=USER]\n"
            f"#AKIMA STARTVECTOR {direction}\n#AKIMA ENDVECTOR {direction}\n"
            f"#SPLINE ON\nG01 F600 {path}\n#SPLINE OFF"
        )
        return motions_of(rows_of(ended_program(tmp_path, text)))["length"]

    plain = lengths("", "X1 Y0.5", "X10 Y5\nX20 Y0\nX30 Y5")
    assert lengths(factors, vector, points) == pytest.approx(plain)


@pytest.mark.parametrize(
    "command",
    [
        "#CONTOUR MODE ON [DEV PATH_DEV={}]",
        "#CONTOUR MODE ON [DIST PRE_DIST={} POST_DIST={}]",
        "#CONTOUR MODE ON [DIST_SOFT PATH_DIST={}]",
        "#HSC ON [BSPLINE PATH_DEV={}]",
        "#HSC ON [OPMODE=1 CONTERROR={}]",
        "#FILTER ON [AX_DEV={}]",
    ],
)
def test_lengths_of_contour_modes_follow_the_unit(tmp_path, command):
    """Under G70 they are in inch, as V.G.WZ_AKT.R reads."""
    off = "#HSC OFF" if "HSC" in command else "#CONTOUR MODE OFF"
    off = "#FILTER OFF" if "FILTER" in command else off

    def lengths(unit: str, mm: float) -> np.ndarray:
        text = (
            f"{unit}\n{command.replace('{}', f'{0.5 / mm:.12f}')}\n"
            f"G01 X{50.8 / mm} F{2540 / mm}\nX{76.2 / mm} Y{25.4 / mm}\n{off}"
        )
        return motions_of(rows_of(ended_program(tmp_path, text)))["length"]

    assert lengths("G70", 25.4) == pytest.approx(lengths("", 1.0))
    assert len(lengths("", 1.0)) > 2
