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
