"""Curves through points, seeded: continuity, deviation, transitions, marks,
streams; scipy is the oracle of splines.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicSpline, make_interp_spline

from cnc_core.blocks import EXACT_STOP, RAPID
from cnc_core.blocks.profile_columns import BLEND, PASS, SMOOTH, STOP, Marks
from cnc_core.config import parse_config
from cnc_core.geometry.profiles.blend import radius_of, tangent_length
from cnc_core.geometry.profiles.points import automatic_codes
from cnc_core.geometry.shapes import bspline
from cnc_core.planning import plan_program
from support.osai_programs import (
    CELL_5,
    SETUP_3,
    SETUP_5,
    changed,
    curves,
    value,
)

PLAIN = changed(SETUP_3, CRV=None, EDG=None)
CUBIC = changed(PLAIN, PNT="(PNT,AXI,AXI,CUB)")


def walk(n, seed, step=1.0):
    """(n, 3) points of a smooth random path with uneven chords, rounded to five decimals."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(scale=0.25, size=(n, 3)), axis=0)
    chord = step * rng.uniform(0.3, 1.5, size=(n, 1))
    return np.round(
        np.cumsum(
            chord * heading / np.linalg.norm(heading, axis=1)[:, None], axis=0
        ),
        5,
    )


def body(points, feed=3000):
    lines = [f"X{x:.5f}Y{y:.5f}Z{z:.5f}" for x, y, z in points]
    return "\n".join([f"{lines[0]}F{feed}", *lines[1:]])


@pytest.mark.parametrize("setup", [PLAIN, CUBIC])
@pytest.mark.parametrize("n", [3, 4, 10, 130, 400])
def test_curves_are_the_splines_of_scipy(shop, setup, n):
    """Centripetal parameters, free ends: the same curve as scipy's natural
    splines, C2 (C4), through every point.
    """
    points = walk(n, n)
    made = curves(shop.profile(body(points), setup))
    assert len(made) == n - 1
    u = np.concatenate(
        [
            [0.0],
            np.cumsum(np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))),
        ]
    )
    if setup is CUBIC:
        spline = CubicSpline(u, points, bc_type="natural")
    else:
        ends = [(3, np.zeros(3)), (4, np.zeros(3))]
        spline = (
            make_interp_spline(u, points, k=5, bc_type=(ends, ends))
            if n > 5
            else None
        )
    for k, (coef, span, _) in enumerate(made):
        assert value(coef, 0.0)[:3] == pytest.approx(points[k], abs=1e-9)
        assert value(coef, span)[:3] == pytest.approx(points[k + 1], abs=1e-9)
        if spline is not None:
            assert value(coef, 0.37 * span)[:3] == pytest.approx(
                spline(u[k] + 0.37 * span), abs=1e-9
            )
    for (a, span, _), (b, _, _) in pairwise(made):
        for order in range(3 if setup is CUBIC else 5):
            assert value(a, span, order) == pytest.approx(
                value(b, 0.0, order), abs=1e-6, rel=1e-6
            )


@pytest.mark.parametrize("degree", [3, 4, 5])
def test_b_splines_are_those_of_scipy(degree):
    """Random control points and knots, single and multiple: every span within
    1e-12 of scipy's values.
    """
    rng = np.random.default_rng(degree)
    for _ in range(50):
        n = int(rng.integers(degree + 1, 30))
        points = rng.normal(size=(n, 5))
        inner = np.sort(rng.integers(1, 40, size=n - degree - 1)).astype(float)
        inner = np.sort(
            np.array([k + 0.37 * (i % degree) for i, k in enumerate(inner)])
        )
        knots = np.concatenate(
            [np.zeros(degree + 1), inner, np.full(degree + 1, 60.0)]
        )
        coef, length, number = bspline.spans(points, knots, degree)
        assert length.sum() == pytest.approx(60.0)
        for c, span, k in zip(coef, length, number, strict=True):
            s = span * np.linspace(0.0, 0.999999, 7)
            mine = np.einsum(
                "ck,sk->sc", c, s[:, None] ** np.arange(degree + 1)
            )
            assert (
                np.abs(
                    mine - BSpline(knots, points, degree)(knots[k] + s)
                ).max()
                < 1e-12
            )


