"""Mode and program control against the mock CNC: semaphore discipline, waiting
for state_r, errors, turns.
"""

from collections.abc import Iterator
from typing import Any

import pytest

from plc_client import (
    AbortProgram,
    Hli,
    Mode,
    ModeControl,
    ProcessState,
    ResetChannel,
    ResumeProgram,
    RunMdi,
    SelectProgram,
    StartProgram,
    State,
    StopProgram,
    connect,
)
from plc_client.mock import MockCnc, cnc_error, line


@pytest.fixture
def cnc() -> Iterator[MockCnc]:
    """A channel that waits for the PLC's start command; 100 mm at 100 mm/s."""
    with MockCnc([line(100)], auto_start=False) as value:
        yield value


@pytest.fixture
def hli(cnc: MockCnc) -> Iterator[Hli]:
    """Its PLC side."""
    with connect(cnc.name) as value:
        yield value


def until_done(
    cnc: MockCnc, fb: Any, *inputs: Any, limit: int = 100
) -> list[State]:
    """Call the block once a cycle until it is done or failed; the states it
    showed, without repetitions.
    """
    seen: list[State] = []
    for _ in range(limit):
        fb(True, *inputs)
        if not seen or seen[-1] is not fb.state:
            seen.append(fb.state)
        if fb.done or fb.error:
            return seen
        cnc.cycle()
    raise AssertionError(f"{fb.state} after {limit} cycles")


def test_start_stop_resume_abort_reset_walk_the_states(
    cnc: MockCnc, hli: Hli
) -> None:
    """Each command is done only when state_r shows it; HOLD stands, resume goes on."""
    ch = hli.gpCh[0]
    assert until_done(cnc, SelectProgram(ch), "part.nc")[-1] is State.DONE
    assert (cnc.mode.state, cnc.mode.parameter) == (
        ProcessState.READY,
        "part.nc",
    )
    until_done(cnc, StartProgram(ch))
    assert cnc.mode.state is ProcessState.ACTIVE
    cnc.run_to(cnc.cycles + 100)
    until_done(cnc, StopProgram(ch))
    held = cnc.distance
    cnc.run_to(cnc.cycles + 50)
    assert cnc.distance == held > 0
    until_done(cnc, ResumeProgram(ch))
    cnc.run_to(cnc.cycles + 50)
    assert cnc.distance > held
    until_done(cnc, AbortProgram(ch))
    assert (cnc.mode.state, cnc.ended) == (ProcessState.SELECTED, True)
    until_done(cnc, ResetChannel(ch))
    assert cnc.mode.state is ProcessState.SELECTED


def test_selected_to_active_in_one_command_passes_intermediate_states(
    cnc: MockCnc, hli: Hli
) -> None:
    """The interface performs the transitions between by itself; the block waits
    for the last one.
    """
    fb = ModeControl(hli.gpCh[0])
    shown = set()
    while not fb(True, Mode.AUTOMATIC, ProcessState.ACTIVE, "part.nc"):
        cnc.cycle()
        shown.add(fb.process_state)
    assert {
        ProcessState.PREPARING,
        ProcessState.READY,
        ProcessState.STARTING,
    } <= shown
    assert (fb.process_state, fb.Done, fb.Busy, fb.ErrorID) == (
        ProcessState.ACTIVE,
        True,
        False,
        0,
    )


def test_command_waits_for_the_semaphore_and_never_overwrites(
    cnc: MockCnc, hli: Hli
) -> None:
    """A command somebody else left in the unit stays untouched until the CNC takes it."""
    ch = hli.gpCh[0]
    unit = ch.channel_mc_control.mode_and_state
    unit.command_w.to_state, unit.command_w.parameter = 2, "foreign.nc"
    unit.command_semaphor_rw = True
    fb = StartProgram(ch)
    fb(True, "mine.nc")
    assert (fb.state, unit.command_w.parameter) == (
        State.WAIT_FREE,
        "foreign.nc",
    )
    unit.enable_w = True
    cnc.cycle()
    fb(True, "mine.nc")
    assert (fb.state, unit.command_w.parameter) == (State.SENT, "mine.nc")


def test_two_blocks_in_one_scan_take_turns(cnc: MockCnc, hli: Hli) -> None:
    """The mistake of the manual's list: two commands back to back, the first one lost. Not here."""
    ch = hli.gpCh[0]
    start, stop = StartProgram(ch), StopProgram(ch)
    for _ in range(60):
        start(True, "part.nc")
        stop(True)
        cnc.cycle()
    assert (start.done, stop.done, cnc.mode.accepted) == (True, True, 2)
    assert cnc.mode.state is ProcessState.HOLD


def test_reset_leaves_the_error_state(cnc: MockCnc, hli: Hli) -> None:
    """A program that fails: start reports it (error 5), reset is done in SELECTED."""
    cnc._script = [line(0.5), cnc_error(20131)]
    start = StartProgram(hli.gpCh[0])
    cnc.mode.enter(ProcessState.ERROR)
    cnc.cycle()
    until_done(cnc, start)
    assert (start.error, start.error_id) == (True, 5)
    reset = ResetChannel(hli.gpCh[0])
    until_done(cnc, reset)
    assert cnc.mode.state is ProcessState.SELECTED


