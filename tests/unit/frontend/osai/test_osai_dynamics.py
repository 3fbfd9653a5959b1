"""JRK and DIN of a profile, and polynomials that run with their parameter,
measured on samples of the axes.
"""

import itertools

import numpy as np
import pytest

from cnc_core.blocks import ELEMENT, TANGENTS, BlockBatch
from cnc_core.config import parse_config
from cnc_core.geometry.profiles.blend import gentle_bend, overlapped_deviation
from cnc_core.geometry.profiles.time_filter import _Caps, _spread
from cnc_core.planning import plan_program
from support.osai_programs import (
    CELL_5,
    SETUP_3,
    SETUP_5,
    changed,
    curves,
)
from support.programs import planned
from support.seeds import few

BENDS = {
    "CRV": None,
    "EDG": None,
    "DIN_X": "(DIN,X,,300)",
    "DIN_Y": "(DIN,Y,,300)",
}
LINE = "X0Y0Z0F6000\nX40Y30"


def profile_plan(shop, body, setup, **options):
    return planned(shop.profile(body, setup, programmed=False, **options))


def largest(result, order):
    """(axes,) largest magnitude of a derivative of the samples."""
    return (
        np.abs(np.diff(result.samples["pos"], n=order, axis=0)).max(axis=0)
        / 1e-3**order
    )


def wave():
    x = np.linspace(0.0, 100.0, 200)
    y = np.sin(1.2 * x) * np.exp(-(((x - 50.0) / 20.0) ** 2))
    lines = [f"X{a:.5f}Y{b:.5f}Z0" for a, b in zip(x, y, strict=True)]
    return "\n".join([lines[0] + "F6000", *lines[1:]])


def test_s_ramps_have_no_jerk_limit(shop):
    """JRK DIS: faster than with the machine's jerk, which is exceeded; velocity
    and acceleration hold.
    """
    made = {
        mode: profile_plan(
            shop, wave(), changed(SETUP_3, JRK=f"(JRK,{mode})", CRV=None)
        )
        for mode in ("ENA", "DIS")
    }
    assert made["DIS"].motion_time_s < made["ENA"].motion_time_s
    assert largest(made["ENA"], 3).max() <= 50000.0 * 1.02
    assert largest(made["DIS"], 3).max() > 100000.0
    assert largest(made["DIS"], 2).max() <= 3000.0 * 1.02
    for result in made.values():
        assert (
            max(v for v in result.max_ratio.values() if v is not None) <= 1.02
        )


def test_s_ramps_end_with_their_profile(shop):
    """Behind G60 the machine's jerk holds again."""
    setup = changed(SETUP_3, JRK="(JRK,DIS)", CRV=None)
    text = f"(HSM,CONFIG1)\nG61\n{LINE}\nG60\nG1 X80 Y60\n"
    result = plan_program(
        shop.program(text, setup, programmed=False), keep_samples=True
    )
    pos = result.samples["pos"]
    behind = np.abs(np.diff(pos[pos[:, 0] > 40.5], n=3, axis=0)).max() / 1e-9
    assert behind <= 50000.0 * 1.02
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.parametrize("length", [5.0274, 5.0822, 5.1370])
def test_the_measured_jerk_does_not_depend_on_batches(shop, length):
    """A batch that ends just behind the profile knows what its last samples
    may.
    """
    setup = changed(SETUP_3, JRK="(JRK,DIS)", CRV=None, DIN_Y="(DIN,Y,,500,,,)")
    text = f"(HSM,CONFIG1)\nG61\nG1 X0 Y0 Z0 F12000\nY{length}\nG60\nG0 Y0\n"
    program = shop.program(text, setup, programmed=False)
    in_batches = plan_program(program, live=(1, lambda _: None))
    assert in_batches.max_ratio["jerk"] <= 1.02


@pytest.mark.parametrize(("mode", "y"), [("ENA", 5000.0), ("AXI", 20000.0)])
def test_jerk_of_the_profile_and_of_the_axes(shop, mode, y):
    """ENA: the profile has one jerk, that of the weakest linear axis; AXI:
    every axis has its own.
    """
    setup = changed(
        SETUP_3,
        JRK=f"(JRK,{mode})",
        CRV=None,
        DIN_X="(DIN,X,,,5000)",
        DIN_Y="(DIN,Y,,,20000)",
    )
    result = profile_plan(shop, "X0Y0Z0F6000\nX1Y40", setup)
    found = largest(result, 3)
    assert found[1] == pytest.approx(y, rel=0.02)
    assert found[0] <= 5000.0 * 1.02


