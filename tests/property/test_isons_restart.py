"""Restart: a program taken up at any line or marker goes on as if it had never been interrupted."""

import random

import numpy as np
import pytest

from cnc_core.blocks import (
    ELEMENT,
    EVENT,
    EVENT_OVERRIDE,
    LINEAR,
    PIECE,
    POLYNOMIAL,
    M,
    S,
    T,
)
from cnc_core.config import load_config, parse_config
from cnc_core.errors import CncError
from cnc_core.frontend.port import OfflinePort
from cnc_core.program import Program
from cnc_core.program.restart import Restart
from support.isons_programs import CELL, exact_cell
from support.paths import FIVE_AXIS
from support.seeds import few

CONFIG = CELL + "[isons]\nVRIPOSO = 600\n[isons.tools.1]\ndiameter = 4\n"


def program(seed):
    """Loops, subroutines, origins, transformations, incremental words; every motion moves."""
    rng = random.Random(seed)
    lines = [
        "G60 F3",
        "T1 M3 S500",
        "$A=0",
        'MARKER $K "piece"',
        "$K=0",
        "G94X5Y-3",
    ]
    for _ in range(rng.randint(2, 4)):
        lines += [f"LOOP {rng.randint(1, 4)}", "$A=$A+1", "$K=$K+1"]
        for _ in range(rng.randint(1, 4)):
            lines.append(
                rng.choice(
                    [
                        "G1X[$A*3.5+1]",
                        "G91\nY1.25\nG90",
                        "DX1DY2",
                        "G24\nX[$A+7]\nG25",
                        "G50X1Y2Z[$A*15]\nG1X[20+$A]Y3\nG51",
                        "GOSUB PART",
                        "F[1+$A/10]",
                        "$_O3=$A",
                        "G20\nDX0.5\nG21",
                        "USER_ZERO 1\nG92 XY\nX3Y1\nUSER_ZERO 0",
                        "G1DX1\nG3DX4DY0R3\nG1",
                        "G1051X1Y1I2J2\nG1DX1\nG1050",
                        "G36X1A\nG1A[$A*100]\nG36X0A",
                        "$B=$_Q0\nG1X[$B/10+0.7]",
                        "IF $A>2\nG1DX1.5\nELSE\nG1DY1.5\nEND_IF",
                        'LIB_MESSAGE "on?" "cap" 1 3\nIF $_X13=1\nG1DX2\nELSE\nG1DX3\nEND_IF',
                        "G1DY1\nG63\nDX2\nG64\nDY1",
                    ]
                )
            )
        lines.append("END_LOOP")
    lines += [
        "G0Z5",
        "END_PROGRAM",
        "@PART",
        "G91",
        "G1X2Y[$A]",
        "Z0.5",
        "G90",
        "RETURN",
    ]
    return "\n".join(lines) + "\n"


def read_from(path, restart=None, start=None, cell=exact_cell):
    port = OfflinePort(np.zeros(4))
    reader = Program(
        path, cell(CONFIG), "isons", port, restart=restart, start=start
    )
    rows = [row.copy() for batch in reader.batches() for row in batch.rows]
    return rows, reader.reader, port


def motions(rows):
    return [row for row in rows if row["type"] <= POLYNOMIAL]


