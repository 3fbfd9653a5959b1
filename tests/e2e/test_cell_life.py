"""Cells that run are listed, watched, and tell of their PLC."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from support.command_line import Outcome, command, wait_for_segment
from support.warm_commands import Server

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
Start = Callable[..., "subprocess.Popen[str]"]
LONG = "G1 F600 X1000\nM30\n"
SHORT = "G1 F6000 X1\nM30\n"
PLC = """
from plc_client import task

@task(interval=0.001)
class Counting:
    def setup(self, hli):
        self.count = 0

    def cyclic(self):
        self.count += 1
"""


@pytest.fixture(scope="module")
def start(warm_commands: Server) -> Start:
    """A command that goes on beside the test."""
    return lambda *arguments: started(warm_commands.command(*arguments))


def started(command: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def told(process: subprocess.Popen[str], text: str) -> str:
    """The next line on standard error that holds a text."""
    assert process.stderr is not None
    for line in process.stderr:
        if text in line:
            return line
    raise AssertionError(f"ended without {text!r}")


@pytest.fixture(scope="module")
def cell(
    start: Start, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[str]:
    """The name of a cell that runs in real time, with a PLC that counts."""
    name = f"t{os.getpid()}-life"
    folder = tmp_path_factory.mktemp("cell")
    (plc := folder / "counting.py").write_text(PLC)
    (part := folder / "long.nc").write_text(LONG)
    process = start(
        *("run", part, "--plc", plc),
        *("--clock", "realtime", "--name", name),
    )
    wait_for_segment(process, name)
    told(process, "started")
    yield name
    os.killpg(process.pid, signal.SIGINT)
    process.communicate(timeout=60)


@pytest.mark.ci
def test_ps_lists_the_cell(cli: Cli, cell: str) -> None:
    """Name, processes, clock, program and state."""
    (found,) = [c for c in cli("ps", "--json").json if c["name"] == cell]
    assert (found["clock"], found["program"]) == ("realtime", "long.nc")
    assert found["state"] == "active"
    assert found["pid"] > 0
    assert found["plc"] > 0
    assert cell in cli("ps").out
    pace = found["planner_us_per_ms"]
    assert 0.0 < pace["p50"] <= pace["p99"] <= pace["max"]


@pytest.mark.ci
def test_watch_reads_again_and_again(cli: Cli, cell: str) -> None:
    """A line of JSON a reading: symbols of the HLI and of a task."""
    path = "gpCh[0]^.bahn_state.dist_prog_start"
    outcome = cli(
        *("watch", path, "Counting.count", "--name", cell),
        *("--count", 3, "--interval", 0.05, "--json"),
    )
    assert outcome.status == 0
    rows = outcome.lines
    assert [set(row) for row in rows] == [{"t", path, "Counting.count"}] * 3
    for key in rows[0]:
        values = [row[key] for row in rows]
        assert values == sorted(set(values))


def test_watch_shows_a_structure_with_units(cli: Cli, cell: str) -> None:
    """Members a line each; --json nests them."""
    arguments = ("watch", "gpCh[0].bahn_state", "--name", cell, "--count", 1)
    assert "dist_prog_start = " in (text := cli(*arguments).out)
    assert " 0.1 um\n" in text
    (row,) = cli(*arguments, "--json").lines
    assert row["gpCh[0].bahn_state"]["command_feed_r"] == 10000


def test_watch_ends_by_ctrl_c(start: Start, cell: str) -> None:
    """Status 130, no traceback."""
    process = start(
        *("watch", "gpCh[0].bahn_state.override_r", "--name", cell),
        *("--interval", 0.05, "--json"),
    )
    assert process.stdout is not None
    assert json.loads(process.stdout.readline())["t"] > 0.0
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err


def test_a_wrong_symbol_and_a_wrong_cell(cli: Cli, cell: str) -> None:
    """Each is named."""
    outcome = cli("watch", "gpCh[0].bahn_stat", "--name", cell)
    assert outcome.status == 1
    assert "bahn_state" in outcome.err
    assert cli("watch", "gpCh[0]", "--name", "none-such").status == 1


def test_a_name_that_is_taken(cli: Cli, cell: str, program: Write) -> None:
    """The living cell stays; the second one is refused with what to do."""
    outcome = cli("run", program(SHORT), "--name", cell)
    assert outcome.status == 1
    assert "905002" in outcome.err
    assert cell in cli("ps").out


@pytest.mark.ci
def test_the_cnc_tells_of_its_plc(program: Write) -> None:
    """Attached, started, completed, lost, came back: each with its times."""
    name = f"t{os.getpid()}-told"
    plc = program(PLC, "counting.py")
    cnc = started(command("cnc", program(SHORT), "--name", name))
    first = started(command("plc", plc, "--name", name))
    for text in ("PLC attached", "part.nc started", "program completed"):
        assert " s  " in told(cnc, text)
    assert name in told(first, "attached")
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate(timeout=60)
    told(cnc, "PLC lost")
    second = started(command("plc", plc, "--name", name))
    told(cnc, "PLC came back")
    os.killpg(cnc.pid, signal.SIGINT)
    cnc.communicate(timeout=60)
    assert cnc.returncode == 130
    told(second, "CNC has ended")
    os.killpg(second.pid, signal.SIGINT)
    second.communicate(timeout=60)
    assert second.returncode == 130
