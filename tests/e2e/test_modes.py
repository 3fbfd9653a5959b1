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


REFUSED = {
    "refused.py": (
        "from plc_client import SelectProgram, StartProgram, task\n"
        "@task(interval=0.001)\n"
        "class P:\n"
        "    def setup(self, hli):\n"
        "        self.scan, ch = 0, hli.gpCh[0]\n"
        "        self.select, self.start = SelectProgram(ch), StartProgram(ch)\n"
        "    def cyclic(self):\n"
        "        self.scan += 1\n"
        "        self.select(self.scan > 10, 'missing.nc')\n"
        "        self.start(self.select.done)\n"
        "    def finished(self):\n"
        "        return self.scan > 60\n"
        "    def result(self):\n"
        "        return {'id': self.select.error_id}\n"
    ),
    "refused.st": (
        "PROGRAM Main\n"
        "VAR chosen : SelectProgram; start : StartProgram; scan : INT; "
        "END_VAR\n"
        "scan := scan + 1;\n"
        "chosen(execute := scan > 10, program_name := 'missing.nc');\n"
        "start(execute := chosen.done);\n"
        "END_PROGRAM\n"
    ),
}


@pytest.mark.ci
@pytest.mark.parametrize("name", REFUSED)
def test_a_selection_that_is_refused_starts_nothing(
    cli: Cli, program: Write, name: str
) -> None:
    """With a program ready, "select, wait for done, start" does not drive that
    one where the other is not there.
    """
    outcome = cli(
        "run",
        program("N10 G1 X50 F6000\n"),
        "--plc",
        program(REFUSED[name], name),
        "--no-autostart",
        "--max-time",
        "1",
        "--json",
    )
    run = outcome.json
    assert run["blocks"] == 0, outcome.err
    assert [text[:6] for text in run["warnings"]] == ["901001"]
    if name == "refused.py":
        assert run["plc"]["result"] == {"id": 901001}
