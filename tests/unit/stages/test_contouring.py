"""Contouring (G61, G261, #CONTOUR MODE): curves against the programmed contour,
by numpy and shapely alone.
"""

import json

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from shapely.geometry import LineString, Point

from cnc_core.blocks import CIRCULAR, LINEAR, POLYNOMIAL, BlockBatch, M
from cnc_core.blocks.pool import coefficients, joined
from cnc_core.config import load_config
from cnc_core.engine import Engine
from cnc_core.errors import Place
from cnc_core.geometry.stages.contouring import Contouring, ContourMachine
from cnc_core.planning import plan_program
from cnc_core.program import Program

pytestmark = pytest.mark.sanitize("stages/contouring")

ON = "#CONTOUR MODE ON [DEV PATH_DEV=0.1]\n"


def prepared(tmp_path, text, cell_text="", **options):
    """All rows of a program, and the program."""
    (tmp_path / "cell.toml").write_text(cell_text)
    (tmp_path / "a.nc").write_text(text)
    program = Program(
        tmp_path / "a.nc", load_config(tmp_path / "cell.toml"), **options
    )
    return joined(list(program.batches())), program


def curve_points(batch, axes, n=200):
    """(polynomials, n, axes) points of the polynomial rows."""
    rows = batch.rows[batch.rows["type"] == POLYNOMIAL]
    coef = coefficients(rows, batch.pool, axes)
    w = np.linspace(0, 1, n)
    return np.stack(
        [
            [Polynomial(c)(w * row["angle"]) for c in one]
            for one, row in zip(coef, rows, strict=True)
        ]
    ).swapaxes(1, 2)


def kinds(batch):
    return batch.rows["type"].tolist()


def motions(batch):
    return batch.rows[batch.rows["type"] <= POLYNOMIAL]


def test_a_corner_between_long_lines_uses_the_deviation_exactly(tmp_path):
    """Two polynomials of degree 4 under the first block's number; the corner is
    PATH_DEV from where they meet.
    """
    batch, program = prepared(
        tmp_path, f"{ON}N10 G01 X10 F1000\nN20 Y10\nN30 X20\nM30\n"
    )
    rows = motions(batch)
    assert rows["type"].tolist() == [
        LINEAR,
        POLYNOMIAL,
        POLYNOMIAL,
        LINEAR,
        POLYNOMIAL,
        POLYNOMIAL,
        LINEAR,
    ]
    assert rows["n"].tolist() == [10, 10, 10, 20, 20, 20, 30]
    assert set(rows["degree"][rows["type"] == POLYNOMIAL]) == {4}
    points = curve_points(batch, 3)
    assert np.hypot(*(points[0, -1, :2] - [10, 0])) == pytest.approx(
        0.1, abs=2e-5
    )
    contour = LineString([(0, 0), (10, 0), (10, 10), (20, 10)])
    assert (
        max(contour.distance(Point(p)) for p in points[..., :2].reshape(-1, 2))
        < 0.1
    )
    assert program.contouring.report.deviation == pytest.approx(0.1, abs=2e-5)
    d = 10 - rows["end"][0, 0]
    assert rows["end"][2, :2] == pytest.approx([10, d])


def test_ends_continue_direction_and_curvature(tmp_path):
    """Between a line and an arc: no curvature at the line, that of the arc at
    the other end; C3 in the middle.
    """
    text = f"{ON}G01 X10 F1000\nG02 X20 Y10 I10 J0\nM30\n"
    batch, _ = prepared(tmp_path, text)
    rows = motions(batch)
    assert rows["type"].tolist() == [LINEAR, POLYNOMIAL, POLYNOMIAL, CIRCULAR]
    coef = coefficients(rows[1:3], batch.pool, 3)
    first, second = ([Polynomial(c) for c in one] for one in coef)

    def at(curve, t):
        d1, d2 = (np.array([p.deriv(k)(t) for p in curve[:2]]) for k in (1, 2))
        return d1 / np.hypot(*d1), (d1[0] * d2[1] - d1[1] * d2[0]) / np.hypot(
            *d1
        ) ** 3

    direction, curvature = at(first, 0.0)
    assert direction == pytest.approx([1, 0], abs=1e-12)
    assert curvature == pytest.approx(0, abs=1e-12)
    direction, curvature = at(second, 1.0)
    begin = rows["end"][2, :2] - [20, 0]
    assert np.hypot(*begin) == pytest.approx(10)
    assert direction == pytest.approx([begin[1] / 10, -begin[0] / 10], abs=1e-9)
    assert curvature == pytest.approx(-0.1, abs=1e-9)
    for k in range(4):
        assert [p.deriv(k)(1.0) for p in first] == pytest.approx(
            [p.deriv(k)(0.0) for p in second], abs=1e-10
        )
    assert rows["angle"][3] == pytest.approx(rows["length"][3] / -10)


