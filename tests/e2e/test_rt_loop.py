"""Real-time loops through the command line: what is logged (T3), what is
refused, what the PLC controls.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from support.command_line import Outcome
from support.inside import Inside

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
CELL = "[axes.X]\nstart_mm = -5\n[axes.Y]\n[axes.Z]\n"
HEAD = "N010 G00 X-5 Y0\nN020 G01 X0 Y0 F1000\n"
MARK_ON, MARK_OFF = "#CONTOUR LOOKAHEAD LOG ON", "#CONTOUR LOOKAHEAD LOG OFF"
BODY = "N080 G1 X4 Y4\nN090 X8 Y4\nN100 X8 Y0\nN110 X4 Y-3\nN120 X0 Y0\n"
LENGTHS = [56568.542495, 40000.0, 40000.0, 50000.0, 50000.0]
FIRST = [0.785398, 0.785398, 1.570796, 0.927295, 1.287002]
LATER = [1.712693, *FIRST[1:]]


def _log(cli: Cli, program: Write, text: str) -> Any:
    cell = program(CELL, "cell.toml")
    return cli(
        "lookahead", program(text), "--index", 0, "--config", cell, "--json"
    ).json


def _elements(answer: Any) -> list[tuple[float, float, float]]:
    lines = [e for e in answer["response"] if e["block_type"] == 1]
    return [
        (e["start_position"], e["length"], e["tangent_variation"])
        for e in lines
    ]


def _expected(
    copies: int, start: float = 50000.0
) -> list[tuple[float, float, float]]:
    out = []
    for copy in range(copies):
        for length, angle in zip(
            LENGTHS, FIRST if copy == 0 else LATER, strict=True
        ):
            out.append((start, length, angle))
            start += length
    return out


def test_marked_outside_three_copies(cli: Cli, program: Write) -> None:
    """T3: ON before and OFF behind the loop log it three times; the block
    behind follows the third copy.
    """
    text = (
        f"{HEAD}N060 {MARK_ON} [PARAM=1]\n#RT WHILE\n{BODY}#RT ENDWHILE\n"
        f"N140 G1 X0 Y10\nN150 {MARK_OFF} [PARAM=8]\n"
    )
    answer = _log(cli, program, text)
    got, want = (
        _elements(answer),
        [*_expected(3), (759705.627485, 100000.0, 0.927295)],
    )
    assert len(got) == len(want)
    for mine, theirs in zip(got, want, strict=True):
        assert mine == pytest.approx(theirs, abs=1e-5)
    assert answer["state"]["count_logged_blocks"] == 18
    assert not answer["state"]["f_log_is_active"]


@pytest.mark.ci
def test_marked_inside_once(cli: Cli, program: Write) -> None:
    """T3, variant inside: seven entries, the elements of the entering pass."""
    text = f"{HEAD}#RT WHILE\nN075 {MARK_ON}\n{BODY}N125 {MARK_OFF}\n#RT ENDWHILE\nN150 G1 X0 Y10\n"
    answer = _log(cli, program, text)
    assert answer["state"]["count_logged_blocks"] == 7
    for mine, theirs in zip(_elements(answer), _expected(1), strict=True):
        assert mine == pytest.approx(theirs, abs=1e-5)


@pytest.mark.ci
@pytest.mark.parametrize(("on_inside", "count"), [(True, 4), (False, 2)])
def test_marked_half_inside(
    on_inside: bool, count: int, cli: Cli, program: Write
) -> None:
    """ON inside and OFF outside, or the reverse: three copies of the marked elements."""
    lines = BODY.splitlines(keepends=True)
    if on_inside:
        text = (
            f"{HEAD}#RT WHILE\n{lines[0]}{MARK_ON}\n"
            f"{''.join(lines[1:])}#RT ENDWHILE\n{MARK_OFF}\n"
        )
    else:
        text = (
            f"{HEAD}{MARK_ON}\n#RT WHILE\n{''.join(lines[:2])}{MARK_OFF}\n"
            f"{''.join(lines[2:])}#RT ENDWHILE\n"
        )
    answer = _log(cli, program, text)
    assert len(_elements(answer)) == 3 * count
    starts = [e[0] for e in _elements(answer)]
    assert starts[count] - starts[0] == pytest.approx(sum(LENGTHS), abs=1e-5)
    assert [e["block_type"] for e in answer["response"]][-1] == 5


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        (
            "G1 X1 F100\n#RT WHILE\nG1 X2\nX1\n#CONTOUR LOOKAHEAD LOG CLEAR\n#RT ENDWHILE\n",
            22073,
            5,
        ),
        ("G1 X1 F100\n#RT WHILE\nG1 X2\nM8\nX1\n#RT ENDWHILE\n", 22073, 4),
        ("G1 X1 F100\n#RT WHILE\nG1 X2\nG4 1\nX1\n#RT ENDWHILE\n", 22073, 4),
        ("G1 X1 F100\n#RT WHILE\nG1 X2\nX1\nM30\n#RT ENDWHILE\n", 22073, 5),
        (
            "G1 X1 F100\n#RT WHILE\nG1 X2\n#RT WHILE\nX1\n#RT ENDWHILE\n",
            22181,
            4,
        ),
        ("G1 X1 F100\n#RT ENDWHILE\n", 22181, 2),
        (
            "G1 X1 F100\n#SPLINE ON\nX2\n#RT WHILE\nX1\n#RT ENDWHILE\n",
            22128,
            4,
        ),
        (
            "G1 X1 F100\n#RT WHILE\n#SPLINE ON\nX2\nX1\n#RT ENDWHILE\n",
            22129,
            6,
        ),
        ("G1 X1 F100\n#RT WHILE\nG1 X2\nX1\n", 22181, 2),
        ("G1 X1 F100\n#RT WHILE\nG1 X2\n#RT ENDWHILE\n", 50991, 4),
        (
            "G17 G41 D1 G1 X1 F100\n#RT WHILE\nG1 X2\nX1\n#RT ENDWHILE\n",
            22158,
            2,
        ),
    ],
)
def test_refused(
    text: str, code: int, line: int, cli: Cli, program: Write
) -> None:
    """Wrong loops are refused with the manual's number at their place."""
    cell = program(
        "[axes.X]\n[axes.Y]\n[axes.Z]\n[tools.1]\nradius_mm = 1.0\n",
        "cell.toml",
    )
    outcome = cli("check", program(text), "--config", cell, "--json")
    assert [(e["code"], e["line"]) for e in outcome.json["errors"]][:1] == [
        (code, line)
    ]


