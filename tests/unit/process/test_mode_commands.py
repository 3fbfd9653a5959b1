"""Mode commands of the PLC while a program runs: one behind the other, and
which of them change nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from support.channels import AUTOMATIC, Channels

ONE = '[channel]\ninterpolator_function = "FCT_IPO_DEFAULT"\n'
LONG = "N10 G1 X100 F6000\nM30\n"
SELECTED, READY, ACTIVE, HOLD, ERROR, RESET = 2, 3, 4, 5, 6, 15
SELECTING, ABORTING = 7, 12
MDI = 3


@pytest.fixture
def cnc(tmp_path: Path) -> Iterator[Channels]:
    """A channel 0.3 s into its program; ``b.nc`` moves Y to 5."""
    (tmp_path / "b.nc").write_text("G1 Y5 F6000\nM30\n")
    with Channels(tmp_path, [LONG], ONE) as cnc:
        cnc.run(300)
        yield cnc


def state(cnc: Channels) -> int:
    unit = cnc.root.channel[0].channel_mc_control.mode_and_state
    return int(unit.state_r.state)


def order(
    cnc: Channels, target: int, name: str = "", mode: int = AUTOMATIC
) -> None:
    """A command as soon as the one before it has been taken."""
    unit = cnc.root.channel[0].channel_mc_control.mode_and_state
    cnc.until(lambda: not unit.command_semaphor_rw)
    cnc.command(0, mode, target, name)
    cnc.run(1)


def errors(cnc: Channels) -> list[int]:
    """What the channel has told the PLC since the last call."""
    unit, out = cnc.root.channel[0].mc_error, []
    unit.enable_w = True
    for _ in range(5):
        cnc.run(1)
        if unit.semaphor_rw:
            out.append(int(unit.satz_r.kopf.error_id))
            unit.semaphor_rw = False
    return out


@pytest.mark.parametrize("ends", [SELECTED, RESET])
def test_a_start_behind_an_abort_waits_for_its_end(
    cnc: Channels, ends: int
) -> None:
    """The abort still brakes: the other program begins where it stands."""
    order(cnc, ends)
    order(cnc, ACTIVE, "b.nc")
    cnc.until(lambda: state(cnc) == ACTIVE)
    stood = cnc.positions(0)
    assert 0.0 < stood[0] < 100.0
    assert cnc.end() == ["completed"]
    assert cnc.positions(0)[:2] == [stood[0], 5.0]
    assert errors(cnc) == []


@pytest.mark.parametrize("first", [SELECTED, RESET])
def test_a_reset_behind_an_abort_waits_for_its_end(
    cnc: Channels, first: int
) -> None:
    """It is carried out, not refused."""
    order(cnc, first)
    order(cnc, RESET)
    cnc.until(lambda: state(cnc) == SELECTED)
    cnc.run(5)
    assert errors(cnc) == []


def test_a_missing_program_behind_an_abort_is_told(cnc: Channels) -> None:
    """As one behind a program's end."""
    order(cnc, SELECTED)
    order(cnc, ACTIVE, "missing.nc")
    cnc.until(lambda: state(cnc) == SELECTED)
    assert errors(cnc) == [901001]


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("name", ["b.nc", "missing.nc"])
def test_another_program_does_not_begin_while_one_runs(
    cnc: Channels, held: bool, name: str
) -> None:
    """Refused; the one that runs goes on, the held one stays held."""
    if held:
        order(cnc, HOLD)
        cnc.until(lambda: state(cnc) == HOLD)
    before = state(cnc)
    order(cnc, ACTIVE, name)
    cnc.until(lambda: state(cnc) == before)
    assert errors(cnc) == [270061]
    assert state(cnc) == before
    order(cnc, ACTIVE)
    assert cnc.end() == ["completed"]
    assert cnc.positions(0)[:2] == [100.0, 0.0]


@pytest.mark.parametrize("wait", [1, 400])
def test_a_held_program_goes_on_by_its_name(cnc: Channels, wait: int) -> None:
    """Also while it still brakes for HOLD."""
    file = cnc.channels[0].modes.program
    assert file is not None
    order(cnc, HOLD)
    cnc.run(wait)
    order(cnc, ACTIVE, file.name)
    cnc.until(lambda: state(cnc) == ACTIVE)
    assert cnc.end() == ["completed"]
    assert cnc.positions(0)[0] == 100.0
    assert errors(cnc) == []


