"""Filters make micro-segment programs faster on a jerk-limited machine; what is
driven stays where they say.
"""

import itertools

import numpy as np
import pytest

from cnc_core.blocks import ELEMENT, NO_OVERRIDE, PIECE, POLYNOMIAL
from cnc_core.geometry.filters.run_filter import distances
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.isons_programs import exact_cell
from support.programs import planned, program_of

AXIS = "[axes.{}]\nv_max_mm_s = 300.0\na_max_mm_s2 = 3000.0\nj_max_mm_s3 = 50000.0\n"
CELL = 'name = "cell"\n' + "".join(AXIS.format(name) for name in "XYZ")
AFC = "[isons]\nSGLAFC_X = 120\nSGLAFC_Y = 120\n"


def micro(head, count=160):
    """Segments of 0.15 mm with 3 um of noise on a curve."""
    rng = np.random.default_rng(3)
    t = np.arange(count) * 0.15 / 20
    r = 20 + 4 * np.sin(5 * t)
    points = np.column_stack([r * np.cos(t), r * np.sin(t)]) + rng.uniform(
        -0.003, 0.003, (count, 2)
    )
    points = points.round(4)
    text = f"G60F3\n{head}\nG0X{points[0, 0]}Y{points[0, 1]}\nG1\n"
    return points, text + "".join(f"X{x}Y{y}\n" for x, y in points[1:])


def micro_plan(folder, head, config="", **options):
    """(points, plan) of the micro-segment program with a head."""
    points, text = micro(head)
    return points, planned(
        program_of(folder, text, exact_cell(CELL + config), "isons"), **options
    )


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    "head",
    [
        "G72X1",
        "G72X1Z5",
        "G74X1",
        "G66X1",
        "G66X1Y3",
        "G106[0]X1A0.5\nG106[1]X1A0.5",
        "G73X3A1\nG72X1\nG74X1Y0.1\nG66X2",
    ],
)
def test_machining_time_falls(tmp_path, head):
    """Every filter: less than half of the time, inside all limits, near the
    programmed path, end point exact.
    """
    points, bare = micro_plan(tmp_path, "")
    _, out = micro_plan(tmp_path, "G69X200\n" + head, AFC)
    assert out.motion_time_s < 0.5 * bare.motion_time_s
    assert all(
        value < 1.03 for value in out.max_ratio.values() if value is not None
    )
    driven = out.samples["pos"][:, :2]
    assert driven[-1] == pytest.approx(points[-1], abs=1e-6)
    begin = int(np.argmin(np.linalg.norm(driven - points[0], axis=1)))
    allowed = (
        sum(f["deviation_mm"] for f in out.filters) + out.path_deviation_mm
    )
    assert distances(driven[begin:], points).max() < allowed + 1e-6
    assert out.path_deviation_mm <= 0.005


def test_speed_steps_stay_behind_afc(tmp_path):
    """SGLAFC: no axis is asked for a larger step of speed at a vertex than it
    may take, driven smoothly or not.
    """
    points, out = micro_plan(tmp_path, "G69X200\nG66X1", AFC)
    _, free = micro_plan(tmp_path, "G69X200\nG66X1")
    assert out.motion_time_s > free.motion_time_s
    pos, speed = out.samples["pos"][:, :2], out.samples["v"]
    directions = (
        np.diff(points, axis=0)
        / np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None]
    )
    step = np.abs(np.diff(directions, axis=0)).max(axis=1)
    for vertex, change in zip(points[1:-1], step, strict=True):
        nearest = np.argmin(np.linalg.norm(pos - vertex, axis=1))
        beside = speed[max(0, nearest - 1) : nearest + 2].min()
        assert beside * change <= 2.0 + 0.2