def told(row):
    place = np.round(row["end"][:4], 9)
    return (
        int(row["line"]),
        *place,
        float(row["feed"]),
        int(row["flags"]),
        int(row["type"]),
    )


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(12), 4))
def test_restart_at_any_line(tmp_path, seed):
    """At the line of any motion, in the pass that reached it: the same motions,
    variables and outputs behind it.
    """
    path = tmp_path / "part.isons"
    path.write_text(program(seed))
    rng = random.Random(seed + 100)
    start = np.array([rng.uniform(-50, 50) for _ in range(4)])
    rows, reader, port = read_from(path, start=start)
    whole = motions(rows)
    for k in rng.sample(range(1, len(whole)), min(6, len(whole) - 1)):
        line = int(whole[k]["line"])
        passes = sum(int(row["line"]) == line for row in whole[: k + 1])
        again, other, ports = read_from(path, Restart(line, passes), start)
        moves = motions(again)
        assert moves[0]["type"] == LINEAR
        assert moves[0]["end"][:4] == pytest.approx(whole[k - 1]["end"][:4])
        assert moves[0]["feed"] == pytest.approx(10)
        assert [told(row) for row in moves[1:]] == [
            told(row) for row in whole[k:]
        ]
        assert other.store.scope.values == reader.store.scope.values
        assert ports._external == port._external
        assert other.channel.frame.total == pytest.approx(
            reader.channel.frame.total
        )
        functions = [
            (int(row["type"]), int(row["code"]), float(row["value"]))
            for row in again[:3]
        ]
        assert functions == [(T, 1, 0), (S, 0, 500), (M, 3, 0)]


def common_rest(moves, whole):
    """How many motions at the end of both are the same."""
    pairs = zip(reversed(moves), reversed(whole), strict=False)
    return next(
        (
            i
            for i, (mine, theirs) in enumerate(pairs)
            if told(mine) != pytest.approx(told(theirs), abs=1e-7)
        ),
        min(len(moves), len(whole)),
    )


@pytest.mark.parametrize("seed", few(range(40), 3))
def test_restart_under_g60_with_its_tolerance(tmp_path, seed):
    """With the default TOL_G60 it begins at the programmed place: the PLC sees the
    same motions, and nothing differs behind the first line that is driven.
    """
    path = tmp_path / "part.isons"
    path.write_text(program(seed))
    rng = random.Random(seed + 200)
    start = np.array([rng.uniform(-50, 50) for _ in range(4)])
    programmed = motions(read_from(path, start=start)[0])
    rows, reader, port = read_from(path, start=start, cell=parse_config)
    whole = driven(rows)
    for k in rng.sample(range(1, len(programmed)), min(3, len(programmed) - 1)):
        line = int(programmed[k]["line"])
        passes = sum(int(row["line"]) == line for row in programmed[: k + 1])
        again, other, ports = read_from(
            path, Restart(line, passes), start, parse_config
        )
        moves = driven(again)
        place = programmed[k - 1]["end"][:4]
        assert moves[0]["end"][:4] == pytest.approx(place)
        blocks = [int(row["count"]) for row in programmed[k:]]
        assert [block for block, _ in elements(again)[1:]] == blocks
        others = moves[1 : len(moves) - common_rest(moves[1:], whole)]
        assert all(int(row["type"]) != LINEAR for row in others[:-1])
        assert other.store.scope.values == reader.store.scope.values
        assert ports._external == port._external


@pytest.mark.parametrize("seed", range(6))
def test_restart_at_a_marker(tmp_path, seed):
    """Behind the block that gives the marker its value, inside loops too."""
    path = tmp_path / "part.isons"
    path.write_text(program(seed))
    whole = motions(read_from(path, start=np.ones(4))[0])
    again, reader, _ = read_from(
        path, Restart(marker="K", value=2.0), np.ones(4)
    )
    tail = [told(row) for row in motions(again)[1:]]
    assert tail == [told(row) for row in whole][len(whole) - len(tail) :]
    assert len(tail) < len(whole)
    assert reader.search.found


def test_places_that_are_not_reached(tmp_path):
    """Error 909170; options that are none."""
    path = tmp_path / "part.isons"
    path.write_text("T1\nG1X1\nG41\nX5\nX9\nG40\n")
    for restart, code in (
        (Restart(99), 909170),
        (Restart(2, 2), 909170),
        (Restart(marker="K", value=1), 909170),
    ):
        with pytest.raises(CncError) as caught:
            read_from(path, restart)
        assert caught.value.code == code
    path.write_text(
        "D4\nG1X1\nG41\nG2X5R9\nG1X9\n"
    )  # what is wrong in the stretch before
    with pytest.raises(CncError) as caught:
        read_from(path, Restart(5))
    assert caught.value.code == 90008
    assert Restart.of(None, 1, "$K = 3") == Restart(marker="K", value=3.0)
    for wrong in ((3, 1, "K=1"), (0, 1, None), (None, 1, "K")):
        with pytest.raises(CncError):
            Restart.of(*wrong)


