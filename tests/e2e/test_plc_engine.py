"""The function blocks against the real engine: what the mock plays, the CNC does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from plc_client import (
    AbortProgram,
    CncWatchdog,
    ContinueMachining,
    DeleteDistanceToGo,
    ErrorReader,
    FeedHold,
    InsertStop,
    MCV_HliInterface,
    Override,
    PathDirection,
    PlcError,
    ProcessState,
    ResetChannel,
    ResumeProgram,
    SingleBlock,
    StartProgram,
    StopProgram,
    TechnoServer,
    Watchdog,
    WatchState,
)

Write = Callable[..., Path]
PART = "N10 G01 X50 Y0 F6000\nN20 G01 Y50\nN30 G01 X0\nN40 G01 Y0\nM30\n"


class Bench:
    """Every block once; the test says what is called in each scan."""

    def setup(self, hli: Any) -> None:
        ch = self.ch = hli.gpCh[0]
        self.functions = TechnoServer(hli)
        self.start, self.stop, self.resume = (
            StartProgram(ch),
            StopProgram(ch),
            ResumeProgram(ch),
        )
        self.abort, self.reset = AbortProgram(ch), ResetChannel(ch)
        self.hold, self.override, self.single = (
            FeedHold(ch),
            Override(ch),
            SingleBlock(ch),
        )
        self.go_on, self.insert, self.delete = (
            ContinueMachining(ch),
            InsertStop(ch),
            DeleteDistanceToGo(ch),
        )
        self.direction, self.errors = PathDirection(ch), ErrorReader(ch)
        self.watchdog, self.cnc, self.interface = (
            Watchdog(ch),
            CncWatchdog(ch),
            MCV_HliInterface(hli),
        )
        self.calls: dict[str, tuple[Any, ...]] = {}
        self.records: list[int] = []

    def cyclic(self) -> None:
        self.functions()
        self.records += [record.error_id for record in self.errors()]
        for name, inputs in self.calls.items():
            getattr(self, name)(*inputs)


def until_done(runner: Any, name: str, *inputs: Any) -> Any:
    """Execute one block to its end; its error number is 0."""
    block = getattr(runner.task, name)
    runner.task.calls[name] = (True, *inputs)
    runner.run_until(lambda: block.done or block.error, limit_s=10.0)
    assert block.error_id == 0, (name, block.state, block.error_id)
    runner.task.calls[name] = (False, *inputs)
    runner.step()
    return block


def test_start_stop_resume_abort(plc: Any, program: Write) -> None:
    """The semaphore discipline against the real unit; HOLD stands, resume goes on, abort ends."""
    runner = plc(Bench, program(PART), autostart=False)
    runner.step(20)
    assert runner.distance == 0.0
    until_done(runner, "start")
    runner.run_to_distance(100_000.0)
    until_done(runner, "stop")
    assert runner.task.stop.process_state == ProcessState.HOLD
    held = runner.distance
    runner.step(50)
    assert runner.distance == held
    until_done(runner, "resume")
    runner.run_to_distance(700_000.0)
    until_done(runner, "abort")
    assert runner.task.abort.process_state in (
        ProcessState.SELECTED,
        ProcessState.READY,
    )


def test_hold_override_and_single_block(plc: Any, program: Write) -> None:
    """Level units: the CNC shows what it uses."""
    runner = plc(Bench, program(PART))
    task = runner.task
    task.calls["override"] = (50.0,)
    runner.run_to_distance(100_000.0)
    assert (task.override.effective, task.override.done) == (50.0, True)
    assert runner.ch._c.bahn_state.active_feed_r == pytest.approx(
        50_000, rel=0.01
    )
    task.calls["hold"] = (True,)
    runner.run_until(lambda: task.hold.standing, limit_s=5.0)
    here = runner.distance
    runner.step(50)
    assert runner.distance == here
    task.calls |= {
        "hold": (False,),
        "override": (100.0,),
        "single": (True, False),
    }
    runner.run_until(lambda: task.single.waiting, limit_s=5.0)
    assert runner.distance == pytest.approx(500_000.0, abs=1.0)
    task.calls["single"] = (True, True)
    runner.run_until(lambda: task.single.steps == 1, limit_s=5.0)
    task.calls["single"] = (False, False)
    runner.run_to_end(limit_s=20.0)
    assert runner.distance == pytest.approx(2_000_000.0, abs=1.0)


def test_inserted_stop_and_continue(plc: Any, program: Write) -> None:
    """Stands at its distance; continue leaves it."""
    runner = plc(Bench, program(PART))
    until_done(runner, "insert", 700_000.0)
    runner.task.calls["go_on"] = (False,)
    runner.run_until(lambda: runner.task.go_on.waiting, limit_s=5.0)
    assert runner.distance == pytest.approx(700_000.0, abs=100.0)
    until_done(runner, "go_on")
    runner.run_to_end(limit_s=20.0)


@pytest.mark.ci
def test_backward_and_forward(plc: Any, program: Write) -> None:
    """dist_prog_start decreases and grows again; the program ends at the same place."""
    runner = plc(Bench, program(PART))
    runner.run_to_distance(700_000.0)
    runner.task.calls["direction"] = (True,)
    runner.run_until(lambda: runner.distance < 400_000.0, limit_s=5.0)
    assert runner.task.direction.backward_active
    runner.task.calls["direction"] = (False,)
    runner.run_to_end(limit_s=20.0)
    assert runner.distance == pytest.approx(2_000_000.0, abs=1.0)


def test_deleted_distance_to_go(plc: Any, program: Write) -> None:
    """The shortcut goes straight to the next motion's target: the program is shorter."""
    runner = plc(Bench, program(PART))
    runner.run_to_distance(100_000.0)
    until_done(runner, "delete")
    seconds = runner.time_s
    runner.run_to_end(limit_s=20.0)
    coord = runner.ch.bahn_state.coord_r
    assert (coord[0].act_position_r, coord[1].act_position_r) == (0, 0)
    assert runner.time_s > seconds


