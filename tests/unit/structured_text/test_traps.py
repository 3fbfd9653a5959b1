"""What a program must not do is told with POU, line and values."""

from __future__ import annotations

import pytest

from plc_client.st import build
from plc_client.st.machine.loader import StProgram, StTrap

HEAD = (
    "PROGRAM MAIN\nVAR i : INT := 9; a : ARRAY [0..3] OF INT;"
    " p : POINTER TO INT; r : REFERENCE TO INT; x : REAL;"
    " s : INT (0..5); d : DINT; END_VAR\n"
)
CASES = [
    ("a[i] := 1;", "index 9 is outside of 0..3"),
    ("p^ := 1;", "p is null"),
    ("r := 1;", "r is null"),
    ("d := 7 / (i - 9);", "division of 7 by zero"),
    ("d := 7 MOD (i - 9);", "division of 7 by zero"),
    ("x := 2.5 / x;", "division of 2.5 by zero"),
    ("s := i;", "value 9 is outside of the subrange 0..5"),
    ("WHILE i > 0 DO i := 9; END_WHILE", "the loop has not ended within 20 ms"),
    ("p := ADR(a); p := p + 100;", "pointer arithmetic points to"),
    ("MEMSET(ADR(a), 0, 1000000000);", "destAddr points to"),
]


@pytest.mark.parametrize(("statement", "text"), CASES)
def test_trap_names_pou_line_and_values(statement: str, text: str) -> None:
    """The third line of the file is named, and the program can be started again."""
    source = f"{HEAD}{statement}\nEND_PROGRAM\n"
    program = StProgram(build({"bad.st": source}))
    program.allow(0.02)
    for _ in range(2):
        program.start()
        with pytest.raises(StTrap) as caught:
            program.run(program.entry("MAIN"), 0)
        assert str(caught.value).startswith("bad.st:3: MAIN: ")
        assert text in str(caught.value)


def test_endless_recursion_is_a_trap() -> None:
    """A function that calls itself uses the stack up, not the process."""
    source = """FUNCTION F : INT
VAR_INPUT n : INT; END_VAR
VAR big : ARRAY [0..999] OF LREAL; END_VAR
F := F(n + 1) + 1;
END_FUNCTION
PROGRAM MAIN VAR x : INT; END_VAR
x := F(1);
END_PROGRAM
"""
    program = StProgram(build({"deep.st": source}))
    program.start()
    with pytest.raises(StTrap, match="F: the stack is used up"):
        program.run(program.entry("MAIN"), 0)


@pytest.mark.ci
def test_a_loop_without_end_is_told_ahead_of_its_trap(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Once, with the POU: a run shows it ahead of whoever waits for the PLC."""
    source = f"{HEAD}WHILE i > 0 DO i := 9; END_WHILE\nEND_PROGRAM\n"
    program = StProgram(build({"bad.st": source}))
    program.allow(2.2)
    program.start()
    with pytest.raises(StTrap, match="within 2200 ms"):
        program.run(program.entry("MAIN"), 0)
    assert capfd.readouterr().err == "a loop in MAIN has not ended for 2 s\n"
