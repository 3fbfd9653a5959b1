"""What the text of a task tells before it runs: waits, and writes of what the
CNC writes.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hli.owners import cnc_writes
from plc_client import advice
from plc_client.mock import line
from plc_client.program import Program
from plc_client.runner import PlcRunner
from plc_client.sources import load_tasks

Write = Callable[..., Path]
TASK = """
import time
from time import sleep as pause
from plc_client import task

def slow_down(ch):
    ch.bahn_state.override_r = 3

def ask():
    return input()

@task(interval={interval})
class Mistaken:
    def setup(self, hli):
        time.sleep(0.0)
        self.ch = hli.gpCh[0]
        self.bahn_state = self.ch.bahn_state
        self.symbol = hli.symbol("gpCh[0].bahn_state.override_r")
        self.wanted = hli.symbol("gpCh[0].bahn_mc_control.override.command_w")

    def cyclic(self):
        {cyclic}
"""
WAITS = "a scan must not wait"
CNC = "which the CNC writes"


def warned(program: Write, cyclic: str, interval: str = "0.001") -> list[str]:
    text = TASK.replace("{interval}", interval).replace("{cyclic}", cyclic)
    tasks = load_tasks(str(program(text, "mistaken.py")))
    return advice.of_class(Program.of(tasks[0]))


@pytest.mark.parametrize(
    ("cyclic", "said"),
    [
        ("time.sleep(0.0001)", WAITS),
        ("pause(0.0001)", WAITS),
        ("ask()", WAITS),
        ("self.ch.bahn_state.dist_prog_start = 0.0", "dist_prog_start"),
        ("self.ch.bahn_state.coord_r[0].name = b'X'", "coord_r"),
        ("self.ch.bahn_state.pos_v_0_pcs_r[1] += 1", "pos_v_0_pcs_r"),
        ("self.ch.channel_mc_control.mode_and_state.state_r.mode = 2", CNC),
        ("self.bahn_state.override_r, x = 1, 2", "override_r"),
        ("slow_down(self.ch)", "override_r"),
        (
            "self.ch.contour_lookahead.response.block[3].length = 5.0",
            "contour_lookahead.response.block.length",
        ),
        ("self.symbol.value = 5", "gpCh[0].bahn_state.override_r"),
    ],
)
def test_a_mistake_in_the_text_is_told(
    program: Write, cyclic: str, said: str
) -> None:
    """Once, with what it touches."""
    (text,) = warned(program, cyclic)
    assert said in text
    assert WAITS in text or CNC in text


@pytest.mark.parametrize(
    "cyclic",
    [
        "self.state_r = self.bahn_state.override_r",
        "self.wanted.value = 500",
        "u = self.ch.bahn_mc_control.feedhold; u.command_w = u.enable_w = True",
        "self.ch.contour_lookahead.request.length = 5.0",
        "self.ch.lc_error.satz_r.kopf.error_id = 4711",
        "override_r = self.symbol.value; self.value = override_r",
        "self.pause(1); self.sleep = 2",
    ],
)
def test_what_is_right_is_left_alone(program: Write, cyclic: str) -> None:
    """Own attributes, commands, the PLC's error record; waits in setup()."""
    assert warned(program, cyclic) == []


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("", ["never enable_w", "never override_valid"]),
        ("control.override.enable_w = True", ["never override_valid"]),
        ("control.override.enable_w = control.override_valid.enable_w = 1", []),
    ],
)
def test_a_command_that_the_cnc_does_not_look_at_is_told(
    program: Write, more: str, said: list[str]
) -> None:
    """command_w without enable_w, and an override without override_valid."""
    lines = ("control = self.ch.bahn_mc_control", more or "pass")
    write = "; ".join((*lines, "control.override.command_w = 500"))
    found = warned(program, write)
    assert len(found) == len(said)
    assert all(part in text for part, text in zip(said, found, strict=True))


@pytest.mark.parametrize(("interval", "count"), [("0.999", 0), ("1", 1)])
def test_a_long_interval_is_told(
    program: Write, interval: str, count: int
) -> None:
    """From one second on: it may have been meant as milliseconds."""
    assert len(warned(program, "pass", interval)) == count


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("gpCh[0]^.bahn_state.dist_prog_start", True),
        ("HLI_Global_Variables.gpCh[0]^.bahn_state.stop_conditions_r", True),
        ("gpCh[0].contour_lookahead.response.block[3].length", True),
        ("gpCh[0]^.bahn_mc_control.override.state_r", True),
        ("gpCh[0]^.bahn_mc_control.override.command_w", False),
        ("gpCh[0]^.contour_lookahead.request.length", False),
        ("gpVECh[0]^.value[3]", False),
        ("Mistaken.override_r", False),
        ("", False),
    ],
)
def test_a_path_tells_who_writes(path: str, status: bool) -> None:
    """By the reference of the HLI: the member, or a structure above it."""
    assert cnc_writes(path) is status


FRACTION = """
from plc_client import FeedControl, Override, task

@task()
class Halved:
    def setup(self, hli):
        self.slow = {block}(hli.gpCh[0])

    def cyclic(self):
        self.slow({percent})
"""


@pytest.mark.parametrize("block", ["FeedControl", "Override"])
@pytest.mark.parametrize(("percent", "count"), [(0.6, 1), (60.0, 0), (0.0, 0)])
def test_an_override_below_one_percent_is_told(
    program: Write, block: str, percent: float, count: int
) -> None:
    """The tool crept without a word: a factor was meant."""
    text = FRACTION.format(block=block, percent=percent)
    (cls,) = load_tasks(str(program(text, "halved.py")))
    with PlcRunner.on_mock(cls, [line(30)]) as runner:
        runner.step(3)
        programs = runner._scanner.programs
        found = [text for one in programs for text in advice.of_run(one)]
    assert len([text for text in found if "in percent" in text]) == count
