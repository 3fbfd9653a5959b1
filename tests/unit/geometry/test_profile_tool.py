"""Versors, compensation, tangential axis and sample machine of the HSM
specification (5.2, 5.3, 5.4, 10, 12.1).
"""

from itertools import pairwise

import numpy as np
import pytest

from cnc_core.blocks import BY_PARAMETER, EXACT_STOP, LINEAR, POLYNOMIAL
from cnc_core.blocks.profile_columns import (
    POINTS,
    ProfileAxis,
    ProfileSpec,
    ToolShape,
)
from cnc_core.config import parse_config
from cnc_core.errors import CncError
from cnc_core.geometry.profiles import jets
from cnc_core.geometry.profiles.tool import Rotaries, Versors
from cnc_core.planning import plan_program
from support.osai_programs import (
    CELL_5,
    SETUP_3,
    SETUP_5,
    changed,
    curves,
    value,
)

AXES = tuple(
    ProfileAxis(name, i, role, place)
    for i, (name, role, place) in enumerate(
        [("X", "ABS", "LI1"), ("Y", "ORD", "LI2"), ("Z", "VRT", "LI3")]
    )
)
UP = np.array([0.0, 0.0, 1.0])


def spec_of(**tool):
    return ProfileSpec(
        POINTS, AXES, "CCP", "CCP", 5, np.zeros(3), 1, tool=ToolShape(**tool)
    )


def line_along(t):
    """One polynomial (1, 3, 2) through the origin along t."""
    coef = np.zeros((1, 3, 2))
    coef[0, :, 1] = t
    return coef


# 5.2


@pytest.mark.parametrize(
    ("t", "alpha", "wanted"),
    [
        ((1, 0, 0), -90, (0, 1, 0)),
        ((1, 0, 0), 90, (0, -1, 0)),
        ((1, 0, 0), 0, (0, 0, 1)),
        ((1, 0, 0), -45, (0, 0.707107, 0.707107)),
        ((0.8, 0, 0.6), -60, (-0.375, 0.780625, 0.5)),
        ((2**-0.5, 2**-0.5, 0), -90, (-0.707107, 0.707107, 0)),
    ],
)
def test_automatic_normal(t, alpha, wanted):
    """The table of 5.2: n.t = 0, n.d = cos(alpha), right-handed about the tangent."""
    versors = Versors(spec_of(contact_deg=alpha), None)
    u = np.zeros(1)
    n = versors.normal(line_along(t), u, jets.still(UP, 1))[0, 0]
    assert n == pytest.approx(wanted, abs=1e-6)
    assert n @ np.array(t) == pytest.approx(0.0, abs=1e-12)


def test_normal_of_a_plunge_is_the_one_before():
    """Along the tool there is no normal: the last one stays."""
    versors = Versors(spec_of(contact_deg=-90), None)
    coef = np.concatenate([line_along((1, 0, 0)), line_along((0, 0, -1))])
    n = versors.normal(coef, np.zeros(2), jets.still(UP, 2))
    assert n[1, 0] == pytest.approx([0, 1, 0])


def test_derivatives_are_exact():
    """Normal and tip of a helix: first and second derivatives agree with
    differences of the values.
    """
    rng = np.random.default_rng(5)
    coef = rng.normal(size=(1, 3, 6))
    spec = spec_of(contact_deg=-60, radius=10, edge_radius=2)
    h, u = 1e-4, 0.4

    def tip(at):
        d = jets.still(UP, 1)
        return Versors(spec, None).tip(coef, np.array([at]), d)[0]

    low, middle, high = tip(u - h), tip(u), tip(u + h)
    assert middle[1] == pytest.approx((high[0] - low[0]) / (2 * h), rel=1e-5)
    assert middle[2] == pytest.approx((high[1] - low[1]) / (2 * h), rel=1e-5)


# 5.3

COMPENSATION = [
    ((0, 0, 1), (10, 20, 30), 10, 2, (19.2, 20, 29.6)),
    ((0, 0, 1), (10, 20, 30), 10, 10, (16, 20, 28)),
    ((0, 0, 1), (10, 20, 30), 10, 0, (20, 20, 30)),
    ((0, 0.5, 0.866025404), (0, 0, 0), 10, 2, (7.856402, -4.843076, 2.086750)),
]


