"""What an expression is worth: the order in which it is read, the type in which it is
computed, and what is refused.
"""

from __future__ import annotations

from typing import Any

import pytest

from plc_client.st import build
from plc_client.st.errors import StError
from plc_client.st.machine.loader import StProgram

CALLED = """
VAR_GLOBAL
gi : INT := 1; gs : STRING := 'a'; gr : LREAL := 1; ga : A := (x := 1);
END_VAR
TYPE A : STRUCT x : INT; END_STRUCT END_TYPE
FUNCTION F : INT gi := gi + 10; F := gi; END_FUNCTION
FUNCTION FR : LREAL gr := gr + 10; FR := gr; END_FUNCTION
FUNCTION G : STRING gs := CONCAT(gs, 'b'); G := gs; END_FUNCTION
FUNCTION H : INT ga.x := ga.x + 10; H := ga.x; END_FUNCTION
FUNCTION Two : INT VAR_INPUT a, b : INT; END_VAR Two := a * 100 + b; END_FUNCTION
FUNCTION Txt : STRING VAR_INPUT a, b : STRING; END_VAR Txt := CONCAT(a, b); END_FUNCTION
FUNCTION Part : INT VAR_INPUT a : A; b : INT; END_VAR Part := a.x * 100 + b; END_FUNCTION
"""


def program(declared: str, statements: str) -> StProgram:
    """One scan of a program."""
    source = (
        f"{CALLED}PROGRAM MAIN\nVAR\n{declared}\nEND_VAR\n{statements}\n"
        "END_PROGRAM\n"
    )
    found = StProgram(build({"order.st": source}))
    found.start()
    found.run(found.entry("MAIN"), 0)
    return found


def worth(type_: str, expression: str, declared: str = "") -> Any:
    """Of an expression that is assigned to a variable of a type."""
    done = program(f"r : {type_}; {declared}", f"r := {expression};")
    return done["MAIN"].r


@pytest.mark.parametrize(
    ("type_", "expression", "value"),
    [
        ("INT", "gi - F()", -10),
        ("INT", "F() - gi", 0),
        ("INT", "gi + F() * 2", 23),
        ("INT", "gi / F()", 0),
        ("INT", "F() / gi", 1),
        ("INT", "gi MOD F()", 1),
        ("LREAL", "gr / FR()", 1 / 11),
        ("LREAL", "gr ** FR()", 1.0),
        ("BOOL", "gs = G()", False),
        ("BOOL", "G() = gs", True),
        ("BOOL", "gi < F()", True),
        ("STRING", "CONCAT(gs, G())", "aab"),
        ("STRING", "CONCAT(G(), gs)", "abab"),
        ("STRING", "Txt(gs, G())", "aab"),
        ("INT", "Two(gi, F())", 111),
        ("INT", "Two(F(), gi)", 1111),
        ("INT", "Two(b := F(), a := gi)", 111),
        ("INT", "Part(ga, H())", 111),
        ("LREAL", "EXPT(gr, FR())", 1.0),
        ("WORD", "SHL(INT_TO_WORD(gi), F())", 2048),
        ("STRING", "LEFT('0123456789abcdefgh', gi + F())", "0123456789ab"),
        ("STRING", "MID(STR := gs, LEN := F(), POS := 1)", "a"),
        ("INT", "SEL(TRUE, gi, F())", 11),
        ("INT", "MAX(gi, F(), gi)", 11),
    ],
)
def test_operands_are_read_from_left_to_right(
    type_: str, expression: str, value: Any
) -> None:
    """A function that changes what stands beside it; C leaves the order open."""
    assert worth(type_, expression) == pytest.approx(value)


def test_indices_are_read_from_left_to_right() -> None:
    """``m[gi, F()]`` with gi before F has changed it."""
    declared = "m : ARRAY [1..12, 1..12] OF INT;"
    done = program(f"{declared} r : INT;", "m[1, 11] := 7; r := m[gi, F()];")
    assert done["MAIN"].r == 7


