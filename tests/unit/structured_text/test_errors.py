"""Wrong sources are told with file, line, column, reason and what to do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from plc_client.st.build import check, sources_of
from plc_client.st.errors import REFUSED
from plc_client.st.source import library

CASES = [
    ("x := nowhere;", "name nowhere is unknown", 6),
    ("x := 1", "; is expected", 1),
    ("x := 'text';", "STRING(4) does not convert to INT", 6),
    ("x := 1.5;", "LREAL does not convert to INT; use LREAL_TO_INT", 6),
    ("x := d;", "DINT does not convert to INT; use DINT_TO_INT", 6),
    ("x := 40000;", "40000 does not fit INT", 6),
    ("a[7] := 1;", "index 7 is outside of 0..3", 3),
    ("x.16 := TRUE;", "INT has no part 16", 3),
    ("IF x THEN x := 1; END_IF", "a condition is BOOL, not INT", 4),
    ("N := 3;", "cannot be written", 1),
    ("CASE x OF 1, 1: x := 2; END_CASE", "the label 1 stands twice", 14),
    ("EXIT;", "EXIT stands outside of a loop", 1),
    ("fb(nope := 1);", "parameter of R_TRIG: nope is unknown; inputs: CLK", 4),
    ("gpCh[12]^.head.channel_nr := 1;", "index 12 is outside of 0..11", 6),
    ("gpCh[0]^.bahn_stat.x := 1;", "did you mean bahn_state?", 10),
    ("x := gpCh[0];", "gpCh[i] is a pointer; write its number, i", 6),
    ("x := gpVECh[0]^.value[0];", "write gpVECh[i]^[n]", 17),
    ("x := 1 +;", "is unexpected", 9),
    ("strict := 7;", "does not convert to Strict", 11),
    ("fb.Q := TRUE;", "output of another block", 4),
    ("x := x + 1.5 MOD 2;", "MOD needs whole numbers", 14),
]


@pytest.mark.parametrize(("statement", "text", "column"), CASES)
def test_error_has_place_reason_and_help(
    statement: str, text: str, column: int
) -> None:
    """The error stands in line 3 of the file, at the column told."""
    source = (
        "PROGRAM MAIN\nVAR x : INT; d : DINT; a : ARRAY [0..3] OF INT; fb : R_TRIG;"
        f" strict : Strict; END_VAR VAR CONSTANT N : INT := 1; END_VAR\n{statement}\nEND_PROGRAM\n"
        "{attribute 'strict'}\nTYPE Strict : (One, Two); END_TYPE\n"
    )
    found = check({"bad.st": source}).log.errors
    assert found, "no error"
    first = found[0]
    assert text in str(first)
    if "expected" not in text and "unexpected" not in text:
        assert (first.file, first.line, first.column) == ("bad.st", 3, column)


@pytest.mark.parametrize(
    "source",
    [
        "PROGRAM Q\nVAR c : Q; END_VAR\nEND_PROGRAM\n",
        "FUNCTION_BLOCK A\nVAR c : ARRAY [0..1] OF A; END_VAR\nEND_FUNCTION_BLOCK\n",
        "FUNCTION_BLOCK A\nVAR b : B; END_VAR\nEND_FUNCTION_BLOCK\n"
        "FUNCTION_BLOCK B\nVAR_OUTPUT a : A; END_VAR\nEND_FUNCTION_BLOCK\n",
    ],
)
def test_a_block_that_contains_itself_is_told(source: str) -> None:
    """By the variable's place; directly, in an array, through another block."""
    found = check({"bad.st": source}).log.errors
    assert ["contains itself" in str(each) for each in found] == [True]


@pytest.mark.parametrize(
    ("source", "text"),
    [
        (
            "VAR_GLOBAL CONSTANT a : INT := b; b : INT := a; END_VAR\n"
            "PROGRAM P\nVAR x : INT; END_VAR\nx := a;\nEND_PROGRAM\n",
            "a depends on itself",
        ),
        (
            "FUNCTION_BLOCK ABSTRACT A\nEND_FUNCTION_BLOCK\n"
            "PROGRAM P\nVAR a : A; END_VAR\nEND_PROGRAM\n",
            "A is ABSTRACT",
        ),
        (
            "PROGRAM P\nVAR a : INT; END_VAR\n"
            f"a := 1{' + 1' * 9000};\nEND_PROGRAM\n",
            "nesting as deep",
        ),
    ],
    ids=("constants", "abstract", "nesting"),
)
def test_programs_that_cannot_run_are_told(source: str, text: str) -> None:
    """None of them is lowered, none is a traceback."""
    found = check({"bad.st": source}).log.errors
    assert text in str(found[0])
    assert found[0].line