@pytest.mark.parametrize(
    ("d", "point", "radius", "edge", "wanted"), COMPENSATION
)
def test_compensation(shop, d, point, radius, edge, wanted):
    """CLP = CCP + r n + (R - r) q - r d, through a program: toroidal, ball and cylindrical tool."""
    x, y, z = point
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,PRG,REL)",
        TOL=f"(TOL,0,{radius},{edge},-90,)",
        TOD="(TOD,{},{},{})".format(*d),
    )
    body = f"X{x}Y{y}Z{z}m0.6n0o0.8F1000\nX{x + 1}Y{y}Z{z}"
    batches = list(shop.profile(body, setup).batches())
    approach = next(
        row for b in batches for row in b.rows if row["type"] == LINEAR
    )
    assert approach["end"][:3] == pytest.approx(wanted, abs=1e-6)


def test_length_of_a_three_axis_tool(shop):
    """The attachment stands L along the tool direction above the tip; R10 r0 L100: Z 130."""
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,PRG,REL)",
        TOL="(TOL,100,10,0,-90,)",
    )
    batches = list(
        shop.profile("X10Y20Z30m0.6n0o0.8F1000\nX11", setup).batches()
    )
    approach = next(
        row for b in batches for row in b.rows if row["type"] == LINEAR
    )
    assert approach["end"][:3] == pytest.approx([20, 20, 130])


def test_versors_are_normalised(shop):
    """Any length of a programmed versor means the same; length zero is refused."""
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,PRG,REL)",
        TOL="(TOL,0,10,2,-90,)",
    )
    one = curves(shop.profile("X0Y0Z0m0.6n0o0.8F1000\nX9\nX12Y3", setup))
    two = curves(shop.profile("X0Y0Z0m1.5n0o2F1000\nX9m6o8\nX12Y3m3o4", setup))
    assert value(one[-1][0], one[-1][1]) == pytest.approx(
        value(two[-1][0], two[-1][1]), abs=1e-9
    )
    with pytest.raises(CncError) as caught:
        list(
            shop.profile("X0Y0Z0m0.6n0o0.8F1000\nX9\nX12m0o0", setup).batches()
        )
    assert (caught.value.code, caught.value.place.line) == (909250, 5)


def test_first_point_needs_its_versors(shop):
    """VER says PRG: the words must be there."""
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,PRG,REL)",
        TOL="(TOL,0,10,2,-90,)",
    )
    with pytest.raises(CncError) as caught:
        list(shop.profile("X0Y0Z0F1000\nX9", setup).batches())
    assert caught.value.code == 909251


def test_offset_of_a_circle(shop):
    """Automatic normals on a circle, contact angle -90, cylindrical tool: a
    circle whose radius is R smaller.
    """
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,REL,REL)",
        TOL="(TOL,0,2,0,-90,)",
        CRV=None,
        EDG=None,
    )
    angles = np.linspace(0, np.pi, 60)
    body = "\n".join(
        f"X{20 * np.cos(a):.9f}Y{20 * np.sin(a):.9f}Z0F1000" for a in angles
    )
    made = curves(shop.profile(body, setup))
    for coef, span, _ in made[5:-5]:  # free ends bend a little
        for s in np.linspace(0, span, 5):
            assert np.hypot(*value(coef, s)[:2]) == pytest.approx(
                18.0, abs=2e-4
            )
    for (a, span, _), (b, _, _) in pairwise(made):
        for order in range(3):
            assert value(a, span, order) == pytest.approx(
                value(b, 0.0, order), abs=1e-7
            )


def test_feed_refers_to_the_contact_curve(shop):
    """Feed on CCP: the time of the smaller offset circle is that of the
    programmed one; feed on CLP: its own.
    """
    angles = np.linspace(0, np.pi, 60)
    body = "\n".join(
        f"X{20 * np.cos(a):.9f}Y{20 * np.sin(a):.9f}Z0F600" for a in angles
    )
    times = {}
    for param in ("CCP", "CLP"):
        setup = changed(
            SETUP_3,
            PNT=f"(PNT,CCP,{param},QUI)",
            VER="(VER,REL,REL,REL)",
            TOL="(TOL,0,2,0,-90,)",
            CRV=None,
            EDG=None,
        )
        times[param] = sum(
            float(row["length"] / row["feed"])
            for _, _, row in curves(shop.profile(body, setup))
        )
    assert times["CCP"] == pytest.approx(np.pi * 20 / 10, rel=1e-4)
    assert times["CLP"] == pytest.approx(np.pi * 18 / 10, rel=1e-4)


# 5.4

CELL_C = parse_config(
    '[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.C]\nkind = "rotary"\n'
)