@pytest.mark.ci
def test_a_stream_gives_the_same_curve(shop):
    """However the points are cut into batches, the curve is the same, and
    little of it is held at a time.
    """
    points = walk(1500, 7)
    whole = curves(shop.profile(body(points), PLAIN))
    parts = curves(shop.profile(body(points), PLAIN), 100)
    assert np.array([c for c, _, _ in parts]) == pytest.approx(
        np.array([c for c, _, _ in whole]), abs=1e-10
    )
    program, most = shop.profile(body(points), PLAIN), 0
    while program.read(100) is not None:
        open_ = program.profiles._open
        most = max(most, len(open_.curves._buffer) if open_ else 0)
    assert most < 500


# transitions


def test_passes_behind_g62_are_parallel(shop):
    """The fit forgets what came before G62: equal points behind equal tangents
    give equal curves, translated.
    """
    rng = np.random.default_rng(2)
    there = np.column_stack(
        [
            np.arange(20.0),
            np.round(rng.normal(scale=0.05, size=20), 5),
            np.zeros(20),
        ]
    )
    lead = np.array([[-6.0, 0, 0], [-4, 0, 0], [-2, 0, 0]])
    shift = np.array([0.0, 3.0, 0.0])
    other = np.array([[-6.0, 0.4, 0], [-4, -0.3, 0], [-2, 0, 0]]) * [1, 0, 1]
    first = body(np.vstack([lead, there[:1]])) + "\nG62\n" + body(there[1:])
    second = (
        body(np.vstack([other, there[:1]]) + shift)
        + "\nG62\n"
        + body(there[1:] + shift)
    )
    a, b = (curves(shop.profile(text, PLAIN))[3:] for text in (first, second))
    for (p, span, _), (q, _, _) in zip(a, b, strict=True):
        for s in np.linspace(0, span, 5):
            assert value(q, s) - value(p, s) == pytest.approx(shift, abs=1e-9)


def test_g62_goes_on_in_the_same_direction(shop):
    """Tangent-continuous at the junction, without a stop; the second derivative may differ."""
    points = walk(30, 11)
    made = curves(
        shop.profile(body(points[:12]) + "\nG62\n" + body(points[12:]), PLAIN)
    )
    t1, t2 = value(made[10][0], made[10][1], 1), value(made[11][0], 0.0, 1)
    assert t1 / np.linalg.norm(t1) == pytest.approx(
        t2 / np.linalg.norm(t2), abs=1e-12
    )
    assert not made[10][2]["flags"] & EXACT_STOP


def speed_at(result, point):
    """Lowest path speed around a point, mm/s."""
    pos, speed = result.samples["pos"][:, :3], result.samples["v"]
    near = np.linalg.norm(pos - np.array(point), axis=1) < 0.3
    return float(speed[near].min())


@pytest.mark.parametrize(("code", "stops"), [("G66", True), ("G67", False)])
def test_g66_stops_and_g67_does_not(shop, code, stops):
    """A right-angled edge: standstill, or the highest speed the axes can stand."""
    text = f"X0Y0Z0F3000\nX10\nX20\n{code}\nX20Y10\nX20Y20"
    result = plan_program(
        shop.profile(text, PLAIN, programmed=False), keep_samples=True
    )
    lowest = speed_at(result, (20, 0, 0))
    assert (lowest < 0.5) if stops else (lowest > 0.5)
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.parametrize(
    ("end", "wanted"), [((20, 10), 120.0), ((30, 10), 169.7056)]
)
def test_speed_at_an_edge(shop, end, wanted):
    """4.3: 1000 mm/s2 and 2 ms let +X to +Y pass at 120 mm/min, a turn of 45
    degrees at 169.7056 mm/min.
    """
    cell = parse_config(
        "cycle_s = 0.002\n"
        + "".join(f"[axes.{a}]\na_max_mm_s2=1000.0\n" for a in "XYZ")
    )
    text = f"X0Y0Z0F3000\nX10\nX20\nG67\nX{end[0]}Y{end[1]}\nX{2 * end[0] - 20}Y{2 * end[1]}"
    setup = changed(PLAIN, EDG="(EDG,0,0,G67,1)")
    made = curves(shop.profile(text, setup, cell=cell))
    assert min(float(row["feed"]) for _, _, row in made) * 60 == pytest.approx(
        wanted, abs=1e-3
    )
    setup = changed(PLAIN, EDG="(EDG,0,0,G67,0.5)")
    made = curves(shop.profile(text, setup, cell=cell))
    assert min(float(row["feed"]) for _, _, row in made) * 60 == pytest.approx(
        wanted / 2, abs=1e-3
    )


