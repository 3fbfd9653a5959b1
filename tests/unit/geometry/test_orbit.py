"""Die sinking: `length_min` on the contour that orbiting shrinks to, against
polygons of shapely.
"""

import numpy as np
import pytest
from shapely.geometry import MultiPoint, Polygon

from cnc_core.config import CellConfig
from cnc_core.errors import CncError
from cnc_core.program import Program

CELL = CellConfig(
    channel={
        "interpolator_function": "FCT_IPO_DEFAULT | FCT_EXTENSION_EQUIDIST"
    }
)


def motions_and_errors(tmp_path, text, cell=CELL, collect=False):
    """Motions of a program, and its errors."""
    (tmp_path / "p.nc").write_text(text)
    program = Program(tmp_path / "p.nc", cell, collect=collect)
    rows = [
        row
        for batch in program.batches()
        for row in batch.rows
        if row["type"] <= 3
    ]
    program.reader.close()
    return rows, program.errors


def contour(points, loop=True, radii="MAX_SCALE=2 MAX_EQUID=5"):
    """A program that runs around the points."""
    lines = [
        f"G00 X{points[0][0]:.9f} Y{points[0][1]:.9f}",
        f"#TRACK CHAN ON [EXTEND=1 {radii}]",
    ]
    lines += ["#RT WHILE"] * loop + ["G01 F1000"]
    lines += [f"X{x:.9f} Y{y:.9f}" for x, y in [*points[1:], points[0]]]
    return "\n".join(
        [
            *lines,
            *["#RT ENDWHILE"] * loop,
            "#TRACK CHAN OFF",
            "G01 X99",
            "M30",
            "",
        ]
    )


def parallel(points, distance):
    """Length of the parallel of each side, to the inside; None if one of them vanishes."""
    inner = Polygon(points).buffer(
        -distance, join_style="mitre", mitre_limit=1e9
    )
    if inner.is_empty or len(inner.exterior.coords) != len(points) + 1:
        return None
    corners = np.array(inner.exterior.coords[:-1])
    sides = np.roll(corners, -1, axis=0) - corners
    out = []
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        along = (b - a) / np.linalg.norm(b - a)
        shares = np.abs(sides @ along) / np.linalg.norm(sides, axis=1)
        near = [
            np.linalg.norm(side)
            for side, s in zip(sides, shares, strict=True)
            if s > 1 - 1e-9
        ]
        out.append(near)
    return out


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("turn", [1, -1], ids=["ccw", "cw"])
def test_polygons_shrink_as_shapely_says(tmp_path, seed, turn):
    """Convex polygons around the origin, in a loop: every side's length on the
    parallel 3 mm inside.
    """
    rng = np.random.default_rng(seed)
    hull = MultiPoint(rng.normal(size=(9, 2)) * 60.0).convex_hull
    points = np.array(hull.exterior.coords[:-1]) - np.array(
        hull.centroid.coords[0]
    )
    points = (
        points[::-1]
        if Polygon(points).exterior.is_ccw != (turn > 0)
        else points
    )
    wanted = parallel(points, 3.0)
    if wanted is None:
        pytest.skip("a side vanishes")
    rows, _ = motions_and_errors(tmp_path, contour(points))
    sides = rows[1 : 1 + len(points)]
    for row, candidates in zip(sides, wanted, strict=True):
        assert min(abs(row["length_min"] - c) for c in candidates) < 1e-6
    assert rows[-1]["length_min"] == rows[-1]["length"]


def test_arcs_lose_the_distance_from_their_radius(tmp_path):
    """A rounded square: lines 1 mm shorter only at true corners, arcs of radius 4 - 3."""
    text = (
        "G00 X-10 Y-10\n#TRACK CHAN ON [EXTEND=2 MAX_SCALE=2 MAX_EQUID=5]"
        "\n#RT WHILE\nG01 X10 F1000\nY6\n"
    )
    text += "G03 X6 Y10 I-4 J0\nG01 X-10\nY-10\n#RT ENDWHILE\nM30\n"
    rows, _ = motions_and_errors(tmp_path, text)
    assert [row["length_min"] for row in rows[1:]] == pytest.approx(
        [14, 13, np.pi / 2, 13, 14]
    )


def test_the_ends_of_an_open_contour_are_not_cut(tmp_path):
    """Outside a loop the first and the last corner do not exist."""
    points = np.array(
        [(-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0)]
    )
    rows, _ = motions_and_errors(tmp_path, contour(points, loop=False))
    assert [row["length_min"] for row in rows[1:5]] == pytest.approx(
        [17, 14, 14, 17]
    )


@pytest.mark.parametrize(
    "radii",
    ["MAX_SCALE=5", "MAX_SCALE=5 MAX_EQUID=0", "MAX_SCALE=5 MAX_EQUID=5"],
)
def test_without_an_equidistant_range_nothing_shrinks(tmp_path, radii):
    """At R_MAX_SCALE the scaled contour is the programmed one."""
    points = np.array(
        [(-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0)]
    )
    rows, _ = motions_and_errors(tmp_path, contour(points, radii=radii))
    assert all(row["length_min"] == row["length"] for row in rows)


def test_long_contours_are_streamed(tmp_path):
    """A regular polygon of 5000 sides outside a loop: one motion is held back,
    all but the ends are cut alike.
    """
    turn = np.linspace(0, 2 * np.pi, 5000, endpoint=False)
    rows, _ = motions_and_errors(
        tmp_path,
        contour(
            100.0 * np.column_stack([np.cos(turn), np.sin(turn)]), loop=False
        ),
    )
    lengths = np.array([row["length_min"] for row in rows[2:-2]])
    assert np.ptp(lengths) < 1e-6
    assert lengths.mean() == pytest.approx(
        2 * 97.0 * np.sin(np.pi / 5000), rel=1e-3
    )


BAD = {
    50917: contour([(0, 0), (1, 0)], radii="MAX_SCALE=5 MAX_EQUID=3"),
    50918: contour([(-10, -10), (10, -10), (0, 0), (10, 10), (-10, 10)]),
    907122: contour([(-10, -2), (10, -2), (10, 2), (-10, 2)]),
    907121: "G00 X10\n#TRACK CHAN ON [EXTEND=1 MAX_SCALE=1 MAX_EQUID=2]\n"
    "G03 X0 Y10 I-10 J0 F9\nG01 X-10 Y-10\nM30\n",
    900012: "#TRACK CHAN ON [EXTEND=13 MAX_SCALE=1 MAX_EQUID=2]\nM30\n",
    900003: "#TRACK CHAN ON [DYN_CS=1]\nM30\n",
    900010: "#TRACK CHAN ON [EXTEND=1 MAX_EQUID=1]\nM30\n",
}


LINES = {50917: 2, 50918: 7, 907122: 6, 907121: 4}  # others: line 1


@pytest.mark.parametrize("code", BAD)
def test_what_cannot_be_orbited_is_refused_by_number(tmp_path, code):
    """Radii, concave contours, corners at arcs, elements that vanish: with the
    line that is wrong.
    """
    with pytest.raises(CncError) as caught:
        motions_and_errors(tmp_path, BAD[code])
    assert caught.value.code == code
    assert caught.value.place.line == LINES.get(code, 1)


def test_the_function_has_to_be_configured(tmp_path):
    """Without FCT_EXTENSION_EQUIDIST the command is refused."""
    _, errors = motions_and_errors(
        tmp_path, contour([(0, 0), (1, 0)]), CellConfig(), collect=True
    )
    assert [e.code for e in errors] == [907120]
