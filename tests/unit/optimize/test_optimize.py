"""The Path Optimizer: noisy points within the tolerance, C2 pieces, sharp
edges, an output that runs, and faster.
"""

import json
from itertools import pairwise

import numpy as np
import pytest

from cnc_core.config import CellConfig, parse_config
from cnc_core.errors import CncError
from cnc_core.optimize import optimize
from cnc_core.optimize.reference import polyline
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

SMT = "(SMT,0.02,0.02,0.002,1,1,1,{0},{0},{0})\n"
SETUP = changed(SETUP_3, CRV=None) + SMT.format("G66")


class Bench:
    """A folder with a program and a setup; ``run`` optimizes, ``made`` are the
    polynomials of the output.
    """

    def __init__(self, folder):
        self.folder = folder

    def run(
        self,
        body,
        setup=SETUP,
        cell=None,
        head="(HSM,SETUP)\nG61\n",
        tail="G60\n",
        **options,
    ):
        self.cell = cell or CellConfig()
        (self.folder / "SETUP").write_text(setup)
        (self.folder / "in.osai").write_text(head + body + "\n" + tail)
        paths = [
            self.folder / name for name in ("in.osai", "SETUP", "out.osai")
        ]
        return optimize(*paths, self.cell, **options)

    def program(self, **options):
        return Program(self.folder / "out.osai", self.cell, "osai", **options)

    def made(self):
        return curves(self.program(programmed=True))


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


def surface(seed=4, passes=3, n=120, noise=0.006):
    """(n, 3) points of a raster over a wavy surface, with noise."""
    rng, rows = np.random.default_rng(seed), []
    for p in range(passes):
        x = np.linspace(0, 40, n)[:: 1 if p % 2 == 0 else -1]
        rows.append(
            np.column_stack(
                [
                    x,
                    np.full(n, 1.0 * p),
                    4 * np.sin(x / 9 + 0.2 * p) + 1.5 * np.cos(x / 4),
                ]
            )
        )
    return np.round(
        np.vstack(rows) + rng.uniform(-noise, noise, (passes * n, 3)), 5
    )


def words(points, feed=6000):
    lines = [f"X{x:.5f}Y{y:.5f}Z{z:.5f}" for x, y, z in points]
    return "\n".join([f"{lines[0]}F{feed}", *lines[1:]])


def far(points, made):
    """Distance of every point from the polynomials, by dense samples."""
    dense = np.vstack(
        [
            [value(c, s)[:3] for s in np.linspace(0, span, 200)]
            for c, span, _ in made
        ]
    )
    out = []
    for p in points:
        i = int(np.linalg.norm(dense - p, axis=1).argmin())
        a, b = dense[max(i - 1, 0)], dense[min(i + 1, len(dense) - 1)]
        t = np.clip((p - a) @ (b - a) / max((b - a) @ (b - a), 1e-30), 0, 1)
        out.append(np.linalg.norm(p - a - t * (b - a)))
    return np.array(out)


@pytest.mark.ci
def test_a_noisy_surface(bench):
    """Every point within Toll of the output, C2 but at edges, fewer polynomials
    than points, and less time.
    """
    points = surface()
    ticks = []
    result = bench.run(
        words(points),
        tick=lambda share, _n: ticks.append(share),
        compared=True,
    )
    made = bench.made()
    assert result.points_in == len(points)
    assert result.polynomials == len(made) < len(points) / 3
    distance = far(points, made)
    assert distance.max() <= 0.02
    assert result.max_deviation_mm == pytest.approx(distance.max(), abs=1e-3)
    assert max(result.continuity.values()) < 1e-9
    for (a, span, row), (b, _, _) in pairwise(made):
        assert value(a, span)[:3] == pytest.approx(value(b, 0.0)[:3], abs=1e-9)
        if not row["flags"] & 2:
            for order in (1, 2):
                assert value(a, span, order) == pytest.approx(
                    value(b, 0.0, order), abs=1e-8
                )
    assert (
        result.comparison["after"]["time_s"]
        < result.comparison["before"]["time_s"]
    )
    assert ticks == sorted(ticks)
    assert ticks[-1] == 1.0


