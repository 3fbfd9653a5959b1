"""Two real processes: the new-element rule, bit-identical runs, live commands,
deaths, bad input.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell
from support.command_line import T1, Outcome, command, wait_for_cycle
from support.plc.follow import Follow, FollowByHand

Cli = Callable[..., Outcome]
Write = Callable[..., Path]


def long_program(blocks: int) -> str:
    """A zigzag of short blocks with arcs now and then; ``blocks`` motion elements."""
    lines = ["F6000 G1 G90"]
    for i in range(1, blocks + 1):
        lines.append(
            f"N{i} G3 X{i * 0.2:.1f} Y0 I0.1 J0"
            if i % 17 == 0
            else f"N{i} G1 X{i * 0.2:.1f} Y{(i % 2) * 0.01:.2f}"
        )
        if i % 17 == 16:
            lines[-1] = f"N{i} G1 X{i * 0.2:.1f} Y0"
    return "\n".join([*lines, "M30", ""])


@pytest.mark.ci_cases
@pytest.mark.parametrize("plc", [Follow, FollowByHand])
def test_mode_2_finds_every_element_once(
    cell: Cell, program: Write, plc: type
) -> None:
    """A program ten times longer than the window: the new-element rule finds
    each element exactly once.
    """
    result = cell.run(program(long_program(1300)), plc=plc)
    assert result.end == "completed", result.errors
    seen = result.plc["result"]
    assert [n for n, _, _ in seen] == list(range(1, 1301))
    starts, lengths = (
        np.array([s for _, s, _ in seen]),
        np.array([x for _, _, x in seen]),
    )
    assert (starts[1:] == starts[:-1] + lengths[:-1]).all()


@pytest.mark.ci
def test_lockstep_runs_are_bit_identical(
    cell: Cell, program: Write, tmp_path: Path
) -> None:
    """Two runs with a PLC that changes the override give the same samples to the last bit."""
    path, recordings = program(long_program(300)), []
    for i in range(2):
        target = tmp_path / f"run{i}.npz"
        result = cell.run(path, "builtin:demo", record=target)
        assert result.end == "completed", result.errors
        with np.load(target) as columns:
            recordings.append({name: columns[name] for name in columns.files})
    assert len(recordings[0]["t"]) > 500
    for name, values in recordings[0].items():
        assert (values == recordings[1][name]).all(), name


PLC_CONTROL = """
from plc_client import task, FeedControl

