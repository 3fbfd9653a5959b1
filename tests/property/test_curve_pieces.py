"""Polynomial pieces driven through the engine, with scipy's splines and quadrature as oracle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import hli
from cnc_core.blocks import BlockBatch, blocks
from cnc_core.config import AxisConfig, CellConfig
from cnc_core.engine import Engine, Event
from cnc_core.errors import CncError, Place
from cnc_core.geometry.shapes.polynomial import distance, normalised
from cnc_core.geometry.stages.axis_limits import AxisLimits
from cnc_core.geometry.stages.stage import RefusedRow
from hli import layout
from hli.areas import Areas
from support.curve_pieces import cell_of, deviation, pieces, spline
from support.drive import FloatArray, curve_rows, drive
from support.fake_cnc import unique_name
from support.limits import ratios
from support.seeds import few

pytestmark = pytest.mark.sanitize("curve", "engine")


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(24), 2))
@pytest.mark.parametrize(
    "live", [False, True], ids=["steady", "override and hold"]
)
@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "no jerk"])
def test_random_splines_are_driven_exactly_and_legally(
    seed: int, live: bool, jerk: bool
) -> None:
    """C2 and C4 splines of all scales: on the path to 1e-6 mm, samples within
    the limits, to the exact end point.
    """
    rng = np.random.default_rng(seed)
    coef, ends, lengths = pieces(spline(rng))
    cell, feed = cell_of(rng), float(rng.choice([20.0, 100.0, 2000.0]))
    rows, pool = curve_rows(coef, ends, lengths, feed)

    def change(_k: int, engine: Engine) -> None:
        engine.set_override(
            float(rng.choice([0.0, 0.3, 1.0, 2.0])), bool(rng.random() < 0.15)
        )

    pos, state = drive(
        rows,
        cell,
        int(rng.choice([30, 120])),
        *((41, change) if live else ()),
        pool=pool,
        jerk=jerk,
    )
    velocity, acceleration = ratios(pos, cell, jerk)
    assert velocity <= (1.001 if jerk else 1.0)
    assert acceleration <= (1.02 if jerk else 1.0)
    assert deviation(coef, ends, pos) <= 1e-6
    assert (pos[-1] == rows["end"][-1][:3]).all()
    assert state.path == pytest.approx(lengths.sum(), abs=1e-6 * len(rows))
    assert state.infeasible == 0


@pytest.mark.ci
@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("seed", few(range(6), 2))
def test_rotary_axes_follow_the_main_axes(seed: int, jerk: bool) -> None:
    """Five axes: length and feed are measured over X Y Z, limits hold on every axis."""
    rng = np.random.default_rng(100 + seed)
    coef, ends, lengths = pieces(spline(rng, axes=5))
    rows, pool = curve_rows(coef, ends, lengths, 100.0)
    cell = cell_of(rng, "XYZAC")
    pos, state = drive(rows, cell, 60, pool=pool, jerk=jerk)
    assert max(ratios(pos, cell, jerk)) <= (1.02 if jerk else 1.0)
    assert deviation(coef, ends, pos) <= 1e-6
    speed = np.linalg.norm(np.diff(pos[:, :3], axis=0), axis=1) / cell.cycle_s
    assert speed.max() <= 100.0 * (1.005 if jerk else 1.0001)
    assert state.infeasible == 0


def test_only_rotary_axes_move() -> None:
    """Main axes at rest: the length is measured over the rotary axes."""
    coef = np.zeros((1, 4, 4))
    coef[0, 3] = [0.0, 30.0, 5.0, -2.0]
    rows, pool = curve_rows(coef, np.array([1.0]), np.array([33.0]), 50.0)
    pos, _ = drive(rows, cell_of(np.random.default_rng(0), "XYZC"), pool=pool)
    assert pos[-1].tolist() == [0.0, 0.0, 0.0, 33.0]


def engine_takes(rows: Any, pool: FloatArray) -> None:
    Engine(CellConfig()).push(BlockBatch(rows, pool))


@pytest.mark.parametrize(
    "wrong", ["length", "end", "start", "pool", "cusp", "degree", "feed", "nan"]
)
def test_rows_that_do_not_fit_their_coefficients_are_refused(
    wrong: str,
) -> None:
    """A piece that would jump, lie about its length or stand still inside is an
    error, not a motion.
    """
    coef = np.zeros((1, 3, 4))
    coef[0, 0, 1:3] = [10.0, 1.0]
    rows, pool = curve_rows(coef, np.array([1.0]), np.array([11.0]), 50.0)
    engine_takes(rows, pool)
    if wrong == "length":
        rows["length"] += 1e-3
    elif wrong == "end":
        rows["end"][0, 1] = 1e-3
    elif wrong == "start":
        pool = pool.copy()
        pool[0], rows["end"][0, 0] = 1.0, 12.0
    elif wrong == "pool":
        rows["pool"] = 5
    elif wrong == "cusp":
        coef[0, 0], coef[0, 1] = [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]
        rows, pool = curve_rows(
            coef, np.array([1.0]), np.array([(13.0**1.5 - 8.0) / 27.0]), 50.0
        )
    elif wrong == "degree":
        rows["degree"] = 6
    elif wrong == "feed":
        rows["feed"] = 0.0
    else:
        pool = pool.copy()
        pool[2] = np.nan
    with pytest.raises(CncError, match="90400"):
        engine_takes(rows, pool)


@pytest.mark.ci
def test_corners_between_curves_and_lines_are_legal() -> None:
    """Curves that meet lines and each other at an angle: the jump and the
    curvature together stay in the limits.
    """
    rng = np.random.default_rng(5)
    coef = np.zeros((200, 3, 6))
    at = np.zeros(3)
    for c in coef:
        c[:, 0], c[:, 1], c[:, 2:] = (
            at,
            rng.normal(size=3),
            rng.normal(size=(3, 4)) * rng.choice([0.0, 0.02, 0.1]),
        )
        at = c.sum(axis=1)
    powers = np.arange(1, 6)

    def speed(u: float, c: FloatArray) -> float:
        return float(
            np.linalg.norm(
                ((c[:, 1:] * powers) * u ** (powers - 1)).sum(axis=1)
            )
        )

    lengths = np.array(
        [quad(speed, 0.0, 1.0, args=(c,), epsabs=1e-12)[0] for c in coef]
    )
    rows, pool = curve_rows(coef, np.ones(len(coef)), lengths, 100.0)
    cell = CellConfig()
    pos, state = drive(rows, cell, pool=pool)
    assert ratios(pos, cell)[1] <= 1.02
    assert deviation(coef, np.ones(len(coef)), pos) <= 1e-6
    assert state.infeasible == 0


def test_software_limits_see_the_exact_extremes() -> None:
    """An arch that ends inside the range but passes above it is refused; one
    whose control points leave is not.
    """
    cell = CellConfig(
        axes={"X": AxisConfig(), "Y": AxisConfig(max_mm=1.0), "Z": AxisConfig()}
    )
    for height, fits in ((0.999, True), (1.001, False)):
        coef = np.zeros((1, 3, 3))
        coef[0, 0, 1], coef[0, 1] = 10.0, [0.0, 4 * height, -4 * height]
        rows, pool = curve_rows(coef, np.ones(1), np.ones(1), 50.0)
        limits = cell.axis_values("min_mm"), cell.axis_values("max_mm")
        stage = AxisLimits(
            cell.axis_names,
            cell.main_axes,
            limits,
            np.zeros(3),
            lambda _f, line: Place("p", line),
        )
        if fits:
            assert len(stage.push(BlockBatch(rows, pool))) == 1
        else:
            with pytest.raises(RefusedRow, match="axis Y"):
                stage.push(BlockBatch(rows, pool))


def test_json_of_a_polynomial() -> None:
    """The contract's keys: parameter 0..s and ascending coefficients by axis, at full precision."""
    coef = np.zeros((1, 3, 3))
    coef[0, 0], coef[0, 1] = [0.0, 1 / 3, 0.1], [0.0, 0.0, 2.0]
    rows, pool = curve_rows(coef, np.array([2.0]), np.array([8.1]), 50.0)
    (block,) = blocks(BlockBatch(rows, pool), np.zeros(3), "XYZ", (0, 1, 2))
    value = block.as_json()
    assert value["type"] == "polynomial"
    assert value["s"] == 2.0
    assert value["coeff"] == {
        "X": [0.0, 1 / 3, 0.1],
        "Y": [0.0, 0.0, 2.0],
        "Z": [0.0, 0.0, 0.0],
    }


