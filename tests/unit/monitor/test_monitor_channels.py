"""The monitor beside a cell with several channels: each page has one of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from cnc_core.monitor.app import Monitor, Served
from cnc_core.monitor.functions import axis_areas, in_units
from cnc_core.monitor.route import read_route
from cnc_core.monitor.security import host_names
from cnc_core.monitor.source import Source
from cnc_core.observing.sight import Sight
from plc_client import task
from plc_client.mock import line, m
from plc_client.runner import PlcRunner
from support.channels import Channels
from support.monitor_page import HERE, LIVE, OURS, TOKEN, Open, acted

CELL = """
[channels.left.axes.X]
[channels.left.axes.Y]
[channels.left.spindles.S]
id = 5
[channels.right.axes.X]
id = 11
[channels.right.axes.Z]
id = 12
"""
EXCHANGE = """
[channels.left.axes.X]
[channels.left.axes.Y]
[channels.left.spindles.S]
id = 5
[channels.right]
guest_axes = [2]
[channels.right.axes.Z]
id = 11
"""


@task()
class Idle:
    """A PLC that commands nothing of its own."""

    def cyclic(self) -> None:
        pass


@pytest.fixture
def cell() -> Iterator[PlcRunner]:
    """Two channels of a mock; the second one is faster at its M function."""
    script = [[line(100)], [line(1), m(8), line(50)]]
    with PlcRunner.on_mock(Idle, script) as runner:
        runner._scanner.orders.open(runner.hli.name)
        runner.step(5)
        yield runner
        runner._scanner.orders.close()


@pytest.fixture
def client(cell: PlcRunner) -> Iterator[TestClient]:
    """A server of this cell."""
    served = Served(TOKEN, name=cell.hli.name)
    app = Monitor(served).app(host_names("127.0.0.1", 8765))
    with TestClient(app, HERE) as made:
        yield made


def drives(channel: int, distance: float, frame: dict[str, Any]) -> bool:
    """A frame of this channel that shows this distance, mm."""
    found = frame.get("motion", {}).get("distance")
    return bool(frame["channel"] == channel and found == distance)


def test_a_frame_is_of_the_channel_that_the_page_has_chosen(
    cell: PlcRunner, client: TestClient
) -> None:
    """Distance, trail and units of that channel, also with two pages."""
    cell.step(40)
    with (
        client.websocket_connect(LIVE + cell.hli.name) as one,
        client.websocket_connect(LIVE + cell.hli.name) as other,
    ):
        first, second = Open(one, client), Open(other, client)
        second.want(channel=1)
        for index, page in ((0, first), (1, second)):
            state = cell.hli.gpCh[index]._c.bahn_state
            frame = page.frame(
                partial(drives, index, state.dist_prog_start * 1e-4)
            )
            assert frame["cell"]["channels"] == ["1", "2"]
            units = {f["unit"].split()[0] for f in frame["functions"]}
            assert units <= {f"gpCh[{index}]"}
        assert first.frame()["channel"] == 0
        first.want(channel=1)
        fresh = first.frame(lambda f: f["channel"] == 1)
        assert fresh["trail_new"]
        assert fresh["trail"]


@pytest.mark.parametrize("channel", [7, -1, "1", None, True, 10**9])
def test_a_channel_that_is_none_shows_the_first(
    cell: PlcRunner, client: TestClient, channel: Any
) -> None:
    """And the page goes on."""
    with client.websocket_connect(LIVE + cell.hli.name) as live:
        page = Open(live, client)
        page.want(channel=channel)
        assert page.frame(lambda f: "motion" in f)["channel"] == 0
        page.want(channel=1)
        assert page.frame(lambda f: f["channel"] == 1)["channel"] == 1


def actions_in(frame: dict[str, Any]) -> list[dict[str, Any]]:
    """Of its events those that say what a page has done."""
    return [event for event in frame["events"] if event["kind"] == "action"]


def test_an_order_acts_on_its_channel_and_is_told_with_it(
    cell: PlcRunner, client: TestClient
) -> None:
    """Feed hold of the second one; the events say who, what and where."""
    with client.websocket_connect(LIVE + cell.hli.name) as live:
        page = Open(live, client)
        order = {"do": "operate", "what": "feedhold", "value": True}
        answer = acted(cell, page, **order, channel=1)
        assert answer.status_code == 200, answer.text
        cell.step(3)
        held = [
            bool(cell.hli.gpCh[i].bahn_mc_control.feedhold.state_r)
            for i in range(2)
        ]
        assert held == [False, True]
        told = page.frame(actions_in)
        (event,) = actions_in(told)
        assert not actions_in(page.frame()) + actions_in(page.frame())
        assert event["text"] == "channel 2: feedhold True"
        assert event["who"].startswith("Ada (page ")
        for wrong in (2, -1, "1", 1.5, True, None):
            refused = acted(cell, page, **order, channel=wrong)
            assert refused.status_code == 422, wrong
            assert "channel" in refused.json()["error"]


@pytest.mark.parametrize("channel", ["2", "x", "-1", "1" * 30, "٣"])
def test_the_program_of_a_channel_that_is_none(
    cell: PlcRunner, client: TestClient, channel: str
) -> None:
    """Another index shows the first one's; what is no index is refused."""
    with client.websocket_connect(LIVE + cell.hli.name) as live:
        Open(live, client).frame(lambda f: f["route"])
        ask = {"cell": cell.hli.name, "channel": channel}
        answer = client.get("/api/route", headers=OURS, params=ask)
        assert answer.status_code == (200 if channel == "2" else 404)


