"""Random programs against an independent construction, and the scanner against the parser."""

import cmath
import itertools
import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cnc_core.blocks import CIRCULAR
from cnc_core.errors import CncError
from cnc_core.frontend.isg import IsgFrontEnd
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort, Wait

MACHINE = ProgramMachine(
    ("X", "Y", "Z", "A"),
    (False, False, False, True),
    (0, 1, 2),
    np.zeros(4),
    {},
    {3: "MOS"},
)
FIXED = settings(
    max_examples=150, deadline=None, derandomize=True, database=None
)
NUMBER = st.integers(-99999, 99999).map(lambda i: i / 100)


def read(text, scan=True):
    """(rows, error numbers) of a program."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p.nc"
        path.write_text(text)
        try:
            reader = IsgFrontEnd(
                path,
                MACHINE,
                OfflinePort(MACHINE.start),
                collect=True,
                scan=scan,
            )
        except CncError as refused:  # a file that is no text
            place = refused.place
            return np.empty(0), [(refused.code, place.line, place.column)]
        batches = [
            b.rows for b in read_all(reader, 16) if not isinstance(b, Wait)
        ]
    return np.concatenate(batches) if batches else np.empty(0), [
        (e.code, e.place.line, e.place.column) for e in reader.errors
    ]


@pytest.mark.ci
@FIXED
@given(
    st.lists(
        st.tuples(st.booleans(), NUMBER, NUMBER, NUMBER),
        min_size=1,
        max_size=20,
    )
)
def test_lines_end_where_the_words_add_up(moves):
    """Absolute words set, incremental words add; the length is the distance of the end points."""
    text = "F600 G01\n" + "".join(
        f"G{90 + inc} X{x} Y{y} Z{z}\n" for inc, x, y, z in moves
    )
    points = [np.zeros(3)]
    for inc, *xyz in moves:
        points.append(points[-1] + xyz if inc else np.array(xyz))
    wanted = [
        (p, math.dist(p, q))
        for q, p in itertools.pairwise(points)
        if math.dist(p, q) > 1e-9
    ]
    rows, errors = read(text)
    assert not errors
    assert len(rows) == len(wanted)
    for row, (end, length) in zip(rows, wanted, strict=True):
        assert np.allclose(row["end"][:3], end, atol=1e-9)
        assert math.isclose(row["length"], length, rel_tol=1e-12, abs_tol=1e-9)


@pytest.mark.ci
@FIXED
@given(
    st.sampled_from([17, 18, 19]),
    st.complex_numbers(max_magnitude=500),
    st.floats(1, 300),
    st.tuples(st.floats(0, 360), st.floats(1, 359), st.booleans()),
    st.tuples(NUMBER, st.booleans()),
)
def test_arcs_and_helices(plane, centre, radius, angles, form):
    """An arc built from centre, radius and angles is found again from its end
    point and I J K or R.
    """
    first, sweep, ccw = angles
    rise, by_radius = form
    start = centre + cmath.rect(radius, math.radians(first))
    end = centre + cmath.rect(
        radius, math.radians(first + (sweep if ccw else -sweep))
    )
    a, b, c = {17: "XYZ", 18: "ZXY", 19: "YZX"}[plane]
    i, j = ("IJK"["XYZ".index(axis)] for axis in (a, b))
    to_centre = centre - start
    how = f"{i}{to_centre.real:.12f} {j}{to_centre.imag:.12f}"
    if by_radius:
        how = f"R{radius if sweep < 180 else -radius:.12f}"
    text = (
        f"G{plane} F600 G00 {a}{start.real:.12f} {b}{start.imag:.12f} {c}0\n"
        f"G{3 if ccw else 2} {a}{end.real:.12f} {b}{end.imag:.12f} {c}{rise} {how}\n"
    )
    rows, errors = read(text)
    row = rows[-1]
    angle = math.radians(sweep if ccw else -sweep)
    tolerance = (
        1e-4 if by_radius else 1e-6
    )  # half circles are ill-conditioned by radius
    assert not errors
    assert row["type"] == CIRCULAR
    assert math.isclose(row["angle"], angle, abs_tol=tolerance)
    assert math.isclose(row["radius"], radius, rel_tol=1e-6)
    assert abs(complex(*row["center"]) - centre) < radius * tolerance + 1e-6
    assert math.isclose(
        row["length"], math.hypot(radius * angle, rise), rel_tol=tolerance
    )


@FIXED
@given(
    st.floats(1, 100),
    st.floats(0.5, 20),
    st.integers(0, 9),
    st.floats(0.05, 0.95),
    st.floats(1, 359),
)
def test_helix_with_pitch(radius, pitch, turns, part, sweep):
    """Full turns are those that fit into the rise, the rest runs to the end angle."""
    end = cmath.rect(radius, math.radians(sweep))
    rise = pitch * (turns + part)
    rows, errors = read(
        f"F600 G00 X{radius:.12f}\n"
        f"G03 X{end.real:.12f} Y{end.imag:.12f} Z{rise:.12f} "
        f"I-{radius:.12f} K{pitch:.12f}\n"
    )
    assert not errors
    assert math.isclose(
        rows[-1]["angle"],
        2 * math.pi * turns + math.radians(sweep),
        abs_tol=1e-6,
    )


WORD = st.one_of(
    st.builds("{}{}".format, st.sampled_from("XYZAIJKRFxy"), NUMBER),
    st.builds("{}={}".format, st.sampled_from("XYZ"), NUMBER),
    st.sampled_from(
        [
            "G0",
            "G01",
            "G02",
            "G3",
            "G17",
            "G18",
            "G19",
            "G90",
            "G91",
            "F600",
            "N10",
            "(c)",
            "R50",
            "I5 J5",
        ]
    ),
    st.sampled_from(
        [
            "X.5",
            "X5.",
            "X[1+2]",
            "X1e5",
            "X--1",
            "; c",
            "(",
            "Q1",
            "S9",
            "M3",
            "I5 J5",
        ]
    ),
    st.sampled_from(["G70", "G71", "G161", "G162", "G60", "G360", "G359"]),
)
LINE = st.builds(" ".join, st.lists(WORD, max_size=5))


@FIXED
@given(st.lists(LINE, min_size=1, max_size=25))
def test_scanner_and_parser_agree(lines):
    """A program read by the scanner and the same program forced through the
    parser give the same rows and errors.
    """
    text = "F100\n" + "\n".join(lines)
    rows, errors = read(text)
    parsed, parser_errors = read(text, scan=False)
    assert errors == parser_errors
    assert rows.tobytes() == parsed.tobytes()


@pytest.mark.ci
@FIXED
@given(st.text(max_size=200))
def test_any_text_is_read_or_refused(text):
    """No text makes the front end fail in another way than by a numbered error."""
    rows, errors = read(text.encode("utf-8", "replace").decode())
    assert all(code and line for code, line, _ in errors)
    assert rows.size == 0 or np.isfinite(rows["end"]).all()