def test_rapid_lines_begin_and_end_at_rest(shop):
    """G00: straight, rapid, zero speed at both ends; the curves before and
    behind are of their own.
    """
    program = shop.profile(
        "X0Y0Z0F3000\nX5\nX10Y1\nG00X40Y10\nG1X45\nX50Y12",
        PLAIN,
        programmed=False,
    )
    rows = np.concatenate([b.rows for b in program.batches()])
    rows = rows[rows["type"] <= 3]
    assert (rows["flags"] & RAPID > 0).tolist() == [
        False,
        False,
        True,
        False,
        False,
    ]
    assert (rows["flags"] & EXACT_STOP > 0).tolist() == [
        False,
        True,
        True,
        False,
        True,
    ]
    program = shop.profile(
        "X0Y0Z0F3000\nX5\nX10Y1\nG00X40Y10\nG1X45\nX50Y12",
        PLAIN,
        programmed=False,
    )
    result = plan_program(program, keep_samples=True)
    assert speed_at(result, (10, 1, 0)) < 0.5
    assert speed_at(result, (40, 10, 0)) < 0.5


@pytest.mark.parametrize(
    ("turn", "radius", "length"),
    [(90, 0.120711, 0.120711), (45, 0.606854, 0.251367), (120, 0.05, 0.086603)],
)
def test_numbers_of_the_blend(turn, radius, length):
    """4.2 for a deviation of 0.05 mm."""
    assert radius_of(np.radians(turn), 0.05) == pytest.approx(radius, abs=1e-6)
    assert tangent_length(np.radians(turn), 0.05) == pytest.approx(
        length, abs=1e-6
    )


@pytest.mark.parametrize("turn", [30, 45, 90, 120, 150])
def test_blend_leaves_the_corner_by_the_chord(shop, turn):
    """G63 between straight lines: the piece begins a tangent length before,
    passes e from the corner, joins C2.
    """
    a = np.radians(turn)
    text = f"X0Y0Z0F3000\nX10\nG63\nX{10 + 10 * np.cos(a):.7f}Y{10 * np.sin(a):.7f}"
    before, piece, behind = curves(shop.profile(text, PLAIN))
    corner = np.array([10.0, 0.0, 0.0])
    reach = tangent_length(a, 0.05)
    assert value(before[0], before[1])[:3] == pytest.approx(
        corner - [reach, 0, 0], abs=1e-6
    )
    far = [
        np.linalg.norm(value(piece[0], s)[:3] - corner)
        for s in np.linspace(0, piece[1], 201)
    ]
    assert min(far) == pytest.approx(0.05, abs=1e-6)
    for (p, span, _), (q, _, _) in pairwise((before, piece, behind)):
        t1, t2 = value(p, span, 1)[:3], value(q, 0.0, 1)[:3]
        assert t1 / np.linalg.norm(t1) == pytest.approx(
            t2 / np.linalg.norm(t2), abs=1e-9
        )
        k1, k2 = (
            np.cross(t, c) / np.linalg.norm(t) ** 3
            for t, c in (
                (t1, value(p, span, 2)[:3]),
                (t2, value(q, 0.0, 2)[:3]),
            )
        )
        assert k1 == pytest.approx(k2, abs=1e-6)


def test_blend_of_bent_curves_stays_within_the_chord(shop):
    """Curves of any shape, corners of any turn: every point is within Chord of
    the path, blended ones included.
    """
    for seed in range(6):
        points = walk(24, seed, 2.0)
        text = body(points[:12]) + "\nG63\n" + body(points[12:])
        made = curves(shop.profile(text, PLAIN))
        dense = np.vstack(
            [
                [value(c, s)[:3] for s in np.linspace(0, span, 40)]
                for c, span, _ in made
            ]
        )
        for point in points:
            assert np.linalg.norm(dense - point, axis=1).min() < 0.05 + 0.03


# automatic marks

MARKS = Marks(
    edge_deg=30.0, edge_code=STOP, long_mm=1.0, ratio=6.0, ratio_code=BLEND
)


