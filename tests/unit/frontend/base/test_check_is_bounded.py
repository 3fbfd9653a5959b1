"""A check ends: what comes again is followed for a bounded number of blocks,
whatever the program asks for.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from cnc_core.config import CellConfig, load_config
from cnc_core.errors import CncError
from cnc_core.frontend.base import reader
from cnc_core.frontend.base.reader import (
    COMPUTED_WORK,
    IDLE_CHECKED,
    REPEATS_CHECKED,
    SETTING_WORK,
)
from cnc_core.frontend.isg.front_end import IsgFrontEnd
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


@pytest.mark.ci
@pytest.mark.parametrize("case", IDLE)
def test_a_loop_that_only_computes(case: str, tmp_path: Path) -> None:
    """907001, long before the billionth pass."""
    program, _ = checked(tmp_path, *IDLE[case])
    assert [error.code for error in program.errors] == [907001]
    assert program.errors[0].place.line > 0
    assert program.reader.block_count <= IDLE_CHECKED + 10


@pytest.mark.parametrize("case", IDLE)
@pytest.mark.ci_cases
def test_a_loop_that_only_computes_ends_without_a_machine(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`plan` and `blocks` follow fewer blocks than `run`: nothing can change."""
    monkeypatch.setattr(reader, "IDLE_ALONE_MAX", 3000)
    name, text = IDLE[case]
    (tmp_path / name).write_text(text)
    program = Program(tmp_path / name, CellConfig())
    with pytest.raises(CncError) as e:
        for _ in program.batches():
            pass
    assert e.value.code == 907001
    assert program.reader.block_count <= 3100


@pytest.mark.parametrize("case", MOVING)
@pytest.mark.ci_cases
def test_a_loop_that_moves(case: str, tmp_path: Path) -> None:
    """A warning, and the check ends."""
    program, rows = checked(tmp_path, *MOVING[case])
    assert not program.errors
    assert [w.code for w in program.reader.warnings] == [909173]
    assert 0 < rows <= REPEATS_CHECKED + 10


CALLS = "".join(f"%L P{k}\nLL P{k + 1}\nLL P{k + 1}\nM17\n" for k in range(18))
COSTLY = {
    "settings": "G1 F100\n$FOR P1=1,100000,1\n#ROTATION ON [ANGLE=P1]\nX1\nX0\n$ENDFOR\nM30\n",
    "calls": f"{CALLS}%L P18\nG1 X1 F1\nX0\nM17\n%M\nLL P0\nM30\n",
}


@pytest.mark.ci
@pytest.mark.parametrize("case", COSTLY)
def test_a_block_that_costs_much_counts_for_many(
    case: str, tmp_path: Path
) -> None:
    """New settings of the stages, calls within calls: the check ends soon."""
    program, rows = checked(tmp_path, "a.nc", COSTLY[case])
    assert not program.errors
    assert [w.code for w in program.reader.warnings] == [909173]
    assert 0 < rows <= REPEATS_CHECKED / COMPUTED_WORK
    settings = REPEATS_CHECKED / SETTING_WORK
    assert case == "calls" or rows <= 5 * settings


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


FEW = "[channel]\nrepeated_blocks_max = {}\n"


def planned(folder: Path, name: str, text: str, most: int) -> int:
    """Rows of the program as ``plan`` reads it."""
    (folder / name).write_text(text)
    (folder / "cell.toml").write_text(FEW.format(most))
    cell = load_config(folder / "cell.toml")
    program = Program(folder / name, cell)
    return sum(len(batch.rows) for batch in program.batches())


@pytest.mark.parametrize("case", MOVING)
def test_a_plan_of_a_loop_that_moves_ends(case: str, tmp_path: Path) -> None:
    """Where no machine follows, it is an error that names the cell's member."""
    with pytest.raises(CncError, match="500 blocks moved again") as e:
        planned(tmp_path, *MOVING[case], 500)
    assert e.value.code == 907001
    assert "repeated_blocks_max" in str(e.value)


def test_a_plan_without_a_bound_follows_every_pass(tmp_path: Path) -> None:
    """0 blocks: any number; a program that ends is read to its end."""
    text = "G1 F100\n$FOR P1=1,400,1\nX[P1]\n$ENDFOR\nM30\n"
    assert planned(tmp_path, "a.nc", text, 0) > 400
    with pytest.raises(CncError, match="300 blocks"):
        planned(tmp_path, "a.nc", text, 300)


def test_a_plan_of_a_long_computation_goes_on(tmp_path: Path) -> None:
    """What only computes ends by itself, or by the bound for idle blocks."""
    text = "P2=0\n$FOR P1=1,3000,1\nP2=P1\n$ENDFOR\nG1 F100 X1\nM30\n"
    assert planned(tmp_path, "a.nc", text, 10) >= 1