def test_blocks_may_refer_to_each_other() -> None:
    """By VAR_IN_OUT, pointers and references, and in methods."""
    source = """FUNCTION_BLOCK A
VAR_IN_OUT b : B; END_VAR
VAR n : INT; r : REFERENCE TO A; END_VAR
n := b.n;
METHOD M : INT
VAR x : B; END_VAR
M := x.n;
END_METHOD
END_FUNCTION_BLOCK
FUNCTION_BLOCK B
VAR_IN_OUT a : A; END_VAR
VAR n : INT; p : POINTER TO A; END_VAR
n := a.n;
END_FUNCTION_BLOCK
PROGRAM P
VAR a : A; b : B; END_VAR
a(b := b); b(a := a);
END_PROGRAM
"""
    assert not check({"good.st": source}).log.errors


def test_several_errors_are_told_at_once() -> None:
    """Three wrong statements and a wrong declaration give four errors."""
    source = """PROGRAM MAIN
VAR a : NOTHING; b : INT; END_VAR
b := one;
b := 'x';
c := 3;
END_PROGRAM
"""
    found = check({"bad.st": source}).log.errors
    assert [problem.line for problem in found] == [2, 3, 4, 5]


def test_refused_constructs_are_named() -> None:
    """The JSON of a check lists POU and construct of what is not supported."""
    source = "PROGRAM MAIN\nVAR p : POINTER TO INT; END_VAR\np := __NEW(INT);\nEND_PROGRAM\n"
    found = check({"new.st": source})
    assert found.log.errors[0].code == REFUSED
    row = found.as_json()["refused"][0]
    assert row == {
        "pou": "MAIN",
        "construct": "__NEW",
        "file": "new.st",
        "line": 3,
    }


@pytest.mark.ci
def test_whole_library_is_right() -> None:
    """Every unit of the library compiles; a name that is nearly one of its
    units is told.
    """
    text = f"// {' '.join(sorted(library.names()))}\n"
    found = check({"all.st": text + "PROGRAM MAIN\nEND_PROGRAM\n"})
    assert [str(e) for e in found.log.errors] == []
    near = check({"m.st": "PROGRAM MAIN\nVAR t : TOOF; END_VAR\nEND_PROGRAM\n"})
    assert "did you mean TOF?" in str(near.log.errors[0])


def test_program_takes_the_units_it_names() -> None:
    """A timer brings itself alone, a block its base."""
    timer = library.units_for(["VAR t : ton; END_VAR"])
    assert ["FUNCTION_BLOCK TON" in u.text for u in timer] == [True]
    modes = library.units_for(["VAR a : AbortProgram; END_VAR"])
    assert any("FUNCTION_BLOCK ABSTRACT ExecuteBlock" in u.text for u in modes)


@pytest.mark.parametrize(
    ("type_", "text"),
    [
        ("STRUCT a : NOPE; END_STRUCT", "type NOPE is unknown"),
        ("ARRAY [3..1] OF INT", "the bounds 3..1 are empty"),
        ("INT (5..1)", "5..1 is no range of INT"),
        ("(A, B, A)", "A stands twice"),
        ("STRUCT a : INT := 'x'; END_STRUCT", "does not convert to INT"),
        ("STRUCT a : Wrong; END_STRUCT", "Wrong contains itself"),
    ],
)
def test_a_wrong_type_is_told_though_nothing_uses_it(
    type_: str, text: str
) -> None:
    """TYPE declarations are checked on their own."""
    source = f"TYPE Wrong : {type_}; END_TYPE\n"
    found = check({"bad.st": source}).log.errors
    assert len(found) == 1
    assert text in str(found[0])
    assert found[0].line == 1


PROGRAM = (
    "PROGRAM MAIN\r\nVAR s : STRING := '\u00e4'; END_VAR\r\nEND_PROGRAM\r\n"
)


@pytest.mark.parametrize(
    "encoding",
    ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le"],
)
def test_encodings_of_files(tmp_path: Path, encoding: str) -> None:
    """UTF-8 and UTF-16 with and without their mark, and Windows-1252."""
    path = tmp_path / "main.st"
    path.write_bytes(PROGRAM.encode(encoding))
    sources = sources_of([path])
    assert list(sources.values()) == [PROGRAM.replace("\r\n", "\n")]
    assert not check(sources).log.errors


