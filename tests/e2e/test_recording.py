"""Recordings of real runs: complete, the same every time, kept whatever ends them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell, CellConfig, Recording
from cnc_core.engine import Engine, Event
from cnc_core.planning import Feeder, plan_program
from cnc_core.planning.recording import PlanRecording
from cnc_core.program import Program
from cnc_core.recording.compare import compare
from cnc_core.recording.recorder import Recorder
from cnc_core.recording.schema import is_wall
from hli.part_file import PartFile
from support.command_line import Outcome, command, wait_for_cycle

Write = Callable[..., Path]
Cli = Callable[..., Outcome]
PART = """F6000
M8
G1 X50 Y20
G2 X60 Y30 I0 J10
#MSG ["half"]
M9
G1 X0 Y0
M30
"""
POSITION = "gpCh[0]^.bahn_state.dist_prog_start"
FAST = """cycle_s = 0.0001
[axes.X]
[axes.Y]
[axes.Z]
[channel.m_synch]
8 = "MVS_SVS"
"""


def tables_of(path: Path) -> dict[str, dict[str, list[object]]]:
    """Every column of every table but those of the wall clock."""
    recording = Recording(path)
    return {
        name: {
            column: recording.table(name)[column].tolist()
            for column in recording.table(name).columns
            if not is_wall(name, column)
        }
        for name in recording.tables
    }


@pytest.mark.ci
def test_a_lockstep_run_recorded_twice_is_the_same(
    program: Write, tmp_path: Path
) -> None:
    """Every table, bit for bit, but columns of the wall clock."""
    found = []
    for k in range(2):
        target = tmp_path / f"{k}.parquet"
        with Cell() as cell:
            result = cell.run(
                program(PART), "builtin:demo", record=target, watch=(POSITION,)
            )
        assert result.end == "completed", result.errors
        assert result.recorded == result.cycles
        found.append(tables_of(target))
    assert found[0] == found[1]
    assert found[0]["requests"]["cycle"]
    assert "half" in found[0]["events"]["text"]
    plc = found[0]["plc"]
    assert max(plc[POSITION]) > 50.0  # type: ignore[type-var]
    assert plc["cycle"] == sorted(plc["cycle"])
    assert plc["scan"] == list(range(1, len(plc["scan"]) + 1))


@pytest.mark.ci
def test_derivatives_are_those_of_the_speed(
    program: Write, tmp_path: Path
) -> None:
    """Acceleration and jerk are the changes over a cycle; the axes' limits hold."""
    target = tmp_path / "a.arrow"
    with Cell() as cell:
        cell.run(program(PART), record=target)
    cycles = Recording(target).cycles
    v, t = cycles["v"], cycles["t"]
    assert np.allclose(np.diff(v) / 1e-3, cycles["acceleration"][1:])
    assert np.allclose(
        np.diff(cycles["acceleration"]) / 1e-3, cycles["jerk"][1:]
    )
    assert np.allclose(np.diff(t), 1e-3)
    assert cycles.units["X"] == "mm"


@pytest.mark.ci
def test_real_time_is_recorded_behind_the_ring(
    program: Write, tmp_path: Path
) -> None:
    """More cycles than the ring has rows: each is there, or counted as lost."""
    config = program(FAST.partition("[channel")[0], "cell.toml")
    target = tmp_path / "a.parquet"
    with Cell(config, clock="realtime") as cell:
        result = cell.run(program("G4 2\nG1 X10 F6000\nM30\n"), record=target)
    assert result.cycles > 16_384
    cycle = Recording(target).cycles["cycle"].astype(np.int64)
    assert result.recorded == len(cycle)
    assert len(cycle) + result.record_lost == result.cycles
    missing = np.diff(cycle).sum() + 1 - len(cycle)
    assert missing <= result.record_lost
    assert cycle[-1] > 16_384


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_signal_keeps_the_recording(
    program: Write, tmp_path: Path, number: int, status: int
) -> None:
    """SIGTERM and SIGHUP of the launcher: both sides end, the file is whole."""
    # under nohup a process ignores SIGHUP, and those that it starts do so too
    signal.signal(number, signal.SIG_DFL)
    target = tmp_path / "r.parquet"
    path = program("F600\n" + "G1 X50\nX0\n" * 100)
    launcher = subprocess.Popen(
        command("run", path, "--clock", "realtime", "--record", target),
        stderr=subprocess.PIPE,
    )
    wait_for_cycle(launcher.pid, 200)
    launcher.send_signal(number)
    launcher.communicate(timeout=90)
    assert launcher.returncode == status
    recording = Recording(target)
    assert recording.complete
    assert recording.meta["end"] == "interrupted"
    assert len(recording.cycles) > 100


@pytest.mark.ci
def test_a_killed_launcher_leaves_what_was_recorded(
    program: Write, tmp_path: Path
) -> None:
    """SIGKILL: the parts are readable under the target's name, and the next run
    to this name makes a file of them.
    """
    target = tmp_path / "r.parquet"
    path = program("F600\n" + "G1 X50\nX0\n" * 100)
    launcher = subprocess.Popen(
        command("run", path, "--clock", "realtime", "--record", target),
        stderr=subprocess.DEVNULL,
    )
    wait_for_cycle(launcher.pid, 200)
    launcher.kill()
    launcher.wait(timeout=90)
    rows = len(settled(target).cycles)
    assert rows > 100
    with Cell() as cell:
        result = cell.run(program("G4 0.01\nM30\n", "b.nc"), record=target)
    name = target.with_name("r-recovered-1.parquet")
    assert any(name.name in text for text in result.warnings)
    assert len(Recording(name).cycles) == rows
    assert Recording(target).complete