def test_lengths_are_arc_lengths(tmp_path):
    """`length` of the curve's rows against a fine polyline."""
    batch, _ = prepared(tmp_path, f"{ON}G01 X10 F1000\nX20 Y10 Z3\nM30\n")
    points = curve_points(batch, 3, n=20001)
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    assert motions(batch)["length"][1:3] == pytest.approx(lengths, rel=1e-8)


@pytest.mark.parametrize("seed", range(6))
def test_random_polylines_stay_within_the_deviation_and_are_continuous(
    tmp_path, seed
):
    """Every point of the path within PATH_DEV of the contour and the other way round; no gaps."""
    rng = np.random.default_rng(seed)
    corners = np.cumsum(rng.normal(0, 3, (40, 2)), axis=0)
    deviation = float(rng.choice([0.02, 0.2, 2.0]))
    text = f"#CONTOUR MODE ON [DEV PATH_DEV={deviation}]\nF5000\n" + "".join(
        f"G01 X{x:.4f} Y{y:.4f}\n" for x, y in corners
    )
    batch, _ = prepared(tmp_path, text + "M30\n")
    contour = LineString([(0, 0), *corners.round(4)])
    path, at = [], np.zeros(2)
    coef = iter(
        coefficients(
            motions(batch)[motions(batch)["type"] == POLYNOMIAL], batch.pool, 3
        )
    )
    for row in motions(batch):
        if row["type"] == POLYNOMIAL:
            points = np.array(
                [Polynomial(c)(np.linspace(0, 1, 40)) for c in next(coef)[:2]]
            ).T
        else:
            points = np.array([at, row["end"][:2]])
        assert points[0] == pytest.approx(at, abs=1e-7)
        at = row["end"][:2]
        assert points[-1] == pytest.approx(at, abs=1e-9)
        path += points.tolist()
    assert max(contour.distance(Point(p)) for p in path) <= deviation + 1e-9
    curve = LineString(path)
    assert (
        max(curve.distance(Point(p)) for p in corners.round(4))
        <= deviation + 1e-6
    )
    assert (motions(batch)["type"] == POLYNOMIAL).sum() > 60


def test_the_corner_distance_is_at_most_half_of_a_block(tmp_path):
    """A block whose both corners take half of it gives no row; REMAIN_PART keeps the rest."""
    program = "G01 X10 F1000\nY1\nX20\nM30\n"
    batch, _ = prepared(
        tmp_path, "#CONTOUR MODE ON [DEV PATH_DEV=5]\n" + program
    )
    assert motions(batch)["type"].tolist() == [
        LINEAR,
        *[POLYNOMIAL] * 4,
        LINEAR,
    ]
    assert motions(batch)["end"][2, :2] == pytest.approx([10, 0.5])
    batch, _ = prepared(
        tmp_path, "#CONTOUR MODE ON [DEV PATH_DEV=5 REMAIN_PART=20]\n" + program
    )
    assert motions(batch)["type"].tolist() == [
        LINEAR,
        *[POLYNOMIAL] * 2,
        LINEAR,
        *[POLYNOMIAL] * 2,
        LINEAR,
    ]
    assert motions(batch)["length"][3] == pytest.approx(0.2)


def test_distances_of_dist_are_limited_together_if_they_are_equal(tmp_path):
    """Different ones each by itself."""
    program = "G01 X10 F1000\nY1\nM30\n"
    batch, _ = prepared(
        tmp_path, "#CONTOUR MODE ON [DIST PRE_DIST=2 POST_DIST=2]\n" + program
    )
    assert motions(batch)["end"][[0, 2], :2] == pytest.approx(
        np.array([[9.5, 0], [10, 0.5]])
    )
    batch, _ = prepared(
        tmp_path, "#CONTOUR MODE ON [DIST PRE_DIST=2 POST_DIST=3]\n" + program
    )
    assert motions(batch)["end"][[0, 2], :2] == pytest.approx(
        np.array([[8.0, 0], [10, 0.5]])
    )


def test_interim_point(tmp_path):
    """POS: the halves meet in the point; a missing coordinate is the corner's."""
    mode = "#CONTOUR MODE ON [POS PRE_DIST=2 POST_DIST=2 X9 Y1]\n"
    batch, _ = prepared(tmp_path, mode + "G01 X10 F1000\nY10\nM30\n")
    assert motions(batch)["end"][1, :3] == pytest.approx([9, 1, 0])
    points = curve_points(batch, 3)
    assert points[0, -1] == pytest.approx([9, 1, 0])


