"""Splines that go there and back: a turn too sharp for a curve is a corner."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.geometry.shapes.sharp_turns import LINE_MM, parts
from cnc_core.planning import plan_program
from cnc_core.program import Program
from cnc_core.units import FloatArray

CELL = 'name = "c"\n' + "".join(
    f"[axes.{axis}]\nv_max_mm_s = 300\na_max_mm_s2 = 3000\nj_max_mm_s3 = 50000\n"
    for axis in "XY"
)
STAND_S = 0.12  # to rest and back to speed, far below the feed
THERE_AND_BACK = {
    "on a line": ("AKIMA", "X10|X0"),
    "with overshoot": ("AKIMA", "X10|X20|X0 Y0.01"),
    "twice": ("BSPLINE", "X20|X40 Y0.05|X60|X40 Y0.05|X20"),
    "all but a cusp": ("BSPLINE", "X1|X2|X1 Y0.0007|X0 Y0.0007"),
    "0.1 um apart": ("BSPLINE", "X1|X2|X1 Y0.0001|X0 Y0.0001"),
    "at a knot": (
        "BSPLINE",
        "X-0.20435 Y-0.07554|X-0.16776 Y-0.17505|X-0.20223 Y-0.07972"
        "|X-0.31542 Y-0.12094",
    ),
    "short": (
        "BSPLINE",
        "X0.01895 Y-0.05882|X0.065 Y-0.0442|X0.00326 Y-0.0638"
        "|X0.02724 Y-0.13933|X0.01097 Y-0.08534|X0.02501 Y-0.13188",
    ),
    "back at its end": ("BSPLINE", "X-7.08|X5.08|X0.75|X9.33358|X14.33358"),
    "small and back": (
        "BSPLINE",
        "X-0.00085 Y-0.00708|X0.0006 Y0.00508|X0.00008 Y0.00075"
        "|X0.00114 Y0.00958|X0.00175 Y0.01469",
    ),
    "38 nm": (
        "AKIMA",
        "X2.0682 Y1.6611|X3.982 Y3.2053|X2.0302 Y1.5504|X3.1568 Y2.4469"
        "|X4.9161 Y3.8626",
    ),
    "turn behind turn": (
        "BSPLINE",
        "X0.04616 Y0.12194|X0.03144 Y0.08251|X0.04943 Y0.13487"
        "|X0.0284 Y0.07365|X0.00031 Y0.0106|X0.06038 Y-0.01618",
    ),
}


def _planned(
    tmp_path: Path, blocks: list[str], jerk: bool
) -> tuple[float, dict[str, float | None]]:
    file = tmp_path / "a.nc"
    file.write_text("\n".join(["G90 G01 F6000", *blocks, "M30"]) + "\n")
    program = Program(file, parse_config(CELL, "c"), "isg")
    plan = plan_program(program, jerk=jerk).as_json()
    return plan["motion_time_s"], plan["max_ratio"]


@pytest.mark.parametrize("name", THERE_AND_BACK)
@pytest.mark.parametrize("jerk", [True, False])
def test_a_spline_there_and_back_takes_little_more_than_its_stands(
    tmp_path: Path, name: str, jerk: bool
) -> None:
    """It is planned within all limits, in hardly more time than the lines between
    its points with their stands; it was refused, or crept for ever.
    """
    kind, text = THERE_AND_BACK[name]
    points = text.split("|")
    spline = [f"#SPLINE TYPE {kind}", "#SPLINE ON", *points, "#SPLINE OFF"]
    time_s, ratios = _planned(tmp_path, spline, jerk)
    lines_s, _ = _planned(tmp_path, points, jerk)
    assert time_s < 1.3 * lines_s + STAND_S
    for what in ("velocity", "acceleration", "jerk", "feed"):
        assert (ratios[what] or 0.0) <= 1.02


def _at(coef: FloatArray, u: FloatArray) -> FloatArray:
    powers = u ** np.arange(coef.shape[1])[:, None]
    return np.asarray((coef @ powers).T)


@pytest.mark.parametrize("seed", range(40))
def test_parts_cover_the_polynomial(seed: int) -> None:
    """One behind the other from its begin to its end; lines are within their
    distance of it.
    """
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-2, 1)
    end = float(10.0 ** rng.uniform(-2, 1))
    place = float(rng.uniform(-0.05, 1.05)) * end
    # a cusp at the place, or nearly
    squares = rng.normal(size=3)
    cubes = rng.normal(size=3) * 10.0 ** rng.uniform(-3, 0)
    drift = rng.normal(size=3) * 10.0 ** rng.uniform(-9, -4)
    u = np.polynomial.Polynomial([-place / end, 1.0 / end])
    coef = size * np.array(
        [
            np.pad((d * u + a * u**2 + b * u**3).coef, (0, 1))[:4]
            for a, b, d in zip(squares, cubes, drift, strict=True)
        ]
    )
    found = parts(coef, end)
    ends = [0.0, *(to for _, to, _ in found)]
    assert [begin for begin, _, _ in found] == ends[:-1]
    assert ends[-1] == end
    assert sorted(ends) == ends
    assert len(found) > 1
    for begin, to, straight in found:
        if straight:
            at = _at(coef, np.linspace(begin, to, 400))
            way = at[-1] - at[0]
            share = ((at - at[0]) @ way / (way @ way)).clip(0.0, 1.0)
            off = at - at[0] - share[:, None] * way
            assert np.linalg.norm(off, axis=1).max() < 1.05 * LINE_MM


def test_a_bend_stays_a_curve() -> None:
    """A quarter of a circle of 1 um has no sharp turn."""
    radius = 1e-3
    quarter = radius * np.array([[0.0, 1.6, 0.0, -0.6], [0.0, 0.0, 1.5, -0.5]])
    assert parts(quarter, 1.0) == [(0.0, 1.0, False)]