def settled(target: Path) -> Recording:
    """The recording when the CNC, which saw its parent die, has ended its part."""
    end = time.monotonic() + 60.0
    before = -1
    while time.monotonic() < end:
        recording = Recording(target)
        rows = len(recording.cycles) if recording.tables else 0
        if rows == before > 0:
            return recording
        before = rows
        time.sleep(0.5)
    raise AssertionError("the recording does not come to its end")


@pytest.mark.ci
def test_columns_are_chosen(program: Write, cli: Cli, tmp_path: Path) -> None:
    """--record-only keeps cycle, time and what is named; a wrong name is an error
    that tells the nearest one.
    """
    path = program(PART)
    done = cli(
        "run", path, "--record", "a.arrow", "--record-only", "v",
        "--record-only", "events",
    )  # fmt: skip
    assert done.status == 0, done.err
    recording = Recording(tmp_path / "a.arrow")
    assert recording.cycles.columns == ("cycle", "t", "v")
    assert recording.tables == ("cycles", "events")
    wrong = cli("run", path, "--record", "b.arrow", "--record-only", "jrek")
    assert wrong.status == 1
    assert "did you mean jerk" in wrong.err
    assert not os.path.exists(tmp_path / "b.arrow.parts")


@pytest.mark.ci
def test_a_run_goes_on_where_nothing_can_be_recorded(
    program: Write, cli: Cli, tmp_path: Path
) -> None:
    """A folder that cannot be written: a warning ahead of the run, the run to its
    end, what is missing in its summary, exit status 1.
    """
    (tmp_path / "file").touch()
    done = cli(
        "run", program(PART), "--plc", "builtin:demo",
        "--record", "file/a.parquet", "--json",
    )  # fmt: skip
    assert done.status == 1
    assert "the run goes on without it" in done.err.splitlines()[0]
    told = json.loads(done.out)
    assert told["end"] == "completed"
    assert told["recorded"] == 0
    assert told["record_lost"] > told["cycles"] > 500
    assert f"{told['cycles']} of cycles" in told["warnings"][0]
    assert "Not a directory" in told["warnings"][0]
    assert [error["code"] for error in told["errors"]] == [901004]


@pytest.mark.parametrize("broken", ["raises", "ends"])
def test_a_writer_that_fails_does_not_stop_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: str
) -> None:
    """A batch that fails counts as lost; a thread that has ended loses nothing in
    virtual time.
    """
    if broken == "raises":
        monkeypatch.setattr(PartFile, "add", _fails)
    else:
        monkeypatch.setattr(Recorder, "_write", lambda _: None)
    path = tmp_path / "part.nc"
    path.write_text("G4 3\nG1 X1 F600\nM30\n")
    cell = CellConfig()
    engine = Engine(cell, record_rows=512)
    feeder = Feeder(Program(path, cell), engine, lambda _: None)
    with closing(engine):
        recorder = Recorder(engine, tmp_path / "a.arrow", cell, b"{}")
        while (event := engine.run(4000)) is not Event.PROGRAM_END:
            if event is Event.RECORD_FULL:
                recorder.make_room()
            feeder.fill()
        recorder.close()
        cycles, lost = int(engine.state.cycle), recorder.lost
    rows = Recording(tmp_path / "a.arrow").cycles
    assert cycles > 3000
    assert len(rows) + lost.get("cycles", 0) == cycles
    assert bool(lost) == (broken == "raises")
    assert ("no memory" in recorder.problem) == (broken == "raises")


def _fails(*_: object) -> bool:
    raise MemoryError("no memory")


def test_a_plan_is_recorded_as_a_run(program: Write, tmp_path: Path) -> None:
    """The cycles of a plan are those of a run without a PLC; functions and the
    contour are there; an error is an event.
    """
    path = program(PART)
    planned = Program(path, CellConfig())
    plan_program(
        planned, recording=PlanRecording(tmp_path / "p.arrow", planned, None)
    )
    with Cell() as cell:
        cell.run(path, "none", record=tmp_path / "r.arrow")
    a, b = Recording(tmp_path / "p.arrow"), Recording(tmp_path / "r.arrow")
    assert a.complete
    assert a.meta["clock"] == "plan"
    assert len(a.elements) == len(b.elements) > 0
    assert a.functions["code"].tolist() == b.functions["code"].tolist()
    found = compare(a, b, "distance")
    # what only a PLC sees: how far it may look
    assert set(found.counts) == {"cycles"}
    assert set(found.counts["cycles"]) == {"max_dist_prog_start"}
    assert len(a.cycles) > 500


@pytest.mark.ci
def test_the_cnc_alone_is_recorded(
    program: Write, cli: Cli, tmp_path: Path
) -> None:
    """``cnc --record``: the file is written when the process ends."""
    done = cli(
        "cnc", program("G4 0.02\nG1 X2 F6000\nM30\n"), "--no-wait",
        "--name", f"hli-cosim-{os.getpid()}-alone", "--clock", "freerun",
        "--max-time", "1", "--record", "a.parquet",
    )  # fmt: skip
    recording = Recording(tmp_path / "a.parquet")
    assert recording.complete, done.err
    assert recording.cycles["X"].max() == 2.0
    assert recording.meta["program"]["file"] == "part.nc"
    assert "end" in recording.events["kind"].tolist()
    assert not (tmp_path / "a.parquet.parts").exists()
