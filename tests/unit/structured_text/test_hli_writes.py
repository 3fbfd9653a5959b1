"""The compiler warns of writing to the HLI where that has no effect."""

from __future__ import annotations

from pathlib import Path

import pytest

from plc_client.st.build import build, check
from plc_client.st.errors import OWNER, UNHEARD

OVERRIDE = "gpCh[0]^.bahn_mc_control.override"
HEAD = "PROGRAM MAIN\nVAR u : MC_CONTROL_UNS16_UNIT; n : DINT; END_VAR\n"


def warnings_of(statements: str) -> list[tuple[int, int, str]]:
    """(number, line, the name that is missing) of each warning."""
    source = f"{HEAD}{statements}\nEND_PROGRAM\n"
    found = check({"w.st": source}).log
    assert not found.errors
    return [(w.code, w.line, w.construct) for w in found.warnings]


@pytest.mark.parametrize(
    "target",
    [
        "gpCh[0]^.bahn_state.active_feed_r",
        "gpCh[0]^.contour_lookahead.state.max_dist_prog_start",
        "gpCh[0]^.contour_lookahead.response.block[n].length",
        "gpAx[1]^.ipo_mc_control.override.state_r",
        "gpPform^.channel_count_r",
    ],
)
def test_a_member_that_the_cnc_writes_is_told(target: str) -> None:
    """Members that end with _r, and those of status structures."""
    assert warnings_of(f"{target} := 1;") == [(OWNER, 3, "")]


def test_outputs_of_a_call_write_too() -> None:
    """``=>`` to a member of the CNC."""
    target = "gpCh[0]^.bahn_state.override_r"
    source = (
        f"{HEAD}F(q => {target});\nEND_PROGRAM\n"
        "FUNCTION F : BOOL\nVAR_OUTPUT q : UINT; END_VAR\nEND_FUNCTION\n"
    )
    found = check({"w.st": source}).log
    assert [w.code for w in (*found.errors, *found.warnings)] == [OWNER]


def test_a_command_names_all_that_is_missing() -> None:
    """Each name once, at the first command; an override has its own flag."""
    command = f"{OVERRIDE}.command_w := 400;\n"
    assert warnings_of(command * 2) == [
        (UNHEARD, 3, "enable_w"),
        (UNHEARD, 3, "override_valid"),
    ]
    enabled = f"{command}{OVERRIDE}.enable_w := TRUE;\n"
    assert warnings_of(enabled) == [(UNHEARD, 3, "override_valid")]
    valid = f"{OVERRIDE}_valid.Enable_W := {OVERRIDE}_valid.command_w := TRUE;"
    assert not warnings_of(command + valid)


def test_variables_of_the_program_are_its_own() -> None:
    """A structure of the HLI that the program declares may be written."""
    assert not warnings_of("u.state_r := 3; u.command_w := 3;")


@pytest.mark.ci
def test_an_edit_elsewhere_keeps_or_ends_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The C of the block that commands is kept; the other one enables or not."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    command = f"{OVERRIDE}.command_w := 1;"
    first = f"FUNCTION_BLOCK A\n{command}\nEND_FUNCTION_BLOCK\n"
    second = "FUNCTION_BLOCK B\n{text}\nEND_FUNCTION_BLOCK\n" + HEAD
    enabling = f"{OVERRIDE}.enable_w := {OVERRIDE}_valid.enable_w := TRUE;"
    for text, many in ((";", 2), (enabling, 0), (";;", 2)):
        source = first + second.replace("{text}", text) + "END_PROGRAM\n"
        assert len(build({"w.st": source}).warnings) == many