@pytest.mark.ci
def test_output_runs_under_g61_p5(bench):
    """The output is a program of its own, with its setup, and what stood around the profile."""
    bench.run(
        words(surface(passes=1)),
        head="G0 X0 Y0 Z10 F6000\nN7(HSM,SETUP)\nG61\n",
        tail="G60\nG0 Z50\nM30\n",
    )
    text = (bench.folder / "out.osai").read_text()
    assert "G61 P5" in text
    assert text.splitlines()[0] == "G0 X0 Y0 Z10 F6000"
    assert text.splitlines()[-1] == "M30"
    result = plan_program(bench.program())
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.ci
def test_group_joints_are_merged(bench):
    """Small groups (Pnt 100) give one C2 curve, within the tolerance."""
    points = surface(passes=1, n=400)
    result = bench.run(words(points), SETUP + "(SMS,,,,,,,,100,,)\n")
    assert result.groups >= 3
    made = bench.made()
    assert far(points, made).max() <= 0.02
    for (a, span, _), (b, _, _) in pairwise(made):
        for order in range(3):
            assert value(a, span, order) == pytest.approx(
                value(b, 0.0, order), abs=1e-8
            )


def corner(n=40, noise=0.004):
    rng = np.random.default_rng(1)
    t = np.linspace(0, 20, n)
    legs = [
        np.column_stack([t, 0 * t, 0 * t]),
        np.column_stack([20 + 0 * t[1:], t[1:], 0 * t[1:]]),
    ]
    out = np.vstack(legs) + rng.uniform(-noise, noise, (2 * n - 1, 3))
    out[n - 1] = (20, 0, 0)
    return np.round(out, 5)


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("mode", "stops"), [("G66", 1), ("G67", 0), ("G63", 0)]
)
def test_edges(bench, mode, stops):
    """C0 G66: sharp and a stop; G67: sharp and passed; G63: a joining piece
    within the tolerance.
    """
    points = corner()
    marked = changed(
        SETUP_3,
        CRV=None,
        EDG=f"(EDG,30,0,{mode},1)",
        THR="(THR,0.01,0.0001,0,0.001,0.005)",
    )
    result = bench.run(words(points), marked + SMT.format(mode))
    assert result.edges == 1
    assert not result.input_kept
    made = bench.made()
    assert sum(bool(row["flags"] & 2) for _, _, row in made[:-1]) == stops
    assert far(points, made).max() <= 0.02
    text = (bench.folder / "out.osai").read_text()
    assert (
        sum(
            line.startswith("<*")
            and line.endswith({"G66": ",1", "G67": ",2"}.get(mode, "?"))
            for line in text.splitlines()
        )
        == ({"G66": 2, "G67": 1, "G63": 0}[mode])
    )
    assert result.joints == (mode == "G63")


@pytest.mark.ci
def test_rapid_lines_stay(bench):
    """G00 lines stand between profiles."""
    points = surface(passes=1)
    body = (
        words(points)
        + "\nG00X50\nG01"
        + words(points[::-1] + np.array([10, 0, 0]))
    )
    bench.run(body)
    lines = (bench.folder / "out.osai").read_text().splitlines()
    assert sum(line == "G61 P5" for line in lines) == 2
    assert sum(line.startswith("G0 X50") for line in lines) == 1
    rows = np.concatenate(
        [b.rows for b in bench.program(programmed=True).batches()]
    )
    assert (rows["flags"] & 1).sum() == 1


def test_a_program_without_g61(bench):
    """Points alone are one profile; what stands before and behind them stays."""
    bench.run(
        "G1 " + words(surface(passes=1)),
        head="; surface\nT1\nS5000 M3\n",
        tail="M30\n",
    )
    lines = (bench.folder / "out.osai").read_text().splitlines()
    assert lines[1:3] == ["T1", "S5000 M3"]
    assert lines[-1] == "M30"


@pytest.mark.ci
def test_five_axes_become_directions(bench):
    """AXI points with A and B: polynomials of the tip and of ijk (machine to tool coordinates)."""
    setup = changed(
        SETUP_5, PNT="(PNT,AXI,AXI,QUI)", TOL="(TOL,100,0,0,-90,100)", CRV=None
    ) + SMT.format("G66")
    t = np.linspace(0, 20, 60)
    body = "\n".join(
        f"X{x:.5f}Y{2 * np.sin(x / 5):.5f}Z0A30B{20 + x / 4:.5f}F3000"
        for x in t
    )
    result = bench.run(body, setup, CELL_5)
    lines = (bench.folder / "out.osai").read_text().splitlines()
    assert {line[1] for line in lines if line.startswith("<")} == set("*XYZijk")
    assert (
        "(PNT,CLP,CLP,QUI,POL)" in (bench.folder / "out.osai.setup").read_text()
    )
    assert result.max_deviation_mm <= 0.02
    rows = np.concatenate([b.rows for b in bench.program().batches()])
    driven = rows[(rows["type"] <= 3) & (rows["flags"] & 256 == 0)]
    assert driven["end"][-1][:5] == pytest.approx(
        [20, 2 * np.sin(4), 0, 30, 25], abs=0.05
    )