@pytest.mark.ci
def test_changes_of_speed_are_spread(shop):
    """Tintgr: the more time changes of speed may take, the less the path
    accelerates; nothing is faster.
    """
    rough, speeds = [], []
    for jrk in ("(JRK,ENA)", "(JRK,ENA,,,,50,)", "(JRK,ENA,,,,400,)"):
        result = profile_plan(shop, wave(), changed(SETUP_3, JRK=jrk, **BENDS))
        acceleration = np.diff(result.samples["v"]) / 1e-3
        rough.append(float(np.sqrt((acceleration**2).mean())))
        speeds.append(result.motion_time_s)
        assert (
            max(v for v in result.max_ratio.values() if v is not None) <= 1.02
        )
    assert rough[2] < 0.7 * rough[1] < 0.7 * rough[0]
    assert speeds[0] < speeds[1] < speeds[2]


@pytest.mark.parametrize("seed", few([106, 249, 170, 7, *range(100)], 4))
def test_spread_shares(seed):
    """Never above the shares, and no change is steeper than the highest step over
    Tintgr.  The first seeds are those with the steepest changes where the least
    share is taken row by row.
    """
    rng = np.random.default_rng(seed)
    n = 400
    share, time, merge = (
        rng.uniform(0.2, 1.0, 8).repeat(50),
        np.full(n, 0.004),
        0.1,
    )
    made = _spread(_Caps(share, time, np.zeros(n, np.bool_)), share, merge)
    assert (made <= share + 1e-12).all()
    assert made.min() == pytest.approx(share.min())
    steepest = np.abs(np.diff(share)).max() / merge
    driven = time * share / made
    between = 0.5 * (driven[1:] + driven[:-1])
    assert (np.abs(np.diff(made)) / between).max() <= steepest * 1.001


@pytest.mark.ci
def test_entities_start_together(shop):
    """JRK Entities: nothing of the profile goes on before so many elements are
    there, and nothing is lost.
    """
    for entities, first in ((0, 1), (50, 50), (5000, 199)):
        setup = changed(
            SETUP_3, JRK=f"(JRK,ENA,,{entities})", CRV=None, EDG=None
        )
        program, counts = shop.profile(wave(), setup, programmed=False), []
        while (batch := program.read(7)) is not None:
            counts.append(
                int((batch.rows["type"] <= 3).sum())
                if hasattr(batch, "rows")
                else 0
            )
        assert next(c for c in counts if c) >= first
        assert sum(counts) == 199


SCALES = (1.0, 40.0, 4000.0)


def polynomials(span, five):
    """Two polynomials that go on into each other, x = 20 u + 20 u^2 over u = s
    / span, 0..1 and 1..2.
    """
    lines = []
    for x, d in (((0.0, 20.0, 20.0), 0.0), ((40.0, 60.0, 20.0), 0.1)):
        scaled = [c / span**k for k, c in enumerate(x)]
        lines.append(f"<*,{span},1,{30 * span},0")
        lines.append("<X," + ",".join(f"{c:.17g}" for c in (*scaled, 0, 0, 0)))
        lines += ["<Y,0,0,0,0,0,0", "<Z,100,0,0,0,0,0"]
        lines += (
            [
                f"<i,{d},{0.1 / span:.17g},0,0,0,0",
                "<j,0,0,0,0,0,0",
                "<k,1,0,0,0,0,0",
            ]
            if five
            else []
        )
    return "\n".join(lines)


