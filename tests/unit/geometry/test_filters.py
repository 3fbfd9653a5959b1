"""Filters of straight motions: streams in pieces, exact ends, true deviations, bounded memory."""

import json
from dataclasses import asdict
from itertools import pairwise

import numpy as np
import pytest
import shapely
from scipy.interpolate import BSpline

from cnc_core.blocks import (
    EXACT_STOP,
    FILTER,
    HAS_VALUE,
    NC_BLOCK,
    BlockBatch,
    M,
)
from cnc_core.geometry.filters.feed_control import FeedControl
from cnc_core.geometry.filters.low_pass import LowPass
from cnc_core.geometry.filters.noise import Noise
from cnc_core.geometry.filters.run_filter import distances, farthest
from cnc_core.geometry.filters.short_segments import ShortSegments
from cnc_core.geometry.filters.spline_filter import SplineFilter
from support.drive import line_rows

pytestmark = pytest.mark.sanitize("stages/polyline_distance")

CASES = [
    (Noise, {"angle": 0.4, "length": 0.4}),
    (Noise, {"angle": 0.2, "length": 1.0, "value": 1}),
    (SplineFilter, {"length": 1.0, "value": 3, "radius": 0.2}),
    (SplineFilter, {"length": 1.0, "value": 2, "radius": 0.3}),
    (SplineFilter, {"length": 1.0, "value": 6, "radius": 0.1}),
    (ShortSegments, {"length": 0.4}),
    (LowPass, {"length": 1.0, "end": [0.4, 0.4, 0.4] + [0] * 6}),
]


def setting(code, **values):
    row = np.zeros(1, NC_BLOCK)
    row["type"], row["code"], row["flags"] = FILTER, code, HAS_VALUE
    row["degree"], row["fill_1"], row["plane"] = 0, 1, 2
    for name, value in values.items():
        row[name] = value
    return row


def through(kind, points, values, size=10**6):
    stage = kind(points[0].copy(), (0, 1, 2))
    stage.push(BlockBatch(setting(stage.code, **values)))
    rows = line_rows(points, 100.0)
    out = [
        stage.push(BlockBatch(rows[i : i + size])).rows
        for i in range(0, len(rows), size)
    ]
    out.append(stage.drain().rows)
    return np.concatenate(out), stage


def zigzag(seed, count=150):
    rng = np.random.default_rng(seed)
    steps = np.c_[
        rng.uniform(0.05, 0.5, count),
        rng.normal(0, 0.2, count),
        rng.normal(0, 0.05, count),
    ]
    return np.cumsum(steps, axis=0)


@pytest.mark.ci_cases
@pytest.mark.parametrize(("kind", "values"), CASES)
@pytest.mark.parametrize("seed", range(2))
def test_streams_give_the_same_in_any_pieces(kind, values, seed):
    """One batch, or pieces of 1 and 7 rows: the same path, the same report;
    ends are exact, lengths fit.
    """
    points = zigzag(seed)
    whole, stage = through(kind, points, values)
    assert whole["end"][-1, :3] == pytest.approx(points[-1], abs=1e-12)
    ends = np.vstack([points[0], whole["end"][:, :3]])
    assert whole["length"] == pytest.approx(
        np.linalg.norm(np.diff(ends, axis=0), axis=1)
    )
    assert (stage.report.blocks_in, stage.report.blocks_out) == (
        len(points) - 1,
        len(whole),
    )
    for size in (1, 7):
        parts, other = through(kind, points, values, size)
        assert parts["end"] == pytest.approx(whole["end"], abs=1e-6)
        assert other.report.blocks_out == len(whole)
        assert other.report.segments_deviation_mm == pytest.approx(
            stage.report.segments_deviation_mm, abs=0.02
        )


@pytest.mark.ci_cases
@pytest.mark.parametrize(("kind", "values"), CASES)
def test_reported_deviation_is_true(kind, values):
    """Against shapely, in the plane, to the resolution of the report."""
    points = zigzag(5) * [1, 1, 0]
    whole, stage = through(kind, points, values)
    before, after = (
        shapely.LineString(points),
        shapely.LineString(np.vstack([points[0], whole["end"][:, :3]])),
    )
    driven = max(
        before.distance(shapely.Point(p))
        for p in shapely.get_coordinates(shapely.segmentize(after, 0.01))
    )
    cut = max(
        after.distance(shapely.Point(p))
        for p in shapely.get_coordinates(shapely.segmentize(before, 0.01))
    )
    assert stage.report.segments_deviation_mm == pytest.approx(driven, abs=0.02)
    assert stage.report.segments_cut_mm == pytest.approx(cut, abs=0.03)


@pytest.mark.parametrize("order", [3, 4, 5, 7])
def test_spline_is_the_clamped_uniform_one(order):
    """Every vertex that comes out lies on scipy's spline."""
    points, degree = zigzag(9, 40), order - 1
    out, _ = through(
        SplineFilter, points, {"length": 5.0, "value": order, "radius": 0.2}, 3
    )
    knots = np.clip(
        np.arange(len(points) + order) - degree, 0, len(points) - degree
    ).astype(float)
    curve = BSpline(knots, points, degree)(
        np.linspace(0, len(points) - degree, 20001)
    )
    assert distances(out["end"][:, :3], curve).max() < 1e-5