@pytest.mark.parametrize(
    ("chords", "marked"),
    [
        ((0.5, 4.0), True),
        ((1.0, 4.0), False),
        ((0.05, 0.9), False),
        ((4.0, 0.5), True),
    ],
)
def test_curvature_marks(chords, marked):
    """9.1 with (CRV,1,6,G63): ratio 8 marks, ratio 4 does not, nor what is
    short of Len; both ways round.
    """
    xyz = np.array([[0.0, 0, 0], [chords[0], 0, 0], [sum(chords), 0, 0]])
    assert automatic_codes(xyz, None, MARKS).tolist() == [
        BLEND if marked else SMOOTH
    ]


@pytest.mark.parametrize(
    ("end", "marked"), [((20.0, 10.0), True), ((20.0, 4.0), False)]
)
def test_edge_marks(end, marked):
    """9.1 with 30 degrees: a turn of 45 is an edge, one of 21.8 is none; 0
    switches the test off.
    """
    xyz = np.array([[0.0, 0, 0], [10.0, 0, 0], [*end, 0]])
    assert automatic_codes(xyz, None, MARKS).tolist() == [
        STOP if marked else SMOOTH
    ]
    assert automatic_codes(xyz, None, Marks()).tolist() == [SMOOTH]


def test_edge_goes_before_curvature():
    """At one point EDG is tested first and suppresses CRV."""
    xyz = np.array([[0.0, 0, 0], [0.5, 0, 0], [0.5, 4, 0]])
    assert automatic_codes(xyz, None, MARKS).tolist() == [STOP]


def test_a_programmed_code_overrides_the_mark(shop):
    """G62 at an edge: no stop there."""
    setup = changed(PLAIN, EDG="(EDG,30,0,G66,1)")
    text = "X0Y0Z0F3000\nX10\nX20Y10\nX30Y10"
    marked = curves(shop.profile(text, setup))
    given = curves(
        shop.profile(
            text.replace("X10\n", "X10\nG62\n").replace(
                "X20Y10\n", "X20Y10\nG62\n"
            ),
            setup,
        )
    )
    assert [bool(row["flags"] & EXACT_STOP) for _, _, row in marked] == [
        True,
        True,
        True,
    ]
    assert [bool(row["flags"] & EXACT_STOP) for _, _, row in given] == [
        False,
        False,
        True,
    ]


def test_a_reversal_is_an_edge(shop):
    """No curve turns back on itself: such a point stops, whatever EDG says."""
    made = curves(shop.profile("X0Y0Z0F3000\nX10\nX20\nX10\nX0", PLAIN))
    assert [bool(row["flags"] & EXACT_STOP) for _, _, row in made] == [
        False,
        True,
        False,
        True,
    ]


def test_null_moves(shop):
    """Points nearer than NullMov are dropped, equal points always; a transition
    behind one stays.
    """
    setup = changed(PLAIN, THR="(THR,0.01,0,0,0.5,0.05)")
    made = curves(
        shop.profile(
            "X0Y0Z0F3000\nX0.2\nX5\nX5.1\nX5.3\nX9\nX9.1\nG66\nX15", setup
        )
    )
    assert [value(c, s)[0] for c, s, _ in made] == pytest.approx(
        [5.0, 9.0, 15.0]
    )
    assert [bool(row["flags"] & EXACT_STOP) for _, _, row in made] == [
        False,
        True,
        True,
    ]
    assert len(curves(shop.profile("X0Y0Z0F3000\nX0\nX5\nX5\nX9", PLAIN))) == 2


# motion


def test_time_of_a_long_line(shop):
    """Length over feed, and the ramps."""
    result = plan_program(
        shop.profile("X0Y0Z0F6000\nX200\nX400\nX600", PLAIN, programmed=False)
    )
    assert result.motion_time_s == pytest.approx(6.0, abs=0.2)


def test_programmed_points_are_passed(shop):
    """What is driven passes every programmed point within THR.Tol, and keeps every limit."""
    points = walk(60, 21, 2.0)
    result = plan_program(
        shop.profile(body(points, 6000), PLAIN, programmed=False),
        keep_samples=True,
    )
    pos = result.samples["pos"][:, :3]
    a, along = pos[:-1], np.diff(pos, axis=0)
    for point in points:
        share = np.clip(
            ((point - a) * along).sum(axis=1)
            / np.maximum((along**2).sum(axis=1), 1e-30),
            0,
            1,
        )
        assert (
            np.linalg.norm(a + share[:, None] * along - point, axis=1).min()
            <= 0.01
        )
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