@pytest.mark.ci
def test_contact_points_get_every_versor(bench):
    """CCP: mno and pqd are written, programmed or automatic."""
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,REL,REL)",
        TOL="(TOL,0,5,1,-90,)",
        CRV=None,
    )
    result = bench.run(words(surface(passes=1)), setup + SMT.format("G66"))
    lines = (bench.folder / "out.osai").read_text().splitlines()
    assert {line[1] for line in lines if line.startswith("<")} == set(
        "*XYZmnopqd"
    )
    assert len(bench.made()) == result.polynomials


@pytest.mark.parametrize(
    ("change", "number"),
    [
        ("", 909207),
        ("(SMT,0,0,0,1,1,1,G66,G66,G66)\n", 909205),
        ("(SMT,0.02,0.02,0.002,1,1,1,G66,G66)\n", 909204),
        ("(SMT,0.02,0.02,0.002,1,1,1,G62,G66,G66)\n", 909205),
        (SMT.format("G66") + "(SMS,2)\n", 909205),
        (SMT.format("G66") + "(SMS,,,,,,,,50)\n", 909205),
        (SMT.format("G66") + "(SMS,,,,4)\n", 909205),
        (SMT.format("G66") + "(SMS,,,,,,,,,ENA,)\n", 900003),
        (SMT.format("G66") + "(SMS,,,,,,,,,,DIS)\n", 900003),
    ],
)
def test_refused_setups(bench, change, number):
    """SMT and SMS have their own errors."""
    with pytest.raises(CncError) as caught:
        bench.run(words(surface(passes=1)), changed(SETUP_3, CRV=None) + change)
    assert caught.value.code == number


def test_errors_of_the_program_have_their_place(bench):
    """A wrong line is told with the file and line of the input, with and without G61."""
    for head, tail, line in (("(HSM,SETUP)\nG61\n", "G60\n", 5), ("", "", 3)):
        with pytest.raises(CncError) as caught:
            bench.run("X0Y0Z0F100\nX1\nX(E1)\nX5", head=head, tail=tail)
        assert (caught.value.code, caught.value.place.line) == (909227, line)
        assert caught.value.place.file.endswith("in.osai")


@pytest.mark.ci
def test_the_input_is_never_overwritten(bench):
    """The output may be neither the input program nor the setup, nor may its own setup be."""
    bench.run("X0Y0Z0F100\nX1\nX5Y1")
    files = [bench.folder / name for name in ("in.osai", "SETUP")]
    before = [path.read_text() for path in files]
    (bench.folder / "new.setup").write_text(before[1])
    for setup, out in (
        ("SETUP", "in.osai"),
        ("SETUP", "SETUP"),
        ("new.setup", "new"),
    ):
        with pytest.raises(CncError) as caught:
            optimize(
                files[0], bench.folder / setup, bench.folder / out, bench.cell
            )
        assert caught.value.code == 909271
    assert [path.read_text() for path in files] == before


def test_polyline():
    """Douglas and Peucker: what is kept is within the tolerance of everything."""
    points = surface(passes=1)
    kept = polyline(points, 0.05)
    assert 2 < len(kept) < len(points) / 2
    for a, b in pairwise(kept):
        chord = points[b] - points[a]
        inside = points[a : b + 1] - points[a]
        t = np.clip(inside @ chord / (chord @ chord), 0, 1)
        assert (
            np.linalg.norm(inside - t[:, None] * chord, axis=1).max()
            <= 0.05 + 1e-12
        )


@pytest.mark.ci
def test_report_is_json(bench):
    """The contract's keys, and more."""
    value = json.loads(
        json.dumps(bench.run(words(surface(passes=1))).as_json())
    )
    assert {
        "points_in",
        "polynomials",
        "max_deviation_mm",
        "points_dropped",
        "continuity",
    } <= set(value)