def test_go_block_macro(tmp_path):
    """M_GOBLOCK moves from where the axes are; $_C tells where the program goes
    on, $_X7 is 2 meanwhile.
    """
    path = tmp_path / "part.isons"
    path.write_text("OPT M_GOBLOCK 8\nG1X10Y10\nX20\n$A=$_X7\nY30\n")
    (tmp_path / "M8.isons").write_text(
        "GLOBAL $S\n$S=$_X7\nG0Z50\nG1X[$_C0]Y[$_C1]\n"
    )
    rows, reader, _ = read_from(
        path, Restart(4), np.array([1.0, 2.0, 3.0, 0.0])
    )
    assert [row["end"][:3].tolist() for row in motions(rows)] == [
        [1, 2, 50],
        [20, 10, 50],
        [20, 10, 3],
        [20, 30, 3],
    ]
    assert (
        reader.store.common.values["S"],
        reader.store.scope.values["A"],
    ) == (2, 0)


def test_positions_are_known_behind_a_restart(tmp_path):
    """$_Q, which the machine answers, tells where the axes are, during the search and behind it."""
    path = tmp_path / "part.isons"
    path.write_text("G1X1F1\n$B=$_Q0\nX5\nX7\n$A=$_Q0\nG1X9\n")
    for line in (2, 3, 4, 5):
        reader = read_from(path, Restart(line), np.array([-3.0, 0, 0, 0]))[1]
        assert (
            reader.store.scope.values["B"],
            reader.store.scope.values["A"],
        ) == (1, 7)


@pytest.mark.parametrize(
    "head",
    [
        "G41",
        "G30R0.4A20",
        "G69X200\nG72X1Y20Z4A0.3",
        'WRITE_PARMAC "MILD_X" 200\nG49X',
    ],
)
@pytest.mark.parametrize("restart", [Restart(11), Restart(marker="K", value=1)])
def test_go_block_macro_where_the_path_reaches_back(tmp_path, head, restart):
    """The macro is executed from where the axes are, then comes the rest of the
    same path; what it sets is its own.
    """
    path = tmp_path / "part.isons"
    lines = [f"G1X{i * 5}Y{3 * (i % 2)}" for i in range(8)]
    body = "\n".join([*lines[:5], "$K=1", *lines[5:]])
    text = f"OPT M_GOBLOCK 8\nF3T1\n{head}\n{body}\nG40\n$A=$_X7\nG1X60\nG0Z1\n"
    path.write_text(text)
    macro = "GLOBAL $S\nGLOBAL $P\n$S=$_X7\nG91\nG0Z50\nG90\nG1F1X[$_C0+1]Y[$_C1]\n$P=$_C0\n"
    (tmp_path / "M8.isons").write_text(macro)
    start = np.array([1.0, 2.0, 3.0, 0.0])
    whole = driven(read_from(path, start=start)[0])
    rows, reader, _ = read_from(path, restart, start)
    moves = driven(rows)
    assert moves[0]["end"][:3].tolist() == [1, 2, 53]
    place, values = moves[2]["end"][:4], reader.store.common.values
    assert moves[1]["end"][:2] == pytest.approx([place[0] + 1, place[1]])
    assert (values["S"], reader.store.scope.values["A"], values["P"]) == (
        2,
        0,
        pytest.approx(place[0]),
    )
    behind = len(whole) - (len(moves) - 3)
    assert behind > 0
    assert whole[behind - 1]["end"][:4] == pytest.approx(place)
    assert [told(row) for row in moves[3:]] == [
        pytest.approx(told(row), abs=1e-7) for row in whole[behind:]
    ]
    functions = [int(row["code"]) for row in rows if row["type"] == T]
    assert functions == [1]