@pytest.mark.parametrize("modulo", [False, True])
def test_the_plc_ends_the_loop(modulo: bool, tmp_path: Path) -> None:
    """The condition is taken at the end of each pass without a stop; with
    MODULO the distance begins anew. #SPLINE may stand inside.
    """
    text = (
        f"G1 X10 F6000\n#RT WHILE{' [MODULO]' if modulo else ''}\nX20\n"
        f"Y10\nX10\nY0\n#RT ENDWHILE\nN90 X0\n"
    )
    with Inside(tmp_path, text) as cnc:
        cnc.level(cnc.bahn.rt_loop_enable, True)
        seen = []
        for _ in range(2000):
            cnc.run(1)
            seen.append(cnc.state.dist_prog_start / 10000)
            assert (
                cnc.clah.state.max_dist_prog_start
                >= cnc.state.dist_prog_start - 1e-3
            )
        passes = round((max(seen) - 10) / 40)
        assert (
            max(seen) == pytest.approx(50.0, abs=0.5) if modulo else passes >= 3
        )
        cnc.level(cnc.bahn.rt_loop_enable, False)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([0, 0, 0])
        turns = cnc.state.dist_prog_start / 10000
        assert (turns - 20) / 40 == pytest.approx(
            1.0 if modulo else round((turns - 20) / 40), abs=1e-9
        )


def test_an_empty_loop_does_not_spin(tmp_path: Path) -> None:
    """A loop without a path is passed once, whatever the PLC says."""
    with Inside(tmp_path, "G1 X10 F6000\n#RT WHILE\n#RT ENDWHILE\nX0\n") as cnc:
        cnc.level(cnc.bahn.rt_loop_enable, True)
        cnc.end()


def _enabled(value: str) -> str:
    return (
        f"G1 X10 F6000\nN20 V.RTG.LOOP.ENABLED = {value}\n#RT WHILE\nX20\n"
        f"Y10\nX10\nY0\n#RT ENDWHILE\nN90 X0\n"
    )


@pytest.mark.parametrize(
    ("before", "value", "driven"),
    [("", "TRUE", True), ("", "FALSE", False), ("P1 = 3\n", "P1 > 2", True)],
)
def test_the_program_sets_the_condition(
    before: str, value: str, driven: bool, tmp_path: Path
) -> None:
    """V.RTG.LOOP.ENABLED is in force behind the block that writes it, where the
    PLC does not command the condition; every program begins with FALSE.
    """
    with Inside(tmp_path, before + _enabled(value)) as cnc:
        for _ in range(1500):
            cnc.run(1)
        assert (cnc.state.rt_loop_count_r > 0) == driven
        assert cnc.state.inside_rt_loop_r == driven
        if driven:
            cnc.level(cnc.bahn.rt_loop_enable, False)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([0, 0, 0])


def test_the_plc_stands_above_the_program(tmp_path: Path) -> None:
    """A unit that the PLC enables is the condition, whatever is written."""
    levels = {"rt_loop_enable": False}
    with Inside(tmp_path, _enabled("TRUE"), levels=levels) as cnc:
        cnc.end()
        assert cnc.state.rt_loop_count_r == 0


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        (
            "G1 X1 F100\n#RT WHILE\nG1 X2\nV.RTG.LOOP.ENABLED = TRUE\nX1\n#RT ENDWHILE\n",
            22073,
            4,
        ),
        ("G17 G41 D1 G1 X1 F100\nV.RTG.LOOP.ENABLED = TRUE\n", 20651, 2),
        ("P1 = V.RTG.TIMER[0]\n", 900003, 1),
        ("V.RTA.ACS.ACT_POS.X = 0\n", 907016, 1),
    ],
)
def test_the_condition_is_refused(
    text: str, code: int, line: int, cli: Cli, program: Write
) -> None:
    """Inside a loop, during compensation, read, the other variables."""
    test_refused(text, code, line, cli, program)