def test_blocks_show_the_segments_and_pieces_are_driven(tmp_path):
    """The rows that are listed are the filter's segments; what is driven are
    smooth pieces behind the same elements.
    """
    _, text = micro("G69X200\nG72X1Y0.5A0.3")
    path = tmp_path / "part.isons"
    path.write_text(text)
    listed = np.concatenate(
        [
            b.rows
            for b in Program(
                path, exact_cell(CELL), "isons", programmed=True
            ).batches()
        ]
    )
    moves = listed[listed["type"] <= POLYNOMIAL]
    assert not (moves["flags"] & (ELEMENT | PIECE)).any()
    ends = moves["end"][:, :2]
    assert np.linalg.norm(np.diff(ends, axis=0), axis=1)[1:-1] == pytest.approx(
        0.3, rel=0.02
    )
    driven = np.concatenate(
        [
            b.rows.copy()
            for b in Program(path, exact_cell(CELL), "isons").batches()
        ]
    )
    elements = driven[
        (driven["type"] <= POLYNOMIAL) & (driven["flags"] & PIECE == 0)
    ]
    assert elements["end"][:, :2] == pytest.approx(ends)
    assert (driven["type"] == POLYNOMIAL).sum() > 5


def test_long_segments_are_driven_exactly(tmp_path):
    """Segments over 1 mm are no micro-segments: nothing is cut off there."""
    path = tmp_path / "part.isons"
    path.write_text("G60F3\nG69X200\nG66X1\nG1X20\nX40Y1\nX60Y0\n")
    assert (
        plan_program(Program(path, exact_cell(CELL), "isons")).path_deviation_mm
        < 1e-9
    )


@pytest.mark.ci
@pytest.mark.parametrize("batch", [1, 7, 4096])
def test_only_the_end_of_a_filtered_run_is_an_exact_stop(tmp_path, batch):
    """Under G61 too, whatever the batches."""
    _, text = micro("G61G69X200\nG72X1Y1A0.1", 400)
    path = tmp_path / "part.isons"
    path.write_text(text)
    program, rows = (
        Program(path, exact_cell(CELL), "isons", programmed=True),
        [],
    )
    while (item := program.read(batch)) is not None:
        rows += [
            row
            for row in getattr(item, "rows", ())
            if row["type"] <= POLYNOMIAL
        ]
    stops = [i for i, row in enumerate(rows) if row["flags"] & 2]
    assert stops == [0, len(rows) - 1]


@pytest.mark.parametrize(
    ("length", "step", "order"),
    [(30.0, 0.02, 4), (0.1, 0.25, 5), (5.0, 0.5, 3), (3.0, 9.0, 2)],
)
def test_reported_deviations_are_those_of_the_rows(
    tmp_path, length, step, order
):
    """Segments much shorter and much longer than the program's: both distances
    as recomputed from the rows.
    """
    rng = np.random.default_rng(5)
    points = np.column_stack(
        [np.arange(25) * length, rng.uniform(-length, length, 25)]
    ).round(4)
    points[0] = 0.0
    path = tmp_path / "part.isons"
    body = "".join(f"X{x}Y{y}\n" for x, y in points[1:])
    path.write_text(
        f"G60G63F3\nG69X200\nG72X1Y{5 * length}A{step}Z{order}\nG1\n{body}"
    )
    program = Program(path, exact_cell(CELL), "isons", programmed=True)
    rows = np.concatenate([batch.rows for batch in program.batches()])
    out = np.vstack(
        [points[:1], rows[rows["type"] <= POLYNOMIAL]["end"][:, :2]]
    )
    report = program.filter_reports[0]
    assert report.cut_mm == pytest.approx(
        float(distances(points, out).max()), abs=1e-9
    )
    share = np.linspace(0.0, 1.0, 41)[:, None]
    dense = np.vstack([a + share * (b - a) for a, b in itertools.pairwise(out)])
    largest = float(
        distances(dense[:: max(1, len(dense) // 20000)], points).max()
    )
    assert largest - 1e-9 <= report.deviation_mm <= largest + 0.05 * length


def test_the_override_has_no_effect_behind_g74(tmp_path):
    """RLS: its motions, as segments and as curves, keep the programmed feed; others do not."""
    _, text = micro("G69X200\nG74X1Y0.3")
    path = tmp_path / "part.isons"
    path.write_text(text + "G74X0\nG1DX1\n")
    for listed in (True, False):
        rows = [
            row
            for b in Program(
                path, exact_cell(CELL), "isons", programmed=listed
            ).batches()
            for row in b.rows
        ]
        driven = [
            row
            for row in rows
            if row["type"] <= POLYNOMIAL and not row["flags"] & ELEMENT
        ]
        fixed = [bool(row["flags"] & NO_OVERRIDE) for row in driven]
        assert fixed == [False, *[True] * (len(fixed) - 2), False]
        assert listed or any(row["type"] == POLYNOMIAL for row in driven)