@pytest.mark.parametrize("five", [False, True])
@pytest.mark.ci
def test_the_parameter_runs_with_the_feed(shop, five):
    """ds/dt = F inside every polynomial, whatever a unit of s is, on five axes
    too; shown is the speed of the path.
    """
    setup, cell = SETUP_3, {}
    if five:
        setup, cell = (
            changed(SETUP_5, PNT="(PNT,CLP,CLP,QUI)", TOL="(TOL,100,0,0,-90,)"),
            {"cell": CELL_5},
        )
    setup = changed(
        setup,
        PNT=f"(PNT,{'CLP,CLP' if five else 'AXI,AXI'},QUI,POL)",
        JRK="(JRK,ENA)",
    )
    for span in SCALES:
        result = profile_plan(shop, polynomials(span, five), setup, **cell)
        q = result.samples["pos"]
        angles = np.radians(q[:, 3:5]) if five else np.zeros((len(q), 2))
        d = np.column_stack(
            [
                np.cos(angles[:, 0]) * np.sin(angles[:, 1]),
                np.sin(angles[:, 0]),
                np.cos(angles[:, 1]),
            ]
        )
        tip = q[:, :3] - (346.5 * d if five else 0.0)
        x = tip[np.abs(tip[:, 2] - 100.0) < 1e-3, 0]
        x = x[(x > 5.0) & (x < 110.0)]
        u = (-20.0 + np.sqrt(400.0 + 80.0 * x)) / 40.0
        assert len(u) > 2000
        assert np.diff(u) / 1e-3 == pytest.approx(0.5, rel=1e-2)
        assert result.max_ratio["feed"] <= 1.02
        speed = np.linalg.norm(np.diff(tip, axis=0), axis=1) / 1e-3
        assert result.samples["v"].max() == pytest.approx(
            speed.max(), rel=0.1 if five else 1e-2
        )


def test_contact_polynomials_run_with_their_parameter(shop):
    """CCP: S and feed refer to the contact curve's parameter, compensated or not."""
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI,POL)",
        TOL="(TOL,0,5,5,-90,)",
        JRK="(JRK,ENA)",
    )
    versors = [
        "<i,0,0,0,0,0,0",
        "<j,0,0,0,0,0,0",
        "<k,1,0,0,0,0,0",
        "<m,0,0.01,0,0,0,0",
        "<n,0,0,0,0,0,0",
    ]
    versors += [
        "<o,1,0,0,0,0,0",
        "<p,1,0,0,0,0,0",
        "<q,0,0,0,0,0,0",
        "<d,0,0,0,0,0,0",
    ]
    body = "\n".join(
        [
            "<*,40,1,1200,0",
            "<X,0,0.5,0.0125,0,0,0",
            "<Y,0,0,0,0,0,0",
            "<Z,0,0,0,0,0,0",
            *versors,
        ]
    )
    result = profile_plan(shop, body, setup)
    x, z = result.samples["pos"][:, 0], result.samples["pos"][:, 2]
    s = np.linspace(0.0, 40.0, 200001)
    n = (
        np.column_stack([0.01 * s, np.ones_like(s)])
        / np.hypot(0.01 * s, 1.0)[:, None]
    )
    curve = 0.5 * s + 0.0125 * s**2 + 5.0 * n[:, 0]
    at = np.interp(x, curve, s)
    inside = (x > 3.0) & (x < 40.0)
    assert np.diff(at[inside]) / 1e-3 == pytest.approx(20.0, rel=1e-3)
    assert z[inside] == pytest.approx(
        np.interp(x[inside], curve, 5.0 * n[:, 1] - 5.0), abs=1e-3
    )


def test_no_stop_inside_a_curve_that_ends_at_rest(shop):
    """The last polynomial is driven without a stop, however far ahead the
    planner has looked when it began.
    """
    body = "<*,40,1,1200,0\n<X,0,0.5,0.0125,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0\n"
    body += (
        "<*,40,2,1200,0\n<X,40,1.5,0.0125,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0"
    )
    result = profile_plan(
        shop,
        body,
        changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,POL)", JRK="(JRK,ENA)"),
    )
    x = result.samples["pos"][:, 0]
    assert np.diff(x[(x > 1.0) & (x < 119.0)]).min() > 0.005