@pytest.mark.parametrize(("role", "wanted"), [("TAN", 45.0), ("TAO", -45.0)])
def test_tangential_axis(shop, role, wanted):
    """Direction (1, 1): TAN 45, TAO -45; a programmed value is a further rotation."""
    setup = SETUP_3 + f"(AXI,C,4,{role},OTH)\n"
    made = curves(
        shop.profile("X0Y0Z0C0F600\nX5Y5\nX10Y10", setup, cell=CELL_C)
    )
    assert value(made[0][0], 0.0)[3] == pytest.approx(wanted)
    made = curves(
        shop.profile("X0Y0Z0C30F600\nX5Y5\nX10Y10", setup, cell=CELL_C)
    )
    assert value(made[0][0], 0.0)[3] == pytest.approx(wanted + 30.0)


def test_tangential_axis_does_not_jump(shop):
    """Around two full circles the angle goes on; at an edge it turns alone, at standstill."""
    setup = changed(SETUP_3, CRV=None) + "(AXI,C,4,TAN,OTH)\n"
    angles = np.linspace(0, 4 * np.pi, 200)
    circle = [f"X{10 * np.cos(a):.6f}Y{10 * np.sin(a):.6f}" for a in angles]
    rows = np.concatenate(
        [
            b.rows
            for b in shop.profile(
                "C0Z0F600"
                + circle[0]
                + "\n"
                + "\n".join([*circle[1:], "X30Y0"]),
                setup,
                cell=CELL_C,
            ).batches()
        ]
    )
    rows = rows[rows["type"] <= POLYNOMIAL]
    turn = np.flatnonzero((rows["type"] == LINEAR) & (np.arange(len(rows)) > 0))
    assert len(turn) == 1
    assert rows["end"][turn[0] - 1][3] == pytest.approx(90 + 720, abs=1.0)
    assert rows["end"][turn[0]][3] == pytest.approx(720, abs=1.0)
    assert (rows["flags"][turn[0] - 1 : turn[0] + 1] & EXACT_STOP).all()


def test_no_tangential_axis_with_polynomials(shop):
    """POL and BSP do not follow the tangent: refused."""
    setup = (
        changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,POL)") + "(AXI,C,4,TAN,OTH)\n"
    )
    with pytest.raises(CncError) as caught:
        list(shop.profile("", setup, cell=CELL_C).batches())
    assert caught.value.code == 909254


# 10 and 12.1: the sample machine

GROUP_1 = """<*,4.000000000e+001,3,3000,1
<X,-3.835260000e+002,0.000000000e+000,-4.440892099e-016,1.850371708e-017,-5.782411587e-019,1.355252716e-021
<Y,-1.121540000e+002,-1.776356839e-015,1.110223025e-016,4.625929269e-018,7.228014483e-020,0.000000000e+000
<Z,2.000000000e+002,-1.000000000e+000,-2.220446049e-016,0.000000000e+000,7.228014483e-020,-6.776263578e-022
<i,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000
<j,-5.375997577e-003,-1.084202172e-019,0.000000000e+000,0.000000000e+000,-8.823259867e-024,6.893171771e-027
<k,9.999855492e-001,1.387778781e-017,-8.673617380e-019,0.000000000e+000,-1.411721579e-021,-1.764651973e-024"""
GROUP_2 = """<*,2.488900000e+001,5,3000,5
<X,-3.835260000e+002,0.000000000e+000,-8.881784197e-016,7.401486831e-017,0.000000000e+000,-1.445602897e-020
<Y,-1.121540000e+002,-3.552713679e-015,0.000000000e+000,9.251858539e-018,0.000000000e+000,1.807003621e-021
<Z,1.600000000e+002,-1.000000000e+000,0.000000000e+000,-3.700743415e-017,-2.023844055e-018,1.626303259e-020
<i,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000
<j,-5.375997577e-003,-2.168404345e-019,1.355252716e-020,0.000000000e+000,6.176281907e-023,2.205814967e-025
<k,9.999855492e-001,0.000000000e+000,0.000000000e+000,0.000000000e+000,-6.776263578e-021,2.823443158e-023"""
GROUP_3 = """<*,6.557923113e+001,64,3000,5
<X,-3.836260000e+002,-8.775202787e-013,8.304468224e-014,-2.544261098e-015,3.13695828e-017,-1.359876104e-019
<Y,-1.736380000e+002,4.116045842e-001,3.370526100e-003,1.039559753e-005,1.237013981e-007,-1.997131743e-009
<Z,8.603200000e+001,9.164030615e-001,-2.215163382e-003,1.562230248e-005,-6.930401526e-007,3.106008361e-009
<i,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000,0.000000000e+000
<j,-9.155922041e-001,5.944508142e-003,-1.757065214e-004,6.214612678e-006,-5.203550510e-008,1.330231937e-010
<k,4.021080896e-001,6.332656007e-003,9.717969494e-005,-8.784047262e-007,-5.093874428e-009,3.500516597e-011"""
POL_5 = changed(SETUP_5, PNT="(PNT,CLP,CLP,QUI,POL)", TOL="(TOL,100,0,0,-90,)")
POL_3 = changed(SETUP_3, PNT="(PNT,CLP,CLP,QUI,POL)")


