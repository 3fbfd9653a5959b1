"""Progress on a terminal, and nothing of it elsewhere."""

from __future__ import annotations

import math
import os
import pty
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from support.command_line import command
from support.osai_programs import SETUP_3, changed

pytestmark = pytest.mark.ci

Write = Callable[..., Path]
BLOCKS = 2_000
SLOW = " + ".join(["SIN[P1]"] * 150)
"""So long that half a million such blocks, which end a plan, take half a minute."""
ENDLESS = f"""N10 G1 X1 F600
N20 P1 = 1
N30 $WHILE 1
N40 P1 = {SLOW}
N50 $ENDWHILE
M30
"""


def on_terminal(*arguments: object) -> tuple[int, str]:
    """Status, and what a command shows on a terminal as standard error."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        command(*arguments),
        stdout=subprocess.DEVNULL,
        stderr=theirs,
        stdin=subprocess.DEVNULL,
        env=os.environ | {"COLUMNS": "80", "TERM": "xterm"},
    )
    os.close(theirs)
    shown = b""
    try:
        while part := os.read(ours, 65536):
            shown += part
    except OSError:  # the other side is closed
        pass
    finally:
        os.close(ours)
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode(errors="replace"))
    return process.wait(), text


@pytest.fixture
def part(program: Write) -> Path:
    """A program that takes some looks."""
    lines = [f"N{i} G1 X{i % 300} F6000" for i in range(1, BLOCKS)]
    return program("\n".join(lines) + "\nM30\n")


@pytest.mark.parametrize("name", ["check", "blocks", "plan", "run"])
def test_a_terminal_sees_how_far_it_is(part: Path, name: str) -> None:
    """Share and N; cell time where some passes."""
    alone: list[str] = []
    if name == "run":
        alone = ["--plc", "none"]
        slow = part.read_text().replace("F6000", "F200")
        part.write_text(slow)  # seconds of wall time: some looks
    status, shown = on_terminal(name, part, *alone)
    assert status == 0
    assert re.search(r"[1-9]\d*%", shown)
    assert re.search(r" N\d+", shown)
    if name in ("plan", "run"):
        assert re.search(r" N\d+ \d+\.\d s", shown)


def test_a_terminal_sees_how_far_the_optimizer_is(tmp_path: Path) -> None:
    """The same of ``optimize``."""
    points = [
        f"N{10 * i} X{0.2 * i:.2f} Y{math.sin(0.02 * i):.4f} Z0"
        for i in range(1, 1000)
    ]
    file, setup = tmp_path / "in.osai", tmp_path / "SETUP"
    file.write_text("\n".join(["G1 F6000", "X0 Y0 Z0", *points, "M30"]) + "\n")
    setup.write_text(
        changed(SETUP_3, CRV=None) + "(SMT,0.02,0.02,0.002,1,1,1,G66,G66,G66)\n"
    )
    status, shown = on_terminal("optimize", file, setup, tmp_path / "out.osai")
    assert status == 0
    assert re.search(r"[1-9]\d*% N\d+", shown)


def test_no_terminal_no_progress(
    cli: Callable[..., object], part: Path
) -> None:
    """Standard error has the dialect alone."""
    outcome = cli("plan", part, "--json")
    err = vars(outcome)["err"]
    assert err.count("\n") == 1
    assert err.startswith("dialect:")


def test_a_plan_that_stands_is_told(
    cli: Callable[..., object], program: Write
) -> None:
    """A line after 3 s, and others 4 s later at the soonest; the wall time ends
    it with status 1.  Between two looks a busy machine computes for seconds.
    """
    endless = program(ENDLESS)
    outcome = vars(cli("plan", endless, "--max-wall", 12, "--dialect", "isg"))
    assert outcome["status"] == 1
    told, *again, ended = (
        line for line in outcome["err"].splitlines() if "next motion" in line
    )
    assert told.startswith("part.nc:")
    assert len(again) <= 2
    assert "905025: not planned after 12 s" in ended


def test_a_run_that_computes_is_told(
    cli: Callable[..., object], program: Write
) -> None:
    """The wall time reaches a program that computes for ever."""
    endless = program(ENDLESS)
    given = ("--max-wall", 8, "--dialect", "isg", "--json")
    outcome = vars(cli("run", endless, "--plc", "none", *given))
    assert outcome["status"] == 1
    assert "waits for the next motion" in outcome["err"].splitlines()[0]
    assert "905025" in outcome["out"]