@pytest.mark.ci
def test_the_approach_is_a_line_of_the_axes(shop):
    """From where the machine stands to the first pose every axis runs linearly,
    then the tip follows the profile.
    """
    setup = changed(
        SETUP_5,
        TOL="(TOL,100,0,0,-90,)",
        VER="(VER,PRG,PRG,PRG)",
        JRK="(JRK,ENA)",
        CRV=None,
    )
    result = profile_plan(
        shop, "X10Y20Z30i0.3j0.4k0.5F3000\nX30\nX50", setup, cell=CELL_5
    )
    q = result.samples["pos"]
    first = next(
        i
        for i in range(len(q))
        if i > 100 and np.abs(q[i] - q[i - 1]).max() < 1e-4
    )
    share = q[: first + 1] @ q[first] / (q[first] @ q[first])
    assert q[: first + 1] == pytest.approx(share[:, None] * q[first], abs=1e-6)
    d = np.array([0.3, 0.4, 0.5]) / np.sqrt(0.5)
    assert q[-1, :3] == pytest.approx(
        np.array([50, 20, 30]) + 346.5 * d, abs=1e-6
    )


def corner_polynomials(code, span):
    k = 10.0 / span
    first = f"<*,{span},1,{1000 / k},{code}\n<X,0,{k},0,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0\n"
    return (
        first
        + f"<*,{span},2,{1000 / k},0\n<X,10,0,0,0,0,0\n<Y,0,{k},0,0,0,0\n<Z,0,0,0,0,0,0"
    )


SPLINES = "X0Y0Z0K0F1000 X3K0 X7K0 X10K0 K10 K10 K10 K10 {} X10Y0K0 Y3K0 Y7K0 Y10K0 K10 K10 K10 K10"
CORNER_SPLINES = SPLINES.replace(" ", "\n")


@pytest.mark.parametrize("form", ["POL", "POL, long", "BSP"])
def test_polynomials_stop_at_g66_and_pass_g67(shop, form):
    """Transition 2 and G67: the edge is left by Tol at most, as far as the
    edge speed needs, and passed; 1 and G66: standstill.
    """
    setup = changed(
        SETUP_3, PNT=f"(PNT,AXI,AXI,QUI,{form[:3]})", JRK="(JRK,ENA)"
    )
    edge = 1.0 * 3000.0 * 0.001  # mm/s: Acc Amax Tc at a right angle
    wanted = overlapped_deviation(np.pi / 2.0, edge, 50_000.0)
    for code in (1, 2):
        span = 1000.0 if "long" in form else 10.0
        body = (
            corner_polynomials(code, span)
            if form != "BSP"
            else CORNER_SPLINES.format(f"G6{5 + code}")
        )
        result = profile_plan(
            shop, body, setup, head="G61" if form != "BSP" else "G61 P3"
        )
        off = np.linalg.norm(result.samples["pos"][:, :2] - [10.0, 0.0], axis=1)
        slowest = result.samples["v"][100:-100].min()
        stand = (
            0.5 * 50_000.0 * 0.001**2
        )  # mm/s: what the sample nearest to a standstill shows at most
        assert slowest < stand if code == 1 else slowest > 10 * stand
        assert off.min() == pytest.approx(
            0.0 if code == 1 else wanted, abs=1e-4 if form != "BSP" else 1e-3
        )
        assert off.min() <= 0.0102
        assert (
            max(v for v in result.max_ratio.values() if v is not None) <= 1.02
        )


@pytest.mark.parametrize("rows", [1, 2, 4096])
def test_the_last_polynomial_ends_the_profile(shop, rows):
    """However the polynomials are read, G60 ends them: the next motion begins
    where the last one ends.
    """
    setup = changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,POL)")
    text = f"(HSM,CONFIG1)\nG61\n{corner_polynomials(0, 10.0)}\nG60\nG91 G1 X1 F100\n"
    program, ends = shop.program(text, setup), []
    while (batch := program.read(rows)) is not None:
        if hasattr(batch, "rows"):
            ends += batch.rows["end"][batch.rows["type"] <= 3][:, :2].tolist()
    assert ends == [[10, 0], [10, 10], [11, 10]]


def test_straight_curves_without_a_jerk_limit(shop):
    """The acceleration-limited planner ramps as hard on polynomials that are lines as on lines."""
    setup = changed(SETUP_3, JRK="(JRK,ENA)", CRV=None, EDG=None)
    program = shop.profile(
        "X0Y0Z0F1000\nX10\nX20\nX30", setup, programmed=False
    )
    result = plan_program(program, jerk=False)
    assert result.motion_time_s == pytest.approx(
        1.8 + 1000.0 / 60.0 / 3000.0, abs=2e-3
    )
    assert result.max_ratio["acceleration"] <= 1.0