def test_the_manuals_polynomials_on_three_axes(shop):
    """12.1: lengths and values of the groups; ijk may stand there and is not used."""
    made = curves(shop.profile(f"{GROUP_1}\n{GROUP_2}", POL_3))
    assert [span for _, span, _ in made] == [40.0, 24.889]
    assert [int(row["n"]) for _, _, row in made] == [3, 5]
    assert [bool(row["flags"] & EXACT_STOP) for _, _, row in made] == [
        True,
        True,
    ]  # G66, end of the profile
    assert [value(c, s)[2] for c, s, _ in made] == pytest.approx(
        [160.0, 135.111], abs=1e-8
    )
    assert [value(c, s / 2)[2] for c, s, _ in made] == pytest.approx(
        [180.0, 147.5555], abs=1e-8
    )
    ((coef, span, row),) = curves(shop.profile(GROUP_3, POL_3))
    assert value(coef, span / 2)[1:3] == pytest.approx(
        [-156.084009939, 113.566198789], abs=1e-8
    )
    assert value(coef, span)[1:3] == pytest.approx(
        [-129.352431327, 131.957626965], abs=1e-8
    )
    assert row["length"] == pytest.approx(65.571101, abs=1e-6)


def test_groups_that_do_not_meet(shop):
    """12.1: groups 2 and 3 joined are refused at group 3."""
    with pytest.raises(CncError) as caught:
        list(shop.profile(f"{GROUP_2}\n{GROUP_3}", POL_3).batches())
    assert (caught.value.code, caught.value.place.line) == (909233, 10)


@pytest.mark.parametrize(
    ("group", "wanted"),
    [
        (
            GROUP_1,
            (-383.526, -114.016783160, 546.494992805, -90.0, 0.308023456),
        ),
        (
            GROUP_3,
            (-383.626, -490.890698732, 225.362453051, -90.0, 66.289968348),
        ),
    ],
)
def test_sample_machine(shop, group, wanted):
    """12.1: axis positions at the beginning of groups 1 and 3 with L = 100."""
    program = shop.profile(group, POL_5, cell=CELL_5, programmed=False)
    rows = np.concatenate([b.rows for b in program.batches()])
    rows = rows[(rows["type"] <= POLYNOMIAL) & (rows["flags"] & 256 == 0)]
    at = np.flatnonzero(rows["flags"] & EXACT_STOP)[0]
    x, y, z, a, b = rows["end"][at][:5]
    assert (x, y, z) == pytest.approx(wanted[:3], abs=1e-6)
    assert (a, b) == pytest.approx(wanted[3:], abs=1e-6) or (
        a,
        b,
    ) == pytest.approx((90.0, -wanted[4]), abs=1e-6)


def test_five_axis_polynomials_need_ijk(shop):
    """CLP on five axes: the direction must be programmed, with points of type AXI it must not."""
    without = "\n".join(
        line for line in GROUP_1.splitlines() if not line.startswith("<i")
    )
    with pytest.raises(CncError) as caught:
        list(shop.profile(without, POL_5, cell=CELL_5).batches())
    assert caught.value.code == 909251
    setup = changed(POL_5, PNT="(PNT,AXI,AXI,QUI,POL)")
    body = GROUP_1 + "\n<A,0,0,0,0,0,0\n<B,0,0,0,0,0,0"
    with pytest.raises(CncError) as caught:
        list(shop.profile(body, setup, cell=CELL_5).batches())
    assert caught.value.code == 909252


def wave(n, versors=True):
    for i in range(n):
        d = (
            f"i{0.3 * np.sin(i / 8):.6f}j{0.2 * np.cos(i / 10):.6f}k1"
            if versors
            else ""
        )
        yield f"X{i}Y{5 * np.sin(i / 7):.5f}Z{np.cos(i / 9):.5f}{d}F3000"


def test_five_axis_points_hold_the_limits(shop):
    """CLP points with ijk on the sample machine: every axis within 1.02 of its
    limits, the tip on its curve.
    """
    setup = changed(SETUP_5, TOL="(TOL,100,0,0,-90,)", VER="(VER,PRG,PRG,PRG)")
    result = plan_program(
        shop.profile("\n".join(wave(40)), setup, cell=CELL_5, programmed=False)
    )
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02
    assert result.path_deviation_mm < 0.005