@pytest.mark.parametrize(
    ("inputs", "error_id"),
    [
        ((Mode.STANDBY, ProcessState.ACTIVE), 270061),
        ((Mode.AUTOMATIC, ProcessState.ERROR), 270061),
        ((9, ProcessState.ACTIVE), 1),
        ((Mode.AUTOMATIC, ProcessState.ACTIVE, "x" * 300), 1),
    ],
)
def test_impossible_commands_are_refused_before_they_are_sent(
    cnc: MockCnc, hli: Hli, inputs: tuple[Any, ...], error_id: int
) -> None:
    """Error number, nothing in the unit; the error goes with execute."""
    fb = ModeControl(hli.gpCh[0])
    fb(True, *inputs)
    assert (fb.error, fb.error_id, fb.state) == (True, error_id, State.ERROR)
    assert not hli.gpCh[0].channel_mc_control.mode_and_state.command_semaphor_rw
    fb(False)
    assert (fb.error, fb.state) == (False, State.IDLE)


def test_plc_that_is_not_present_is_told(cnc: MockCnc, hli: Hli) -> None:
    """plc_present_w FALSE: the unit is dead, error 2 instead of waiting for ever."""
    hli.set_present(False)
    fb = StartProgram(hli.gpCh[0])
    fb(True)
    assert fb.error_id == 2


def test_command_not_taken_or_not_reached_in_time(
    cnc: MockCnc, hli: Hli
) -> None:
    """3: the semaphore stays; 4: taken, but the state never comes."""
    fb = StartProgram(hli.gpCh[0], timeout_s=0.02)
    fb(True)
    hli.gpCh[0].channel_mc_control.mode_and_state.enable_w = False
    while not fb.error:
        cnc.cycle()
        fb(True)
    assert fb.error_id == 3
    hli.gpCh[0].channel_mc_control.mode_and_state.command_semaphor_rw = False
    select = SelectProgram(hli.gpCh[0], timeout_s=0.02)
    cnc.mode.cycle = lambda present: ""  # type: ignore[method-assign]
    select(True)
    hli.gpCh[0].channel_mc_control.mode_and_state.command_semaphor_rw = False
    until_done(cnc, select)
    assert select.error_id == 4


@pytest.mark.parametrize("acknowledged", [False, True])
def test_a_command_that_the_cnc_refuses_is_not_done(
    cnc: MockCnc, hli: Hli, acknowledged: bool
) -> None:
    """HOLD without motion to hold: its number in mc_error, at once; the same
    record does not refuse the next command.
    """
    ch = hli.gpCh[0]
    ch.mc_error.enable_w = acknowledged
    for _ in range(2):
        hold = StopProgram(ch)
        assert until_done(cnc, hold, limit=5)[-1] is State.ERROR
        assert hold.error_id == 270061
        ch.mc_error.semaphor_rw = False
    assert until_done(cnc, SelectProgram(ch), "part.nc")[-1] is State.DONE


def test_done_stays_until_execute_falls_and_a_falling_execute_takes_nothing_back(
    cnc: MockCnc, hli: Hli
) -> None:
    """IEC: outputs are valid as long as execute is TRUE, at least for one call."""
    fb = StartProgram(hli.gpCh[0])
    fb(True)
    assert fb.busy
    for _ in range(30):
        cnc.cycle()
        if fb(False):
            break
    assert fb.done
    assert (fb(False), fb.state) == (False, State.IDLE)


def test_mdi_text_goes_in_the_parameter(cnc: MockCnc, hli: Hli) -> None:
    """Mode 3 with the blocks' text."""
    until_done(cnc, RunMdi(hli.gpCh[0]), "G01 X10 F1000")
    assert (cnc.mode.mode, cnc.mode.parameter) == (Mode.MDI, "G01 X10 F1000")


def test_block_that_is_no_longer_called_loses_its_turn(
    cnc: MockCnc, hli: Hli
) -> None:
    """A start that was given once and forgotten does not lock the others out."""
    forgotten, stop = (
        StartProgram(hli.gpCh[0], timeout_s=60.0),
        StopProgram(hli.gpCh[0]),
    )
    forgotten(True, "part.nc")
    cnc._script = [line(1000)]
    waited = 0
    while not stop(True):
        waited += stop.state is State.WAIT_FREE
        cnc.cycle()
        assert not stop.error
    assert waited >= 500
    assert cnc.mode.state is ProcessState.HOLD


def test_a_hold_that_meets_the_end_of_the_program_is_over_at_once(
    cnc: MockCnc, hli: Hli
) -> None:
    """Error 4, and the next block has its turn."""
    ch = hli.gpCh[0]
    until_done(cnc, StartProgram(ch), "part.nc")
    hold = StopProgram(ch)
    hold(True)
    cnc.cycle()
    cnc.mode.enter(ProcessState.SELECTED)
    hold(True)
    assert (hold.error, hold.error_id) == (True, 4)
    assert until_done(cnc, ResetChannel(ch))[-1] is State.DONE


def test_a_program_that_comes_and_goes_between_two_scans_has_run(
    cnc: MockCnc, hli: Hli
) -> None:
    """Its start is done: the channel rests, and nothing was refused."""
    cnc._script = [line(0.5)]
    start = StartProgram(hli.gpCh[0], timeout_s=0.2)
    for _ in range(8):
        start(True, "part.nc")
        cnc.run_to(cnc.cycles + 30)
    assert (start.done, start.error_id) == (True, 0)


def test_a_command_waits_for_the_outcome_of_the_one_before(
    cnc: MockCnc, hli: Hli
) -> None:
    """The refusal of one that was given up is not that of the next."""
    ch = hli.gpCh[0]
    cnc.mode.enter(ProcessState.ABORTING)
    cnc.cycle()
    select = SelectProgram(ch)
    for _ in range(3):
        select(True, "part.nc")
        assert select.state is State.WAIT_FREE
        cnc.cycle()
    cnc.errors.add(901001, class_=1)
    cnc.cycle()
    cnc.mode.enter(ProcessState.SELECTED)
    assert until_done(cnc, select, "part.nc")[-1] is State.DONE
