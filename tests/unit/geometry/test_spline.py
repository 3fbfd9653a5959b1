"""#SPLINE: Akima curves against scipy, B-splines against scipy, ends, tangents, errors."""

from functools import partial

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.interpolate import Akima1DInterpolator, BSpline

from cnc_core.blocks import DWELL, LINEAR, POLYNOMIAL
from cnc_core.blocks.pool import coefficients, joined
from cnc_core.planning import plan_program
from support.programs import ended_program

CELL = "[axes.X]\n[axes.Y]\n[axes.Z]\n[tools.1]\nradius_mm = 1.0\n"
program_of = partial(ended_program, cell=CELL)


def curves(batch):
    """Per polynomial row: (row, one Polynomial per axis)."""
    rows = batch.rows[batch.rows["type"] == POLYNOMIAL]
    return [
        (row, [Polynomial(c) for c in coef])
        for row, coef in zip(
            rows, coefficients(rows, batch.pool, 3), strict=True
        )
    ]


def lines(points):
    return "\n".join(f"X{x:.6f} Y{y:.6f} Z{z:.6f}" for x, y, z in points)


@pytest.mark.parametrize("n", [3, 4, 5, 6, 60])
def test_akima_agrees_with_scipy(tmp_path, n):
    """Values along the whole curve; the stage sees it in batches and holds three segments."""
    points = np.cumsum(
        np.random.default_rng(n).normal(0, 5, (n, 3)), axis=0
    ).round(6)
    program = program_of(
        tmp_path,
        f"G01 F1000 {lines(points[:1])}\n#SPLINE ON\n{lines(points[1:])}\n#SPLINE OFF\nX0",
    )
    found, item = [], program.read(4)
    while item is not None:
        found.append(item)
        item = program.read(4)
    batch = joined(found)
    t = np.concatenate(
        [[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    )
    oracle = Akima1DInterpolator(t, points)
    pieces = curves(batch)
    assert len(pieces) == n - 1
    for i, (row, curve) in enumerate(pieces):
        w = np.linspace(0, row["angle"], 20)
        assert (
            pytest.approx(oracle(t[i] + w), abs=1e-8)
            == np.array([c(w) for c in curve]).T
        )
        fine = np.array(
            [c(np.linspace(0, row["angle"], 20001)) for c in curve]
        ).T
        assert row["length"] == pytest.approx(
            np.linalg.norm(np.diff(fine, axis=0), axis=1).sum(), rel=1e-6
        )


def test_bspline_agrees_with_scipy(tmp_path):
    """Control points are the programmed ones, the outer ones mirrored so that
    the curve meets them.
    """
    points = np.cumsum(
        np.random.default_rng(1).normal(0, 5, (9, 3)), axis=0
    ).round(6)
    text = (
        f"#SPLINE TYPE BSPLINE\nG01 F1000 {lines(points[:1])}\nG151\n"
        f"{lines(points[1:])}\nG150\nX0"
    )
    batch = joined(list(program_of(tmp_path, text).batches()))
    control = np.vstack(
        [2 * points[0] - points[1], points, 2 * points[-1] - points[-2]]
    )
    oracle = BSpline(np.arange(-3, len(control) + 1), control, 3)
    for i, (_, curve) in enumerate(curves(batch)):
        w = np.linspace(0, 1, 9)
        assert (
            pytest.approx(oracle(i + w), abs=1e-9)
            == np.array([c(w) for c in curve]).T
        )
    moving = batch.rows[batch.rows["type"] == POLYNOMIAL]
    assert moving["end"][-1, :3] == pytest.approx(points[-1])


def ends(tmp_path, trans, text="G02 X10 Y10 I0 J10"):
    """Unit directions in which a spline between a block and a line up begins and ends."""
    program = program_of(
        tmp_path,
        f"{trans}\nG01 F1000 X0 Y0\n{text}\nG151 G01 X20 Y10\nX30 Y0\nX40 Y10\nG150 Y30",
    )
    pieces = curves(joined(list(program.batches())))
    first = np.array([c.deriv()(0) for c in pieces[0][1]])
    last = np.array([c.deriv()(pieces[-1][0]["angle"]) for c in pieces[-1][1]])
    return first / np.linalg.norm(first), last / np.linalg.norm(last)


def test_tangential_ends_take_the_direction_of_their_neighbours(tmp_path):
    """A circle before, a line behind the spline."""
    first, last = ends(
        tmp_path, "#AKIMA TRANS [START=TANGENTIAL END=TANGENTIAL]"
    )
    assert first == pytest.approx(
        [0, -1, 0], abs=1e-9
    )  # clockwise, three quarters of a turn
    assert last == pytest.approx([0, 1, 0], abs=1e-9)
    assert ends(tmp_path, "#SET ASPLINE MODE[2,2]")[1] == pytest.approx(
        [0, 1, 0], abs=1e-9
    )


def test_programmed_ends(tmp_path):
    """The manual's example: slope 1 at the start; axes without a component are found."""
    text = (
        "#AKIMA TRANS [START=USER END=USER]\n"
        "#AKIMA STARTVECTOR X1 Y1 Z0\n#AKIMA ENDVECTOR X0 Y-2"
    )
    first, last = ends(tmp_path, text, "X10 Y10")
    assert first == pytest.approx([0.5**0.5, 0.5**0.5, 0])
    assert last == pytest.approx([0, -1, 0])


def test_rows_between_keep_their_places(tmp_path):
    """A dwell inside a spline stands between the same blocks."""
    program = program_of(
        tmp_path,
        "G01 F1000\n#SPLINE ON\nX10\nY10\nG04 1\nX20\nY0\nX30\n#SPLINE OFF\nX50",
    )
    batch = joined(list(program.batches()))
    assert batch.rows["type"].tolist()[:7] == [
        POLYNOMIAL,
        POLYNOMIAL,
        DWELL,
        POLYNOMIAL,
        POLYNOMIAL,
        POLYNOMIAL,
        LINEAR,
    ]


@pytest.mark.parametrize("wait_behind", range(1, 5))
def test_a_wait_leaves_what_follows_it_a_spline(tmp_path, wait_behind):
    """#FLUSH WAIT ahead of any point, the last one, too: the curve goes on with
    its tangent, so one point is enough.
    """
    points = [(10, 5, 0), (20, 2, 0), (30, 3, 0), (40, -5, 0)]
    moves = lines(points).split("\n")
    moves.insert(wait_behind, "#FLUSH WAIT")
    text = "\n".join(["G01 F3000", "#SPLINE ON", *moves, "#SPLINE OFF"])
    program = program_of(tmp_path, text)
    rows = joined(list(program.batches())).rows
    assert rows["type"][rows["type"] <= POLYNOMIAL].tolist() == [POLYNOMIAL] * 4
    assert rows["end"][rows["type"] == POLYNOMIAL, 0].tolist() == [
        x for x, *_ in points
    ]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("#SPLINE ON\nG01 F100 X1\n#SPLINE OFF\nX5", 911001),
        ("#SPLINE ON\nG01 F100 X1\nG02 X2 I0.5\nX5\n#SPLINE OFF", 911002),
        ("G41 D1\n#SPLINE ON", 911003),
        ("#SPLINE ON\nG41 D1 G01 X1 F100", 911003),
        ("#SPLINE TYPE NURBS", 900010),
        ("#AKIMA STARTVECTOR X0", 900012),
    ],
)
def test_errors(tmp_path, text, code):
    """By number."""
    program = program_of(tmp_path, text, collect=True)
    list(program.batches())
    assert code in [e.code for e in program.errors]