def test_direction_and_tip_are_those_programmed(shop):
    """Forward kinematics of what is driven give points and directions back."""
    setup = changed(
        SETUP_5, TOL="(TOL,100,0,0,-90,)", VER="(VER,PRG,PRG,PRG)", CRV=None
    )
    program = shop.profile(
        "\n".join(wave(30)), setup, cell=CELL_5, programmed=False
    )
    rows = np.concatenate([b.rows for b in program.batches()])
    machine = program.kinematics._machines[1]
    driven = rows[(rows["type"] <= POLYNOMIAL) & (rows["flags"] & 256 == 0)]
    pose = machine.forward(driven["end"][:, :5], 100.0)
    for i in range(5, 25, 6):
        point = np.array([i, 5 * np.sin(i / 7), np.cos(i / 9)])
        d = np.array([0.3 * np.sin(i / 8), 0.2 * np.cos(i / 10), 1.0])
        k = int(np.linalg.norm(pose.tip - point, axis=1).argmin())
        assert pose.tip[k] == pytest.approx(point, abs=1e-3)
        assert pose.direction[k] == pytest.approx(
            d / np.linalg.norm(d), abs=1e-4
        )


def test_points_of_rotary_axes(shop):
    """VER,REL: the direction comes from A and B; both programs of one path drive the same axes."""
    setup = changed(SETUP_5, TOL="(TOL,100,0,0,-90,)")
    body = "\n".join(f"X{i}Y0Z0A{i * 2}B{10 + i}F3000" for i in range(12))
    made = curves(shop.profile(body, setup, cell=CELL_5))
    assert value(made[-1][0], made[-1][1])[3:5] == pytest.approx([22, 21])
    with pytest.raises(CncError) as caught:  # the first point names every axis
        list(shop.profile("X0Y0Z0i0j0k1F100\nX1", setup, cell=CELL_5).batches())
    assert caught.value.code == 909225


def test_ijk_with_axis_points(shop):
    """Five axes, points of type AXI: ijk is refused; three axes: it is not used."""
    setup = changed(SETUP_5, PNT="(PNT,AXI,AXI,QUI)")
    with pytest.raises(CncError) as caught:
        list(
            shop.profile(
                "X0Y0Z0A0B0i0j0k1F100\nX1", setup, cell=CELL_5
            ).batches()
        )
    assert caught.value.code == 909252
    program = shop.profile("X0Y0Z0i0j0k1F100\nX1\nX2")
    assert len(curves(program)) == 2
    assert 909270 in [w.code for w in program.reader.warnings]


def test_unreachable_direction(shop):
    """A direction beyond the limits of the rotary axes is refused at its point's line."""
    cell = parse_config(
        "".join(
            f"[axes.{n}]\nid={i}\n"
            for n, i in zip("XYZ", (1, 2, 4), strict=True)
        )
        + '[axes.A]\nid=5\nkind="rotary"\n[axes.B]\nid=6\nkind="rotary"\n'
        "min_mm=-30.0\nmax_mm=30.0\n"
    )
    setup = changed(SETUP_5, TOL="(TOL,100,0,0,-90,)", VER="(VER,PRG,PRG,PRG)")
    with pytest.raises(CncError) as caught:
        list(
            shop.profile(
                "X0Y0Z0i0j0k1F3000\nX5\nX10i1\nX15", setup, cell=cell
            ).batches()
        )
    assert (caught.value.code, caught.value.place.line) == (909260, 5)


def test_operating_limits(shop):
    """AXP limits of the setup hold beside those of the machine."""
    setup = changed(SETUP_3, AXP_X="(AXP,X,0,,-5,8)")
    with pytest.raises(CncError) as caught:
        list(shop.profile("X0Y0Z0F100\nX5\nX9", setup).batches())
    assert (caught.value.code, caught.value.place.line) == (909261, 5)


def test_both_branches_of_the_sample_machine(shop):
    """10.4: the inverse of row 5 is A30 B20 near there and A-150 B-20 near
    that; at B = 0 A stays.
    """
    program = shop.profile(
        "X0Y0Z0A0B0F100\nX1",
        changed(SETUP_5, TOL="(TOL,100,0,0,-90,)"),
        cell=CELL_5,
    )
    list(program.batches())
    machine = program.profiles._machines[1]
    d = jets.still(np.array([0.296198133, 0.171010072, 0.939692621]), 1)
    for near, wanted in (((20, 10), (30, 20)), ((-140, -10), (-150, -20))):
        found = Rotaries(
            machine, np.array([0, 0, 0, *near], dtype=float)
        ).angles(d, np.ones(1, bool))
        assert found[0, 0] == pytest.approx(wanted, abs=1e-6)
    up = Rotaries(machine, np.array([0, 0, 0, 77.0, 0])).angles(
        jets.still(UP, 1), np.ones(1, bool)
    )
    assert up[0, 0] == pytest.approx([77.0, 0.0])


