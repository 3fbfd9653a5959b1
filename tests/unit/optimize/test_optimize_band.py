"""The Path Optimizer never costs time and never leaves the path: sparse and
noisy surfaces, corners that nothing marks.

Oracles: the planner's own time of input and output; distances from dense
samples of the curve that the input drives; scipy's B-splines and numpy's dense
algebra.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import BSpline

from cnc_core.config import CellConfig
from cnc_core.optimize import optimize
from cnc_core.optimize.band import off_path
from cnc_core.optimize.least_squares import (
    Normal,
    derivative_rows,
    knot_vector,
    local_basis,
)
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.osai_programs import (
    CELL_5,
    SETUP_3,
    SETUP_5,
    changed,
    curves,
    value,
)

TOLL = 0.02


def setup_of(toll, edge="(EDG,0,0,G66,1)", mode="G66"):
    smt = f"(SMT,{toll},{toll},{toll / 10},1,1,1,{mode},{mode},{mode})\n"
    return (
        changed(
            SETUP_3, CRV=None, EDG=edge, THR=f"(THR,{toll},0.0001,0,0,{toll})"
        )
        + smt
    )


def wave(step, noise, seed=7, length=50):
    rng, x = np.random.default_rng(seed), np.arange(0, length, step)
    made = np.column_stack([x, 3 * np.sin(x / 9), 2 * np.cos(x / 4)])
    return np.round(made + rng.uniform(-noise, noise, made.shape), 5)


def raster(step, noise, seed=3, rows=2, length=15):
    rng, out = np.random.default_rng(seed), []
    for row in range(rows):
        x = np.arange(0, length + 0.01, step)[:: 1 if row % 2 == 0 else -1]
        out.append(
            np.column_stack(
                [
                    x,
                    np.full_like(x, 1.3 * row),
                    3 * np.sin(x / 8) + 1.5 * np.exp(-((x - 8) ** 2) / 15),
                ]
            )
        )
    made = np.vstack(out)
    return np.round(made + rng.uniform(-noise, noise, made.shape), 5)


def optimized(folder, points, setup, feed=6000):
    lines = [f"X{x:.5f}Y{y:.5f}Z{z:.5f}" for x, y, z in points]
    begin = "G0" + lines[0]
    (folder / "SETUP").write_text(setup)
    (folder / "in.osai").write_text(
        "\n".join(
            [
                begin,
                "(HSM,SETUP)",
                "G61",
                f"{lines[0]}F{feed}",
                *lines[1:],
                "G60",
                "",
            ]
        )
    )
    result = optimize(
        *(folder / name for name in ("in.osai", "SETUP", "out.osai")),
        CellConfig(),
    )
    before, after = (
        plan_program(Program(folder / n, CellConfig(), "osai"))
        for n in ("in.osai", "out.osai")
    )
    made = curves(
        Program(folder / "out.osai", CellConfig(), "osai", programmed=True)
    )
    return result, before.motion_time_s, after.motion_time_s, made


def samples(made, count=40):
    return np.vstack(
        [
            [value(c, s)[:3] for s in np.linspace(0, span, count)]
            for c, span, _ in made
        ]
    )


def distance(points, line):
    """(n,) distance of points from a polyline, without any search structure."""
    a, chord = line[:-1], np.diff(line, axis=0)
    square = np.maximum((chord * chord).sum(axis=1), 1e-300)
    out = []
    for p in points:
        t = np.clip(((p - a) * chord).sum(axis=1) / square, 0, 1)
        out.append(np.linalg.norm(p - a - t[:, None] * chord, axis=1).min())
    return np.array(out)


@pytest.mark.ci
@pytest.mark.parametrize("feed", [4000, 15000])
@pytest.mark.parametrize(
    ("step", "noise"),
    [(1.0, 0.0), (2.0, 0.0), (1.1, 0.006), (2.0, 0.006), (0.3, 0.006)],
)
def test_a_sparse_surface_is_not_slower(tmp_path, step, noise, feed):
    """Points 0.3 to 2 mm apart, with noise and without: less time than before,
    every point within Toll.
    """
    points = wave(step, noise)
    result, before, after, made = optimized(
        tmp_path, points, setup_of(TOLL), feed
    )
    assert after < before
    assert result.time_before_s == pytest.approx(before)
    assert result.time_after_s == pytest.approx(after)
    assert distance(points, samples(made)).max() <= TOLL
    assert result.max_path_deviation_mm <= TOLL


@pytest.mark.ci
@pytest.mark.parametrize("noise", [0.0, 0.006, 0.012])
def test_corners_that_nothing_marks_do_not_bulge(tmp_path, noise):
    """EDG off, rows with square ends: between the points too the output stays
    with the curve the input would drive.
    """
    points = raster(1.5 if noise == 0.0 else 0.4, noise)
    _, before, after, made = optimized(tmp_path, points, setup_of(TOLL))
    program = Program(
        tmp_path / "in.osai", CellConfig(), "osai", programmed=True
    )
    driven = samples(curves(program), 60)
    dense = samples(made)
    band = np.minimum(distance(dense, driven), distance(dense, points))
    assert band.max() <= TOLL
    assert distance(points, dense).max() <= TOLL
    assert after < before


@pytest.mark.ci
def test_noise_above_the_tolerance(tmp_path):
    """Scatter wider than the band: still every point within Toll, and in less
    time than through every point.
    """
    points = wave(0.5, 0.03)
    _, before, after, made = optimized(tmp_path, points, setup_of(0.01))
    assert distance(points, samples(made)).max() <= 0.01
    assert after < before


@pytest.mark.ci
def test_a_joint_takes_more_than_the_last_polynomial(tmp_path):
    """Racc reaches over short polynomials; the points that a joining piece
    replaces are within Toll of it.
    """
    rng, t = np.random.default_rng(5), np.arange(0, 20.01, 0.25)
    corner = np.vstack(
        [
            np.column_stack([t, 0 * t, 0 * t]),
            np.column_stack([20 + 0 * t[1:], t[1:], 0 * t[1:]]),
        ]
    )
    points = np.round(corner + rng.uniform(-0.008, 0.008, corner.shape), 5)
    points[len(t) - 1] = (20, 0, 0)
    result, _, _, made = optimized(
        tmp_path, points, setup_of(0.05, "(EDG,40,0,G63,1)", "G63")
    )
    assert result.joints == 1
    dense = samples(made)
    assert distance(points, dense).max() <= 0.05
    away = np.linalg.norm(dense - [20, 0, 0], axis=1).min()
    assert 0.03 < away <= 0.05
    for (a, span, _), (b, _, _) in pairwise(made):
        assert value(a, span)[:3] == pytest.approx(value(b, 0.0)[:3], abs=1e-9)


@pytest.mark.ci
def test_off_path_is_an_upper_bound_and_close():
    """The bound from the Bernstein hull holds for dense samples of random
    curves, and is little above them.
    """
    rng = np.random.default_rng(2)
    for _ in range(20):
        u = np.cumsum(rng.uniform(0.5, 1.5, 12))
        vertices = np.column_stack(
            [u, np.sin(u), 0.3 * rng.normal(size=12).cumsum()]
        )
        coef = np.zeros((11, 3, 6))
        coef[:, :, 0], coef[:, :, 1] = (
            vertices[:-1],
            np.diff(vertices, axis=0) / np.diff(u)[:, None],
        )
        coef[:, 1, 2] = 0.1 * rng.normal(size=11)
        coef[:, 1, 1] -= coef[:, 1, 2] * np.diff(u)
        bound, k = off_path(vertices, u, coef, u, pieces=4)
        dense = np.vstack(
            [
                [value(c, s) for s in np.linspace(0, h, 60)]
                for c, h in zip(coef, np.diff(u), strict=True)
            ]
        )
        truth = distance(dense, vertices).max()
        assert truth <= bound.max() + 1e-12
        assert bound.max() <= 1.5 * truth + 1e-9
        assert len(k) == len(bound)


@pytest.mark.parametrize("count", [1, 2, 5, 23])
def test_least_squares_agree_with_dense_algebra(count):
    """The banded normal equations give what numpy's dense solver gives, ends given or not."""
    rng = np.random.default_rng(count)
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 2.0, count))])
    knots, u = (
        knot_vector(breaks),
        np.sort(rng.uniform(0, breaks[-1], 40 * count)),
    )
    size = count + 5
    first, local = local_basis(u, knots)
    dense = BSpline.design_matrix(
        np.minimum(u, breaks[-1] - 1e-12), knots, 5
    ).toarray()
    rows, share = derivative_rows(knots)
    second = np.array(
        [
            BSpline(knots, unit, 5).derivative(2).c[: size - 2]
            for unit in np.eye(size)
        ]
    ).T
    values = rng.normal(size=(len(u), 2))
    normal = Normal(size)
    normal.add(first, local, np.ones(len(u)))
    normal.add(np.arange(size - 2), rows, 1e-3 * share)
    right = dense.T @ values
    left = dense.T @ dense + second.T @ np.diag(1e-3 * share) @ second
    free = slice(2, size - 1)
    begin, finish = rng.normal(size=(2, 2)), rng.normal(size=(1, 2))
    wanted = np.zeros((size, 2))
    wanted[:2], wanted[-1] = begin, finish[0]
    wanted[free] = np.linalg.solve(
        left[free, free], (right - left @ wanted)[free]
    )
    assert normal.solved(right, begin, finish) == pytest.approx(
        wanted, abs=1e-7
    )
    whole = np.linalg.solve(left, right)
    assert normal.solved(right, begin[:0], finish[:0]) == pytest.approx(
        whole, abs=1e-6
    )