def test_a_spline_is_driven_inside_the_limits(tmp_path):
    """No stop between its pieces, acceleration as allowed."""
    points = [(10 * i, 5 * (i % 3), 0) for i in range(1, 12)]
    result = plan_program(
        program_of(
            tmp_path, f"G01 F6000\n#SPLINE ON\n{lines(points)}\n#SPLINE OFF"
        )
    )
    assert result.max_ratio["acceleration"] <= 1.0
    assert result.max_ratio["velocity"] <= 1.0


@pytest.mark.parametrize("kind", ["AKIMA", "BSPLINE"])
def test_a_spline_that_turns_on_its_line_has_its_exact_length(tmp_path, kind):
    """It has corners where it turns; its length is the way of the axis between
    them, by scipy's curve.
    """
    xs = np.array([0.0, 3.7, 9.3, 4.1, 11.9, 15.0])
    points = "\n".join(f"X{x}" for x in xs[1:])
    program = program_of(
        tmp_path,
        f"G01 F1000 X0\n#SPLINE TYPE {kind}\n#SPLINE ON\n{points}\n#SPLINE OFF",
    )
    rows = joined(list(program.batches())).rows
    rows = rows[rows["type"] <= POLYNOMIAL]
    if kind == "AKIMA":
        at = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(xs)))])
        oracle, end = Akima1DInterpolator(at, xs), at[-1]
    else:
        control = [2 * xs[0] - xs[1], *xs, 2 * xs[-1] - xs[-2]]
        oracle = BSpline(np.arange(-3, len(control) + 1), control, 3)
        end = len(xs) - 1.0
    x = oracle(np.linspace(0.0, end, 2_000_001))
    way = np.abs(np.diff(x)).sum()
    assert rows["length"].sum() == pytest.approx(way, abs=1e-8)
    corners = np.diff(np.sign(np.diff(rows["end"][:, 0])))
    assert np.count_nonzero(corners) == 2