def driven_of(program):
    rows = np.concatenate([b.rows for b in program.batches()])
    return rows[(rows["type"] <= POLYNOMIAL) & (rows["flags"] & 256 == 0)]


def test_contact_points_on_five_axes(shop):
    """CCP with every versor programmed: the tilted check of 5.3, through polynomials and points."""
    setup = changed(
        SETUP_5,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,PRG,PRG,REL)",
        TOL="(TOL,100,10,2,-90,)",
        EDG=None,
        CRV=None,
    )
    words = "i0j0.5k0.866025404m0.6n0o0.8"
    program = shop.profile(
        f"X0Y0Z0{words}F1000\nX1\nX2", setup, cell=CELL_5, programmed=False
    )
    last = driven_of(program)["end"][-1][:5]
    pose = program.profiles._machines[1].forward(last, 100.0)
    assert pose.tip[0] == pytest.approx(
        [9.856402, -4.843076, 2.086750], abs=1e-5
    )
    assert pose.direction[0] == pytest.approx([0, 0.5, 0.866025404], abs=1e-8)
    lines = {
        "X": "0,1,0,0,0,0",
        "Y": "0,0,0,0,0,0",
        "Z": "0,0,0,0,0,0",
        "i": "0,0,0,0,0,0",
        "j": "0.5,0,0,0,0,0",
        "k": "0.866025404,0,0,0,0,0",
        "m": "0.6,0,0,0,0,0",
        "n": "0,0,0,0,0,0",
        "o": "0.8,0,0,0,0,0",
        "p": "0.832050,0,0,0,0,0",
        "q": "-0.480384,0,0,0,0,0",
        "d": "0.277350,0,0,0,0,0",
    }
    body = "<*,2,1,1000,0\n" + "\n".join(
        f"<{name},{c}" for name, c in lines.items()
    )
    pol = changed(setup, PNT="(PNT,CCP,CCP,QUI,POL)")
    again = driven_of(shop.profile(body, pol, cell=CELL_5, programmed=False))[
        "end"
    ][-1][:5]
    assert again == pytest.approx(last, abs=1e-4)
    for name in "mq":
        without = "\n".join(
            line
            for line in body.splitlines()
            if not line.startswith(f"<{name}")
        )
        with pytest.raises(CncError) as caught:
            list(shop.profile(without, pol, cell=CELL_5).batches())
        assert caught.value.code == 909251


def test_b_splines_of_directions(shop):
    """BSP on five axes: ijk is a spline too, normalised where it is evaluated."""
    setup = changed(
        SETUP_5, PNT="(PNT,CLP,CLP,QUI,BSP)", TOL="(TOL,100,0,0,-90,)"
    )
    body = "X0Y0Z0i0.2j0k1K0F1000\nX5i0.3K0\nX10i0.4j0.2K0\nX15i0.1K0\nK10\nK10\nK10\nK10"
    program = shop.profile(
        body, setup, head="G61 P3", cell=CELL_5, programmed=False
    )
    ends = driven_of(program)["end"][:, :5]
    pose = program.profiles._machines[1].forward(ends[-1], 100.0)
    d = np.array([0.1, 0.2, 1.0])
    assert pose.tip[0] == pytest.approx([15, 0, 0], abs=1e-6)
    assert pose.direction[0] == pytest.approx(d / np.linalg.norm(d), abs=1e-9)
    with pytest.raises(CncError) as caught:
        list(
            shop.profile(
                body.replace("j0", ""), setup, head="G61 P3", cell=CELL_5
            ).batches()
        )
    assert caught.value.code == 909251


def test_feed_of_axis_points_refers_to_the_tip(shop):
    """AXI points, feed on CLP, OriginLen: a pure rotation of B moves the tip on
    a circle of radius K + L.
    """
    setup = changed(
        SETUP_5,
        PNT="(PNT,AXI,CLP,QUI)",
        TOL="(TOL,,,0,-90,100)",
        EDG=None,
        CRV=None,
    )
    body = "\n".join(f"X{i / 100:.2f}Y0Z0A0B{i}F1000" for i in range(21))
    made = curves(shop.profile(body, setup, cell=CELL_5))
    seconds = sum(float(row["length"] / row["feed"]) for _, _, row in made)
    assert seconds == pytest.approx(
        np.radians(20) * 346.5 / (1000 / 60), rel=0.01
    )
    with pytest.raises(CncError) as caught:
        list(
            shop.profile(
                body, changed(setup, PNT="(PNT,CLP,AXI,QUI)"), cell=CELL_5
            ).batches()
        )
    assert caught.value.code == 909208


