"""Tool radius compensation from program text to rows: selection, corners,
deselection, errors, order.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from cnc_core.blocks import CIRCULAR, COMPENSATION, LINEAR, POLYNOMIAL, H, M
from cnc_core.config import parse_config
from cnc_core.errors import CncError
from cnc_core.frontend.port import Wait
from support.programs import error_of, motions_of, rows_of
from support.programs import program_of as open_program

pytestmark = pytest.mark.sanitize("stages/compensation")

CELL = parse_config(
    "[tools.1]\nradius_mm = 5.0\n[tools.2]\nradius_mm = 3.0\n[tools.3]\nradius_mm = -5.0\n"
)
HEAD = "G00 X0 Y0 D1\nF1200\n"


program_of = partial(open_program, cell=CELL)


def compensated(folder: Path, text: str) -> np.ndarray:
    """All rows of a program on the cell of these tests."""
    return rows_of(program_of(folder, text))


def moves(folder: Path, text: str) -> np.ndarray:
    return motions_of(compensated(folder, text))


def ends(rows: np.ndarray) -> list[tuple[float, float]]:
    return [
        (round(float(x), 6) + 0.0, round(float(y), 6) + 0.0)
        for x, y in rows["end"][:, :2]
    ]


@pytest.mark.parametrize(
    ("code", "radius", "length"),
    [
        (41, 150000, 235619.449019),
        (42, 250000, 392699.081699),
        (40, 200000, 314159.265359),
    ],
)
def test_t2_quarter_arc(
    tmp_path: Path, code: int, radius: float, length: float
) -> None:
    """T2 of the look-ahead specification: radii and length of the compensated
    quarter arc, in 0.1 um.
    """
    text = (
        f"G00 X0 Y-20 D1\nN10 G{code} G01 X20 Y-20 F1000\nN20 Y0\n"
        f"N30 G03 X0 Y20 I-20 J0\nN40 G01 X-20\nG40 X-40\n"
    )
    arc = next(r for r in moves(tmp_path, text) if r["n"] == 30)
    assert arc["type"] == CIRCULAR
    assert arc["radius"] * 1e4 == pytest.approx(radius, abs=1e-6)
    assert arc["length"] * 1e4 == pytest.approx(length, abs=1e-6)
    assert arc["programmed_radius"] * 1e4 == pytest.approx(200000, abs=1e-6)
    assert arc["angle"] == pytest.approx(math.pi / 2)


def test_tangential_joins_make_no_slivers(tmp_path: Path) -> None:
    """Line, arc, line, arc joined tangentially: as many rows as blocks, the
    arcs keep their angle exactly.
    """
    contour = "N1 X20\nN2 G03 X30 Y10 I0 J10\nN3 G01 Y20\nN4 G02 X40 Y30 I10 J0\nN5 G01 X60\n"
    rows = moves(
        tmp_path, f"G00 X-20 Y0 D1\nF1200\nG41 G01 X0\n{contour}G40 X70\n"
    )
    assert [r["n"] for r in rows] == [0, 0, 1, 2, 3, 4, 5, 0]
    arcs = rows[rows["type"] == CIRCULAR]
    assert arcs["angle"] == pytest.approx(
        [math.pi / 2, -math.pi / 2], abs=1e-15
    )
    assert arcs["radius"] == pytest.approx([5, 15], abs=1e-12)


@pytest.mark.parametrize(
    ("mode", "corner", "expected"),
    [
        (138, 25, [(20, 5), (40, 5)]),
        (139, 25, [(15, 5), (40, 5)]),
        (139, 26, [(15, 0), (20, 5), (40, 5)]),
        (237, 26, [(-5, 0), (-5, 20), (0, 25), (0, 25)]),
        (239, 25, [(20, 5), (40, 5)]),
    ],
)
def test_selection_on_the_left_of_an_outer_corner(
    tmp_path: Path, mode: int, corner: int, expected: list
) -> None:
    """Where the approach ends: direct beside the first contour block, indirect
    around the corner, perpendicular.
    """
    text = f"G00 X20 Y-40 D1\nF1200\nG{mode} G{corner}\nN1 G41 G01 X20 Y0\nN2 X40\n"
    if mode == 237:
        text = f"G00 X0 Y0 D1\nF1200\nG{mode} G{corner}\nN1 G41 G01 Y20\nN2 G01 X0.0001\n"
        assert ends(moves(tmp_path, text))[:3] == expected[:3]
        return
    assert ends(moves(tmp_path, text))[1:] == expected


@pytest.mark.parametrize("mode", [138, 139, 239])
def test_selection_at_an_inner_corner_ends_beside_the_contour(
    tmp_path: Path, mode: int
) -> None:
    """Up to 180 degrees direct and indirect selection are the same."""
    text = f"G00 X20 Y40 D1\nF1200\nG{mode} G41 G01 X20 Y0\nX40\n"
    assert ends(moves(tmp_path, text))[1:] == [(20, 5), (40, 5)]


@pytest.mark.parametrize(
    ("mode", "corner", "expected"),
    [
        (138, 25, [(40, 5), (40, -30)]),
        (139, 25, [(45, 5), (40, -30)]),
        (139, 26, [(40, 5), (45, 0), (40, -30)]),
        (237, 25, [(40, 5), (40, 0), (40, -30)]),
    ],
)
def test_deselection_mirrors_selection(
    tmp_path: Path, mode: int, corner: int, expected: list
) -> None:
    """G40 behind an outer corner: how the last contour block ends and where the tool goes."""
    text = f"G00 X0 Y40 D1\nF1200\nG{corner}\nG41 G01 X0 Y0\nX40\nG40 G{mode}\nX40 Y-30\n"
    assert ends(moves(tmp_path, text))[2:] == expected


def test_g239_leaves_the_tool_beside_the_contour(tmp_path: Path) -> None:
    """An axis stays beside its programmed position until it is programmed; an
    arc straight after G40 is refused.
    """
    text = "G00 X0 Y1 D1\nF1200\nG239 G41 G01 X30 Y20\nX120\nG40\n"
    assert ends(moves(tmp_path, text + "G00 X150\nX200\nY0\n"))[2:] == [
        (120, 25),
        (150, 25),
        (200, 25),
        (200, 0),
    ]
    error = error_of(compensated, tmp_path, text + "G02 X140 I10 J0\n")
    assert (error.code, error.place.line) == (906002, 6)


def test_perpendicular_mode_takes_any_block_first_and_last(
    tmp_path: Path,
) -> None:
    """G237: lines perpendicular to an arc, under the numbers of the G41 and G40
    blocks, switching rows before them.
    """
    text = (
        "G00 X10 Y10 D1\nF1200\nG237\nN50 G42\nN55 M8\n"
        "N60 G03 X60 Y60 J50\nN65 M9\nN90 G40\nN100 G00 X0\n"
    )
    rows = compensated(tmp_path, text)
    assert [int(r["n"]) for r in rows] == [0, 55, 50, 60, 65, 90, 100]
    assert [int(r["type"]) for r in rows] == [
        LINEAR,
        M,
        LINEAR,
        CIRCULAR,
        M,
        LINEAR,
        LINEAR,
    ]
    assert ends(rows)[2:4] == [(10, 5), (65, 60)]
    assert rows[3]["radius"] == pytest.approx(55)
    assert ends(rows)[5:] == [(60, 60), (0, 60)]


@pytest.mark.parametrize("code", [41, 42])
def test_tangential_selection_and_deselection(
    tmp_path: Path, code: int
) -> None:
    """G05: one arc that ends, or begins, in the direction of the contour."""
    text = f"G00 X-30 Y-20 D1\nF1200\nN1 G05 G{code} G01 X0 Y0\nN2 X50\nN3 G05 G40 X80 Y-30\n"
    rows = moves(tmp_path, text)
    first, last = rows[1], rows[3]
    side = 5.0 if code == 41 else -5.0
    assert (first["type"], last["type"]) == (CIRCULAR, CIRCULAR)
    assert ends(rows)[1:] == [(0, side), (50, side), (80, -30)]
    assert first["center"][0] == pytest.approx(0)
    assert last["center"][0] == pytest.approx(50)
    for row, start in ((first, (-30, -20)), (last, (50, side))):
        assert math.dist(row["center"], start) == pytest.approx(row["radius"])
        assert math.dist(row["center"], row["end"][:2]) == pytest.approx(
            row["radius"]
        )
        assert row["programmed_radius"] == 0.0


@pytest.mark.parametrize(
    ("second", "lines"),
    [
        ("N2 Y-40", 0),
        ("N2 X20 Y-20", 1),
        ("N2 G02 X20 Y-20 I-20 J0", 1),
        ("N2 G02 X0 Y20 I-20 J10", 2),
    ],
)
@pytest.mark.parametrize("corner", [25, 26])
def test_rows_inserted_behind_a_line(
    tmp_path: Path, second: str, lines: int, corner: int
) -> None:
    """G25 inserts as many lines as the manual's table says, G26 one arc; their
    number is the block's before them.
    """
    text = f"G00 X0 Y40 D1\nF1200\nG{corner} G41 G01 X0 Y0\nN1 X40\n{second}\n"
    rows = moves(tmp_path, text)
    between = rows[rows["n"] == 1][1:]
    if corner == 26:
        assert [int(t) for t in between["type"]] == [CIRCULAR]
        assert between["radius"][0] == pytest.approx(5)
        assert between["programmed_radius"][0] == 0.0
        assert between["angle"][0] < 0
    else:
        assert [int(t) for t in between["type"]] == [LINEAR] * lines
    assert (between["line"] == 4).all()
    assert (between["count"] == 4).all()
    assert (between["feed"] == 20.0).all()


@pytest.mark.parametrize(
    ("second", "lines"),
    [("N2 G02 X20 Y20 I0 J20", 2), ("N2 G02 X50 Y20 I5 J10", 3)],
)
def test_lines_inserted_between_arcs(
    tmp_path: Path, second: str, lines: int
) -> None:
    """Two arcs: two lines up to 270 degrees, three beyond."""
    first = "N1 G02 X40 Y0 I20 J0"
    text = f"G00 X0 Y-40 D1\nF1200\nG41 G01 X0 Y0\n{first}\n{second}\n"
    rows = moves(tmp_path, text)
    assert len(rows[rows["n"] == 1][1:]) == lines


def test_inner_corner_is_the_intersection(tmp_path: Path) -> None:
    """Both blocks end where their offsets meet; nothing is inserted."""
    text = "G00 X0 Y-40 D1\nF1200\nG41 G01 X0 Y0\nX40\nY40\nX0\n"
    assert ends(moves(tmp_path, text))[2:] == [(35, 5), (35, 35), (0, 35)]


def test_switching_rows_keep_their_order(tmp_path: Path) -> None:
    """M, H, markers and moves of other axes stay between their motions, behind
    the rows of the corner.
    """
    text = (
        f"{HEAD}G26\nG41 G01 X0 Y10\nN1 Y40\nN2 M8\nN3 H4\nN4 Z-3\n"
        f"N5 #CONTOUR LOOKAHEAD LOG [PARAM=1]\nN6 X40\nM30\n"
    )
    rows = compensated(tmp_path, text)
    assert [int(n) for n in rows["n"]] == [0, 1, 1, 2, 3, 4, 5, 6, 0]
    assert [int(t) for t in rows["type"][3:5]] == [M, H]
    plunge = rows[5]
    assert plunge["end"][:3] == pytest.approx([0, 45, -3])
    assert plunge["length"] == pytest.approx(3)
    assert COMPENSATION not in rows["type"]


def test_helix_keeps_its_height(tmp_path: Path) -> None:
    """A full turn with a third axis: radius and sweep compensated, the height
    stays, the length is the helix's.
    """
    text = "G00 X20 Y0 D1\nF1200\nG237 G41\nG03 X20 Y0 I-20 J0 Z-4\nG40\n"
    rows = moves(tmp_path, text)
    helix = rows[2]
    assert (helix["type"], helix["radius"]) == (CIRCULAR, 15)
    assert helix["angle"] == pytest.approx(2 * math.pi)
    assert helix["end"][2] == -4
    assert helix["length"] == pytest.approx(math.hypot(30 * math.pi, 4))


def test_planes(tmp_path: Path) -> None:
    """In G18 the offset acts on Z and X, left as seen against Y."""
    rows = moves(tmp_path, "G00 X0 Y7 Z0 D1\nF1200\nG18 G237 G41 G01 Z30\n")
    assert rows["end"][1, :3] == pytest.approx([5, 7, 0])
    assert rows["end"][2, :3] == pytest.approx([5, 7, 30])


def test_negative_radius_swaps_the_side(tmp_path: Path) -> None:
    """G41 with radius -5 is G42 with radius 5."""
    text = "G00 X0 Y-40 D{d}\nF1200\nG{g} G01 X0 Y0\nX40\nY40\n"
    left, right = text.format(d=3, g=41), text.format(d=1, g=42)
    assert ends(moves(tmp_path, left)) == ends(moves(tmp_path, right))


def test_change_of_side(tmp_path: Path) -> None:
    """G42 during G41: the block runs from beside the last contour block to beside the next one."""
    text = (
        "G00 X0 Y-10 D2\nF1200\nG41 G01 X0 Y10\nN10 X20 Y25\n"
        "N20 X40 G42\nN30 X60 Y10\nN40 X0 Y0 G40\n"
    )
    rows = moves(tmp_path, text)
    assert ends(rows)[2:4] == [(18.2, 27.4), (38.2, 22.6)]


def test_circle_at_the_change_of_side_becomes_a_line(tmp_path: Path) -> None:
    """A circular block with the change is driven as a line, with a warning at its place."""
    text = f"{HEAD}G41 G01 X0 Y10\nX20\nG42 G02 X40 I10 J0\nG01 X60\n"
    part = program_of(tmp_path, text)
    rows = np.concatenate([b.rows for b in part.batches()])
    assert [int(t) for t in rows["type"]] == [LINEAR] * 4
    assert [(w.code, w.place.line) for w in part.reader.warnings] == [
        (906005, 5)
    ]


def test_radius_change_takes_effect_along_a_line(tmp_path: Path) -> None:
    """The block behind the new D word begins at the old distance and ends at the new one."""
    text = "G00 X0 Y40 D1\nF1200\nG41 G01 X0 Y0\nX40\nX80 D2\nX120\n"
    assert ends(moves(tmp_path, text))[2:] == [(40, 5), (80, 3), (120, 3)]


def test_contour_feed(tmp_path: Path) -> None:
    """G11: the feed of arcs is that of the contour; G10, the initial state,
    that of the tool centre.
    """
    text = "G00 X20 Y0 D1\nF1200\nG{g} G237 G41\nG03 X-20 I-20\nG40\n"
    assert moves(tmp_path, text.format(g=11))["feed"][2] == pytest.approx(
        20 * 15 / 20
    )
    assert moves(tmp_path, text.format(g=10))["feed"][2] == pytest.approx(20)


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("G41\nG02 X10 Y10 I10 J0\n", 90008, 4),
        ("G41 G01 X0 Y10\nY20\nG02 X6 Y20 I3 J0\n", 0, 0),
        ("G42 G01 X0 Y10\nY20\nG02 X6 Y20 I3 J0\n", 90017, 5),
        ("G41 G01 X0 Y10\nY30\nD2 G02 X40 Y30 I20 J0\n", 90047, 5),
        ("G41 G01 X0 Y10\nX50\nG40\nG02 X70 I10 J0\n", 906002, 6),
        ("G41 G01 X0 Y10\nX10\nY12\nX0\n", 906001, 5),
        ("G41 G01 X0 Y10\nX50\n#FLUSH\n", 20651, 5),
        ("G41 G01 X0 Y10\nX50\n#FLUSH WAIT\n", 20651, 5),
        ("G41 G01 X0 Y10\nX50\n#CONTOUR LOOKAHEAD LOG CLEAR\n", 20651, 5),
        ("G41 G01 X0 Y10\nX50\nG18\n", 20133, 5),
        ("G41 G01 X0 Y10\nX50\nG05 X60\n", 906006, 5),
        ("G236\n", 900003, 3),
        ("G238\n", 900003, 3),
        ("G141\n", 900003, 3),
        ("G41 G42\n", 20114, 3),
        ("G25 G26\n", 20113, 3),
        ("G138 G139\n", 20126, 3),
        ("G138 G05 G41 G01 X20 Y10\nX40\n", 0, 0),
        ("G41 G01 X0 Y10\nY20\nG02 X12 Y20 I6 J0\nG02 X36 Y20 I12 J0\n", 0, 0),
    ],
)
def test_errors_have_number_and_line(
    tmp_path: Path, text: str, code: int, line: int
) -> None:
    """Every refusal names the block; what is allowed passes."""
    if not code:
        assert len(compensated(tmp_path, HEAD + text))
        return
    error = error_of(compensated, tmp_path, HEAD + text)
    assert (error.code, error.place.line) == (code, line)
    assert error.place.file.endswith("part.nc")
    assert error.place.source


@pytest.mark.ci
def test_too_many_rows_between_two_motions(tmp_path: Path) -> None:
    """90011 instead of unbounded memory."""
    error = error_of(
        compensated,
        tmp_path,
        f"{HEAD}G41 G01 X0 Y10\nX50\n" + "M8\n" * 1001 + "X60\n",
    )
    assert (error.code, error.place.line) == (90011, 1005)


def test_rows_ahead_of_an_error_are_handed_out(tmp_path: Path) -> None:
    """The contour up to the refused block is executed, then the error comes, and it stays."""
    part = program_of(
        tmp_path, f"{HEAD}G42 G01 X0 Y10\nY20\nY30\nG02 X6 I3 J0\nG01 X50\n"
    )
    first = part.read()
    assert first is not None
    assert not isinstance(first, Wait)
    assert [int(x) for x in first.rows["line"]] == [3, 4]
    for _ in range(2):
        with pytest.raises(CncError) as caught:
            part.read()
        assert caught.value.code == 90017


def test_nothing_of_a_refused_block_is_handed_out(tmp_path: Path) -> None:
    """An M function in the block of a refused motion is not executed."""
    part = program_of(tmp_path, f"{HEAD}X1 Y1\nG41\nM8 G02 X9 I4 J0\n")
    first = part.read()
    assert first is not None
    assert not isinstance(first, Wait)
    assert [int(t) for t in first.rows["type"]] == [LINEAR]


def test_all_errors_are_collected(tmp_path: Path) -> None:
    """Behind an error the program goes on uncompensated up to the next selection."""
    arc = "G42 G01 X0 Y10\nY20\nG02 X6 I3 J0\nG40 G01 X50\n"
    part = program_of(tmp_path, HEAD + arc + "X0 Y0\n" + arc, collect=True)
    assert sum(len(b) for b in part.batches())
    assert [(e.code, e.place.line) for e in part.errors] == [
        (90017, 5),
        (90017, 10),
    ]


def test_flush_behind_deselection(tmp_path: Path) -> None:
    """Behind G40 a flush is allowed: the contour ends beside its last point,
    the next line leads back.
    """
    text = (
        "G00 X0 Y40 D1\nF1200\nG41 G01 X0 Y0\nX40\nG40\n#FLUSH WAIT\nX40 Y-30\n"
    )
    part = program_of(tmp_path, text)
    items = list(iter(part.read, None))
    assert [isinstance(i, Wait) for i in items].count(True) == 1
    rows = np.concatenate([i.rows for i in items if not isinstance(i, Wait)])
    assert ends(rows[rows["type"] <= POLYNOMIAL])[2:] == [(40, 5), (40, -30)]


def test_program_may_end_under_compensation(tmp_path: Path) -> None:
    """The last block ends beside its programmed end, M30 behind it."""
    rows = compensated(
        tmp_path, "G00 X0 Y40 D1\nF1200\nG41 G01 X0 Y0\nX40\nM30\n"
    )
    assert ends(rows)[2] == (40, 5)
    assert rows[-1]["type"] == M


@pytest.mark.ci
def test_long_programs_need_bounded_memory(tmp_path: Path) -> None:
    """A hundred thousand compensated blocks: one motion is held back at most,
    every block comes out once.
    """
    steps = [
        f"X{i * 0.2:.4f} Y{20 * math.cos(i / 50):.4f}" for i in range(100_000)
    ]
    part = program_of(
        tmp_path,
        "G00 X-1 Y0 D2\nF1200\nG26 G41 G01 X-1 Y20\n"
        + "\n".join(steps)
        + "\nG40 X0 Y0\nM30\n",
    )
    held, lines = [], set()
    for batch in part.batches():
        held.append(part.compensation.held)
        lines.update(batch.rows["line"].tolist())
    assert max(held) <= 2
    assert len(lines) == 100_000 + 4