@pytest.mark.ci
def test_every_channel_has_a_trail_from_the_start_on(
    cell: PlcRunner, client: TestClient
) -> None:
    """Also the one that no page shows: it is there when it is chosen."""
    with client.websocket_connect(LIVE + cell.hli.name) as live:
        page = Open(live, client)
        end = time.monotonic() + 0.4
        while time.monotonic() < end:
            cell.step(1)
            page.frame()
        page.want(channel=1)
        fresh = page.frame(lambda f: f["channel"] == 1)
        assert len(fresh["trail"]) > 2


def test_functions_are_those_of_the_axes_that_a_channel_has(
    tmp_path: Path,
) -> None:
    """An axis that was taken counts where it is; a spindle where it is at home."""
    texts = [
        "#PUT AX [Y]\nG1 X50 F600\nM30\n",
        "#CALL AX [Y,2,1]\nG1 Z50 F600\nM30\n",
    ]
    homes = range(3), range(3, 4)
    with Channels(tmp_path, texts, EXCHANGE) as cnc:
        sights = [Sight(cnc.hli, i) for i in range(2)]

        def areas() -> list[list[int]]:
            assert all(sight.take() for sight in sights)
            return [axis_areas(cnc.hli, sights, i, homes[i]) for i in range(2)]

        def names() -> list[list[str]]:
            return [[a["name"] for a in s.positions()] for s in sights]

        assert areas() == [[0, 1, 2], [3]]
        assert names() == [["X", "Y"], ["Z"]]
        cnc.until(lambda: areas() == [[0, 2], [1, 3]])
        assert names() == [["X"], ["Z", "Y"]]
        assert in_units(cnc.hli, 0, [0, 2]) == []


TWO = "N10 #SIGNAL [ID=7 CH=2]\nN20 #WAIT [ID=9 CH=2]\nN30 G01 X5 F600\nM30\n"


def test_a_route_is_that_of_a_channel(program: Callable[..., Path]) -> None:
    """Its axes and its dialect; what it waits for counts as there."""
    config = program(CELL, "cell.toml")
    part = program("N10 #WAIT [ID=9 CH=1]\nN20 G01 X3 Z4 F600\nM30\n")
    route = read_route(Source(part, config, channel=1))
    assert (route.whole, route.problem) == (True, "")
    assert route.points[-1][:4] == [3.0, 0.0, 4.0, 5.0]
    left = read_route(Source(program(TWO, "left.nc"), config))
    assert left.points[-1][:4] == [5.0, 0.0, 0.0, 5.0]
    none = read_route(Source(part, config, channel=2))
    assert "2 channels" in none.problem