@pytest.mark.parametrize("text", ["G1 Y9 F600", "G91 G1 X10 F600"])
def test_no_text_begins_while_a_text_runs(cnc: Channels, text: str) -> None:
    """MDI: the same text is refused, too; it would be driven once more."""
    order(cnc, SELECTED)
    cnc.until(lambda: state(cnc) == SELECTED)
    stood = cnc.positions(0)[0]
    order(cnc, ACTIVE, "G91 G1 X10 F600", MDI)
    cnc.until(lambda: state(cnc) == ACTIVE)
    order(cnc, ACTIVE, text, MDI)
    assert errors(cnc) == [270061]
    assert cnc.end() == ["completed"]
    assert cnc.positions(0)[:2] == pytest.approx([stood + 10.0, 0.0])


def test_a_held_text_goes_on_by_itself(cnc: Channels) -> None:
    """MDI: in HOLD the same text is the program that is held."""
    order(cnc, SELECTED)
    order(cnc, ACTIVE, "G1 X90 F600", MDI)
    cnc.until(lambda: state(cnc) == ACTIVE)
    cnc.run(300)
    order(cnc, HOLD, mode=MDI)
    cnc.until(lambda: state(cnc) == HOLD)
    order(cnc, ACTIVE, "G1 X90 F600", MDI)
    cnc.until(lambda: state(cnc) == ACTIVE)
    assert errors(cnc) == []
    assert cnc.end() == ["completed"]
    assert cnc.positions(0)[:2] == [90.0, 0.0]


@pytest.mark.parametrize("target", [READY, ACTIVE])
def test_a_program_that_is_not_there_leaves_none_selected(
    cnc: Channels, target: int
) -> None:
    """So the next start does not drive the one that was selected before."""
    order(cnc, SELECTED)
    order(cnc, READY, "b.nc")
    cnc.until(lambda: state(cnc) == READY)
    order(cnc, target, "missing.nc")
    cnc.until(lambda: state(cnc) == SELECTED)
    assert errors(cnc) == [901001]
    order(cnc, ACTIVE)
    cnc.run(20)
    assert (state(cnc), errors(cnc)) == (SELECTED, [905020])
    assert cnc.positions(0)[1] == 0.0


def test_ready_without_a_name_takes_the_aborted_program_up(
    cnc: Channels,
) -> None:
    """From its beginning, by the next start."""
    order(cnc, READY)
    cnc.until(lambda: state(cnc) == READY)
    assert errors(cnc) == []
    order(cnc, ACTIVE)
    cnc.until(lambda: state(cnc) == ACTIVE)
    assert cnc.end() == ["completed"]
    assert cnc.positions(0)[0] == 100.0


@pytest.mark.parametrize("stands", [False, True])
def test_hold_where_no_program_runs_is_no_hold(
    cnc: Channels, stands: bool
) -> None:
    """State HOLD never shows, behind an abort either: there is nothing to hold."""
    order(cnc, SELECTED)
    cnc.until(lambda: not stands or state(cnc) == SELECTED)
    order(cnc, HOLD)
    seen = {state(cnc)}
    for _ in range(400):
        cnc.run(1)
        seen.add(state(cnc))
    assert HOLD not in seen
    assert errors(cnc) == [270061]


@pytest.mark.parametrize(
    ("target", "name"), [(SELECTED, ""), (READY, ""), (READY, "b.nc")]
)
@pytest.mark.parametrize("held", [False, True])
def test_an_abort_of_a_wrong_program_ends_in_error(
    tmp_path: Path, held: bool, target: int, name: str
) -> None:
    """What was asked for behind the abort is refused; RESET leaves the error."""
    (tmp_path / "b.nc").write_text("G1 Y5 F6000\nM30\n")
    text = "N10 G01 X100 F6000\nN20 X200\nN30 G01 X$UNKNOWN[\nM30\n"
    with Channels(tmp_path, [text], ONE) as cnc:
        cnc.run(300)
        if held:
            order(cnc, HOLD)
            cnc.until(lambda: state(cnc) == HOLD)
        order(cnc, target, name)
        cnc.until(lambda: not cnc.channels[0].modes.running)
        assert 270061 in errors(cnc)
        assert state(cnc) == ERROR
        order(cnc, RESET)
        cnc.run(5)
        assert state(cnc) == SELECTED
        order(cnc, ACTIVE, "b.nc")
        cnc.until(lambda: state(cnc) == ACTIVE)
        assert cnc.end() == ["completed"]
        assert cnc.positions(0)[1] == 5.0