@pytest.mark.parametrize("collect", [True, False])
def test_what_stands_behind_a_loop_is_no_repetition(
    collect: bool, tmp_path: Path
) -> None:
    """A long file behind a short loop is read to its end."""
    lines = [f"X{i % 7}" for i in range(REPEATS_CHECKED + 100)]
    head = ["G1 F100", "$FOR P1=1,3,1", "Y[P1]", "$ENDFOR"]
    text = "\n".join([*head, *lines, "M30\n"])
    if collect:
        program, rows = checked(tmp_path, "a.nc", text)
        assert not program.reader.warnings
    else:
        rows = planned(tmp_path, "a.nc", text, 500)
    assert rows >= len(lines)


def test_a_subprogram_called_once_is_no_repetition(tmp_path: Path) -> None:
    """Its blocks count from the second call on."""
    lines = "\n".join(f"X{i % 7}" for i in range(300))
    part = f"%L UP\n{lines}\nM17\n%MAIN\nG1 F100\n{{}}\nM30\n"
    assert planned(tmp_path, "a.nc", part.format("LL UP"), 200) >= 300
    often = part.format("$FOR P1=1,3,1\nLL UP\n$ENDFOR")
    with pytest.raises(CncError, match="200 blocks"):
        planned(tmp_path, "a.nc", often, 200)


ARRAYS = {
    "V.P": ("a.nc", "#VAR\nV.P.A{}[1000][1000]\n#ENDVAR\n", "M30\n"),
    "P": ("a.nc", "#VAR\nP{}1[1000000]\n#ENDVAR\n", "M30\n"),
    "DIM": ("a.isons", "DIM $A{}[1000000]\n", "G1X1F1\n"),
}


@pytest.mark.parametrize("case", ARRAYS)
def test_arrays_of_a_program_have_a_room_together(
    case: str, tmp_path: Path
) -> None:
    """Four of a million elements; the fifth is an error with its line."""
    name, one, end = ARRAYS[case]
    texts = [one.format(k) for k in range(1, 6)]
    right, _ = checked(tmp_path, name, "".join([*texts[:4], end]))
    assert not right.errors
    wrong, _ = checked(tmp_path, name, "".join([*texts, end]))
    assert [error.code for error in wrong.errors] == [907013]
    assert "4000000 elements" in wrong.errors[0].text


def test_an_array_that_is_gone_takes_no_room(tmp_path: Path) -> None:
    """Of a subprogram that has ended; one that is declared again."""
    local = "%L A\n#VAR\nV.L.A[1000000]\n#ENDVAR\nM17\n%M\n"
    again = "#VAR\nV.P.B[1000000]\n#ENDVAR\n" * 6
    text = local + "LL A\n" * 6 + again + "M30\n"
    program, _ = checked(tmp_path, "a.nc", text)
    assert not program.errors


def test_a_block_behind_plain_lines_is_compiled_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The end of a loop, whether its lines move or not; twice at most."""
    compiled: Counter[str] = Counter()
    compile_block = IsgFrontEnd._compile

    def counted(reader: IsgFrontEnd, text: str) -> Any:
        compiled[text] += 1
        return compile_block(reader, text)

    monkeypatch.setattr(IsgFrontEnd, "_compile", counted)
    for line in ("G1 X1 F1", "X1 Y2\nX0"):
        text = f"G1 F100\n$FOR P1=1,50,1\n{line}\n$ENDFOR\nM30\n"
        checked(tmp_path, "a.nc", text)
        assert compiled.pop("$ENDFOR") <= 2


def test_comments_that_never_end_are_searched_once(tmp_path: Path) -> None:
    """Each has its error; the text behind is read for the first one alone."""
    text = "#COMMENT BEGIN\n" * 2000
    program, _ = checked(tmp_path, "a.nc", text)
    assert {error.code for error in program.errors} == {20569, 900022}
    inner = "#COMMENT BEGIN\n#COMMENT BEGIN\nX1\n#COMMENT END\nN9 G1 X1 F100\n"
    program, rows = checked(tmp_path, "b.nc", inner)
    assert [error.place.line for error in program.errors] == [1]
    assert rows == 1


@pytest.mark.parametrize("word", ["SAVE_VAR", "LOAD_VAR"])
def test_files_of_many_values_count_for_many_blocks(
    word: str, tmp_path: Path
) -> None:
    """The check ends long before the last pass."""
    (tmp_path / "v.txt").write_text("1\n" * 60_000)
    text = f'DIM_VAR 60000\nLOOP 100000\n{word} "v.txt"\nEND_LOOP\n'
    program, _ = checked(tmp_path, "a.isons", text)
    assert program.reader.block_count < 1000


@pytest.mark.parametrize("number", ["3000000000", "99999999999999999999"])
def test_a_tool_number_that_no_row_holds(number: str, tmp_path: Path) -> None:
    """Refused with its place, with no tool table too."""
    program, _ = checked(tmp_path, "a.isons", f"G1X1F100\nT{number}\n")
    (error,) = program.errors
    assert (error.code, error.place.line) == (900014, 2)