@pytest.mark.ci
def test_long_sections_of_many_groups(tmp_path):
    """Groups of 100 points over unmarked corners and long chords: joints within
    the band, none keeps a bulge.
    """
    points = np.vstack(
        [
            raster(0.4, 0.005, seed=k) + np.array([0, 4.0 * k, 0])
            for k in range(3)
        ]
    )
    setup = setup_of(TOLL) + "(SMS,,,,,,,,100,,)\n"
    result, before, after, made = optimized(tmp_path, points, setup)
    assert result.groups >= 2
    assert distance(points, samples(made)).max() <= TOLL
    assert result.max_path_deviation_mm <= TOLL
    assert after < before
    for (a, span, _), (b, _, _) in pairwise(made):
        for order in range(3):
            assert value(a, span, order) == pytest.approx(
                value(b, 0.0, order), abs=1e-6
            )


@pytest.mark.ci
def test_feed_along_the_axes_stays_that(tmp_path):
    """AXI points on five axes, feed along the axes: the tip's polynomials take as long."""
    setup = changed(
        SETUP_5,
        PNT="(PNT,AXI,AXI,QUI)",
        TOL="(TOL,100,,0,-90,100)",
        JRK="(JRK,ENA)",
        CRV=None,
    )
    q = np.linspace(0, 30, 61)
    lines = [
        f"X{a:.5f}Y{np.sin(a / 5):.5f}Z400A{a:.5f}B{10 + a / 3:.5f}" for a in q
    ]
    (tmp_path / "SETUP").write_text(
        setup + f"(SMT,{TOLL},{TOLL},{TOLL / 10},1,1,1,G66,G66,G66)\n"
    )
    text = [
        "G0" + lines[0],
        "(HSM,SETUP)",
        "G61",
        lines[0] + "F600",
        *lines[1:],
        "G60",
        "",
    ]
    (tmp_path / "in.osai").write_text("\n".join(text))
    result = optimize(
        *(tmp_path / name for name in ("in.osai", "SETUP", "out.osai")), CELL_5
    )
    assert result.time_after_s == pytest.approx(result.time_before_s, rel=0.01)