@pytest.mark.ci
def test_watchdogs_and_interface(plc: Any, program: Write) -> None:
    """Both sides see each other; the shapes agree; a PLC that falls silent is
    noticed, with a record.
    """
    runner = plc(Bench, program(PART))
    task = runner.task
    task.calls |= {"watchdog": (True, 50_000), "cnc": (True,), "interface": ()}
    runner.step(100)
    assert (
        task.watchdog.alive,
        task.cnc.alive,
        task.interface.Initialized,
    ) == (True, True, True)
    del task.calls["watchdog"]
    runner.step(200)
    task.calls["watchdog"] = (True, 50_000)
    runner.step(3)
    assert task.watchdog.state is WatchState.MISSED
    assert 270053 in task.records


@pytest.mark.parametrize("text", ["N10 G999\nM30\n", "N20 G01 X200000\nM30\n"])
def test_a_program_that_ends_by_an_error_is_no_end(
    plc: Any, program: Write, text: str
) -> None:
    """run_to_end() tells number and file; a syntax error as well as one on the
    way.
    """
    runner = plc(Bench, program(text))
    with pytest.raises(PlcError, match=r"ended with error \d+ \(part\.nc"):
        runner.run_to_end(limit_s=20.0)


def test_error_of_the_program_arrives_and_reset_leaves_it(
    plc: Any, program: Write
) -> None:
    """mc_error names the number; the mode is ERROR until the reset."""
    runner = plc(Bench, program("N10 G01 X10 F6000\nN20 G01 X200000\nM30\n"))
    runner.run_until(lambda: runner.task.records, limit_s=5.0)
    until_done(runner, "reset")
    assert runner.task.reset.process_state in (
        ProcessState.SELECTED,
        ProcessState.READY,
    )