def test_types_nested_too_deeply_are_told_once() -> None:
    """A chain of 1500 structures; each would be tried again."""
    chain = "".join(
        f"TYPE S{n} : STRUCT a : S{n + 1}; END_STRUCT END_TYPE\n"
        for n in range(1500)
    )
    (found,) = check(
        {"deep.st": chain + "TYPE S1500 : INT; END_TYPE\n"}
    ).log.errors
    assert found.code == REFUSED


@pytest.mark.parametrize(
    ("statement", "text"),
    [
        (
            "l(modus := 1);",
            "modus is unknown; did you mean mode? inputs: start_",
        ),
        (
            "l(don => b);",
            "don is unknown; did you mean done? outputs: done, busy",
        ),
        ("b := l.dones;", "did you mean done?"),
        ("nCoutn := 1;", "did you mean nCount?"),
        ("b := GVL_Cel.x;", "did you mean GVL_Cell?"),
        ("l.reed_log();", "did you mean read_log?"),
    ],
)
def test_a_near_name_is_told_as_it_is_declared(
    statement: str, text: str
) -> None:
    """Not in capitals; an unknown parameter names all that there are."""
    variables = "VAR l : ContourLookahead; b : BOOL; nCount : INT; END_VAR"
    source = {
        "GVL_Cell.st": "VAR_GLOBAL x : BOOL; END_VAR\n",
        "bad.st": f"PROGRAM MAIN\n{variables}\n{statement}\nEND_PROGRAM\n",
    }
    (error,) = check(source).log.errors
    assert text in error.text


def test_a_near_type_is_told_as_it_is_declared() -> None:
    """Blocks of the library, types of the HLI and of the program."""
    source = """TYPE E_Color : (Red, Green); END_TYPE
PROGRAM MAIN
VAR
a : ContourLookAheadd;
b : HLI_BAHN_STAT;
c : E_Colour;
END_VAR
END_PROGRAM
"""
    found = check({"bad.st": source}).log.errors
    meant = [error.text.partition("; ")[2] for error in found]
    names = ("ContourLookahead", "HLI_BAHN_STATE", "E_Color")
    assert meant == [f"did you mean {name}?" for name in names]


CLOSED = """FUNCTION_BLOCK Inner
VAR n : INT; END_VAR
IF n > 1 THEN
FOR n := 1 TO 3 DO
CASE n OF
1: n := 2;
END_CASE
END_FOR
END_IF
WHILE n > 3 DO
REPEAT
n := n - 1;
UNTIL n < 0
END_REPEAT
END_WHILE
METHOD M : INT
VAR x : INT; END_VAR
M := x;
END_METHOD
ACTION Act:
n := 2;
END_ACTION
PROPERTY P : INT
GET
P := n;
END_GET
END_PROPERTY
END_FUNCTION_BLOCK
TYPE T : STRUCT
a : INT;
END_STRUCT
END_TYPE
FUNCTION F : INT
F := 1;
END_FUNCTION
PROGRAM MAIN
VAR b : Inner; END_VAR
b();
END_PROGRAM
"""
ENDS = [match.span() for match in re.finditer(r"END_\w+", CLOSED)]


@pytest.mark.parametrize("end", ENDS, ids=[CLOSED[a:b] for a, b in ENDS])
def test_a_missing_or_wrong_end_is_named(end: tuple[int, int]) -> None:
    """With the line where what is open begins; a word like it is shown."""
    word = CLOSED[slice(*end)]
    opener = "VAR" if word == "END_VAR" else word.removeprefix("END_")
    before = CLOSED[: end[0]]
    at = [m.start() for m in re.finditer(rf"\b{opener}\b", before)][-1]
    begins = (
        f"{opener} in line {CLOSED.count(chr(10), 0, at) + 1} is not closed"
    )
    for typo, text in (
        ("", f"{word} is missing: {begins}"),
        (word[:-1], f"{word} is expected instead of {word[:-1]}: {begins}"),
    ):
        source = before + typo + CLOSED[end[1] :]
        error = check({"bad.st": source}).log.errors[0]
        assert error.text == text
        assert not typo or error.line == before.count("\n") + 1


def test_each_wrong_end_is_told_at_its_line() -> None:
    """Not only the first one."""
    source = CLOSED.replace("END_FOR", "END_FR").replace("END_IF", "END_I")
    found = check({"bad.st": source}).log.errors
    assert [error.line for error in found][:2] == [8, 9]


def test_an_error_ahead_of_a_missing_end_stays_what_it_is() -> None:
    """The end that is missing comes to light when it is mended."""
    source = "PROGRAM MAIN\nVAR n : INT; END_VAR\nn := ;\nn := 1;\n"
    (error, *_) = check({"bad.st": source}).log.errors
    assert (error.line, "is unexpected" in error.text) == (3, True)
