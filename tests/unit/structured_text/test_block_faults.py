"""Wrong inputs of the library's blocks are told at the user's call."""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.pytest_plugin import PlcFactory
from plc_client.mock import line
from plc_client.st.build import check
from plc_client.task import PlcError

SERVER = "server : TechnoServer; shut : TechnoBlock;"


def program(variables: str, statement: str) -> str:
    """The statement stands in line 3."""
    return f"PROGRAM MAIN\nVAR {variables} END_VAR\n{statement}\nEND_PROGRAM\n"


@pytest.mark.parametrize(
    ("statement", "text"),
    [
        ("server.on(shut, 'X', 50);", "technology function 'X': M, H, S or T"),
        ("server.on(shut, 'm', 50);", "technology function 'm': M, H, S or T"),
        ("server.on(shut, 'MM');", "technology function 'MM': M, H, S or T"),
        ("server.on(shut, 'M', -5);", "technology function number -5: from 0"),
    ],
)
def test_literals_that_no_function_has_are_errors(
    statement: str, text: str
) -> None:
    """Kind and number of ``TechnoServer.on``, at the argument's place."""
    (error,) = check({"on.st": program(SERVER, statement)}).log.errors
    assert text in error.text
    assert (error.file, error.line) == ("on.st", 3)


def test_functions_that_there_are_pass() -> None:
    """Each kind, with a number and without one."""
    calls = "".join(f"server.on(shut, '{kind}');" for kind in "MHST")
    source = program(SERVER, calls + "server.on(shut, 'M', 0);")
    assert not check({"on.st": source}).log.errors


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("variables", "statement", "text"),
    [
        (
            SERVER + " kind : STRING := 'N';",
            "server.on(shut, kind, 50);",
            "TechnoServer.on: technology function 'N': M, H, S or T",
        ),
        (
            SERVER + " number : DINT := -5;",
            "server.on(shut, 'M', number);",
            "TechnoServer.on: technology function number -5: from 0 on",
        ),
        (
            "o : Override;",
            "o(channel := 3, path := 50.0);",
            "Override: channel 3 is not configured; the CNC has 0..0",
        ),
        (
            "a : AxisControl;",
            "a(axis := 9);",
            "AxisControl: axis 9 is not configured; the CNC has 0..2",
        ),
        (
            "q : ContourQueue;",
            "q(length := 1.0, channel := 2);",
            "ContourQueue: channel 2 is not configured; the CNC has 0..0",
        ),
        (
            "s : StartProgram; n : INT := 300;",
            "s(channel := n);",
            "StartProgram: channel 300 is not configured; the CNC has 0..0",
        ),
        (
            "n : DINT;",
            "n := gpCh[1]^.head.channel_nr;",
            "channel 1 is not configured; the CNC has 0..0",
        ),
    ],
)
def test_a_fault_in_a_block_has_the_place_of_the_call(
    plc: PlcFactory, tmp_path: Path, variables: str, statement: str, text: str
) -> None:
    """File and line of the user, the block, what is wrong and what there is."""
    path = tmp_path / "fault.st"
    path.write_text(program(variables, statement))
    runner = plc(path, script=[line(30)])
    with pytest.raises(PlcError) as caught:
        runner.step(1)
    assert f"fault.st:3: StTrap: MAIN: {text}" in str(caught.value)