def test_parameter_feed(shop):
    """ds/dt = F: the manual's spline takes S / F (and its ramps) although its
    curve is longer than that.
    """
    setup = changed(PLAIN, PNT="(PNT,AXI,AXI,QUI,BSP)")
    text = (
        "X0Y0Z0K0F60\nX7Y23K0\nX38Y26K0\nX23Y-15K0\nX69Y-15K2.5\n"
        "X61Y12K5\nX84Y15K7.5\nK10\nK10\nK10\nK10"
    )
    program = shop.profile(text, setup, head="G61 P3", programmed=False)
    assert plan_program(program).motion_time_s == pytest.approx(10.0, abs=0.5)


def test_marks_have_names():
    """The codes of the waist are those of the program."""
    assert (SMOOTH, BLEND, STOP, PASS) == (0, 63, 66, 67)


def measured(result, axis, order):
    """Largest derivative of an axis over the samples, mm/s .."""
    pos, dt = result.samples["pos"][:, axis], result.samples["t"][1]
    return float(np.abs(np.diff(pos, n=order)).max() / dt**order)


@pytest.mark.ci
def test_velocity_limits_of_the_setup(shop):
    """DIN: Vmax and Vrap of a profile hold on their axis, and on no other;
    rapid lines stay rapid for the PLC.
    """
    setup = changed(PLAIN, DIN_Y="(DIN,Y,600,,,1200,,)")
    text = (
        "X0Y0Z0F6000\nX30Y20\nX60Y50\nX90Y90\nG00X190Y190\nG1X290Y191\nX390Y192"
    )
    result = plan_program(
        shop.profile(text, setup, programmed=False), keep_samples=True
    )
    rapid = result.samples["pos"][:, 0] > 100
    rapid &= result.samples["pos"][:, 0] < 190
    speed = (
        np.abs(np.diff(result.samples["pos"][:, 1]))[rapid[1:]] / result.cycle_s
    )
    assert speed.max() == pytest.approx(20.0, rel=0.02)
    slow = (
        np.abs(np.diff(result.samples["pos"][:, 1]))[
            result.samples["pos"][1:, 0] < 89
        ]
        / result.cycle_s
    )
    assert 9.0 < slow.max() <= 10.0 * 1.02
    assert measured(result, 0, 1) > 95.0
    rows = np.concatenate([b.rows for b in shop.profile(text, setup).batches()])
    assert (rows["flags"] & RAPID).any()


def test_acceleration_limit_of_the_setup_in_bends(shop):
    """DIN: the speed in a bend is such that Amax takes it."""
    setup = changed(PLAIN, DIN_X="(DIN,X,,200,,,,)", DIN_Y="(DIN,Y,,200,,,,)")
    angles = np.linspace(0, 2 * np.pi, 80)
    text = body(
        np.round(
            np.column_stack(
                [5 * np.cos(angles), 5 * np.sin(angles), 0 * angles]
            ),
            5,
        ),
        9000,
    )
    result = plan_program(
        shop.profile(text, setup, programmed=False), keep_samples=True
    )
    v = result.samples["v"]
    assert np.median(v[v > 1]) == pytest.approx(np.sqrt(200 * 5), rel=0.05)


STRICT = "(DIN,%s,3000,400,6000,4800,500,5000)"
BOUNDS = {
    1: (50.0, 80.0),
    2: (400.0, 500.0),
    3: (6000.0, 5000.0),
}  # by derivative: of G01, of G00


def strict(jrk="(JRK,ENA)"):
    return changed(
        PLAIN, JRK=jrk, **{f"DIN_{axis}": STRICT % axis for axis in "XYZ"}
    )


@pytest.mark.parametrize("seed", range(3))
def test_every_limit_of_the_setup_holds(shop, seed):
    """DIN far below the machine: no axis exceeds velocity, acceleration or
    jerk, of G01 and of G00, on the samples.
    """
    points = walk(40, seed)
    far = points[-1] + [60.0, 20.0, 0.0]
    text = body(points, 9000) + "\nG00X{:.4f}Y{:.4f}Z{:.4f}".format(*far)
    result = plan_program(
        shop.profile(text, strict(), programmed=False), keep_samples=True
    )
    pos = result.samples["pos"]
    rapid = np.linalg.norm(pos[:, :3] - points[-1], axis=1).argmin()
    for part, motion in ((pos[: rapid - 2], 0), (pos[rapid + 2 :], 1)):
        for order, most in BOUNDS.items():
            reached = (
                np.abs(np.diff(part, n=order, axis=0)).max()
                / result.cycle_s**order
            )
            assert reached <= 1.02 * most[motion]
            assert order > 1 or not motion or reached > 0.9 * most[motion]


