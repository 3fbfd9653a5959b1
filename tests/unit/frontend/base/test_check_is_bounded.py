"""A check ends: what comes again is followed for a bounded number of blocks,
whatever the program asks for.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.config import CellConfig
from cnc_core.frontend.base.reader import IDLE_CHECKED, REPEATS_CHECKED
from cnc_core.program import Program

IDLE = {
    "LOOP": ("a.isons", "LOOP 1000000000\n$A=1\nEND_LOOP\nG1X1F1\n"),
    "GOTO": ("a.isons", "$A=0\n@L\n$A=$A+1\nGOTO L\n"),
    "$FOR": ("a.nc", "P2=0\n$FOR P1=0,1000000000,1\nP2=P2+1\n$ENDFOR\nM30\n"),
    "$WHILE": ("a.nc", "P2=0\n$WHILE 1\nP2=P2+1\n$ENDWHILE\nM30\n"),
}
MOVING = {
    "LOOP": ("a.isons", "LOOP 1000000000\nG1X1F1\nX0\nEND_LOOP\n"),
    "GOTO": ("a.isons", "$A=0\n@L\nG1X[$A]F1\n$A=$A+1\nGOTO L\n"),
    "$WHILE": ("a.nc", "$WHILE 1\nG1 X1 F100\nX0\n$ENDWHILE\nM30\n"),
    "$GOTO": ("a.nc", "N10 G1 X1 F100\nX0\n$GOTO N10\nM30\n"),
}


def checked(folder: Path, name: str, text: str) -> tuple[Program, int]:
    """The program behind its check, and its rows."""
    (folder / name).write_text(text)
    program = Program(folder / name, CellConfig(), collect=True)
    rows = sum(len(batch.rows) for batch in program.batches())
    return program, rows


@pytest.mark.parametrize("case", IDLE)
def test_a_loop_that_only_computes(case: str, tmp_path: Path) -> None:
    """907001, long before the billionth pass."""
    program, _ = checked(tmp_path, *IDLE[case])
    assert [error.code for error in program.errors] == [907001]
    assert program.errors[0].place.line > 0
    assert program.reader.block_count <= IDLE_CHECKED + 10


@pytest.mark.parametrize("case", MOVING)
def test_a_loop_that_moves(case: str, tmp_path: Path) -> None:
    """A warning, and the check ends."""
    program, rows = checked(tmp_path, *MOVING[case])
    assert not program.errors
    assert [w.code for w in program.reader.warnings] == [909173]
    assert 0 < rows <= REPEATS_CHECKED + 10


def test_long_programs_without_loops_are_checked_to_their_end(
    tmp_path: Path,
) -> None:
    """Blocks that stand in the file are no repetitions."""
    lines = ["G1 F100", *(f"X{i % 7} (line)" for i in range(REPEATS_CHECKED))]
    program, rows = checked(
        tmp_path, "a.nc", "\n".join([*lines, "P1=1", "GG1", "M30", ""])
    )
    assert rows >= REPEATS_CHECKED
    assert [error.place.line for error in program.errors] == [len(lines) + 2]