def test_soft_corners_grow_with_the_feed(tmp_path):
    """DIST_SOFT: at low feed a small curve does; PATH_DIST bounds it, -1 does not.
    Its size grows with the square of the feed by the acceleration, at low feeds
    with the power 3/2 by the jerk.
    """

    def distance(keys, feed):
        batch, _ = prepared(
            tmp_path,
            f"#CONTOUR MODE ON [DIST_SOFT {keys}]\nG01 X100 F{feed}\nY100\nM30\n",
        )
        return 100 - motions(batch)["end"][0, 0]

    assert distance("PATH_DIST=1", 18000) == pytest.approx(1)
    small, free = distance("PATH_DIST=1", 600), distance("PATH_DIST=-1", 6000)
    assert 5 < free <= 50
    assert distance("PATH_DIST=1", 150) == pytest.approx(small / 8, rel=0.02)
    assert small < 0.7
    assert distance("PATH_DIST=-1", 5000) == pytest.approx(
        free * 25 / 36, rel=0.02
    )


def test_blocks_too_short_warn_once_and_stay_corners(tmp_path):
    """120216; RELEVANT_PATH passes over them."""
    program = "N1 G01 X10 F1000\nN2 Y0.01\nN3 X20\nN4 Y10\nM30\n"
    batch, found = prepared(tmp_path, ON + program)
    assert kinds(batch)[:3] == [LINEAR, LINEAR, LINEAR]
    assert sorted(w.code for w in found.reader.warnings) == [120206, 120216]
    batch, found = prepared(
        tmp_path,
        "#CONTOUR MODE ON [DEV PATH_DEV=0.1 RELEVANT_PATH=0.1]\n"
        + program
        + "G260\n",
    )
    assert motions(batch)["n"].tolist() == [1, 1, 1, 3, 3, 3, 4]
    assert found.contouring.report.skipped == 1
    assert found.contouring.report.deviation <= 0.1


def test_g61_holds_for_its_block(tmp_path):
    """The manual's three ways to say the same give the same rows."""
    points = [
        (20, 100),
        (40, 100),
        (60, 20),
        (80, 20),
        (100, 100),
        (120, 100),
        (140, 20),
    ]
    blocks = [f"X{x} Y{y}" for x, y in points]
    modal = "\n".join(
        [
            "G261 " * (i == 1) + "G260 " * (i == 5) + b
            for i, b in enumerate(blocks)
        ]
    )
    alone = "\n".join(
        [
            "G261\n" * (i == 1) + "G260\n" * (i == 5) + b
            for i, b in enumerate(blocks)
        ]
    )
    single = "\n".join(
        ["G61 " * (1 <= i <= 4) + b for i, b in enumerate(blocks)]
    )
    rows = [
        motions(prepared(tmp_path, f"G01 F1000\n{t}\nM30\n")[0])
        for t in (modal, alone, single)
    ]
    for other in rows[1:]:
        for name in ("type", "end", "length"):
            assert np.array_equal(rows[0][name], other[name])
    assert (rows[0]["type"] == POLYNOMIAL).sum() == 8


@pytest.mark.parametrize(
    ("action", "place"),
    [("PRE_ACTION", 1), ("INTER_ACTION", 2), ("POST_ACTION", 3)],
)
def test_functions_stand_where_the_mode_wants_them(tmp_path, action, place):
    """M functions that do not wait; those that wait keep their corner."""
    text = f"#CONTOUR MODE ON [DEV PATH_DEV=0.1 {action}]\nG01 X10 F1000\nM{{}} Y10\nM30\n"
    cell = '[channel]\nm_synch = {"80" = "MOS", "81" = "MVS_SVS", "82" = "MVS_SNS"}\n'
    batch, _ = prepared(tmp_path, text.format(80), cell)
    assert kinds(batch).index(M) == place
    batch, _ = prepared(tmp_path, text.format(81), cell)
    assert kinds(batch)[:3] == [LINEAR, M, LINEAR]
    batch, _ = prepared(
        tmp_path, text.format(82).replace("M30", "X0\nM30"), cell
    )
    assert (
        kinds(batch).count(POLYNOMIAL) == 2
    )  # only ahead of the block that ends with a wait
    assert kinds(batch)[:5] == [
        LINEAR,
        POLYNOMIAL,
        POLYNOMIAL,
        M,
        LINEAR,
    ]  # it belongs to that block


