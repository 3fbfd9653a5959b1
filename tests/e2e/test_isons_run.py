"""IsoNs programs through the command line, and with a PLC that answers their outputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Outcome

PLC = Path(__file__).with_name("plc_isons.py")
Cli = Callable[..., Outcome]
Write = Callable[..., Path]


def test_inputs_and_outputs_reach_the_plc(cli: Cli, program: Write) -> None:
    """WAIT_INPUT sees the PLC's answer to an output, $_K its numbers; then an input that does not come: the alarm."""
    part = program(
        "F6\n$_O5=1\n$_K0=21\nG1X5\nWAIT_INPUT 2 1 5 9\nADD_VAR $_K1\nADD_VAR $_R0\n$_O5=0\nG4F0.1\nG62\n"
        'ADD_VAR $_I2\nSAVE_VAR "seen.txt"\nWAIT_INPUT 2 1 0.3 12\nG0X0\n',
        "part.isons",
    )
    outcome = cli("run", part, "--plc", PLC, "--json", "--out", part.parent / "out")
    run = outcome.json
    assert [(e["code"], e["line"]) for e in run["errors"]] == [(909131, 13)], outcome.err
    assert "alarm 12" in run["errors"][0]["text"]
    assert run["files"] == ["seen.txt"]
    seen = [float(line) for line in (part.parent / "out" / "seen.txt").read_text().split()]
    assert seen == [42.0, pytest.approx(5.0), 0.0]


def test_timers_count_machine_time(cli: Cli, program: Write) -> None:
    """T-10: a timer of 1500 ms stands at 0 after 1.5 s; a positioner takes its time."""
    part = program("$_T0=1500\nG4F1\n@W\nIF $_T0>0\nGOTO W\nEND_IF\nPF[0] 600\nPA[0] 5\nG0X1\n", "part.isons")
    run = cli("run", part, "--json").json
    assert run["end"] == "completed"
    assert 2.0 < run["sim_time_s"] < 2.2


def test_blocks_and_check(cli: Cli, program: Write) -> None:
    """T-01 as blocks, found to be this dialect by its content; all errors of a wrong program with their places."""
    part = program("$A=100\nG90 G1X[$A]Y100\nG91 X5Y-3\nG90 X0Y0\n")
    ends = [row["end"] for row in cli("blocks", part, "--json").lines]
    assert [(end["X"], end["Y"]) for end in ends] == [(100, 100), (105, 97), (0, 0)]
    wrong = program("LOOP 2.5\nEND_LOOP\nGOTO NO\nG103\nG2X5R0\n", "wrong.isons")
    outcome = cli("check", wrong, "--json")
    assert [(e["code"], e["line"]) for e in outcome.json["errors"]][:3] == [(909105, 1), (907023, 3), (900003, 4)]
    assert outcome.status == 1
