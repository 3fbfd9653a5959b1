"""Cases a hostile user found; each was a defect once."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hli import layout
from plc_client import connect
from support.command_line import T1, Outcome, command, wait_for_cycle

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
IDLE = (
    "from plc_client import task\n@task(interval=0.001)\nclass P:\n"
    "    def cyclic(self):\n        pass\n"
)
SNIPPET = """
from plc_client import connect, task, ContourLookahead
from cnc_core import Cell

@task(interval=0.001)
class OverrideFromContour:
    def setup(self, hli):
        self.ch = hli.gpCh[0]
        self.clah = ContourLookahead(self.ch.contour_lookahead)

    def cyclic(self):
        self.clah(start_position=self.ch.bahn_state.dist_prog_start, length=50_000.0)
        if self.clah.done:
            radius = self.clah.blocks["compensated_radius"]

with Cell() as cell:
    result = cell.run("part.nc", plc=OverrideFromContour)
print(result.end, result.requests["mode2"] > 10)
"""


@pytest.mark.ci
def test_a_script_may_hold_the_task_and_the_run(
    program: Write, tmp_path: Path
) -> None:
    """The contract's snippet as a plain script: the PLC process reads the class
    and starts no further cell.
    """
    program(T1)
    script = program(SNIPPET, "snippet.py")
    done = subprocess.run(
        [sys.executable, script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )
    assert done.stdout.split() == ["completed", "True"], done.stderr


@pytest.mark.ci
@pytest.mark.parametrize("clock", ["lockstep", "freerun", "realtime"])
def test_the_cnc_serves_behind_the_programs_end(
    program: Write, clock: str
) -> None:
    """`cnc` goes on cycling and answering after M30, also for a PLC that comes
    later, without using up a core.
    """
    name = f"hli-test-{os.getpid()}"
    cnc = subprocess.Popen(
        command("cnc", program(T1), "--name", name, "--clock", clock),
        stderr=subprocess.PIPE,
    )
    plc = subprocess.Popen(
        command("plc", program(IDLE, "idle.py"), "--name", name),
        stderr=subprocess.PIPE,
    )
    try:
        with connect(name, wait_s=60, role="reader") as reader:
            deadline = time.monotonic() + 90
            while (
                reader.phase != layout.HLI_PHASE_ENDED
                and time.monotonic() < deadline
            ):
                time.sleep(0.02)
            time.sleep(0.3)
            before, cpu = reader.cycle, cpu_s(cnc.pid)
            begin = time.monotonic()
            while reader.cycle <= before + 50 and time.monotonic() < begin + 60:
                time.sleep(0.5)
            assert reader.cycle > before + 50
            assert cpu_s(cnc.pid) - cpu < 0.9 * (time.monotonic() - begin)
        plc.send_signal(signal.SIGINT)
        plc.communicate(timeout=90)
        with connect(name, wait_s=60) as late:
            assert late.exchange(0, 1e9)["block_number"].tolist() == [
                30,
                40,
                50,
                70,
                80,
            ]
            assert len(late.exchange(0, 0)) == 8
    finally:
        for process in (plc, cnc):
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=90)


def cpu_s(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("text", ["", "; nothing\n", "G04 X0.1\n"])
def test_plan_of_a_program_without_motion(
    cli: Cli, program: Write, text: str
) -> None:
    """No motion is no error."""
    result = cli("plan", program(text), "--json")
    assert result.status == 0, result.err
    assert result.json["path_deviation_mm"] == 0.0


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    "arc",
    ["G03 X1 Y0 Z100 R1000000", "G03 X1 Y0 Z1000 R10000000", "G02 X0 I5000 Z7"],
)
def test_deviation_on_very_flat_arcs_is_true(
    cli: Cli, program: Write, arc: str
) -> None:
    """The measurement does not invent a deviation."""
    config = program(
        "[axes.X]\nmin_mm=-1e9\nmax_mm=1e9\n[axes.Y]\nmin_mm=-1e9\nmax_mm=1e9\n[axes.Z]\n",
        "cell.toml",
    )
    result = cli(
        "plan",
        program(f"G90 F600000\nG00 X0\n{arc}\n"),
        "--config",
        config,
        "--json",
    )
    assert result.status == 0, result.err
    assert result.json["path_deviation_mm"] < 1e-5


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nothing.nc", "901001: file not found"),
        (".", "901005: a folder, no program"),
        ("/dev/zero", "901005: /dev/zero is a device"),
    ],
)
def test_cnc_without_a_program_ends_at_once(
    cli: Cli, name: str, said: str
) -> None:
    """What is no program is reported before anybody waits for a PLC."""
    outcome = cli("cnc", name, "--name", f"hli-test-{os.getpid()}", timeout=90)
    assert outcome.status == 1
    assert said in outcome.err
    assert "waiting" not in outcome.err


@pytest.mark.ci
@pytest.mark.parametrize(
    ("arguments", "number"),
    [
        (("run", "part.nc", "--record", "d.npz"), 901004),
        (("run", "part.nc", "--record", "/proc/x.npz"), 901004),
        (("plan", "part.nc", "--samples", "d.npz"), 901004),
        (("run", "nothing.nc"), 901001),
        (("run", "part.nc", "--plc", "nothing.py"), 901001),
        (("lookahead", "nothing.nc", "--index", "0"), 901001),
        (("plan", "nothing.nc"), 901001),
        (("run", "part.nc", "--plc", "syntax.py"), 905003),
        (("run", "part.nc", "--plc", "binary.py"), 905003),
        (("run", "part.nc", "--plc", "raises.py"), 905003),
    ],
)
def test_failures_have_numbers_and_json(
    cli: Cli,
    program: Write,
    tmp_path: Path,
    arguments: tuple[str, ...],
    number: int,
) -> None:
    """Every failure has a number; --json prints one object with `errors` whatever happens."""
    program(T1)
    (tmp_path / "d.npz").mkdir()
    program("def f(:\n", "syntax.py")
    (tmp_path / "binary.py").write_bytes(b"\x00\x01\xff")
    program(
        IDLE.replace(
            "        pass", "        raise RuntimeError('boom\\nline2')"
        ),
        "raises.py",
    )
    outcome = cli(*arguments, "--json")
    assert outcome.status == 1
    assert "Traceback" not in outcome.err
    assert [e["code"] for e in json.loads(outcome.out)["errors"]] == [number]
    assert str(number) in outcome.err


def test_an_error_of_the_plc_program_has_its_place(
    cli: Cli, program: Write
) -> None:
    """File, line and the whole text, also over several lines."""
    program(T1)
    plc = program(
        IDLE.replace(
            "        pass", "        raise RuntimeError('boom\\nline2')"
        ),
        "raises.py",
    )
    error = cli("run", "part.nc", "--plc", "raises.py", "--json").json[
        "errors"
    ][0]
    assert error["file"] == str(plc)
    assert error["line"] == 5
    assert "RuntimeError: boom line2" in error["text"]


@pytest.mark.ci
def test_file_names_are_no_markup(
    cli: Cli, program: Write, tmp_path: Path
) -> None:
    """A name with brackets is printed as it is."""
    (tmp_path / "a[").mkdir()
    for name in ("a[/b].nc", "a[red]b.nc"):
        program(T1, name)
        outcome = cli("check", name)
        assert outcome.status == 0
        assert name in outcome.out
        assert cli("plan", name).status == 0


@pytest.mark.ci
def test_files_lists_only_what_the_program_wrote(
    cli: Cli, program: Write, tmp_path: Path
) -> None:
    """What stood in the folder before is not listed."""
    (tmp_path / "have").mkdir()
    program("old", "have/old.txt")
    assert (
        cli("run", program(T1), "--out", "have", "--json").json["files"] == []
    )


def test_prints_of_the_plc_program_are_seen(cli: Cli, program: Write) -> None:
    """They go to standard error, as they come; standard output stays JSON."""
    program(
        IDLE.replace(
            "        pass", "        print('hello from the PLC', flush=True)"
        ),
        "prints.py",
    )
    outcome = cli("run", program("G4 0.005\n"), "--plc", "prints.py", "--json")
    assert outcome.status == 0
    assert "hello from the PLC" in outcome.err
    assert outcome.json["end"] == "completed"


@pytest.mark.ci
def test_sigterm_keeps_the_recording(program: Write, tmp_path: Path) -> None:
    """SIGTERM of the launcher ends both sides and finishes the recording."""
    record = tmp_path / "r.npz"
    path = program("F600\n" + "G1 X50\nX0\n" * 100)
    launcher = subprocess.Popen(
        command("run", path, "--clock", "realtime", "--record", record),
        stderr=subprocess.PIPE,
    )
    wait_for_cycle(launcher.pid, 200)
    launcher.send_signal(signal.SIGTERM)
    launcher.communicate(timeout=90)
    assert launcher.returncode == 143
    with np.load(record) as columns:
        assert len(columns["t"]) > 100
        assert columns["t"][0] == 0.0


SLOW_FOLLOWER = """
from plc_client import ContourLookahead, task

