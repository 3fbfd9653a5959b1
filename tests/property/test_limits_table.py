"""The table of limits tells the truth: what is one too many is refused with the
number that stands in its row, and in bounded time.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cnc_core.config import CellConfig, load_config
from cnc_core.errors import CncError
from cnc_core.frontend.operator import read_answers
from cnc_core.program import Program
from support.osai_programs import SETUP_3
from support.paths import docs_page

NESTED = "%L P{0}\nLL P{1}\nM17\n"
LEVELS = "".join(NESTED.format(k, k + 1) for k in range(21))
MACROS = "".join(f'"M{k}" = "\\"M{k - 1}\\""\n' for k in range(1, 23))
ROWS: dict[str, tuple[str, str, int]] = {
    "errors that `check` collects": ("isg", "GG\n" * 1100, 900022),
    "blocks that `check` repeats": (
        "isg",
        "G1 F100\n$WHILE 1\nX1\nX[0]\n$ENDWHILE\nM30\n",
        909173,
    ),
    "blocks without motion": (
        "isg",
        "P2=0\n$WHILE 1\nP2=P2+1\n$ENDWHILE\nM30\n",
        907001,
    ),
    "length of a block": ("iso", f"X{'1' * 4096}\nM2\n", 20301),
    "program levels": (
        "isg",
        f"{LEVELS}%L P21\nM17\n%M\nLL P0\nM30\n",
        907002,
    ),
    "macros in each other": ("isg", f'"M0" = "X1"\n{MACROS}"M22"\n', 20301),
    "brackets of an expression": (
        "isg",
        f"X{'[' * 42}1{']' * 42}\nM30\n",
        20927,
    ),
    "operators of an expression": (
        "isg",
        f"P1=1{'+1' * 501}\nM30\n",
        20927,
    ),
    "elements of an array (ISG)": (
        "isg",
        "#VAR\nV.P.A[1001][1000]\n#ENDVAR\nM30\n",
        907013,
    ),
    "elements of an array (IsoNs)": ("isons", "DIM $A[1000001]\n", 900012),
    "elements of all arrays": (
        "isons",
        "".join(f"DIM $A{k}[1000000]\n" for k in range(5)),
        907013,
    ),
    "variables of a program (IsoNs)": (
        "isons",
        "".join(f"$A{k}=1\n" for k in range(2049)),
        909104,
    ),
    "rows that one block makes": (
        "iso",
        "G91 G81 X1 Y1 Z-1 R1 L900000 F1\nM2\n",
        900012,
    ),
    "turns of one circle": ("iso", "G2 X0 Y0 I1 P1000001 F1\nM2\n", 900012),
    "bytes that are no text": ("isg", "G1 X1 \x01\n", 901009),
    "control statements in each other": (
        "isg",
        "$IF 1\n" * 21 + "$ENDIF\n" * 21 + "M30\n",
        20211,
    ),
    "lines of a setup file": ("osai", "(HSM,LONG)\n", 909202),
    "characters of a placeholder": (
        "isg",
        '#MSG ["%201d", 1]\nM30\n',
        907051,
    ),
}


def told(row: str) -> list[int]:
    """The numbers in the last column of the row that begins so."""
    lines = docs_page("limits.md").read_text().splitlines()
    found = [line for line in lines if line.startswith(f"| {row}")]
    assert found, row
    return [int(n) for n in re.findall(r"\d{5,6}", found[0].split("|")[-2])]


def codes(folder: Path, dialect: str, text: str) -> list[int]:
    """Numbers of what a check of the text says."""
    (folder / "LONG").write_text(SETUP_3 + ";\n" * 1001)
    path = folder / "program.nc"
    path.write_text(text)
    try:
        program = Program(path, CellConfig(), dialect, collect=True)
        for _ in program.batches():
            pass
    except CncError as error:
        return [error.code]
    said = [*program.errors, *program.reader.warnings]  # type: ignore[attr-defined]
    return [one.code for one in said]


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.ci_cases
def test_a_program_that_asks_for_too_much(row: str, tmp_path: Path) -> None:
    """Refused or warned of, by the number in its row."""
    dialect, text, code = ROWS[row]
    assert code in codes(tmp_path, dialect, text)
    assert code in told(row)


CELLS = {
    "nesting of a cell file": "a = " + "[" * 2000 + "\n",
    "name of an axis": "[axes.ABCDEFGHIJKLMNOPQ]\n",
}


@pytest.mark.parametrize("row", CELLS)
def test_a_cell_that_asks_for_too_much(row: str, tmp_path: Path) -> None:
    """By the number in its row."""
    path = tmp_path / "cell.toml"
    path.write_text(CELLS[row])
    with pytest.raises(CncError) as refused:
        load_config(path)
    assert refused.value.code in told(row)


def test_a_number_in_answers_that_no_float_holds(tmp_path: Path) -> None:
    """By the number in its row."""
    path = tmp_path / "answers.json"
    path.write_text('[{"set": {"A": 1' + "0" * 400 + "}}]")
    with pytest.raises(CncError) as refused:
        read_answers(path)
    assert refused.value.code in told("number in a script of answers")


def test_a_file_that_is_read_at_once(tmp_path: Path) -> None:
    """By one of the numbers in its row."""
    path = tmp_path / "answers.json"
    with path.open("wb") as file:
        file.truncate((16 << 20) + 1)
    with pytest.raises(CncError) as refused:
        read_answers(path)
    assert refused.value.code in told("file that is read at once")