@pytest.mark.parametrize(
    ("type_", "expression", "value"),
    [
        ("WORD", "w AND NOT 16#80", 0x1234),
        ("WORD", "NOT 16#80 AND w", 0x1234),
        ("WORD", "w AND NOT 16#4", 0x1230),
        ("WORD", "w OR NOT 16#8000", 0x7FFF),
        ("DWORD", "d AND NOT 16#8000", 0x12345678),
        ("DWORD", "d XOR NOT 0", 0xEDCBA987),
        ("LWORD", "NOT 0", 2**64 - 1),
        ("WORD", "NOT 16#80", 0xFF7F),
        ("INT", "NOT 5", -6),
    ],
)
def test_not_of_a_literal_has_the_width_of_the_other_operand(
    type_: str, expression: str, value: int
) -> None:
    """The bits above the literal stay."""
    declared = "w : WORD := 16#1234; d : DWORD := 16#12345678;"
    assert worth(type_, expression, declared) == value


@pytest.mark.parametrize(
    "expression",
    ["a - b", "b - a", "a * c", "c + c", "-a", "ABS(s)", "a OR b", "NOT a"],
)
def test_constants_are_computed_as_variables_are(expression: str) -> None:
    """CONSTANT does not change a result: every operation wraps at its type."""
    declared = (
        "a : USINT := 3; b : USINT := 5; c : USINT := 200; s : SINT := -128;"
    )
    found = [
        program(
            f"r : INT; END_VAR VAR {kind} {declared}", f"r := {expression};"
        )["MAIN"].r
        for kind in ("", "CONSTANT")
    ]
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("loop", "passes"),
    [
        ("u := 0 TO n - 1", 0),
        ("u := 0 TO n + 2", 3),
        ("u := 3 TO n - 1 BY -1", 4),
        ("u := 3 TO m BY -1", 2),
        ("v := 0 TO n - 1", 0),
        ("y := 1 TO 5", 5),
        ("y := 5 TO 1 BY -1", 5),
        ("y := 1 TO 5 BY 3", 2),
    ],
)
def test_passes_of_loops(loop: str, passes: int) -> None:
    """Bounds below an unsigned counter, and counters of whole subranges."""
    declared = "u : ULINT; v : UDINT; n : DINT; m : ULINT := 2; y : INT (1..5); r : DINT;"
    body = f"FOR {loop} DO r := r + 1; IF r > 99 THEN EXIT; END_IF END_FOR"
    assert program(declared, body)["MAIN"].r == passes


@pytest.mark.parametrize(
    ("type_", "expression", "hours"),
    [
        ("LTOD", "LTOD#23:00:00 + LTIME#2h", 1),
        ("LTOD", "LTOD#01:00:00 - LTIME#2h", 23),
        ("LTOD", "LTOD#01:00:00 + LTIME#49h", 2),
        ("TOD", "TOD#23:00:00 + T#2h", 1),
        ("TOD", "TOD#01:00:00 - T#2h", 23),
    ],
)
def test_times_of_day_stay_in_the_day(
    type_: str, expression: str, hours: int
) -> None:
    """Over midnight, both ways."""
    unit = 3_600_000_000_000 if type_ == "LTOD" else 3_600_000
    assert worth(
        "ULINT", f"{type_}_TO_ULINT(t)", f"t : {type_} := {expression};"
    ) == (hours * unit)


@pytest.mark.parametrize(
    ("declared", "statement", "text"),
    [
        ("d : DINT; s : STRING;", "s := INT_TO_STRING(d);", "DINT_TO_INT"),
        ("d : DINT; r : LREAL;", "r := USINT_TO_LREAL(d);", "DINT_TO_USINT"),
        ("u : ULINT; d : DINT;", "d := UINT_TO_DINT(u);", "ULINT_TO_UINT"),
        ("x : REAL;", "x := 1E39;", "does not fit REAL"),
        ("x : REAL;", "x := REAL#3.5E38;", "does not fit REAL"),
        ("x : LREAL;", "x := 1E400;", "does not fit LREAL"),
        (
            "l : LTIME; x : INT;",
            "CASE l OF T#1s: x := 1; END_CASE",
            "TIME does not convert to LTIME",
        ),
        ("x : INT;", "CASE x OF T#1s: x := 1; END_CASE", "does not convert"),
    ],
)
def test_what_would_lose_its_value_is_refused(
    declared: str, statement: str, text: str
) -> None:
    """With what to write instead, or the range."""
    with pytest.raises(StError, match=text):
        program(declared, statement)


def test_conversions_by_name_widen() -> None:
    """A value of a smaller type is the source's type, too."""
    assert worth("STRING", "DINT_TO_STRING(i)", "i : INT := -7;") == "-7"
    assert worth("LREAL", "INT_TO_LREAL(5)") == 5.0
