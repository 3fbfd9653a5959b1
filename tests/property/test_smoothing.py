"""Smoothing within a tolerance: certified deviation recomputed by dense
sampling, order of rows, smoothness, engine.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import (
    CIRCULAR,
    DWELL,
    EXACT_STOP,
    LINEAR,
    MARKER,
    NC_BLOCK,
    PIECE,
    POLYNOMIAL,
    RAPID,
    SMOOTHING,
    BlockBatch,
    M,
)
from cnc_core.config import AxisConfig, CellConfig
from cnc_core.engine import Engine, Event
from cnc_core.geometry.stages.smoothing import Smoothing, SmoothingMachine
from cnc_core.planning import plan_program
from cnc_core.planning.measure import TrajectoryCheck
from cnc_core.program import Program
from support.drive import FloatArray, line_rows
from support.seeds import few
from support.smoothed_paths import (
    FIVE_AXES,
    MACHINE,
    derivatives,
    distance,
    executed,
    judge,
    programmed,
    rounded_curve,
    sampled,
    smooth,
)

pytestmark = pytest.mark.sanitize("stages/smoothing")

SHAPES: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "walk of all scales": lambda r: np.cumsum(
        r.normal(size=(80, 3)) * r.lognormal(-1, 2, (80, 1)), axis=0
    ),
    "dense CAM data": lambda r: rounded_curve(r, 250, 0.2),
    "coarse CAM data": lambda r: rounded_curve(r, 70, 1.5),
    "tiny segments": lambda r: np.cumsum(
        r.normal(size=(200, 3)) * 0.003 + [0.004, 0, 0], axis=0
    ),
    "spikes": lambda r: np.column_stack(
        [
            np.arange(120) * 0.3,
            np.where(r.random(120) < 0.2, 0.03, 0),
            np.zeros(120),
        ]
    ),
    "out and back": lambda _: np.column_stack(
        [np.tile([0, 5, 4.99, 5, 0], 8), np.arange(40) * 0.01, np.zeros(40)]
    ),
    "nearly straight": lambda r: np.column_stack(
        [np.arange(400) * 0.02, r.normal(size=400) * 2e-5, np.zeros(400)]
    ),
    "right angles": lambda _: np.column_stack(
        [
            np.repeat(np.arange(8), 2),
            np.repeat(np.arange(9), 2)[1:-1],
            np.zeros(16),
        ]
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("tolerance", [0.002, 0.01, 0.1])
def test_the_path_stays_within_the_tolerance(
    shape: str, tolerance: float
) -> None:
    """Both ways, to the exact end, with every programmed row kept as an element
    and its distance covered.
    """
    points = SHAPES[shape](np.random.default_rng(len(shape)))
    points = points - points[0]
    rows = line_rows(points, 100.0)
    batch, report = smooth(rows, points[0], tolerance)
    judge(rows, points[0], tolerance, batch)
    assert report.deviation <= tolerance * (1 + 1e-9)
    assert report.irregular == 0


@pytest.mark.parametrize("chunk", [1, 7, 100])
def test_batches_do_not_matter(chunk: int) -> None:
    """The same rows come out, whatever the batches were."""
    points = rounded_curve(np.random.default_rng(2), 300, 0.3)
    rows = line_rows(points, 100.0)
    whole, _ = smooth(rows, points[0], 0.01)
    parts, _ = smooth(rows, points[0], 0.01, chunk)
    for name in ("end", "length", "type", "flags", "line", "value"):
        assert (whole.rows[name] == parts.rows[name]).all(), name
    assert (whole.pool == parts.pool).all()


def test_joins_of_a_smooth_section_are_smooth() -> None:
    """Tangent and curvature are continuous from piece to piece of dense and of coarse data."""
    for chord in (0.2, 1.5):
        points = rounded_curve(np.random.default_rng(5), 250, chord)
        batch, report = smooth(line_rows(points, 100.0), points[0], 0.01)
        assert (executed(batch)["type"] == POLYNOMIAL).all()
        assert report.fallbacks == 0
        ends = derivatives(batch)
        jump = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=2)
        assert jump[:, 0].max() < 1e-7
        assert jump[:, 1].max() < 1e-6 * max(
            1.0, float(np.linalg.norm(ends[:, :, 1], axis=2).max())
        )


def test_dense_data_needs_few_pieces_and_follows_the_curve_behind_it() -> None:
    """Points of a circle, rounded: about eight blocks a piece, curvature of the circle."""
    angle = np.arange(1200) * 0.2 / 30
    points = (
        30 * np.column_stack([np.cos(angle) - 1, np.sin(angle), 0 * angle])
    ).round(4)
    batch, report = smooth(line_rows(points, 100.0), points[0], 0.01)
    assert report.pieces < len(points) / 4
    curvature = np.linalg.norm(derivatives(batch)[10:-10, 0, 1], axis=1)
    assert np.abs(curvature * 30 - 1).max() < 0.05


def test_long_lines_stay_exact_between_blends() -> None:
    """A square: the corners are blended symmetrically by the tolerance, the
    sides are driven exactly.
    """
    points = np.array(
        [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [0, 0, 0.0]]
    )
    batch, report = smooth(line_rows(points, 100.0), points[0], 0.01)
    pieces = executed(batch)
    assert pieces["type"].tolist().count(POLYNOMIAL) == report.corners == 3
    middle = sampled(batch, points[0])[pieces["type"] == POLYNOMIAL][:, 4]
    assert np.linalg.norm(middle - points[1:4], axis=1) == pytest.approx(
        [0.01] * 3, rel=1e-6
    )
    assert pieces["length"][pieces["type"] == LINEAR].sum() > 39.0


def test_a_line_between_stops_is_the_programmed_row() -> None:
    """What is driven as programmed stays one row, element and piece."""
    points = np.array([[0, 0, 0], [10, 0, 0.0]])
    rows = line_rows(points, 100.0)
    batch, _ = smooth(rows, points[0], 0.01)
    assert batch.rows.tobytes() == rows.tobytes()


def test_true_edges_and_stops_are_met_exactly() -> None:
    """A turn over the limit stays a corner; an exact stop ends on its point and
    stops the last piece.
    """
    points = np.array(
        [
            [0, 0, 0],
            [1, 0, 0],
            [2, 0.2, 0],
            [1, 0.3, 0],
            [0, 0.5, 0],
            [-1, 1, 0],
            [-1, 2, 0.0],
        ]
    )
    rows = line_rows(points, 100.0)
    rows["flags"][4] |= EXACT_STOP
    batch, _ = smooth(rows, points[0], 0.05)
    path = judge(rows, points[0], 0.05, batch)
    for exact in (points[2], points[5]):
        assert np.abs(path[:, -1] - exact).max(axis=1).min() < 1e-12
    pieces = executed(batch)
    stops = pieces[(pieces["flags"] & EXACT_STOP) > 0]
    assert len(stops) == 1
    assert (stops["end"][0][:3] == points[5]).all()


def rows_among(points: FloatArray, at: int, kind: int, flags: int = 0) -> Any:
    rows = line_rows(points, 100.0)
    other = np.zeros(1, NC_BLOCK)
    other["type"], other["flags"], other["line"], other["code"] = (
        kind,
        flags,
        999,
        8,
    )
    rows["count"] = rows["line"]
    return np.concatenate([rows[:at], other, rows[at:]])


@pytest.mark.parametrize("kind", [M, DWELL])
def test_functions_take_effect_on_their_point(kind: int) -> None:
    """An M function cuts a piece, nothing more; a dwell ends the section. Both
    stand behind what comes before them.
    """
    points = rounded_curve(np.random.default_rng(9), 120, 0.3)
    rows = rows_among(points, 60, kind)
    batch, _ = smooth(rows, points[0], 0.01)
    judge(rows[rows["type"] <= POLYNOMIAL], points[0], 0.01, batch)
    at = int(np.flatnonzero(batch.rows["type"] == kind)[0])
    before = BlockBatch(batch.rows[:at], batch.pool)
    pieces = executed(before)
    assert pieces["value"].sum() == pytest.approx(
        rows["length"][:60].sum(), abs=1e-8
    )
    miss = np.linalg.norm(pieces["end"][-1][:3] - points[60])
    assert miss <= (1e-12 if kind == DWELL else 0.01)
    assert len(programmed(before)) == 60
    smooth_there = (
        derivatives(before)[-1, 1, 0]
        - derivatives(BlockBatch(batch.rows[at:], batch.pool))[0, 0, 0]
    )
    assert np.linalg.norm(smooth_there) < 1e-6 or kind == DWELL


def test_markers_keep_their_place_among_the_elements() -> None:
    """LOG rows stand between the same two elements as in the program and do not cut the path."""
    points = rounded_curve(np.random.default_rng(9), 120, 0.3)
    plain, _ = smooth(line_rows(points, 100.0), points[0], 0.01)
    batch, _ = smooth(rows_among(points, 60, MARKER), points[0], 0.01)
    at = int(np.flatnonzero(batch.rows["type"] == MARKER)[0])
    assert len(programmed(BlockBatch(batch.rows[:at]))) == 60
    assert (executed(batch)["length"] == executed(plain)["length"]).all()


def test_a_change_of_feed_cuts_a_piece() -> None:
    """Every piece has one feed, and it covers only motions programmed with that feed."""
    points = rounded_curve(np.random.default_rng(4), 200, 0.3)
    rows = line_rows(points, 100.0)
    rows["feed"][80:150] = 40.0
    batch, _ = smooth(rows, points[0], 0.01)
    pieces, slow = executed(batch), rows["feed"] == 40.0
    for feed, which in ((40.0, slow), (100.0, ~slow)):
        assert pieces["value"][pieces["feed"] == feed].sum() == pytest.approx(
            rows["length"][which].sum(), abs=1e-8
        )


def test_rapid_motion_is_not_smoothed() -> None:
    """G00 passes unchanged; the section ends exactly where it begins."""
    points = rounded_curve(np.random.default_rng(4), 100, 0.3)
    rows = line_rows(points, 100.0)
    rows["flags"][50], rows["feed"][50] = RAPID, 0.0
    batch, _ = smooth(rows, points[0], 0.01)
    judge(rows, points[0], 0.01, batch)
    (at,) = np.flatnonzero(batch.rows["flags"] & RAPID)
    assert batch.rows[at].tobytes() == rows[50].tobytes()


def test_rows_switch_the_smoothing() -> None:
    """NC_SMOOTHING rows: off until the first one, its tolerance, off again; the
    rows themselves are consumed.
    """
    points = rounded_curve(np.random.default_rng(6), 150, 0.5)
    rows, switch = line_rows(points, 100.0), np.zeros(2, NC_BLOCK)
    switch["type"], switch["code"], switch["value"] = SMOOTHING, [1, 0], 0.05
    program = np.concatenate(
        [rows[:50], switch[:1], rows[50:100], switch[1:], rows[100:]]
    )
    batch, report = smooth(program, points[0], 0.0)
    assert (batch.rows["type"] != SMOOTHING).all()
    judge(rows, points[0], 0.05, batch)
    plain = executed(batch)["flags"] & PIECE == 0
    assert plain[:50].all()
    assert plain[-49:].all()
    assert 0.001 < report.deviation <= 0.05


def arc_rows(rng: np.random.Generator) -> tuple[Any, FloatArray, FloatArray]:
    """Lines and arcs in turn, tangential and not; (rows, start, dense points of the contour)."""
    rows, at, dense = np.zeros(30, NC_BLOCK), 0j, [0j]
    for i, row in enumerate(rows):
        if i % 2:
            radius, begin, sweep = (
                rng.lognormal(0.5, 1.0),
                rng.uniform(0, 6),
                rng.uniform(0.3, 5) * rng.choice([-1, 1]),
            )
            centre = at - radius * np.exp(1j * begin)
            turn = np.exp(1j * (begin + sweep * np.linspace(0, 1, 200)))
            dense += list(centre + radius * turn[1:])
            at = centre + radius * turn[-1]
            row["type"], row["plane"], row["center"], row["angle"] = (
                CIRCULAR,
                17,
                (centre.real, centre.imag),
                sweep,
            )
            row["radius"] = row["programmed_radius"] = radius
            row["length"] = radius * abs(sweep)
        else:
            step = complex(*rng.normal(size=2)) * rng.lognormal(0, 1.0)
            at, row["type"], row["length"] = at + step, LINEAR, abs(step)
            dense.append(at)
        row["end"][:2], row["feed"], row["line"] = (
            (at.real, at.imag),
            100.0,
            i + 1,
        )
    points = np.array(dense)
    return (
        rows,
        np.zeros(3),
        np.column_stack([points.real, points.imag, 0 * points.real]),
    )


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(4), 2))
def test_arcs_and_lines_are_smoothed_together(seed: int) -> None:
    """Deviation from the true arcs, not from chords."""
    rows, start, dense = arc_rows(np.random.default_rng(seed))
    batch, _ = smooth(rows, start, 0.01)
    points = sampled(batch, start).reshape(-1, 3)
    assert (
        distance(dense, points) <= 0.01 + 4e-4
    )  # what 200 chords leave out of the largest arcs
    assert distance(points, dense[::4]) <= 0.0105
    assert np.abs(points[-1] - rows["end"][-1][:3]).max() < 1e-9


def five_axis_points(rng: np.random.Generator, n: int = 300) -> FloatArray:
    t = np.cumsum(rng.uniform(0.004, 0.02, n))
    main = np.column_stack(
        [30 * np.cos(t) - 30, 30 * np.sin(t), 4 * np.sin(3 * t)]
    )
    return np.column_stack([main, 20 * np.sin(2 * t), 90 * t]).round(4)


def test_rotary_axes_have_their_own_tolerance() -> None:
    """Linear and rotary deviation each within theirs, at the same place of the contour."""
    points = five_axis_points(np.random.default_rng(1))
    rows = line_rows(points, 100.0)
    rows["length"] = rows["length_min"] = np.linalg.norm(
        np.diff(points[:, :3], axis=0), axis=1
    )
    batch, _ = smooth(
        rows, points[0], 0.01, machine=FIVE_AXES, rotary_tolerance=0.05
    )
    path = sampled(batch, points[0]).reshape(-1, 5)
    assert distance(points[:, :3], path[:, :3]) <= 0.01
    assert distance(points[:, 3:], path[:, 3:]) <= 0.05
    scaled = np.array([1, 1, 1, 0.2, 0.2])
    assert distance(points * scaled, path * scaled) <= 0.01 * np.sqrt(2)
    assert len(executed(batch)) < len(rows)


def test_rotary_motion_alone_passes_unchanged() -> None:
    """Where the main axes rest there is no path to smooth."""
    points = np.zeros((20, 5))
    points[:10, 0], points[10:, 0] = np.arange(10) * 0.3, 2.7
    points[10:, 4] = np.arange(1, 11) * 3.0
    rows = line_rows(points, 50.0)
    batch, _ = smooth(rows, points[0], 0.01, machine=FIVE_AXES)
    alone = executed(batch)[-10:]
    assert alone.tobytes() == rows[-10:].tobytes()


@pytest.mark.parametrize(
    "shape",
    [
        "dense CAM data",
        "coarse CAM data",
        "walk of all scales",
        "tiny segments",
    ],
)
def test_the_engine_drives_what_comes_out(shape: str) -> None:
    """Limits and deviation of the samples by the check that did not plan; the
    PLC's element follows the path.
    """
    points = SHAPES[shape](np.random.default_rng(3))
    points = points - points[0]
    rows = line_rows(points, 100.0)
    batch, _ = smooth(rows, points[0], 0.01)
    cell = CellConfig()
    engine, check, seen = (
        Engine(cell, record_rows=65536),
        TrajectoryCheck(cell),
        [],
    )
    check.table.add(batch.rows, batch.pool)
    first = 0
    while (event := engine.run(1_000_000)) in (
        Event.NEED_BLOCKS,
        Event.RECORD_FULL,
    ):
        if event is Event.NEED_BLOCKS:
            first += engine.push(batch, first)
            if first == len(batch.rows):
                engine.finish()
        samples = engine.take_samples()
        check.add(samples)
        seen.append(samples.element)
    samples = engine.take_samples()
    check.add(samples)
    check.finish()
    seen.append(samples.element)
    assert event is Event.PROGRAM_END
    assert check.ratio["velocity"] <= 1.0
    assert check.ratio["acceleration"] <= 1.02
    assert check.ratio["feed"] <= 1.005
    assert check.deviation <= 0.01 + 1e-9
    assert engine.state.infeasible == 0
    elements = np.concatenate(seen)
    assert (np.diff(elements) >= 0).all()
    assert elements[-1] == len(rows) - 1
    assert (samples.pos[-1] == points[-1]).all() or np.abs(
        samples.pos[-1] - points[-1]
    ).max() < 1e-9
    engine.close()


def test_plan_uses_the_tolerance(program: Callable[..., Path]) -> None:
    """plan --tolerance: faster through fine data, the deviation told."""
    points = rounded_curve(np.random.default_rng(8), 600, 0.3)
    text = "\n".join(
        [
            "G90 F6000",
            *(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in points[1:]),
            "M30",
            "",
        ]
    )
    path = program(text)
    exact = plan_program(Program(path, CellConfig()))
    loose = plan_program(Program(path, CellConfig(), tolerance=0.01))
    assert exact.path_deviation_mm < 1e-9
    assert 0 < loose.path_deviation_mm <= 0.01
    assert loose.motion_time_s < 0.95 * exact.motion_time_s
    assert loose.blocks == exact.blocks
    assert loose.max_ratio["acceleration"] <= 1.02


def test_a_long_stream_needs_no_more_memory() -> None:
    """Rows come out as they go in: what the stage holds back is bounded, and so
    is Python's memory.
    """
    points = rounded_curve(np.random.default_rng(1), 20_000, 0.05)
    rows = line_rows(points, 100.0)
    stage, behind, peak = Smoothing(points[0], MACHINE, 0.01), 0, 0
    tracemalloc.start()
    for i in range(0, len(rows), 1000):
        behind += 1000 - len(
            programmed(stage.push(BlockBatch(rows[i : i + 1000])))
        )
        peak = max(peak, behind)
    memory = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3000
    assert memory < 5_000_000


def test_axes_of_the_cell_reach_the_stage() -> None:
    """A cell with rotary axes smooths without main axes being confused."""
    cell = CellConfig(
        axes={
            "C": AxisConfig(kind="rotary"),
            "X": AxisConfig(),
            "Z": AxisConfig(),
        }
    )
    machine = SmoothingMachine(cell.main_axes, 1, 3000.0, 100.0)
    x = np.arange(100) * 0.2
    points = np.column_stack([3 * np.sin(x), x, np.sin(x)]).round(4)
    rows = line_rows(points, 50.0)
    rows["length"] = np.linalg.norm(np.diff(points[:, 1:], axis=0), axis=1)
    batch, _ = smooth(rows, points[0], 0.01, machine=machine)
    engine = Engine(cell)
    assert engine.push(batch) == len(batch)
    engine.close()