def test_the_spline_of_order_two_is_the_programmed_path():
    """Its control polygon, segment by segment; no exact stops inside, as for the other orders."""
    points = zigzag(9, 40)
    stage = SplineFilter(points[0].copy(), (0, 1, 2))
    stage.push(BlockBatch(setting(stage.code, length=5.0, value=2, radius=0.2)))
    rows = line_rows(points, 100.0)
    rows["flags"] |= EXACT_STOP
    out = np.concatenate(
        [
            *(
                stage.push(BlockBatch(rows[i : i + 7])).rows
                for i in range(0, 39, 7)
            ),
            stage.drain().rows,
        ]
    )
    assert (out["end"] == rows["end"]).all()
    assert [bool(flags & EXACT_STOP) for flags in out["flags"]] == [
        False
    ] * 38 + [True]


def test_other_rows_end_a_run_and_keep_their_place():
    """An M function between motions: the run ends in front of it, exactly."""
    points = zigzag(3, 20)
    stage = SplineFilter(points[0].copy(), (0, 1, 2))
    rows = line_rows(points, 100.0)
    function = np.zeros(1, NC_BLOCK)
    function["type"] = M
    head = setting(stage.code, length=5.0, value=3, radius=0.2)
    out = stage.push(
        BlockBatch(np.concatenate([head, rows[:10], function, rows[10:]]))
    ).rows
    out = np.concatenate([out, stage.drain().rows])
    place = int(np.flatnonzero(out["type"] == M)[0])
    assert out["end"][place - 1, :3] == pytest.approx(points[10])
    assert out["end"][-1, :3] == pytest.approx(points[-1])


@pytest.mark.ci
def test_filters_hold_no_more_than_their_reach():
    """A run of many rows leaves a few hundred behind at most."""
    points = zigzag(4, 20_000)
    for kind, values in CASES:
        stage = kind(points[0].copy(), (0, 1, 2))
        stage.push(BlockBatch(setting(stage.code, **values)))
        rows, given = line_rows(points, 100.0), 0
        for i in range(0, len(rows), 1000):
            given += len(stage.push(BlockBatch(rows[i : i + 1000])))
        held = stage._rows if kind is SplineFilter else stage._held
        assert len(held) < 300
        assert given > 0.2 * len(rows)
        if len(points) > 2000:
            points = points[:2000]


@pytest.mark.parametrize("inertia", [1.0, 4.0])
def test_feed_control_keeps_the_axes(inertia):
    """Speed steps of the axes at corners stay inside their limits, whatever the
    pieces; inertia decelerates earlier.
    """
    t = np.linspace(0, 6, 400)
    points = np.c_[30 * np.cos(t), 10 * np.sin(2 * t), 0 * t]
    values = {
        "end": [2.0, 1.0] + [0] * 7,
        "value": 3,
        "radius": inertia,
        "length_min": 50.0,
        "pool": 40,
        "length": 1.0,
    }
    whole, _ = through(FeedControl, points, values)
    slope = np.diff(points, axis=0) / whole["length"][:, None]
    speed = np.minimum(
        np.minimum(whole["feed"][:-1], whole["feed"][1:]),
        whole["end_speed"][:-1],
    )
    step = np.abs(np.diff(slope, axis=0)) * speed[:, None]
    assert (step[:, :2] <= np.array([2.0, 1.0]) * (1 + 1e-6)).all()
    for size in (1, 11):
        parts, _ = through(FeedControl, points, values, size)
        assert len(parts) == len(whole)
        if inertia == 1.0:
            assert parts["feed"] == pytest.approx(whole["feed"])


def test_reports_are_plain_numbers():
    """They go into the plan's JSON and into messages."""
    _, stage = through(Noise, zigzag(1, 50), CASES[0][1])
    assert json.loads(json.dumps(asdict(stage.report)))["blocks_in"] == 49
    assert str(stage.report).startswith("filter NOISE: 49 blocks in, ")


@pytest.mark.parametrize("seed", range(8))
def test_the_largest_distance_is_that_of_dense_points(seed):
    """Against points every few micrometres: never less, hardly more, where the
    farthest point is no vertex.
    """
    rng = np.random.default_rng(seed)
    other = np.column_stack([np.arange(9) * 3.0, rng.uniform(-4, 4, 9)])
    mine = np.vstack([other[0], [other[3] + rng.uniform(-1, 1, 2)], other[-1]])
    share = np.linspace(0.0, 1.0, 4001)[:, None]
    dense = np.vstack([a + share * (b - a) for a, b in pairwise(mine)])
    expected = float(distances(dense, other).max())
    assert expected - 1e-9 <= farthest(mine, other) <= expected + 0.005
    assert farthest(mine, other) == pytest.approx(
        farthest(mine[::-1], other[::-1]), abs=2e-6
    )


def test_the_spline_puts_out_a_bounded_number_of_segments():
    """44 segments of metres in steps of 0.001 mm: a thousand for each, not six
    million."""
    rng = np.random.default_rng(0)
    points = np.cumsum(rng.normal(size=(45, 3)) * 1000.0, axis=0)
    values = {"length": 1e4, "value": 3, "radius": 0.001}
    stage = SplineFilter(points[0].copy(), (0, 1, 2))
    stage.push(BlockBatch(setting(stage.code, **values)))
    rows = stage.push(BlockBatch(line_rows(points, 100.0))).rows
    last = stage.drain().rows
    assert len(rows) + len(last) <= 1001 * 44
    assert last["end"][-1, :3] == pytest.approx(points[-1])