NO_JERK = parse_config(
    "cycle_s = 0.002\n"
    + "".join(
        f"[axes.{a}]\na_max_mm_s2 = 1000.0\nj_max_mm_s3 = 0.0\n" for a in "XYZ"
    )
)


@pytest.mark.parametrize(
    ("acc", "turn"), [(1, 90), (1, 45), (2, 90), (2, 120), (4, 90), (4, 45)]
)
def test_edge_speed_of_g67(shop, acc, turn):
    """vs = Acc Amax Tc / |t2 - t1| (4.3): 120 and 169.7056 mm/min with Acc 1,
    more with more; within Tol.
    """
    a = np.radians(turn)
    setup = changed(
        SETUP_3,
        JRK="(JRK,DIS)",
        CRV=None,
        EDG=f"(EDG,30,0,G67,{acc})",
        THR="(THR,0.05,0.0001,0,0,0.05)",
    )
    body = f"X0Y0Z0F6000\nX30\nX{30 + 30 * np.cos(a):.9f}Y{30 * np.sin(a):.9f}"
    result = profile_plan(shop, body, setup, cell=NO_JERK)
    wanted = acc * 1000.0 * 0.002 / max(1.0 - np.cos(a), np.sin(a))
    if (acc, turn) in ((1, 90), (1, 45)):
        assert 60.0 * wanted == pytest.approx(
            {90: 120.0, 45: 169.7056}[turn], abs=1e-4
        )
    away = np.linalg.norm(result.samples["pos"][:, :2] - [30.0, 0.0], axis=1)
    at = int(away.argmin())
    assert result.samples["v"][at - 30 : at + 30].min() == pytest.approx(
        wanted, rel=0.01
    )
    assert away.min() <= 0.05 + 1e-3
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


def test_edge_speed_of_g67_within_a_small_tolerance(shop):
    """What the acceleration of the axes allows on the piece within Tol comes before Acc."""
    setup = changed(
        SETUP_3,
        JRK="(JRK,DIS)",
        CRV=None,
        EDG="(EDG,30,0,G67,20)",
        THR="(THR,0.01,0.0001,0,0,0.05)",
    )
    result = profile_plan(shop, "X0Y0Z0F6000\nX30\nY30", setup, cell=NO_JERK)
    bend = gentle_bend(round(np.pi / 2.0, 3))[0]
    slowest = result.samples["v"][30:-30].min()
    along_one_axis = np.sqrt(1000.0 * 0.01 / bend)
    assert (
        0.97 * along_one_axis < slowest < 1.03 * 2.0**0.25 * along_one_axis
    )  # the bend lies between both axes
    assert slowest < 0.2 * 20.0 * 1000.0 * 0.002  # what Acc asks for
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


def test_polynomials_are_described_as_programmed(shop):
    """``blocks`` shows length and coefficients of every polynomial as
    programmed, at edges of G67 too.
    """
    setup = changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,POL)", JRK="(JRK,ENA)")
    for code in (0, 1, 2):
        made = curves(shop.profile(corner_polynomials(code, 10.0), setup))
        assert [span for _, span, _ in made] == [10.0, 10.0]
        assert made[0][0].tolist() == [[0, 1, 0, 0, 0, 0], [0] * 6, [0] * 6]
        assert made[1][0].tolist() == [
            [10, 0, 0, 0, 0, 0],
            [0, 1, 0, 0, 0, 0],
            [0] * 6,
        ]


@pytest.mark.parametrize(
    ("end", "moving"), [("X60", 1), ("X60Y60", 2), ("X60Y60Z60", 3)]
)
def test_the_jerk_is_the_profiles_or_the_axes(shop, end, moving):
    """On a line ENA limits the jerk along the profile, AXI that of every axis:
    the root of their number more.
    """
    body, jerk = f"X0Y0Z0F9000\n{end}", {}
    for mode in ("ENA", "AXI"):
        result = profile_plan(
            shop, body, changed(SETUP_3, JRK=f"(JRK,{mode})", CRV=None)
        )
        along = np.diff(result.samples["pos"][:, :3], n=3, axis=0) / 1e-9
        jerk[mode] = float(np.linalg.norm(along, axis=1).max())
    assert jerk["ENA"] == pytest.approx(50_000.0, rel=0.01)
    assert jerk["AXI"] == pytest.approx(50_000.0 * np.sqrt(moving), rel=0.01)