def test_resume_behind_a_broken_tool(tmp_path):
    """RESUME_T goes back to the block of the last T, in its loop and pass, with
    the other tool; out of macros too.
    """
    path = tmp_path / "part.isons"
    path.write_text(
        "GLOBAL $N\nLOOP 2\nT1\nG1DX10\n$N=$N+1\nIF $N=2\nHM5\nEND_IF\nG1DY1\nEND_LOOP\n$A=$_X6\n"
    )
    (tmp_path / "HM5.isons").write_text("G1Z7\nRESUME_T 2\nG1Z0\n")
    config = CONFIG + "[isons.tools.2]\ndiameter = 6\n"
    port = OfflinePort(np.zeros(4))
    found = Program(path, exact_cell(config), "isons", port)
    rows = [row.copy() for batch in found.batches() for row in batch.rows]
    assert [int(row["code"]) for row in rows if row["type"] == T] == [1, 1, 2]
    ends = [row["end"][:3].tolist() for row in motions(rows)]
    assert ends == [
        [10, 0, 0],
        [10, 1, 0],
        [20, 1, 0],
        [20, 1, 7],
        [30, 1, 7],
        [30, 2, 7],
    ]
    assert found.reader.store.scope.values["A"] == 2
    for text, code in (("RESUME_T 1\n", 909172), ("T1\nRESUME_T 9\n", 900014)):
        path.write_text(text)
        with pytest.raises(CncError) as caught:
            read_from(path)
        assert caught.value.code == code


def reaching_back(seed):
    """Compensation, corners, filters: what is driven depends on blocks before and behind."""
    rng = random.Random(seed)
    x = y = 0.0
    lines = ["G60 G63 F3", "T1 M3 S500", "G69X200", f"G0X{x}Y{y}"]
    for _ in range(rng.randint(2, 4)):
        kind = rng.choice(
            ["compensated", "corners", "spline", "low pass", "mild"]
        )
        count = rng.randint(6, 14)
        lines += {
            "compensated": [f"G{rng.choice([41, 42])}"],
            "corners": ["G30R0.4A20"],
            "spline": ["G72X1Y1Z4A0.3"],
            "low pass": ["G106[0]X1A0.6B3", "G106[1]X1A0.6"],
            "mild": ["$M=200", 'WRITE_PARMAC "MILD_X" $M', "G49X"],
        }[kind]
        step = 9.0 if kind in ("compensated", "corners") else 0.5
        for i in range(count):
            x, y = (
                x + step,
                y + rng.uniform(0.3, 0.8) * step * (-1 if i % 2 else 1),
            )
            lines.append(f"G1X{x:.3f}Y{y:.3f}")
        lines += {
            "compensated": ["G40", "G1DX20"],
            "corners": ["G30R0"],
            "spline": ["G72X0"],
            "low pass": ["G106[0]X0", "G106[1]X0"],
            "mild": ["G49"],
        }[kind]
        x += 20.0 if kind == "compensated" else 0.0
        lines.append("M8")
    return "\n".join([*lines, "G0Z5"]) + "\n"


def driven(rows):
    return [
        row
        for row in rows
        if row["type"] <= POLYNOMIAL and not row["flags"] & ELEMENT
    ]