@task(interval=0.001)
class Control:
    def setup(self, hli):
        self.hli, self.ch = hli, hli.gpCh[0]
        self.feed = FeedControl(self.ch)
        self.log = []

    def cyclic(self):
        t = self.hli.cycle
        override = {0: 100.0, 1: 50.0, 2: 0.0, 3: 200.0}[min(t // 200, 3)]
        self.feed(override=override, feedhold=400 <= t < 500 or 760 <= t < 940)
        b = self.ch.bahn_state
        known = self.ch.contour_lookahead.state.max_dist_prog_start
        self.log.append((t, b.active_feed_r / 1000.0, b.stop_condition_r, b.dist_prog_start, known))

    def result(self):
        return self.log
"""


def test_override_and_feed_hold_from_the_plc(
    cell: Cell, program: Write, tmp_path: Path
) -> None:
    """Override 50, 0 and 200 % and feed hold act, inside all limits; the
    look-ahead stays supplied.
    """
    plc = program(PLC_CONTROL, "control.py")
    target = tmp_path / "run.npz"
    result = cell.run(program("F3000\nG1 X100\nX0\nM30\n"), plc, record=target)
    assert result.end == "completed", result.errors
    log = {row[0]: row for row in result.plc["result"]}
    assert log[190][1] == pytest.approx(50.0)
    assert log[390][1] == pytest.approx(25.0)
    assert log[475][1] == 0.0
    assert log[475][2] & 1
    assert log[590][1] == 0.0
    assert log[590][2] & 4
    assert log[755][1] == pytest.approx(100.0)
    assert log[930][1] == 0.0
    assert log[930][4] == pytest.approx(2_000_000.0)
    with np.load(target) as columns:
        a = np.abs(np.diff(columns["pos"], n=2, axis=0)).max() / 1e-6
        assert a <= 3000.0 * 1.02
        assert columns["pos"][-1].tolist() == [0.0, 0.0, 0.0]


def test_m00_waits_for_continue(cell: Cell, program: Write) -> None:
    """M00 stands until the PLC gives an edge on continue_machining; the built-in PLC does."""
    result = cell.run(program("F6000\nG1 X5\nM0\nX10\nM0\nM30\n"))
    assert result.end == "completed", result.errors


@pytest.mark.ci
def test_freerun_of_100000_lines(cell: Cell, program: Write) -> None:
    """100 000 plain lines run in freerun; the CNC's memory stays bounded (checked by its peak)."""
    lines = "".join(
        f"G1X{(i % 1000) * 0.05:.2f}Y{(i // 1000) * 0.1:.2f}\n"
        for i in range(100_000)
    )
    result = cell.run(program("F60000\n" + lines + "M30\n"), clock="freerun")
    assert result.end == "completed", result.errors
    assert result.blocks >= 100_000
    assert result.peak_mb < 200.0


# ------------------------------------------------------------------------------------------------
# deaths and bad input
def wait_for_children(pid: int, count: int) -> list[int]:
    """Process numbers of the two sides of a running ``hli-cosim run``."""
    deadline = time.monotonic() + 90
    while time.monotonic() < deadline:
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
        children = [int(p) for p in text.split()]
        if len(children) >= count:
            return children
        time.sleep(0.01)
    raise AssertionError("the two processes did not start")


@pytest.mark.ci
@pytest.mark.parametrize("victim", [0, 1])
@pytest.mark.parametrize("delay", [0.05, 0.6])
def test_a_killed_side_ends_the_run(
    program: Write, tmp_path: Path, victim: int, delay: float
) -> None:
    """kill -9 of CNC or PLC: the run ends `aborted`, exit 1, with its JSON, and
    what was recorded is kept.
    """
    path = program("F600\n" + "G1 X50\nX0\n" * 500)
    record = tmp_path / "r.npz"
    process = subprocess.Popen(
        command(
            "run", path, "--clock", "realtime", "--record", record, "--json"
        ),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    children = wait_for_children(process.pid, 2)
    time.sleep(delay)
    os.kill(children[victim], signal.SIGKILL)
    out, err = process.communicate(timeout=90)
    assert process.returncode == 1, err
    value = json.loads(out)
    assert value["end"] == "aborted"
    assert value["errors"]
    assert record.exists()


@pytest.mark.ci
def test_interrupt_ends_both_sides_and_keeps_the_recording(
    program: Write, tmp_path: Path
) -> None:
    """Ctrl-C: exit 130, nothing left, the recording holds what was driven."""
    path, record = program("F600\n" + "G1 X50\nX0\n" * 500), tmp_path / "r.npz"
    process = subprocess.Popen(
        command("run", path, "--clock", "realtime", "--record", record),
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    wait_for_children(process.pid, 2)
    wait_for_cycle(process.pid, 100)
    os.killpg(process.pid, signal.SIGINT)
    process.communicate(timeout=90)
    assert process.returncode == 130
    with np.load(record) as columns:
        assert len(columns["t"]) > 10


@pytest.mark.ci
def test_a_second_cnc_on_one_name_is_refused(program: Write) -> None:
    """`cnc` on a name in use ends at once with an error that names the owner."""
    path, name = program(T1), f"hli-test-{os.getpid()}"
    first = subprocess.Popen(
        command("cnc", path, "--name", name), stderr=subprocess.PIPE
    )
    try:
        deadline = time.monotonic() + 90
        while (
            not Path(f"/dev/shm/{name}").exists()
            and time.monotonic() < deadline
        ):
            time.sleep(0.01)
        second = subprocess.run(
            command("cnc", path, "--name", name),
            capture_output=True,
            text=True,
            timeout=90,
            check=False,
        )
        assert second.returncode == 1
        assert f"in use by process {first.pid}" in second.stderr
    finally:
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=90)
    assert first.returncode == 130


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ("G1 X10 F100\nG1 X20 Q5\n", 2, 8),
        ("G1 X1 F100\n#FOO BAR\n", 2, None),
        ("G2 X10 Y0 I5 J0 R5 F100\n", 1, None),
        ("G2 X10 F100\n", 1, None),
        ("G2 X10 Y0 R0 F10\n", 1, None),
        ("G1 X200000 F10\n", 1, None),
    ],
)
@pytest.mark.ci_cases
def test_bad_programs_give_a_numbered_error_with_place(
    cli: Cli, program: Write, text: str, line: int, column: int | None
) -> None:
    """check and run report FILE:LINE:COL: CODE: text, the source line under it, exit 1."""
    path = program(text)
    checked = cli("check", path, "--json")
    assert checked.status == 1
    error = checked.json["errors"][0]
    assert error["line"] == line
    assert column is None or error["column"] == column
    assert f"{path}:{line}:{error['column']}: {error['code']}: " in checked.err
    assert text.splitlines()[line - 1] in checked.err
    ran = cli("run", path, "--json")
    assert ran.status == 1
    assert ran.json["end"] == "error"
    assert ran.json["errors"][0]["code"] == error["code"]
    assert "Traceback" not in checked.err + ran.err


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "nothing.nc"),
        ("check", "nothing.nc"),
        ("run", "part.nc", "--plc", "nothing.py"),
        ("run", "part.nc", "--config", "nothing.toml"),
        ("plan", "nothing.nc"),
    ],
)
def test_missing_files_are_named(
    cli: Cli, program: Write, arguments: tuple[str, ...]
) -> None:
    """A missing file is an error with its name, not a traceback."""
    program(T1)
    outcome = cli(*arguments)
    assert outcome.status == 1
    assert "nothing" in outcome.err
    assert "not found" in outcome.err
    assert "Traceback" not in outcome.err


def test_an_error_in_the_plc_program_is_reported(
    cli: Cli, program: Write
) -> None:
    """An exception in user code ends the run with its file and line."""
    plc = program(
        "from plc_client import task\n\n@task(interval=0.001)\nclass P:\n"
        "    def cyclic(self):\n        1 / 0\n",
        "bad.py",
    )
    outcome = cli("run", program(T1), "--plc", plc, "--json")
    assert outcome.status == 1
    assert outcome.json["end"] in ("error", "aborted")
    assert any(
        "bad.py" in e["file"] and "ZeroDivisionError" in e["text"]
        for e in outcome.json["errors"]
    )