CORNERS = {
    "inside": "X0Y0Z0K0F600\nX10Y0Z0K0\nX20Y0Z0K0\nX20Y0Z0K0\nX20Y0Z0K1\n"
    "X20Y10Z0K2\nX20Y20Z0K3\nK4\nK4\nK4\nK4",
    "at the end": "X0Y0Z0K0F600\nX10Y0Z0K0\nX20Y0Z0K0\nX20Y10Z0K0\nX20Y10Z0K1\n"
    "X20Y10Z0K2\nK3\nK3\nK3\nK3",
}


@pytest.mark.parametrize("body", CORNERS.values(), ids=CORNERS)
def test_control_points_that_coincide_make_a_corner(shop, body):
    """The curve passes its triple control point at rest while the parameter
    runs on: driven to its end, legally.
    """
    result = profile_plan(
        shop, body, changed(SETUP_3, PNT="(PNT,AXI,AXI,QUI,BSP)"), head="G61P3"
    )
    assert result.samples["pos"][-1] == pytest.approx(
        [20.0, 20.0 if "X20Y20" in body else 10.0, 0.0], abs=1e-9
    )
    assert 0.3 < result.motion_time_s < 3.0
    assert max(v for v in result.max_ratio.values() if v) <= 1.02


@pytest.mark.ci
@pytest.mark.parametrize("jrk", ["(JRK,ENA)", "(JRK,ENA,,,400,150,200)"])
@pytest.mark.parametrize("form", ["", ",POL"])
@pytest.mark.parametrize("turn", [60, 90, 150])
def test_an_edge_of_g67_is_not_slower_than_a_stop(shop, turn, form, jrk):
    """Under a jerk limit G67 takes at most the time of G66; more Acc makes no
    edge slower, smoothing over time (Tstab, Ttop, Tintgr) neither.
    """
    a, times = np.radians(turn), []
    for code, acc in ((66, 1), (67, 0.5), (67, 2), (67, 10)):
        setup = changed(
            SETUP_3,
            PNT=f"(PNT,AXI,AXI,QUI{form})",
            JRK=jrk,
            CRV=None,
            EDG=f"(EDG,0,0,G66,{acc})",
            THR="(THR,0.05,0.0001,0,0,0.05)",
        )
        body = (
            f"X0Y0Z0F6000\nX10\nG{code}\n"
            f"X{10 + 10 * np.cos(a):.9f}Y{10 * np.sin(a):.9f}"
            if not form
            else f"<*,10,1,6000,{code - 65}\n<X,0,1,0,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0\n"
            f"<*,10,2,6000,0\n<X,10,{np.cos(a):.9f},0,0,0,0\n"
            f"<Y,0,{np.sin(a):.9f},0,0,0,0\n<Z,0,0,0,0,0,0"
        )
        result = profile_plan(shop, body, setup)
        times.append(result.motion_time_s)
        ratios = [v for v in result.max_ratio.values() if v is not None]
        assert max(ratios) <= 1.02
    slack = 0.001  # a cycle
    assert all(b <= a + slack for a, b in itertools.pairwise(times)), times


def test_a_curve_that_begins_at_rest_has_a_direction(shop):
    """X stands and Y = 10 w^2: from +Y to +Y, as the straight curve behind it."""
    setup = changed(SETUP_3, PNT="(PNT,AXI,AXI,CUB,POL)")
    curve = "<*,1,{},600,0\n<X,10,0,0,0\n<Y,{}\n<Z,0,0,0,0\n"
    program = shop.program(
        "G90 G01 F3000\nN1 G1 X10 Y0 Z0\n(HSM,CONFIG1)\nG61 P3\n"
        + curve.format(20, "0,0,10,0")
        + curve.format(30, "10,10,0,0")
        + "G60\nM30\n",
        setup,
        programmed=False,
    )
    seen = []
    while (batch := program.read()) is not None:
        if isinstance(batch, BlockBatch):
            seen += [
                batch.pool[row["pool"] : row["pool"] + 6].tolist()
                for row in batch.rows
                if row["flags"] & ELEMENT and row["degree"] == TANGENTS
            ]
    along_y = [0.0, 1.0, 0.0]
    assert seen == [pytest.approx(2 * along_y)] * 2
