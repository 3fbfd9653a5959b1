"""Operation modes with real processes: the PLC selects, starts, holds, aborts
and restarts programs.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from support.command_line import Outcome
from support.paths import PLC_PROGRAMS

PLC = PLC_PROGRAMS / "modes.py"
Cli = Callable[..., Outcome]
Write = Callable[..., Path]


@pytest.mark.ci
def test_the_plc_runs_the_programs(cli: Cli, program: Write) -> None:
    """Start, hold, resume, abort, another program, MDI, a missing program,
    reset: states, distances, errors.
    """
    part = program("N10 G1 X50 F6000\nN20 Y20\n")
    program("N10 G1 X5 F6000\n", "second.nc")
    outcome = cli("run", part, "--plc", PLC, "--no-autostart", "--json")
    run = outcome.json
    assert not outcome.err.count("Error"), outcome.err
    states = [state for state, _ in run["plc"]["result"]["log"]]
    assert states == [
        3,
        11,
        4,
        13,
        5,
        4,
        7,
        12,
        2,
        11,
        4,
        2,
        11,
        4,
        2,
        9,
        2,
        15,
        2,
    ]
    assert run["plc"]["result"]["errors"] == [901001]
    assert run["plc"]["result"]["position"] == 70_000
    assert run["end"] == "completed"
    assert outcome.status == 0


def test_a_program_aborted_by_the_plc(cli: Cli, program: Write) -> None:
    """A run whose program the PLC aborts ends as aborted, with that reason."""
    plc = program(
        "from plc_client import task\n"
        "@task(interval=0.001)\n"
        "class P:\n"
        "    def setup(self, hli):\n"
        "        self.ch = hli.gpCh[0]\n"
        "    def cyclic(self):\n"
        "        unit = self.ch.channel_mc_control.mode_and_state\n"
        "        if self.ch.bahn_state.dist_prog_start > 100000 and not unit.enable_w:\n"
        "            unit.enable_w = True\n"
        "            unit.command_w.to_mode, unit.command_w.to_state = 2, 15\n"
        "            unit.command_semaphor_rw = True\n",
        "abort.py",
    )
    outcome = cli(
        "run", program("N10 G1 X50 F6000\nN20 X0\n"), "--plc", plc, "--json"
    )
    assert outcome.status == 1
    assert outcome.json["end"] == "aborted"
    assert [e["code"] for e in outcome.json["errors"]] == [905023]


@pytest.mark.ci
def test_runs_with_modes_are_the_same_every_time(
    cli: Cli, program: Write
) -> None:
    """Lockstep: two runs under mode control give the same cycles and the same log."""
    part = program("N10 G1 X50 F6000\nN20 Y20\n")
    program("N10 G1 X5 F6000\n", "second.nc")
    first, second = (
        cli("run", part, "--plc", PLC, "--no-autostart", "--json").json
        for _ in range(2)
    )
    assert first["cycles"] == second["cycles"]
    assert first["plc"]["result"] == second["plc"]["result"]
