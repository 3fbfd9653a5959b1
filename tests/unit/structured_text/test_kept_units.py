"""An edit of one block makes the C of that block anew and of no other."""

from __future__ import annotations

from pathlib import Path

import pytest

from hli import layout
from plc_client.st.build import Checked, _own_hash, check
from plc_client.st.machine import lowered

SOURCE = """
FUNCTION_BLOCK Counter
VAR_INPUT up : BOOL; END_VAR
VAR_OUTPUT n : UINT; END_VAR
VAR CONSTANT STEP_ : INT := 2; END_VAR
IF up THEN n := n + STEP_; END_IF
METHOD Twice : INT
VAR_INPUT a : INT; END_VAR
VAR_INST calls : INT; END_VAR
again:
calls := calls + 1;
IF calls < 2 THEN JMP again; END_IF
Twice := 2 * a; // METHOD
END_METHOD
PROPERTY Last : UINT
GET
Last := n;
END_GET
END_PROPERTY
ACTION Clear: n := 0; END_ACTION
END_FUNCTION_BLOCK

FUNCTION Half : INT
VAR_INPUT a : INT; END_VAR
VAR u : UINT; END_VAR
u := a;
Half := a / 2;
END_FUNCTION

PROGRAM MAIN
VAR c : Counter; x : INT; t : STRING := 'END_VAR'; END_VAR
c(up := TRUE);
x := Half(4) + c.Twice(3);
END_PROGRAM
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HLI_COSIM_CACHE", str(tmp_path))


def kept(text: str) -> Checked:
    return check({"a.st": text}, keeps=True)


def warned(found: Checked) -> list[tuple[int, str]]:
    return [(w.line, w.text) for w in found.log.warnings]


def test_kept_c_is_the_c_that_would_be_made() -> None:
    """The second build has the same C and the same warnings as the first one."""
    first, second = kept(SOURCE), kept(SOURCE)
    assert second.world.classes["COUNTER"].pou.outlined
    assert second.program.texts == first.program.texts
    assert warned(second) == warned(first) != []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("Half := a / 2;", "Half := a / 3;\n\n"),
        ("Twice := 2 * a;", "\nTwice := 3 * a;"),
        ("u := a;", ""),
        ("STEP_ : INT := 2", "STEP_ : INT := 5"),
        ("n := 0;", "n := 1;"),
        ("Last := n;", "Last := n + 1;"),
        ("a : INT; END_VAR\nVAR u", "a : INT; b : INT := 3; END_VAR\nVAR u"),
    ],
)
def test_an_edit_gives_the_c_of_a_fresh_build(old: str, new: str) -> None:
    """Whatever is edited: C and warnings are those of a build without a cache."""
    kept(SOURCE)
    text = SOURCE.replace(old, new)
    assert text != SOURCE
    found, fresh = kept(text), check({"a.st": text})
    assert found.log.errors == []
    assert found.program.texts == fresh.program.texts
    assert warned(found) == warned(fresh)


def test_an_edit_of_statements_leaves_other_blocks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only the block whose statements have changed is made anew."""
    kept(SOURCE)
    made = []
    keep = lowered.LoweredUnits.keep

    def noted(self: lowered.LoweredUnits, unit: object, *rest: object) -> None:
        made.append(unit.text.split()[1])  # type: ignore[attr-defined]
        keep(self, unit, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(lowered.LoweredUnits, "keep", noted)
    kept(SOURCE.replace("a / 2", "a / 3"))
    assert made == ["Half"]


def test_errors_are_told_each_time() -> None:
    """What is wrong is never kept."""
    text = SOURCE.replace("Half := a / 2;", "Half := b;")
    for _ in range(2):
        assert [e.line for e in kept(text).log.errors] == [27]


def twincat(body: str) -> dict[str, str]:
    """A TwinCAT object with a method, and a program beside it."""
    text = (
        "<TcPlcObject><POU Name='FB_A'><Declaration>FUNCTION_BLOCK FB_A\n"
        "VAR_INPUT a : INT; END_VAR\nVAR u : UINT; END_VAR\n</Declaration>"
        f"<Implementation><ST>{body}</ST></Implementation>"
        "<Method Name='M'><Declaration>METHOD M : INT</Declaration>"
        "<Implementation><ST>M := a; u := a;</ST></Implementation></Method>"
        "</POU></TcPlcObject>"
    )
    main = "PROGRAM MAIN\nVAR f : FB_A; END_VAR\nf(a := f.M());\nEND_PROGRAM\n"
    return {"FB_A.TcPOU": text, "MAIN.st": main}


def test_a_twincat_object_is_kept_as_a_whole() -> None:
    """An edit of its body makes the object anew and leaves the program."""
    check(twincat("u := a;"), keeps=True)
    edited = twincat("\nu := a + 1;")
    found, fresh = check(edited, keeps=True), check(edited)
    assert found.program.texts == fresh.program.texts
    assert warned(found) == warned(fresh)
    assert not found.world.classes["FB_A"].pou.outlined
    assert found.world.classes["MAIN"].pou.outlined


def test_another_hli_is_another_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was compiled for another layout of the HLI is not loaded."""
    here = _own_hash()
    other = tmp_path / "layout.py"
    other.write_text(Path(layout.__file__).read_text() + "MORE = 1\n")
    _own_hash.cache_clear()
    with monkeypatch.context() as patched:
        patched.setattr(layout, "__file__", str(other))
        assert _own_hash() != here
    _own_hash.cache_clear()
    assert _own_hash() == here
