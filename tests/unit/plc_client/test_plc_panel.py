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


@task()
class Idle:
    """A program that commands nothing."""

    def cyclic(self) -> None:
        pass


@pytest.fixture
def two() -> Iterator[PlcRunner]:
    """A PLC beside a mock with two channels."""
    script = [[line(100)], [line(100)]]
    with PlcRunner.on_mock(Idle, script) as runner:
        runner.step(2)
        yield runner


def of_channel(
    runner: PlcRunner, channel: Any, what: str, value: Any = None
) -> dict[str, Any]:
    """The answer to an order of the panel of one channel."""
    given = {"do": "operate", "what": what, "value": value, "channel": channel}
    return dict(runner._scanner._online(given)["panel"])


def test_a_panel_acts_on_its_channel_alone(two: PlcRunner) -> None:
    """Override and feed hold of the second channel leave the first one alone."""
    first, second = (two.hli.gpCh[i].bahn_mc_control for i in range(2))
    before = first.override.state_r
    assert of_channel(two, 1, "override", 40)["held"] == {"override": 40.0}
    of_channel(two, 1, "feedhold", True)
    two.step(3)
    assert second.override.state_r == 400
    assert second.feedhold.state_r
    assert first.override.state_r == before
    assert not first.feedhold.state_r
    states = two._scanner._online({"do": "statistics"})["panels"]
    assert states[0]["held"] == {}
    assert states[1]["held"] == {"override": 40.0, "feedhold": True}
    of_channel(two, 1, "override")
    of_channel(two, 1, "feedhold")
    assert two._scanner._online({"do": "list"})["forced"] == {}


def test_commands_of_two_channels_run_beside_each_other(
    two: PlcRunner,
) -> None:
    """A stop of one while the other's is under way; each ends by itself."""
    for channel in (0, 1):
        assert of_channel(two, channel, "stop")["state"] == "busy"
    two.step(200)
    states = two._scanner.panel.states()
    assert [state["command"] for state in states] == ["stop", "stop"]
    assert "busy" not in [state["state"] for state in states]
    assert not two._scanner.panel.any


@pytest.mark.parametrize("channel", [2, -1, True, "1", 1.0, None])
def test_a_channel_that_is_none_is_refused(
    two: PlcRunner, channel: Any
) -> None:
    """In words, with the number of channels that there are."""
    with pytest.raises(ValueError, match="the cell has 2"):
        of_channel(two, channel, "feedhold", True)
