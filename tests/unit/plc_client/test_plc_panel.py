"""The operator's panel of a running PLC: levels, commands, what it refuses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from hli.symbol import SymbolError
from plc_client import FeedControl, task
from plc_client.mock import MockCnc, line
from plc_client.runner import PlcRunner

OVERRIDE = "HLI_Global_Variables.gpCh[0]^.bahn_mc_control.override.command_w"


@task()
class Program:
    """Commands an override of its own in each scan."""

    def setup(self, hli: Any) -> None:
        self.feed = FeedControl(hli.gpCh[0])

    def cyclic(self) -> None:
        self.feed(override=80.0)


@pytest.fixture
def plc() -> Iterator[PlcRunner]:
    """A PLC on a mock that drives 100 mm."""
    with PlcRunner.on_mock(Program, [line(100)]) as runner:
        runner.step(2)
        yield runner


def order(runner: PlcRunner, what: str, value: Any = None) -> dict[str, Any]:
    """The answer to an order of the panel."""
    given = {"do": "operate", "what": what, "value": value}
    answer = runner._scanner._online(given)
    return dict(answer["panel"])


def test_a_level_holds_against_the_program_until_it_is_released(
    plc: PlcRunner,
) -> None:
    """The forced override is listed and counts; released, the program's counts."""
    control = plc.ch.bahn_mc_control
    assert control.override.command_w == 800
    assert order(plc, "override", 60)["held"] == {"override": 60.0}
    plc.step(3)
    assert control.override.command_w == control.override.state_r == 600
    forced = plc._scanner._online({"do": "list"})["forced"]
    assert forced[OVERRIDE] == 600
    assert order(plc, "override")["held"] == {}
    plc.step(3)
    assert control.override.command_w == control.override.state_r == 800


def test_a_level_without_a_program_is_given_back_to_the_operator() -> None:
    """The unit is enabled as before: not at all."""

    @task()
    class Nothing:
        def cyclic(self) -> None:
            pass

    with PlcRunner.on_mock(Nothing, [line(100)]) as runner:
        unit = runner.ch.bahn_mc_control.feedhold
        order(runner, "feedhold", True)
        runner.step(2)
        assert (unit.command_w, unit.enable_w) == (True, True)
        order(runner, "feedhold")
        runner.step(2)
        assert (unit.command_w, unit.enable_w) == (False, False)


@pytest.mark.parametrize(
    ("what", "value", "text"),
    [
        ("override", 201, "0..200"),
        ("override", float("nan"), "a number of percent"),
        ("override", "fast", "a number of percent"),
        ("rapid_override", True, "a number of percent"),
        ("feedhold", 1, "true or false"),
        ("mdi", " ", "a block is needed"),
        ("mdi", "X" * 300, "at most 299"),
        ("explode", None, "is not on the panel: override"),
    ],
)
def test_what_does_not_fit_is_refused(
    plc: PlcRunner, what: str, value: Any, text: str
) -> None:
    """With the reason; nothing is forced then."""
    with pytest.raises((SymbolError, ValueError), match=text):
        order(plc, what, value)
    assert plc._scanner._online({"do": "list"})["forced"] == {}


def test_commands_are_done_by_the_blocks_of_the_plc() -> None:
    """Stop and resume a program; one command at a time; the end is told."""
    cnc = MockCnc([line(100)])
    with PlcRunner.on_mock(Program, cnc) as runner:
        runner.step(20)
        assert order(runner, "stop")["state"] == "busy"
        with pytest.raises(ValueError, match="stop is not done yet"):
            order(runner, "reset")
        runner.step(400)
        answer = runner._scanner._online({"do": "statistics"})
        assert answer["panel"]["state"] == "done", answer["panel"]
        assert not runner._scanner.panel.any
        here = runner.distance
        runner.step(50)
        assert runner.distance == here
        order(runner, "resume")
        runner.step(400)
        assert runner.distance > here
        assert answer["tasks"]["Program"]["scans"] > 100
        assert sum(answer["handshake"]["counts"]) <= answer["handshake"]["n"]
