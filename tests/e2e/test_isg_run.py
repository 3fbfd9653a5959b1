"""ISG programs in the co-simulation: external variables shared with the PLC,
files, lenient mode, endless programs.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell
from support.command_line import command
from support.plc.external import Answer

CELL = '[external.GO]\ntype = "UNS32"\n[external.REQUEST]\n[external.ANSWER]\n'
PROGRAM = """V.E.REQUEST = 12.5
G00 X10
$WHILE V.E.GO == 0
P1 = 1
$ENDWHILE
G01 X[V.E.ANSWER] F6000
#MSG ["answer %f", V.E.ANSWER]
#FILE NAME [MSG="log.txt"]
#MSG SAVE EXCLUSIVE ["line %d", 5]
M99
M30
"""


@pytest.mark.ci
def test_program_and_plc_share_external_variables(tmp_path: Path) -> None:
    """The program waits for the PLC's answer, reads it, writes its file; two
    lockstep runs are the same.
    """
    (tmp_path / "cell.toml").write_text(CELL)
    (tmp_path / "a.nc").write_text(PROGRAM)
    runs = []
    for number in range(2):
        target = tmp_path / f"run{number}.npz"
        with Cell(tmp_path / "cell.toml") as cell:
            result = cell.run(
                tmp_path / "a.nc",
                Answer,
                out=tmp_path / "out",
                record=target,
                lenient=True,
            )
        assert (result.end, result.errors) == ("completed", [])
        assert result.messages[:2] == ["answer 25.000000", "line 5"]
        assert result.files == ["log.txt"]
        assert result.plc["result"] == 12.5
        runs.append((result.cycles, np.load(target)["pos"]))
    assert (tmp_path / "out" / "log.txt").read_text() == "line 5\nline 5\n"
    assert runs[0][0] == runs[1][0] >= 80
    assert (runs[0][1] == runs[1][1]).all()
    assert runs[0][1][-1][0] == 25.0


@pytest.mark.ci
def test_lenient_on_the_command_line(cli, program) -> None:
    """check, blocks and plan take --lenient; without it the undefined function is an error."""
    path = program("M99 G00 X1\nM30\n")
    assert cli("check", path).status == 1
    for name in ("check", "blocks", "plan"):
        done = cli(name, path, "--lenient", "--json")
        assert done.status == 0, done.err
        assert "907041" in done.err


@pytest.mark.ci
def test_an_endless_program_can_be_interrupted(tmp_path: Path) -> None:
    """Ctrl-C ends a CNC whose program computes for ever."""
    (tmp_path / "a.nc").write_text("$DO\nP1=1\n$ENDDO\n")
    name = f"hli-test-{os.getpid()}"
    process = subprocess.Popen(
        command(
            "cnc",
            tmp_path / "a.nc",
            "--name",
            name,
            "--no-wait",
            "--clock",
            "freerun",
        ),
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    process.stderr.readline()
    time.sleep(2.0)
    process.send_signal(signal.SIGINT)
    assert process.wait(20.0) == 130
    process.stderr.close()


def test_warnings_of_the_program_are_no_messages(tmp_path: Path) -> None:
    """``messages`` are what the program says; what is said about the program
    stands in ``warnings``, once.
    """
    (tmp_path / "a.nc").write_text('G129 50\n#MSG ["a"]\nG00 X1\nM30\n')
    (tmp_path / "cell.toml").write_text(CELL)
    with Cell(tmp_path / "cell.toml") as cell:
        result = cell.run(tmp_path / "a.nc", out=tmp_path / "out")
    assert (result.end, result.messages) == ("completed", ["a"])
    assert [warning.split(": ")[1] for warning in result.warnings] == ["907040"]
