"""What passes in silence and should not: a warning with the mend; --strict
makes it an error.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cnc_core import Cell, RunResult
from support.command_line import Outcome

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
PART = "G1 F6000 X5\nM30\n"
PLC = """
import time
import plc_client
from plc_client import task

@task(interval={interval})
class Mistaken:
    def setup(self, hli):
        self.ch = hli.gpCh[0]
        {setup}

    def cyclic(self):
        {cyclic}
"""
OVERRIDE = (
    "c = self.ch.bahn_mc_control; c.override.command_w = 2001;"
    " c.override_valid.command_w = c.override_valid.enable_w = True;"
    " c.override.enable_w = True"
)


def run(
    program: Write,
    cyclic: str = "pass",
    setup: str = "pass",
    interval: str = "0.001",
    **options: Any,
) -> RunResult:
    text = PLC.replace("{cyclic}", cyclic).replace("{setup}", setup)
    plc = program(text.replace("{interval}", interval), "mistaken.py")
    with Cell() as cell:
        return cell.run(program(PART), plc, **options)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"interval": "10"}, "for ms write interval=0.01"),
        ({"cyclic": "time.sleep(0.01)"}, "no sleep or input, TON for times"),
        (
            {"cyclic": "self.ch.bahn_mc_control.feedhold.state_r = False"},
            "assigns state_r, which the CNC writes",
        ),
        (
            {"force": {"gpCh[0]^.bahn_state.override_r": 500}},
            "the CNC writes it in each cycle",
        ),
        ({"setup": OVERRIDE}, "an override above 200 %"),
        (
            {
                "setup": "self.ov = plc_client.Override(self.ch)",
                "cyclic": "self.ov(path=250.0)",
            },
            "ov (Override) got an input out of range",
        ),
        (
            {
                "setup": "self.see = plc_client.ContourLookahead(self.ch)",
                "cyclic": "self.see(0.0, 500.0, mode=3)",
            },
            "see (ContourLookahead) got an input out of range",
        ),
    ],
)
@pytest.mark.ci
def test_a_mistake_is_told_with_its_mend(
    program: Write, options: dict[str, Any], said: str
) -> None:
    """The run completes with one warning; under strict it ends with an error."""
    result = run(program, **options)
    assert result.end == "completed"
    assert [said in text for text in result.warnings] == [True]
    strict = run(program, **options, strict=True)
    assert (strict.end, strict.warnings) == ("error", [])
    assert [said in error["text"] for error in strict.errors] == [True]
    assert [error["code"] for error in strict.errors] == [905026]


def test_an_ordinary_task_is_left_alone(program: Write) -> None:
    """Its own attributes may end as they like; strict changes nothing."""
    result = run(
        program, "self.count_r = self.ch.bahn_state.override_r", strict=True
    )
    assert (result.end, result.warnings, result.errors) == (
        "completed",
        [],
        [],
    )