def elements(rows):
    """(block, length) of what the PLC sees."""
    return [
        (int(row["count"]), float(row["length"]))
        for row in motions(rows)
        if not row["flags"] & PIECE
    ]


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(10), 4))
def test_restart_where_the_path_reaches_back(tmp_path, seed):
    """In the middle of compensated contours, rounded corners and filtered runs:
    exactly the rest of the same path.
    """
    path = tmp_path / "part.isons"
    path.write_text(reaching_back(seed))
    rng = random.Random(seed + 50)
    start = np.array([-7.0, 3.0, 1.0, 0.0])
    rows, _, _ = read_from(path, start=start)
    whole = driven(rows)
    lines = sorted({int(row["line"]) for row in whole})
    for line in rng.sample(lines[1:], min(8, len(lines) - 1)):
        again = read_from(path, Restart(line), start)[0]
        moves = driven(again)
        behind = next(i for i, row in enumerate(whole) if row["count"] >= line)
        assert moves[0]["end"][:4] == pytest.approx(
            whole[behind - 1]["end"][:4]
        )
        assert len(moves) - 1 == len(whole) - behind
        for mine, theirs in zip(moves[1:], whole[behind:], strict=True):
            assert told(mine) == pytest.approx(told(theirs), abs=1e-7)
        seen, all_seen = elements(again)[1:], elements(rows)
        assert [n for n, _ in seen] == [n for n, _ in all_seen][
            len(all_seen) - len(seen) :
        ]
        for (_, length), (_, full) in list(
            zip(reversed(seen), reversed(all_seen), strict=False)
        )[:-1]:
            assert length <= full + 1e-9
        pieces = sum(
            float(row["value"]) for row in moves if row["flags"] & PIECE
        )
        covered = sum(
            float(row["length"])
            for row in motions(again)
            if row["flags"] & ELEMENT
        )
        assert pieces == pytest.approx(covered, abs=1e-6)


@pytest.mark.parametrize("line", range(5, 14))
def test_restart_beside_the_end_of_compensation(tmp_path, line):
    """Behind G40 the axes stand beside the contour until a motion of the plane leaves it."""
    path = tmp_path / "part.isons"
    path.write_text(
        "G60G63F3\nD3\nG41\nG1X10\nX20Y9\nX30\nY15\nG40\nG62\nZ7\nX-20\nX1\nY9\n"
    )
    start = np.array([5.0, 6.0, 7.5, 0.0])
    whole, moves = (
        driven(read_from(path, restart, start)[0])
        for restart in (None, Restart(line))
    )
    behind = next(i for i, row in enumerate(whole) if row["count"] >= line)
    assert moves[0]["end"][:4] == pytest.approx(whole[behind - 1]["end"][:4])
    assert [told(row) for row in moves[1:]] == [
        pytest.approx(told(row), abs=1e-7) for row in whole[behind:]
    ]


def test_restart_under_rtcp(tmp_path):
    """The tip's path goes on from where the axes would be."""
    cell = load_config(FIVE_AXIS / "head_head.toml")
    path = tmp_path / "part.isons"
    path.write_text(
        "G103 Z80\nF3\nG0X10Y20Z200\nG104\nG1C30B20\nX50\nC10\nG105\nG1Z300\n"
    )

    def axes(restart):
        port = OfflinePort(np.zeros(5))
        batches = Program(path, cell, "isons", port, restart=restart).batches()
        return [row.copy() for batch in batches for row in driven(batch.rows)]

    whole = axes(None)
    for line in (6, 7, 9):
        again = axes(Restart(line))
        behind = next(i for i, row in enumerate(whole) if row["count"] >= line)
        assert again[0]["end"][:5] == pytest.approx(
            whole[behind - 1]["end"][:5], abs=1e-6
        )
        assert [told(row) for row in again[1:]] == [
            told(row) for row in whole[behind:]
        ]


def test_functions_of_the_stretch_before(tmp_path):
    """The last T, S, spindle and coolant function, and G11, are put out again;
    events on the path are not.
    """
    path = tmp_path / "part.isons"
    for text in ("", "G41\n"):
        path.write_text(
            f"T1 S100\nM3\nG1X1\nG11\nM8\nG100X5\n{text}X20\nS200\nX30\n"
        )
        line = len(path.read_text().splitlines())
        rows = read_from(path, Restart(line))[0]
        told_again = [
            (int(row["type"]), int(row["code"]), float(row["value"]))
            for row in rows
            if row["type"] > POLYNOMIAL
        ]
        assert (T, 1, 0.0) in told_again
        assert (S, 0, 200.0) in told_again
        assert {(M, 3, 0.0), (M, 8, 0.0)} <= set(told_again)
        assert [code for kind, code, _ in told_again if kind == EVENT] == [
            EVENT_OVERRIDE
        ]