@task(interval=0.05)
class Slow:
    def setup(self, hli):
        self.clah, self.seen = ContourLookahead(hli.gpCh[0].contour_lookahead), []

    def cyclic(self):
        self.seen += [float(b["length"]) for b in self.clah.follow(200_000.0)]

    def finished(self):
        return not self.clah.busy

    def result(self):
        return [len(self.seen), sum(self.seen), self.clah.gaps, self.clah.lost_distance]
"""


@pytest.mark.ci
def test_a_follower_that_is_too_slow_is_told_what_it_lost(
    cli: Cli, program: Write
) -> None:
    """0.02 mm blocks against a 50 ms task: what was dropped is counted, nothing
    is lost in silence.
    """
    text = "G1 F10000\n" + "".join(f"X{i * 0.02:.2f}\n" for i in range(1, 3001))
    program(SLOW_FOLLOWER, "slow.py")
    value = cli("run", program(text), "--plc", "slow.py", "--json").json
    count, length, gaps, lost = value["plc"]["result"]
    assert gaps > 0
    assert count < 3000
    assert length + lost == pytest.approx(600_000.0, abs=200 * 128 + 200)


@pytest.mark.ci
def test_steps_and_channels_are_checked(program: Write) -> None:
    """step() takes whole cycles from 1 on; a channel that is not configured is refused by name."""
    name = f"hli-test-{os.getpid()}"
    cnc = subprocess.Popen(
        command("cnc", program(T1), "--name", name, "--clock", "lockstep"),
        stderr=subprocess.PIPE,
    )
    try:
        with connect(name, wait_s=60) as hli:
            for wrong in (0, -1, 2**31):
                with pytest.raises(ValueError, match="step of"):
                    hli.step(wrong)
            with pytest.raises(TypeError):
                hli.step(1.5)  # type: ignore[arg-type]
            with pytest.raises(ValueError, match="channel 3"):
                hli.exchange(0, 1, channel=3)
            assert hli.step(5) == 5
    finally:
        cnc.send_signal(signal.SIGINT)
        cnc.communicate(timeout=90)


PATIENT = (
    "import cnc_core.process as p; p.FIRST_SCAN_S = 1e9; from "
    "cnc_core.cli import main; main()"
)


@pytest.mark.parametrize("clock", ["realtime", "freerun", "lockstep"])
@pytest.mark.ci
def test_a_client_without_a_scan_is_not_waited_for(
    program: Write, clock: str
) -> None:
    """Who connects by hand is no scan runtime: the program starts when it
    attaches, whatever a first scan may take.
    """
    name = f"hli-test-{os.getpid()}"
    arguments = ["cnc", str(program(T1)), "--name", name, "--clock", clock]
    cnc = subprocess.Popen(
        [sys.executable, "-P", "-c", PATIENT, *arguments],
        stderr=subprocess.PIPE,
    )
    try:
        with connect(name, wait_s=60) as hli:
            end = time.monotonic() + 60
            while (
                hli.phase < layout.HLI_PHASE_RUNNING and time.monotonic() < end
            ):
                if clock == "lockstep":
                    hli.step(timeout_s=60)
                time.sleep(0.001)
            assert hli.phase >= layout.HLI_PHASE_RUNNING
    finally:
        cnc.send_signal(signal.SIGINT)
        cnc.communicate(timeout=90)