@pytest.mark.parametrize("event", [Event.PROGRAM_END])
def test_zero_override_then_on(event: Event) -> None:
    """A stop on the middle of a curve comes to rest and goes on."""
    coef = np.zeros((1, 3, 4))
    coef[0, 0, 1], coef[0, 1, 2:] = 50.0, [8.0, -5.0]
    length = quad(
        lambda u: float(np.hypot(50.0, 16.0 * u - 15.0 * u * u)),
        0,
        1,
        epsabs=1e-12,
    )[0]
    rows, pool = curve_rows(coef, np.ones(1), np.array([length]), 100.0)
    engine = Engine(CellConfig(), record_rows=5000)
    engine.push(BlockBatch(rows, pool))
    engine.finish()
    engine.run(150)
    engine.set_override(1.0, hold=True)
    engine.run(200)
    assert engine.state.speed == 0.0
    engine.set_override(1.0)
    assert engine.run(2000) is event


def test_the_plc_sees_polynomials() -> None:
    """Type 6, length and kink at the start as the look-ahead specification
    says; the circle's members are 0.
    """
    coef = np.zeros((2, 3, 3))
    coef[0, 0, 1], coef[0, 1, 2] = 10.0, 4.0
    coef[1, :, 0], coef[1, 0, 1] = [10.0, 4.0, 0.0], 10.0
    length = quad(lambda u: float(np.hypot(10.0, 8.0 * u)), 0, 1, epsabs=1e-12)[
        0
    ]
    rows, pool = curve_rows(coef, np.ones(2), np.array([length, 10.0]), 50.0)
    segment = hli.create(unique_name(), 1, 3)
    try:
        engine = Engine(CellConfig(), segment=segment)
        engine.push(BlockBatch(rows, pool))
        engine.finish()
        engine.hold_start(True)
        unit = Areas(segment).gpCh[0].contour_lookahead
        unit.request.length = 1e9
        unit.semaphor_rw = True
        engine.run(1)
        first, second = unit.response.block[0], unit.response.block[1]
        assert (first.block_type, second.block_type) == (
            layout.HLI_CLAH_POLYNOMIAL,
        ) * 2
        assert first.length == pytest.approx(length * 1e4, rel=1e-12)
        assert second.start_position == first.length
        assert second.tangent_variation == pytest.approx(
            np.arctan2(8.0, 10.0), abs=1e-12
        )
        assert (
            first.compensated_radius,
            first.programmed_radius,
            first.circle_angle,
        ) == (0.0, 0.0, 0.0)
        engine.close()
    finally:
        segment.close()
        segment.unlink()


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", [0, 1, 2, 1065, 1096, 1204, 1223, 1229, 1247])
def test_points_of_a_polynomial_have_no_distance_from_it(seed: int) -> None:
    """Also where it runs at very uneven speed, a millimetre between two chords
    and a hundred in one.
    """
    rng = np.random.default_rng(seed)
    coef, ends, _ = pieces(spline(rng))
    unit = normalised(coef, ends)
    for c in unit[:3]:
        points = (
            c @ rng.uniform(0.0, 1.0, 4000) ** np.arange(c.shape[1])[:, None]
        ).T
        assert distance(np.repeat(c[None], 4000, axis=0), points).max() <= 1e-9