@pytest.mark.ci
def test_the_tip_never_exceeds_a_feed_on_the_tip(shop):
    """AXI points, feed on CLP, swaying axes: the tip's speed is F to 0.5 %, in
    the middle of polynomials too (8 % too fast before).
    """
    setup = changed(
        SETUP_5,
        PNT="(PNT,AXI,CLP,QUI)",
        TOL="(TOL,,,0,-90,100)",
        EDG=None,
        CRV=None,
    )
    turn = np.linspace(0.0, 4.0, 25)
    body = "\n".join(
        f"X{20 * t:.4f}Y{8 * np.sin(t):.4f}Z{5 * np.cos(2 * t):.4f}"
        f"A{3 * np.sin(3 * t):.4f}B{15 + 4 * np.cos(2 * t):.4f}F1200"
        for t in turn
    )
    program = shop.profile(body, setup, cell=CELL_5, programmed=False)
    result = plan_program(program, keep_samples=True)
    machine = program.profiles._machines[1]
    tip = machine.forward(result.samples["pos"], 100.0).tip
    speed = np.linalg.norm(np.diff(tip, axis=0), axis=1) / 1e-3
    steady = speed[400:-400]
    assert steady.max() <= 1.005 * 20.0
    assert np.median(steady) >= 0.99 * 20.0


def test_tangential_axis_of_the_chain(shop):
    """A rotary axis that follows the tangent: ijk counts along the motion, to its left, upwards."""
    setup = changed(
        SETUP_5,
        AXI_A="(AXI,A,5,TAN,WRK)",
        VER="(VER,PRG,PRG,PRG)",
        TOL="(TOL,100,0,0,-90,)",
        EDG=None,
        CRV=None,
    )
    body = "X0Y0Z0A0i0.5j0k0.866025404F1000\nX5Y5\nX10Y10"
    program = shop.profile(body, setup, cell=CELL_5, programmed=False)
    pose = program.profiles
    ends = driven_of(program)["end"][-1][:5]
    direction = pose._machines[1].forward(ends, 100.0).direction[0]
    assert direction == pytest.approx(
        [0.5 / np.sqrt(2), 0.5 / np.sqrt(2), 0.866025404], abs=1e-6
    )


def test_chain_that_makes_no_machine(shop):
    """Linear axes that do not span the space: 909211 at the profile."""
    setup = changed(
        SETUP_5, CIN_Z="(CIN,Z,0,0,0,0,0,0)", TOL="(TOL,100,0,0,-90,)"
    )
    with pytest.raises(CncError) as caught:
        list(shop.profile("X0Y0Z0A0B0F100\nX1", setup, cell=CELL_5).batches())
    assert caught.value.code == 909211


@pytest.mark.parametrize(
    ("xyz", "ab", "length", "tip", "d"),
    [
        ((0, 0, 0), (0, 0), 0, (0, 0, -246.5), (0, 0, 1)),
        ((1, 2, 3), (0, 0), 100, (1, 2, -343.5), (0, 0, 1)),
        ((1, 2, 3), (0, 90), 100, (-345.5, 2, 3), (1, 0, 0)),
        ((1, 2, 3), (90, 90), 100, (1, -344.5, 3), (0, 1, 0)),
        (
            (100, 50, 400),
            (30, 20),
            100,
            (-2.632652991, -9.254989831, 74.396506898),
            (0.296198133, 0.171010072, 0.939692621),
        ),
        (
            (100, 50, 400),
            (-90, 45),
            100,
            (100, 295.012499681, 154.987500319),
            (0, -0.707106781, 0.707106781),
        ),
        (
            (10, 20, 30),
            (180, -30),
            0,
            (-113.25, 20, -183.475262033),
            (0.5, 0, 0.866025404),
        ),
    ],
)
def test_table_of_the_sample_machine(shop, xyz, ab, length, tip, d):
    """10.3: the machine of the setup, through MAC and CIN; and back again."""
    program = shop.profile(
        "X0Y0Z0A0B0F100\nX1",
        changed(SETUP_5, TOL="(TOL,100,0,0,-90,)"),
        cell=CELL_5,
    )
    list(program.batches())
    machine = program.profiles._machines[1]
    q = np.array([*xyz, *ab], dtype=float)
    pose = machine.forward(q, length)
    assert pose.tip[0] == pytest.approx(tip, abs=1e-8)
    assert pose.direction[0] == pytest.approx(d, abs=1e-8)
    assert machine.inverse(pose.tip, pose.direction, q, length)[
        0
    ] == pytest.approx(q, abs=1e-8)