def test_axis_limits_of_the_setup_on_five_axes(shop):
    """DIN holds for the machine's own axes, whatever the tip and the tool direction do."""
    limits = {
        "X": (3000, 400, 6000),
        "Y": (2500, 300, 5000),
        "Z": (3000, 400, 6000),
    }
    limits |= {"A": (3000, 600, 9000), "B": (2500, 500, 8000)}
    din = {
        f"DIN_{axis}": f"(DIN,{axis},{v},{a},{j})"
        for axis, (v, a, j) in limits.items()
    }
    setup = changed(SETUP_5, JRK="(JRK,AXI)", VER="(VER,PRG,PRG,PRG)", **din)
    t = np.linspace(0.0, 2.0, 60)
    points = np.column_stack(
        [40 * np.cos(t) + 30 * t, 40 * np.sin(t), 5 * np.sin(2 * t)]
    )
    tool = np.column_stack(
        [0.4 * np.sin(t), 0.3 * np.cos(1.3 * t) + 0.2, np.ones_like(t)]
    )
    lines = body(points, 6000).splitlines()
    lines = [
        line + "i{:.6f}j{:.6f}k{:.6f}".format(*d)
        for line, d in zip(lines, tool, strict=True)
    ]
    result = plan_program(
        shop.profile("\n".join(lines), setup, cell=CELL_5, programmed=False),
        keep_samples=True,
    )
    for i, (v, a, j) in enumerate(limits.values()):
        reached = [measured(result, i, order) for order in (1, 2, 3)]
        assert (np.array(reached) <= 1.02 * np.array([v / 60.0, a, j])).all()
    assert measured(result, 3, 1) > 0.8 * 50.0


def test_limits_end_with_the_profile(shop):
    """What follows G60 moves with the machine's own limits."""
    text = (
        f"(HSM,CONFIG1)\nG61\n{body(walk(10, 1), 6000)}\nG60\nG1X80Y0Z0F60000\n"
    )
    result = plan_program(
        shop.program(text, strict(), programmed=False), keep_samples=True
    )
    assert measured(result, 0, 2) > 1500.0


def test_scale_and_mode_of_jerk(shop):
    """JRK Jrs scales every jerk; Mode DIS leaves those of DIN and of the machine aside."""
    jerks = {}
    for jrk in ("(JRK,ENA)", "(JRK,AXI,0.5)", "(JRK,DIS,0.5)"):
        shop_result = plan_program(
            shop.profile("X0Y0Z0F3000\nX60", strict(jrk), programmed=False),
            keep_samples=True,
        )
        jerks[jrk] = measured(shop_result, 0, 3)
    assert jerks["(JRK,ENA)"] == pytest.approx(6000.0, rel=0.03)
    assert jerks["(JRK,AXI,0.5)"] == pytest.approx(3000.0, rel=0.03)
    assert jerks["(JRK,DIS,0.5)"] > 90000.0


@pytest.mark.ci
@pytest.mark.parametrize("seed", range(4))
def test_any_points_are_driven(shop, seed):
    """Random points with random transitions, however sharp: every limit holds,
    every point is passed.
    """
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 20, (30, 3)).round(3)
    lines = body(points, 6000).splitlines()
    for i in np.flatnonzero(rng.random(29) < 0.3)[::-1]:
        lines.insert(int(i) + 1, f"G{rng.choice([62, 63, 66, 67])}")
    setup = changed(PLAIN, PNT=f"(PNT,AXI,AXI,{'QUI' if seed % 2 else 'CUB'})")
    result = plan_program(
        shop.profile("\n".join(lines), setup, programmed=False),
        keep_samples=True,
    )
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02
    assert result.samples["pos"][-1][:3] == pytest.approx(points[-1], abs=1e-6)


def test_a_programmed_reversal_is_an_edge(shop):
    """G62, G63, G67 where the path turns back: standstill, no curve leads through."""
    made = curves(
        shop.profile("X0Y0Z0F1000\nX5\nG63\nX0\nG67\nX5\nG62\nX0", PLAIN)
    )
    assert [bool(row["flags"] & EXACT_STOP) for _, _, row in made] == [True] * 4