@pytest.mark.parametrize(
    "between", ["#FLUSH", "#FLUSH CONTINUE", "G04 1", "G60 G01 X10.5", "M00"]
)
def test_what_stops_keeps_the_corner(tmp_path, between):
    """The path is where the program says when something takes effect there."""
    batch, _ = prepared(
        tmp_path, f"{ON}G01 X10 F1000\n{between}\nG01 Y10\nG260\nM30\n"
    )
    assert POLYNOMIAL not in kinds(batch)


def test_other_axes_keep_their_tolerance(tmp_path):
    """TRACK_DEV bounds what a rotary axis is off at the corner."""
    cell = "[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.C]\nkind = 'rotary'\n"
    text = "#CONTOUR MODE ON [DEV PATH_DEV=5 TRACK_DEV={}]\nG01 X10 C90 F1000\nY10 C0\nM30\n"
    free, _ = prepared(tmp_path, text.format(0), cell)
    bound, _ = prepared(tmp_path, text.format(2), cell)
    off = [90 - motions(b)["end"][1, 3] for b in (free, bound)]
    assert off[0] > 10
    assert off[1] == pytest.approx(2, abs=1e-3)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("#CONTOUR MODE [DEV PATH_DEV=0]", 120129),
        ("#CONTOUR MODE [DIST PRE_DIST=0]", 120131),
        ("#CONTOUR MODE [DIST PATH_DEV=1]", 120207),
        ("#CONTOUR MODE [DEV DIST]", 120207),
        ("#CONTOUR MODE [DEV PATH_DEV=1 X10]", 120207),
        ("#CONTOUR MODE ON\n#CONTOUR MODE [DIST_SOFT]", 120698),
        ("#HSC ON\nG61 G01 X1 F100", 120433),
        ("G261\n#HSC ON", 120433),
        ("#HSC ON\nG95 F1", 120433),
        ("#HSC ON\n#HSC [BSPLINE PATH_DEV=0.1]", 120433),
        ("#CONTOUR MODE", 900010),
        ("#CONTOUR MODE [DEV PATH_DEV]", 900004),
        ("#CONTOUR MODE [DEV REMAIN_PART=101]", 900012),
    ],
)
def test_wrong_settings_are_refused(tmp_path, text, code):
    """By number, at their place."""
    _, program = prepared(tmp_path, text + "\n", collect=True)
    assert [e.code for e in program.errors] == [code]


def test_the_look_ahead_sees_shortened_blocks_and_polynomials(tmp_path):
    """The log's entries: type 6 with the number of the block before the corner, lengths add up."""
    text = (
        f"{ON}#CONTOUR LOOKAHEAD LOG ON\nN10 G01 X10 F1000\nN20 Y10\n"
        f"N30 X20\nG260\n#CONTOUR LOOKAHEAD LOG OFF\nM30\n"
    )
    batch, program = prepared(tmp_path, text)
    lengths = motions(batch)["length"]
    assert lengths.sum() == pytest.approx(
        30
        - 4 * (10 - motions(batch)["end"][0, 0])
        + lengths[[1, 2, 4, 5]].sum()
    )
    engine = Engine(program.cell)
    try:
        assert engine.push(batch, 0) == len(batch)
    finally:
        engine.close()


def test_the_planner_drives_rounded_corners_faster_and_inside_the_limits(
    tmp_path,
):
    """A zigzag with rounded corners is faster than the exact one, deviation as allowed."""
    zigzag = "".join(
        f"G01 X{10 * i} Y{10 * (i % 2)} F12000\n" for i in range(1, 10)
    )

    def plan(head):
        (tmp_path / "b.nc").write_text(head + zigzag + "G260\nM30\n")
        return plan_program(Program(tmp_path / "b.nc", load_config(None)))

    rounded, exact = plan("#CONTOUR MODE ON [DEV PATH_DEV=0.5]\n"), plan("")
    assert rounded.motion_time_s < exact.motion_time_s
    assert rounded.path_deviation_mm == pytest.approx(0.5, abs=1e-3)
    assert rounded.max_ratio["acceleration"] <= 1.0
    assert rounded.max_ratio["feed"] <= 1.0 + 1e-9


def test_empty_batches_and_resync_do_no_harm():
    """The stage as the pipeline uses it."""
    stage = Contouring(
        np.zeros(3),
        ContourMachine((0, 1, 2), 3000, 300, {}),
        lambda file, line: Place(),
        lambda w: None,
    )
    assert len(stage.push(BlockBatch.empty())) == 0
    stage.resync(np.ones(3))
    assert len(stage.drain()) == 0
    assert json.dumps(stage.report.corners) == "0"
