"""What a filter reports is what is driven: recomputed from the samples of ``plan`` with shapely."""

import numpy as np
import pytest
import shapely

from cnc_core.blocks import LINEAR, BlockBatch
from cnc_core.config import parse_config
from cnc_core.geometry.filters.run_filter import distances, farthest
from cnc_core.program import Program
from support.programs import planned, program_of

AXIS = "[axes.{}]\nv_max_mm_s = 300.0\na_max_mm_s2 = 3000.0\nj_max_mm_s3 = 50000.0\n"
CELL = (
    'name = "cell"\n'
    + "".join(AXIS.format(name) for name in "XYZ")
    + "[isons]\nSGLAFC_X = 300\nSGLAFC_Y = 300\n"
)
COARSE = np.array(
    [
        (107.16, 130.27),
        (100.59, 131.18),
        (100.14, 129.37),
        (96.74, 130.73),
        (95.38, 129.14),
        (92.66, 130.5),
        (89.95, 128.46),
        (86.55, 131.41),
        (82.24, 129.14),
        (77.71, 132.31),
        (72.95, 128.91),
        (67.97, 132.31),
        (62.98, 129.37),
        (57.55, 133.45),
        (52.34, 129.59),
    ]
)
SMALL_MM = 1e-4  # samples are some um apart


def micro(count=120):
    """0.15 mm apart, with some um of noise and a sharp corner in the middle."""
    rng = np.random.default_rng(11)
    t = np.arange(count) * 0.15 / 20
    r = 20 + 4 * np.sin(5 * t)
    points = np.column_stack([r * np.cos(t), r * np.sin(t)]) + rng.uniform(
        -0.004, 0.004, (count, 2)
    )
    points[count // 2 :, 1] -= 2 * (
        points[count // 2 :, 1] - points[count // 2, 1]
    )
    return points.round(4)


def driven_plan(folder, points, head, feed, tail=""):
    """The plan of lines through the points behind a head."""
    body = "".join(f"X{x}Y{y}\n" for x, y in points[1:])
    begin = f"G60F3\n{head}\nG0X{points[0, 0]}Y{points[0, 1]}\n"
    text = f"{begin}G1F{feed}\n{body}{tail}"
    return planned(program_of(folder, text, CELL, "isons"))


def measured(out, points):
    """(driven from programmed, programmed from driven, half of the way between samples), mm."""
    driven = out.samples["pos"][:, :2]
    driven = driven[
        int(np.argmin(np.linalg.norm(driven - points[0], axis=1))) :
    ]
    dense = shapely.get_coordinates(
        shapely.segmentize(shapely.LineString(points), 0.005)
    )
    apart_at_most = (
        float(np.linalg.norm(np.diff(driven, axis=0), axis=1).max()) / 2
    )
    return apart(driven, points), apart(dense, driven), apart_at_most


def apart(points, line):
    """Largest distance of points from a polyline."""
    moved = np.flatnonzero(np.linalg.norm(np.diff(line, axis=0), axis=1) > 0)
    tree = shapely.STRtree(
        shapely.linestrings(np.stack([line[moved], line[moved + 1]], axis=1))
    )
    return float(
        tree.query_nearest(
            shapely.points(points), all_matches=False, return_distance=True
        )[1].max()
    )


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    "head",
    [
        "G72X1",
        "G72X1Z2",
        "G72X1Z6A0.05",
        "G72X1Y0.3A0.9",
        "G74X1Y0.4",
        "G66X1",
        "G106[0]X1A0.4B1\nG106[1]X1A0.7",
        "G73X1Y1",
        "G73X3A1\nG72X1\nG74X1Y0.1\nG106[0]X1A0.5B1\nG66X2",
    ],
)
def test_micro_segments_are_driven_as_reported(tmp_path, head):
    """The total bounds what is measured and is hardly above it; the first
    filter's own number is the total.
    """
    points = micro()
    out = driven_plan(tmp_path, points, "G69X200\n" + head, 0.3)
    deviation, cut, between = measured(out, points)
    assert deviation <= out.filtered["deviation_mm"] + 1e-6
    assert out.filtered["deviation_mm"] <= deviation + between + SMALL_MM
    assert out.filtered["cut_mm"] == pytest.approx(cut, rel=0.02, abs=SMALL_MM)
    assert out.filters[0]["deviation_mm"] == pytest.approx(
        out.filtered["deviation_mm"], abs=1e-9
    )
    assert out.filtered["deviation_mm"] > 0.0005


@pytest.mark.ci
@pytest.mark.parametrize(
    "head",
    ["G72X1Y7", "G72X1Y7Z5", "G72X1Y7A1", "G73X1Y45Z5", "G74X1Y2.5", "G72X1Y5"],
)
def test_coarse_paths_are_driven_as_reported(tmp_path, head):
    """The path of the specification's filter cases, what stands behind the
    filter's end included.
    """
    out = driven_plan(
        tmp_path,
        COARSE,
        "G69X200\n" + head,
        1,
        "G72X0G73X0\nG74X0\nG0X40Y0\nG1X50Y20\n",
    )
    back = np.vstack([COARSE, [40.0, 0.0], [50.0, 20.0]])
    deviation, cut, between = measured(out, back)
    report = out.filters[0]
    assert (
        deviation - 1e-6
        <= report["deviation_mm"]
        <= deviation + min(between, 0.01) + SMALL_MM
    )
    assert report["cut_mm"] == pytest.approx(cut, rel=0.01, abs=1e-3)


