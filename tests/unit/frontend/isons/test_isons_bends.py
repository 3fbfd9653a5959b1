"""Long output segments of G72: the spline is driven, whose chords they are."""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BSpline
from shapely.geometry import LineString, Point

from cnc_core.blocks import ELEMENT, PIECE, POLYNOMIAL
from cnc_core.planning import PlanResult
from cnc_core.program import Program
from support.programs import planned, program_of

AXIS = "[axes.{}]\nv_max_mm_s = 300.0\na_max_mm_s2 = 3000.0\n"
JERK = "j_max_mm_s3 = 50000.0\n"


def cell(jerk: bool) -> str:
    axes = "".join(AXIS.format(n) + (JERK if jerk else "") for n in "XYZ")
    return 'name = "cell"\n' + axes


def sine(wave: float, step: float = 0.1) -> np.ndarray:
    """(n, 2) points of a sine of 0.4 mm over 12 mm."""
    x = np.arange(0.0, 12.0 + 1e-9, step)
    return np.column_stack([x, 0.4 * np.sin(2 * np.pi * x / wave)]).round(4)


def program(folder: Path, head: str, wave: float, jerk: bool = True) -> Program:
    points = sine(wave)
    body = "".join(f"X{x}Y{y}\n" for x, y in points[1:])
    text = f"G60F3\nG69X200\n{head}\nG0X0Y0\nG1\n{body}"
    return program_of(folder, text, cell(jerk), "isons")


def plan(folder: Path, head: str, wave: float, jerk: bool = True) -> PlanResult:
    return planned(program(folder, head, wave, jerk))


@pytest.mark.ci_cases
@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("wave", [4.0, 7.3])
def test_long_segments_take_no_longer_than_no_filter(
    tmp_path: Path, wave: float, jerk: bool
) -> None:
    """Segments of 1 and 2 mm on a sine of 0.4 mm: corners of 50 degrees
    between them are none of the spline."""
    without = plan(tmp_path, "", wave, jerk).motion_time_s
    for step in (1, 2):
        found = plan(tmp_path, f"G72X1Y1A{step}", wave, jerk)
        assert found.motion_time_s < 1.02 * without
        ratios = [r for r in found.max_ratio.values() if r is not None]
        assert max(ratios) < 1.02


def test_what_is_driven_is_the_spline(tmp_path: Path) -> None:
    """The axes follow the clamped uniform B-spline of the programmed points."""
    points, degree = sine(4.0), 2
    spans = len(points) - degree
    knots = np.clip(np.arange(-degree, spans + degree + 1), 0, spans)
    curve = BSpline(knots.astype(float), points, degree)(
        np.linspace(0.0, spans, 20001)
    )
    found = plan(tmp_path, "G72X1Y1A1", 4.0)
    driven = found.samples["pos"][::7, :2]
    away = [float(np.hypot(*(curve - p).T).min()) for p in driven]
    assert max(away) < 0.03
    # what is reported bounds how far it leaves the chords
    rows = np.concatenate(
        [b.rows for b in program(tmp_path, "G72X1Y1A1", 4.0).batches()]
    )
    seen = rows[(rows["type"] <= POLYNOMIAL) & (rows["flags"] & PIECE == 0)]
    chords = LineString(np.vstack([[0.0, 0.0], seen["end"][:, :2]]))
    most = max(Point(p).distance(chords) for p in driven)
    assert 0.05 < most <= found.path_deviation_mm


@pytest.mark.parametrize("size", [1, 7, 4096])
def test_the_plc_sees_the_segments(tmp_path: Path, size: int) -> None:
    """Elements of 1 mm, whose programmed lengths the pieces cover, in batches
    of any size."""
    source, found = program(tmp_path, "G72X1Y1A1", 4.0), []
    while (item := source.read(size)) is not None:
        found += [
            r for r in getattr(item, "rows", ()) if r["type"] <= POLYNOMIAL
        ]
    rows = np.array(found)
    seen = rows[rows["flags"] & PIECE == 0]
    ends = np.vstack([[0.0, 0.0], seen["end"][:, :2]])
    lengths = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    assert lengths == pytest.approx(seen["length"], abs=1e-9)
    assert (lengths[1:-1] < 1.0 + 1e-6).all()
    assert (lengths[1:-1] > 0.95).all()
    assert not seen["center"].any()
    assert not seen["degree"].any()
    pieces = rows[rows["flags"] & PIECE != 0]
    elements = seen[seen["flags"] & ELEMENT != 0]
    assert pieces["value"].sum() == pytest.approx(elements["length"].sum())
    stops = np.flatnonzero(rows["flags"] & 2)
    assert len(stops) <= 1


@pytest.mark.parametrize("head", ["G72X1Y1A1\nG74X1Y0.3", "G72X1Y1A1\nG66X1"])
def test_other_filters_take_segments(tmp_path: Path, head: str) -> None:
    """The end is reached behind filters that change the segments or their feeds."""
    found = plan(tmp_path, head, 4.0)
    assert found.samples["pos"][-1][:2] == pytest.approx(
        sine(4.0)[-1], abs=1e-6
    )