def test_a_start_on_its_way_finds_the_program_running(tmp_path: Path) -> None:
    """The cell has started it meanwhile: it is ACTIVE, and can be held."""
    with Channels(tmp_path, [LONG], ONE, start=False) as cnc:
        cnc.run(5)
        assert state(cnc) == READY
        cnc.command(0, AUTOMATIC, ACTIVE)
        cnc.group.run(1)  # GEO has taken it, the cell not yet
        cnc.channels[0].start()
        cnc.run(200)
        assert state(cnc) == ACTIVE
        order(cnc, HOLD)
        cnc.until(lambda: state(cnc) == HOLD)
        assert errors(cnc) == []
        assert 0.0 < cnc.positions(0)[0] < 100.0


def test_a_program_shows_active_with_its_first_data(
    cnc: Channels, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Distance, log and end are the new program's: in real time GEO may publish
    in between.
    """
    engine, seen = cnc.channels[0].engine, []
    begin = engine.begin_program

    def begin_program() -> None:
        seen.append(engine.mode_state)
        begin()
        seen.append(engine.mode_state)

    monkeypatch.setattr(engine, "begin_program", begin_program)
    order(cnc, SELECTED)
    order(cnc, ACTIVE, "b.nc")
    cnc.until(lambda: state(cnc) == ACTIVE)
    assert ACTIVE not in seen
    assert len(seen) == 2


@pytest.mark.parametrize("after", ["SELECTED", "READY"])
@pytest.mark.parametrize(
    ("target", "parameter", "mode", "outcome"),
    [
        (READY, "b.nc", AUTOMATIC, READY),
        (READY, "missing.nc", AUTOMATIC, SELECTED),
        (ACTIVE, "G1 Y1 F60", MDI, ACTIVE),
    ],
)
def test_no_state_but_the_outcome_shows_behind_an_abort(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    target: int,
    parameter: str,
    mode: int,
    outcome: int,
    after: str,
) -> None:
    """In real time a PLC could take a state in between for the outcome."""
    (tmp_path / "b.nc").write_text("G1 Y5 F6000\nM30\n")
    cell = f'{ONE}state_after_program = "{after}"\n'
    with Channels(tmp_path, [LONG], cell) as cnc:
        cnc.run(300)
        engine, shown = cnc.channels[0].engine, []
        set_mode = engine.set_mode

        def noted(mode: int, state: int) -> None:
            shown.append(state)
            set_mode(mode, state)

        monkeypatch.setattr(engine, "set_mode", noted)
        order(cnc, target, parameter, mode)
        cnc.until(lambda: state(cnc) == outcome)
    assert shown[:2] == [ABORTING, outcome]


def test_a_command_that_geo_has_taken_keeps_its_transient_state(
    cnc: Channels,
) -> None:
    """What the cell shows meanwhile is not the command's outcome."""
    cnc.command(0, AUTOMATIC, SELECTED)
    cnc.group.run(1)  # GEO has taken it, the cell not yet
    assert state(cnc) == SELECTING
    cnc.channels[0].modes.show()
    assert cnc.channels[0].engine.mode_state == SELECTING
    cnc.until(lambda: state(cnc) == SELECTED)


def test_a_held_text_of_several_lines_goes_on(cnc: Channels) -> None:
    """Also with the line ends of Windows."""
    text = "G1 X20 F6000\r\nG1 X0"
    order(cnc, SELECTED)
    order(cnc, ACTIVE, text, MDI)
    cnc.until(lambda: state(cnc) == ACTIVE)
    order(cnc, HOLD, mode=MDI)
    cnc.until(lambda: state(cnc) == HOLD)
    order(cnc, ACTIVE, text, MDI)
    cnc.until(lambda: state(cnc) == ACTIVE)
    assert errors(cnc) == []
    assert cnc.end() == ["completed"]