@pytest.mark.ci
def test_subprograms_come_into_the_output(bench):
    """(CLS) calls, calls in them too: their profiles are smoothed in their
    place, the rest of their lines stays.
    """
    points = surface(passes=1)
    (bench.folder / "PROFILE.nc").write_text(
        "G61\n" + words(points) + "\nG60\nG1 Z20 F1000\n"
    )
    (bench.folder / "OUTER").write_text("(CLS,PROFILE)\n")
    result = bench.run(
        "",
        head="(HSM,SETUP)\n(CLS,PROFILE)\nN5 (CLS,OUTER) ; again\n",
        tail="M30\n",
        compared=True,
    )
    assert (result.profiles, result.points_in) == (2, 2 * len(points))
    lines = [
        line
        for line in (bench.folder / "out.osai").read_text().splitlines()
        if line and line[0] != "<"
    ]
    once = ["G61 P5", "G60", "G1 Z20 F1000"]
    assert lines == ["(HSM,out.osai.setup)", *once, *once, "M30"]
    made = bench.made()
    assert far(points, made[: len(made) // 2]).max() <= 0.02


def test_missing_subprogram(bench):
    """A call of nothing is refused in its place."""
    with pytest.raises(CncError) as caught:
        bench.run("", head="(HSM,SETUP)\n(CLS,NOTHING)\n", tail="M30\n")
    assert (caught.value.code, caught.value.place.line) == (907030, 2)


def directions(made):
    """Unit tangents at both ends of every polynomial: (n, 2, 3)."""
    slopes = np.array(
        [[value(c, 0.0, 1)[:3], value(c, span, 1)[:3]] for c, span, _ in made]
    )
    return slopes / np.linalg.norm(slopes, axis=2)[:, :, None]


@pytest.mark.ci
def test_g62_stays_tangent(bench):
    """Behind G62 the next curve begins in the direction in which the one before ends."""
    points = surface(passes=1)
    result = bench.run(words(points[:60]) + "\nG62\n" + words(points[60:]))
    t = directions(bench.made())
    assert np.abs(t[:-1, 1] - t[1:, 0]).max() < 1e-9
    assert result.continuity["tangent_rad"] < 1e-9
    assert far(points, bench.made()).max() <= 0.02


FOURTH = parse_config(
    "[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.C]\nkind = 'rotary'\n"
)


@pytest.mark.ci
@pytest.mark.parametrize(("role", "sign"), [("TAN", 1.0), ("TAO", -1.0)])
def test_a_tangential_axis_becomes_a_polynomial(bench, role, sign):
    """Its angle follows the smoothed curve within TollX, offset included; at an
    edge the axes stand and it turns.
    """
    rng, t = np.random.default_rng(0), np.linspace(0, np.pi, 120)
    arc = np.column_stack(
        [20 * np.cos(t), 20 * np.sin(t), 0 * t]
    ) + rng.uniform(-0.004, 0.004, (120, 3))
    line = np.column_stack([np.linspace(-20, 0, 30)[1:], np.zeros((29, 2))])
    points = np.round(np.vstack([arc, line]), 5)
    setup = (
        changed(SETUP_3, CRV=None)
        + "(SMT,0.02,0.5,0.002,1,1,1,G66,G66,G66)\n"
        + f"(AXI,C,4,{role},OTH)\n"
    )
    lines = words(points).splitlines()
    bench.run("\n".join([lines[0] + "C10", *lines[1:]]), setup, FOURTH)
    assert (
        "(AXI,C,4,OTH,OTH,DIS)" in (bench.folder / "out.osai.setup").read_text()
    )
    made = bench.made()
    assert len(made) < 30
    for c, span, _ in made:
        for s in np.linspace(0.0, span, 9):
            slope = value(c, s, 1)
            wanted = 10.0 + sign * np.degrees(np.arctan2(slope[1], slope[0]))
            assert (
                value(c, s)[3] - wanted + 180.0
            ) % 360.0 - 180.0 == pytest.approx(0.0, abs=1.0)
    assert far(points, made).max() <= 0.02
    result = plan_program(bench.program())
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.ci
def test_rapid_lines_of_a_tip_stay_inside(bench):
    """On five axes a G00 line inside a profile is one of the tip: a polynomial
    that ends at rest, no G0 of the axes.
    """
    setup = changed(
        SETUP_5, TOL="(TOL,100,0,0,-90,)", VER="(VER,PRG,PRG,PRG)", CRV=None
    ) + SMT.format("G66")
    t = np.linspace(0, 20, 60)
    lines = [
        f"X{x:.5f}Y{2 * np.sin(x / 5):.5f}Z0i{0.01 * x:.5f}j0k1" for x in t
    ]
    body = "\n".join(
        [lines[0] + "F3000", *lines[1:], "G0Z50", "G0X0", "G1Z0", *lines[1:]]
    )
    bench.run(body, setup, CELL_5)
    text = (bench.folder / "out.osai").read_text()
    assert "G0 " not in text
    assert text.count("G61") == 1
    made = bench.made()
    assert sum(abs(value(c, span)[2] - 50.0) < 1e-9 for c, span, _ in made) == 2
    ends = [
        bool(row["flags"] & 2)
        for c, span, row in made
        if abs(value(c, span)[2] - 50.0) < 1e-9
    ]
    assert ends == [True, True]


@pytest.mark.ci
def test_variables_of_the_setup(bench):
    """Fields that are E variables have the program's values, and are variables
    in the output's setup too.
    """
    setup = (
        changed(SETUP_3, CRV=None, TOL="(TOL,E2,,0,-90,)")
        + "(SMT,E1,0.02,0.002,1,1,1,G66,G66,G66)\n"
    )
    points = surface(passes=1)
    result = bench.run(
        words(points), setup, head="E1=0.05\nE2=7\n(HSM,SETUP)\nG61\n"
    )
    assert 0.0 < result.max_deviation_mm <= 0.05
    assert "(TOL,E2,,0,-90,0)" in (bench.folder / "out.osai.setup").read_text()
    assert far(points, bench.made()).max() <= 0.05


@pytest.mark.ci
def test_edges_of_directions_have_their_own_code(bench):
    """EDG VAngle finds edges of ijk; C0V says how they are treated, C0 those of the path."""
    setup = changed(
        SETUP_5,
        TOL="(TOL,100,0,0,-90,)",
        VER="(VER,PRG,PRG,PRG)",
        EDG="(EDG,30,5,G66,1)",
        CRV=None,
    )
    setup += "(SMT,0.02,0.02,0.002,1,1,1,G66,G66,G67)\n"
    t = np.linspace(0, 20, 60)
    lines = [f"X{x:.5f}Y0Z0i{0.0 if x < 10 else 0.3:.5f}j0k1" for x in t]
    result = bench.run(
        "\n".join([lines[0] + "F3000", *lines[1:]]), setup, CELL_5
    )
    assert result.edges == 1
    text = (bench.folder / "out.osai").read_text().splitlines()
    assert (
        sum(line.startswith("<*") and line.endswith(",2") for line in text) == 1
    )


def test_a_single_point_is_not_lost(bench):
    """A profile of one point is a line to it."""
    bench.run("X5Y6Z7F600")
    assert (bench.folder / "out.osai").read_text().splitlines()[
        1
    ] == "G1 X5 Y6 Z7 F600"


@pytest.mark.ci
def test_automatic_normals_are_those_of_the_smoothed_path(bench):
    """Noise of some micrometres turns chords by degrees; mno of the output
    follow the path that is driven.
    """
    setup = changed(
        SETUP_3,
        PNT="(PNT,CCP,CCP,QUI)",
        VER="(VER,REL,REL,REL)",
        TOL="(TOL,0,5,1,-90,)",
        CRV=None,
    )
    points = surface(passes=1)
    result = bench.run(words(points), setup + SMT.format("G66"))
    assert result.polynomials < len(points) / 5
    assert far(points[:, [0, 1, 2]], contact_curve(bench)).max() <= 0.02


def contact_curve(bench):
    """The polynomials of X, Y, Z as they are written: of the contact points, not of the tool."""
    out, group = [], {}
    for line in (bench.folder / "out.osai").read_text().splitlines():
        if line.startswith("<*"):
            group = {"span": float(line.split(",")[1])}
        elif line[:2] in ("<X", "<Y", "<Z"):
            group[line[1]] = [float(c) for c in line.split(",")[1:]]
            if line[1] == "Z":
                out.append(
                    (np.array([group[a] for a in "XYZ"]), group["span"], None)
                )
    return out
