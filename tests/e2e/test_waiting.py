"""A run that stands says so: where, what for, since when, who could end it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cnc_core import Cell
from support.command_line import (
    SHM,
    Outcome,
    command,
    wait_for_cycle,
    wait_for_path,
    wait_for_segment,
)

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
CELL = '[channel]\nm_synch = {50 = "MVS_SVS"}\n'
IDLE = """
from plc_client import task

@task(interval=0.001)
class Idle:
    def setup(self, hli):
        self.ch, self.axis = hli.gpCh[0], hli.gpAx[0]
        {setup}

    def cyclic(self):
        {cyclic}
"""
EXTERNAL = '[external.GO]\ntype = "UNS32"\n'
M50 = "N10 G1 X10 F6000\nN80 M50\nN90 X20\nM30\n"
MOVES = "N10 G1 X10 F600\nN20 X20\nM30\n"


def idle(program: Write, setup: str = "pass", cyclic: str = "pass") -> Path:
    """A PLC that ends nothing."""
    return program(
        IDLE.replace("{setup}", setup).replace("{cyclic}", cyclic), "idle.py"
    )


def waits(
    program: Write, text: str, plc: Path, cell: str = CELL, **options: Any
) -> list[dict[str, Any]]:
    """What a run waits for when its cell time is used up."""
    with Cell(program(cell, "cell.toml")) as machine:
        result = machine.run(program(text), plc, max_time=3.0, **options)
    assert result.end == "error"
    assert [e["code"] for e in result.errors] == [905025]
    assert result.sim_time_s == pytest.approx(3.0)
    assert all(w["what"] in result.errors[0]["text"] for w in result.waiting)
    return result.waiting


def test_a_function_that_nobody_acknowledges(program: Write) -> None:
    """File, line and N of the block; number and synchronisation; what to use."""
    (found,) = waits(program, M50, idle(program))
    assert Path(found["file"]).name == "part.nc"
    assert (found["line"], found["n"]) == (2, 80)
    assert found["what"] == "acknowledgement of M50 (MVS_SVS)"
    assert 2.0 < found["since_s"] < 3.0
    assert "no task acknowledges M functions" in found["who"]
    assert "TechnoServer or AcknowledgeAll" in found["who"]


def test_a_function_of_a_subprogram_names_its_file(program: Write) -> None:
    """The line stands in the file that holds it."""
    program("N5 G1 X5 F6000\n\nN6 M50\nM29\n", "sub.nc")
    (found,) = waits(program, "N1 L sub.nc\nM30\n", idle(program))
    assert Path(found["file"]).name == "sub.nc"
    assert (found["line"], found["n"]) == (3, 6)


@pytest.mark.parametrize(
    ("text", "ch", "what", "who"),
    [
        ("N10 G1 X1 F600\nN20 M0\nM30\n", "", "continue at M0", "AutoContinue"),
        (MOVES, "feedhold=True", "the end of feed hold", "feedhold.command_w"),
        (
            MOVES,
            "override=0; v = self.ch.bahn_mc_control.override_valid;"
            " v.command_w = v.enable_w = True",
            "an override above 0",
            "override.command_w",
        ),
        (MOVES, "single_block=True", "continue in single block", "continue"),
    ],
)
@pytest.mark.ci_cases
def test_what_the_plc_holds(
    program: Write, text: str, ch: str, what: str, who: str
) -> None:
    """Stops and holds of the PLC are named with what ends them."""
    setup = "pass"
    if ch:
        unit, value = ch.split("=", 1)
        setup = (
            f"u = self.ch.bahn_mc_control.{unit}; u.enable_w = True;"
            f" u.command_w = {value}"
        )
    (found,) = waits(program, text, idle(program, setup))
    assert found["what"] == what
    assert who in found["who"]


def test_an_axis_that_is_held_is_named(program: Write) -> None:
    """Feed hold of one axis: its name, and the unit to write."""
    setup = (
        "u = self.axis.ipo_mc_control.feedhold;"
        " u.command_w = True; u.enable_w = True"
    )
    (found,) = waits(program, MOVES, idle(program, setup))
    assert found["what"] == "the end of the feed hold of axis X"


@pytest.mark.ci
def test_a_program_that_waits_for_a_variable(program: Write) -> None:
    """The block that reads it again and again is shown."""
    text = "N10 G1 X1 F600\nN20 $WHILE V.E.GO == 0\nN30 $ENDWHILE\nM30\n"
    (found,) = waits(program, text, idle(program), cell=EXTERNAL)
    assert "$WHILE V.E.GO" in found["what"] or "$ENDWHILE" in found["what"]


def test_a_program_that_nobody_starts(program: Write) -> None:
    """Without autostart the PLC has to start it."""
    (found,) = waits(program, MOVES, idle(program), autostart=False)
    assert found["what"] == "start of the program"
    assert "StartProgram" in found["who"]


@pytest.mark.ci
def test_a_plc_that_does_not_scan(program: Write) -> None:
    """No cell time passes: the wall time ends the run and names the scan."""
    plc = idle(program, cyclic="import time; time.sleep(60)")
    with Cell() as machine:
        result = machine.run(program(MOVES), plc, max_wall=3.0)
    assert result.end == "error"
    assert any("--max-wall" in e["text"] for e in result.errors)
    assert result.waiting[0]["what"] == "a scan of the PLC"


def test_a_run_that_moves_ends_in_its_time_too(program: Write) -> None:
    """Nothing is waited for; the error tells what the program does."""
    with Cell() as machine:
        result = machine.run(program(MOVES), max_time=0.5)
    assert (result.end, result.waiting) == ("error", [])
    assert "goes on at N10" in result.errors[0]["text"]


def test_a_plc_that_does_not_finish(program: Write) -> None:
    """How long is told in the cell's time, which goes on behind the program's end."""
    plc = program(
        IDLE.replace("{setup}", "pass").replace("{cyclic}", "pass")
        + "\n    def finished(self):\n        return False\n",
        "stays.py",
    )
    (one,) = waits(program, "N10 G1 X5 F6000\nM30\n", plc)
    assert one["what"] == "the PLC behind the program's end"
    assert 2.5 < one["since_s"] < 3.0


def test_a_run_that_completes_waits_for_nothing(program: Write) -> None:
    """Limits that are not reached change nothing."""
    with Cell() as machine:
        result = machine.run(program(MOVES), max_time=100.0, max_wall=100.0)
    assert (result.end, result.waiting) == ("completed", [])


@pytest.mark.ci
def test_the_line_comes_while_the_run_stands(cli: Cli, program: Write) -> None:
    """On standard error, before the end; --json stays one object; status 1."""
    arguments = ["--plc", idle(program), "--config", program(CELL, "cell.toml")]
    outcome = cli("run", program(M50), *arguments, "--max-time", 5, "--json")
    assert outcome.status == 1
    assert outcome.json["waiting"][0]["n"] == 80
    first = outcome.err.splitlines()[0]
    assert first.startswith("part.nc:2: N80: waits for acknowledgement of M50")
    assert " for 1.0 s; " in first


@pytest.mark.parametrize("rest", [[], ["--json"]])
@pytest.mark.ci
def test_ctrl_c_tells_where_it_stood(program: Write, rest: list[str]) -> None:
    """One line with the wait and what was written, status 130, nothing left."""
    arguments = [
        program(M50),
        "--plc",
        idle(program),
        "--config",
        program(CELL, "cell.toml"),
        "--record",
        program("", "run.npz"),
    ]
    process = subprocess.Popen(
        command("run", *arguments, *rest),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    wait_for_cycle(process.pid, 2000)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    last = err.splitlines()[-1]
    assert last.startswith("interrupted after ")
    assert "acknowledgement of M50 (MVS_SVS) at part.nc:2" in last
    assert "run.npz" in last
    assert not list(SHM.glob(f"hli-cosim-{process.pid}-*"))
    if rest:
        result = json.loads(out)
        (wait,) = result["waiting"]
        assert wait["line"] == 2
        # it has stood since shortly behind the start, up to the last cycle
        assert 0.0 < result["sim_time_s"] - wait["since_s"] < 0.5


@pytest.mark.ci
def test_ctrl_c_ends_a_plan(program: Write) -> None:
    """One line with how far it was and what was written, status 130."""
    endless = program(
        "N10 $WHILE 1\nN20 G01 X10 F6000\nN30 X0\n$ENDWHILE\nM30\n"
    )
    recording = endless.with_name("plan.parquet")
    process = subprocess.Popen(
        command("plan", endless, "--record", recording),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_path(process, endless.parent, "plan.parquet.parts/cnc*")
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    last = err.splitlines()[-1]
    assert last.startswith("interrupted after ")
    assert " s of cell time" in last
    assert last.endswith(f"; written: {recording}")
    assert recording.is_file()


@pytest.mark.ci
def test_ctrl_c_while_the_worker_starts() -> None:
    """A process of a run that still reads its packages says nothing of it."""
    script = (
        "import os, signal, time\n"
        "from cnc_core.cell.worker import Worker\n"
        "signal.signal(signal.SIGINT, lambda *_: None)\n"
        "worker = Worker()\n"
        "for _ in range(20):\n"
        "    os.killpg(0, signal.SIGINT)\n"
        "    time.sleep(0.02)\n"
        "print(worker.usable)\n"
        "worker.close()\n"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", script],
        capture_output=True,
        text=True,
        check=False,
        start_new_session=True,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


@pytest.mark.parametrize("name", ["cycle", "handshake"])
@pytest.mark.ci
def test_ctrl_c_ends_a_benchmark(name: str) -> None:
    """One line and status 130: no crash of its threads, no traceback of its
    processes.
    """
    process = subprocess.Popen(
        command("bench", name, "--seconds", "60"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    wait_for_segment(process, f"hli-bench-{process.pid}-")
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.strip() == "interrupted"


def test_ctrl_c_while_the_command_is_read() -> None:
    """One line and status 130, wherever in the imports it comes."""
    script = (
        "import os, signal, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'cnc_core.commands.console':\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "from cnc_core.__main__ import main\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", script],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (
        130,
        "",
        "interrupted\n",
    )
