"""What passes in silence in Structured Text is warned of, as in Python; --strict
makes it an error.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cnc_core import Cell, RunResult

Write = Callable[..., Path]
PART = "G1 F6000 X5\nM30\n"


def run(
    program: Write, variables: str, statements: str, **options: Any
) -> RunResult:
    """The statements stand in line 3."""
    text = f"PROGRAM MAIN\nVAR {variables} END_VAR\n{statements}\nEND_PROGRAM\n"
    plc = program(text, "mistaken.st")
    with Cell() as cell:
        return cell.run(program(PART), plc, **options)


UNIT = "gpCh[0]^.bahn_mc_control.feedhold."
CASES = [
    (
        "o : Override; n : INT;",
        "n := n + 1; IF n > 5 THEN o(path := 0.4); END_IF",
        "task MAIN: o commands an override of 0.4 %; overrides are in percent:"
        " 40 for 0.4",
    ),
    (
        "f : ARRAY [1..2] OF FeedControl; k : DINT;",
        "k := k + 1; IF k = 9 THEN f[2](override := 500.0); END_IF",
        "task MAIN: f[2] (FeedControl) got override := 500 and sent nothing in"
        " 1 scans; override is 0..200 percent",
    ),
    (
        "o : Override;",
        "o(path := -10.0);",
        "task MAIN: o (Override) got path := -10 and sent nothing in",
    ),
    (
        "c : ContourLookahead;",
        "c(length := 1.0, mode := 3);",
        "task MAIN: c (ContourLookahead) got mode := 3 and sent nothing in",
    ),
    (
        "c : ContourLookahead;",
        "c(length := -1.0, mode := 2);",
        "task MAIN: c (ContourLookahead) got length := -1 and sent nothing in",
    ),
    (
        "",
        f"{UNIT}command_w := FALSE;",
        "mistaken.st:3:35: 953003: gpCh[i]^.bahn_mc_control.feedhold.command_w"
        " is written, and enable_w nowhere; the CNC looks at a unit while",
    ),
    (
        "",
        "gpCh[0]^.bahn_state.active_feed_r := 5;",
        "mistaken.st:3:21: 953002: gpCh[i]^.bahn_state.active_feed_r is written"
        " by the CNC in each cycle; write command_w",
    ),
]


@pytest.mark.ci
@pytest.mark.parametrize(
    ("variables", "statements", "said"),
    CASES,
    ids=["percent", "feed", "range", "mode", "length", "enable", "owner"],
)
def test_a_silent_mistake_is_a_warning(
    program: Write, variables: str, statements: str, said: str
) -> None:
    """The run completes with one warning; under strict it ends with an error."""
    result = run(program, variables, statements)
    assert result.end == "completed", result.describe()
    assert [said in text for text in result.warnings] == [True]
    strict = run(program, variables, statements, strict=True)
    assert (strict.end, strict.warnings) == ("error", [])
    assert [said in error["text"] for error in strict.errors] == [True]


@pytest.mark.ci
def test_a_block_of_a_list_of_globals_is_told_once(program: Write) -> None:
    """By the first of two tasks, with the name of its list."""
    plc = program(
        "VAR_GLOBAL o : Override; END_VAR\n"
        "PROGRAM One\no(path := -1.0);\nEND_PROGRAM\n"
        "PROGRAM Two\nEND_PROGRAM\n",
        "lists.st",
    )
    with Cell() as cell:
        result = cell.run(program(PART), plc)
    assert ["lists.o (Override)" in text for text in result.warnings] == [True]


@pytest.mark.ci
def test_what_is_meant_passes(program: Write) -> None:
    """A command with all that belongs to it; strict changes nothing."""
    statements = (
        f"{UNIT}command_w := FALSE; {UNIT}enable_w := TRUE;"
        " o(path := HLI_NONE); a(override := 100.0); c(length := 0.0);"
    )
    variables = "o : Override; a : AxisControl; c : ContourLookahead;"
    result = run(program, variables, statements, strict=True)
    assert result.end == "completed", result.describe()