@pytest.mark.parametrize("between", ["", "G62\n", "G4F0.01\n"])
@pytest.mark.parametrize(
    "head", ["G72X1Y7", "G72X1Y7Z1", "G73X1Y45Z5", "G106[0]X1A0.5B8"]
)
def test_the_way_ahead_of_a_filter_does_not_count(tmp_path, head, between):
    """Switched on where the contour begins: the same numbers as in front of the way there."""
    body = "".join(f"X{x}Y{y}\n" for x, y in COARSE[1:])
    found = []
    for order in ("{on}{way}", "{way}{on}"):
        text = order.format(
            on=f"G69X200\n{head}\n", way="G0X107.16Y130.27\n" + between
        )
        path = tmp_path / "part.isons"
        path.write_text(f"G60F3\n{text}G1\n{body}")
        program = Program(path, parse_config(CELL), "isons", programmed=True)
        list(program.batches())
        found.append((program.filtered.deviation_mm, program.filtered.cut_mm))
    assert found[0] == pytest.approx(found[1], abs=1e-6)
    assert found[0][1] < 8


def test_splines_of_the_lowest_orders_are_not_slower(tmp_path):
    """Orders 1 and 2 keep the path: no deviation, and no more time than without a filter."""
    bare = driven_plan(tmp_path, COARSE, "", 3)
    for order in (1, 2):
        out = driven_plan(tmp_path, COARSE, f"G69X200\nG72X1Y7Z{order}", 3)
        assert out.motion_time_s <= bare.motion_time_s * (1 + 1e-9)
        assert out.filtered["deviation_mm"] < 1e-9


def test_without_a_filter_nothing_is_reported(tmp_path):
    """The edges that --tolerance or G49 round are no deviation of a filter."""
    out = driven_plan(tmp_path, COARSE, "G69X200", 3)
    assert out.filters == []
    assert out.filtered == {"deviation_mm": 0.0, "cut_mm": 0.0}


@pytest.mark.ci
def test_reports_of_long_runs_do_not_depend_on_their_stretches(tmp_path):
    """8000 blocks, more than what is kept: as recomputed from the rows that are
    driven; switched off, it stays.
    """
    rng = np.random.default_rng(2)
    points = np.column_stack(
        [np.cumsum(rng.uniform(0.05, 0.3, 8000)), rng.uniform(-0.2, 0.2, 8000)]
    ).round(4)
    points[0] = 0.0
    body = "".join(f"X{x}Y{y}\n" for x, y in points[1:])
    path = tmp_path / "part.isons"
    path.write_text(
        f"G60G63F3\nG69X200\nG73X1Z0.2Y30\nG106[1]X1A0.3B5\nG1\n{body}G69X0\nG1X0Y5\n"
    )
    for size in (977, 4096):
        program, rows = (
            Program(path, parse_config(CELL), "isons", programmed=True),
            [],
        )
        while (item := program.read(size)) is not None:
            assert len(program.filtered._programmed.counts) < 3 * 4096 + size
            if isinstance(item, BlockBatch) and len(item):
                rows.append(item.rows[item.rows["type"] == LINEAR])
        out = np.vstack([[0.0, 0.0], np.concatenate(rows)["end"][:-1, :2]])
        assert program.filtered.deviation_mm == pytest.approx(
            farthest(out, points), abs=2e-6
        )
        assert program.filtered.cut_mm == pytest.approx(
            farthest(points, out), abs=2e-6
        )


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", range(8))
def test_distances_of_polylines(seed):
    """Against shapely, in the plane and, turned, in space; ``known`` is never undercut."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 200, 2)
    mine, other = (
        np.cumsum(rng.normal(size=(n, 2)), axis=0),
        np.cumsum(rng.normal(size=(m, 2)), axis=0),
    )
    line = shapely.LineString(other) if m > 1 else shapely.Point(other[0])
    expected = shapely.distance(line, shapely.points(mine))
    assert distances(mine, other) == pytest.approx(expected, abs=1e-12)
    dense = (
        shapely.get_coordinates(
            shapely.segmentize(shapely.LineString(mine), 0.01)
        )
        if n > 1
        else mine
    )
    largest = float(shapely.distance(line, shapely.points(dense)).max())
    assert largest - 1e-6 <= farthest(mine, other) <= largest + 0.01
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    assert farthest(mine @ turned, other @ turned) == pytest.approx(
        farthest(mine, other), abs=2e-6
    )
    assert farthest(mine, other, 1e6) == 1e6