def test_machine_with_two_tables(shop):
    """10.4: MAC WRK, bed WRK, tables C and A under the part."""
    setup = changed(
        SETUP_5,
        MAC="(MAC,WRK,WRK)",
        TOL="(TOL,100,0,0,-90,)",
        AXI_X="(AXI,X,1,ABS,LI1)",
        AXI_Y="(AXI,Y,2,ORD,LI2)",
        AXI_A="(AXI,A,5,OTH,TOL)",
        AXI_B="(AXI,B,6,OTH,WRK)",
        CIN_A="(CIN,A,0,0,0,0,90,0)",
        CIN_B="(CIN,B,0,0,0,0,-90,0)",
        CIN_w="(CIN,w,0,0,0,0,0,0)",
        CIN_X="(CIN,X,0,0,0,0,90,0)",
        CIN_Y="(CIN,Y,0,0,0,-90,0,-90)",
        CIN_Z="(CIN,Z,0,0,0,90,0,0)",
        CIN_t="(CIN,t,0,0,0,0,0,0)",
    )
    program = shop.profile("X0Y0Z0A0B0F100\nX1", setup, cell=CELL_5)
    list(program.batches())
    pose = program.profiles._machines[1].forward(
        np.array([100.0, 50, 400, 30, 20]), 100.0
    )
    assert pose.tip[0] == pytest.approx(
        [160.082190214, 147.441762853, 234.807621135], abs=1e-8
    )
    assert pose.direction[0] == pytest.approx(
        [0.171010072, 0.469846310, 0.866025404], abs=1e-8
    )


def test_location_in_the_centre_and_feed_along_the_arc(shop):
    """The cell decides what the manual leaves open: centre instead of tip
    (31.6), arc length instead of parameter.
    """
    cell = parse_config('[osai]\nlocation = "centre"\nfeed = "arc"\n')
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,PRG,REL)",
        TOL="(TOL,0,10,2,-90,)",
    )
    batches = list(
        shop.profile(
            "X10Y20Z30m0.6n0o0.8F1000\nX11", setup, cell=cell
        ).batches()
    )
    approach = next(
        row for b in batches for row in b.rows if row["type"] == LINEAR
    )
    assert approach["end"][:3] == pytest.approx([19.2, 20, 31.6])
    ((_, _, row),) = curves(shop.profile(GROUP_3, POL_3, cell=cell))
    assert not row["flags"] & BY_PARAMETER
    ((_, _, row),) = curves(shop.profile(GROUP_3, POL_3))
    assert row["flags"] & BY_PARAMETER
    with pytest.raises(CncError, match="did you mean 'location'"):
        parse_config('[osai]\nlocatoin = "centre"\n')


def test_a_normal_that_leaves_the_tool_direction(shop):
    """From flat contact on q is where the normal goes; where it swings across,
    the tool steps over at standstill.
    """
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,PRG,REL)",
        TOL="(TOL,0,10,2,-90,)",
        EDG=None,
        CRV=None,
    )
    text = "X0Y0Z0m0n0o1F3000\nX5m0.1\nX10m0.2\nX15m0.3\nX20m0.4"
    result = plan_program(
        shop.profile(text, setup, programmed=False), keep_samples=True
    )
    assert result.samples["pos"][-1][0] == pytest.approx(
        20 + 2 * 0.371390676 + 8, abs=1e-5
    )
    text = "X0Y0Z0m-0.2n0o1F3000\nX5m-0.1\nX10m0\nX15m0.1\nX20m0.2"
    rows = driven_of(shop.profile(text, setup, programmed=False))
    steps = rows[(rows["type"] == LINEAR) & (np.arange(len(rows)) > 0)]
    assert steps["length"].tolist() == pytest.approx([16.0], abs=1e-3)


def test_directions_that_change_at_one_place(shop):
    """Where only ijk changes the tip stands: edges on both sides, the rotary
    axes turn, everything is driven.
    """
    setup = changed(
        SETUP_5,
        TOL="(TOL,100,0,0,-90,)",
        VER="(VER,PRG,PRG,PRG)",
        EDG=None,
        CRV=None,
    )
    text = "X0Y0Z0i0.3j0.05k1F3000\nX5i0.15\nX10i0\ni-0.15\nX15\nX20i-0.2"
    program = shop.profile(text, setup, cell=CELL_5, programmed=False)
    result = plan_program(program, keep_samples=True)
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02
    pose = program.profiles._machines[1].forward(result.samples["pos"], 100.0)
    d = np.array([-0.2, 0.05, 1.0])
    assert pose.direction[-1] == pytest.approx(d / np.linalg.norm(d), abs=1e-6)
    still = np.linalg.norm(pose.tip - [10, 0, 0], axis=1) < 1e-3
    assert np.ptp(pose.direction[still][:, 0]) > 0.14
