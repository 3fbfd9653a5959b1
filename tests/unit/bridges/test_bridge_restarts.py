"""CNC and PLC end and come back, before the eyes of clients."""

from __future__ import annotations

import asyncio
import gc
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from support.bridged import ADS_HOST, Bridged

FEED = "HLI_Global_Variables.gpCh[0]^.bahn_state.active_feed_r"
NET_ID = "127.0.0.1.1.1"
WAIT_S = 20.0


def until(condition: Callable[[], bool]) -> None:
    """Wait for it; it fails after a while."""
    end = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.005)


@pytest.fixture
def plc(bridged: Bridged) -> Any:
    """A connection of pyads to the PLC's port."""
    pyads: Any = pytest.importorskip("pyads")
    pyads.open_port()
    pyads.add_route(NET_ID, ADS_HOST)
    with pyads.Connection(NET_ID, 851, ADS_HOST) as found:
        yield found
    pyads.delete_route(pyads.AmsAddr(NET_ID, 851))
    pyads.close_port()


class Ads:
    """Reads by handles that were taken once."""

    def __init__(self, plc: Any) -> None:
        self._pyads: Any = pytest.importorskip("pyads")
        self._plc = plc
        self._feed = plc.get_handle(FEED)
        self._gain = plc.get_handle("Slow.gain")

    def told(self) -> tuple[int, int]:
        """The feed, or 0 and the error."""
        return self._read(self._feed, self._pyads.PLCTYPE_DINT)

    def gain(self) -> tuple[float, int]:
        """A variable of the PLC, or 0 and the error."""
        return self._read(self._gain, self._pyads.PLCTYPE_LREAL)

    def _read(self, handle: int, kind: Any) -> tuple[Any, int]:
        try:
            return self._plc.read_by_name("", kind, handle=handle), 0
        except self._pyads.ADSError as error:
            return 0, int(error.err_code)


def test_ads_tells_that_the_cnc_ended_and_came_back(
    bridged: Bridged, plc: Any
) -> None:
    """By state and errors; handles and notifications go on with the next one."""
    pyads: Any = pytest.importorskip("pyads")
    ads = Ads(plc)
    came: list[int] = []

    @plc.notification(pyads.PLCTYPE_DINT)
    def changed(handle: int, name: str, stamp: Any, value: int) -> None:
        came.append(value)

    bridged.channel.bahn_state.active_feed_r = 11
    wish = pyads.NotificationAttrib(4, 4, cycle_time=1)
    handles = plc.add_device_notification(FEED, wish, changed)
    until(lambda: 11 in came)
    assert (ads.told(), plc.read_state()[0]) == ((11, 0), 5)
    bridged.lose_cnc()
    until(lambda: plc.read_state()[0] == 6)
    assert ads.told() == ads.gain() == (0, 0x707)
    bridged.another_cnc()
    bridged.channel.bahn_state.active_feed_r = 22
    until(lambda: plc.read_state()[0] == 5)
    until(lambda: 22 in came)
    assert ads.told() == (22, 0)
    until(lambda: ads.gain() == (2.5, 0))
    plc.del_device_notification(*handles)


@pytest.mark.ci
def test_opcua_tells_that_the_cnc_ended_and_came_back(served: Any) -> None:
    """As events; subscriptions go on with the next one."""
    client: Any = pytest.importorskip("support.opcua_client")
    ua = client.ua

    async def look() -> tuple[list[Any], list[str]]:
        told = client.Told()
        async with client.session(served.url) as one:
            subscription = await one.client.create_subscription(10, told)
            served.channel.bahn_state.active_feed_r = 33
            await subscription.subscribe_data_change(one.symbol(FEED))
            await subscription.subscribe_events(
                one.cnc("CncInterface"), ua.NodeId(1011, one._cnc)
            )
            await client.until(lambda: 33 in told.values)
            await asyncio.to_thread(served.lose_cnc)
            await client.until(lambda: len(told.events) >= 1)
            await asyncio.to_thread(served.another_cnc)
            served.name_axes()
            served.channel.bahn_state.active_feed_r = 44
            await client.until(lambda: 44 in told.values)
            await client.until(lambda: len(told.events) >= 3)
            await subscription.delete()
        return told.values, [event.Message.Text for event in told.events]

    values, texts = asyncio.run(look())
    assert values[-1] == 44
    assert any("ended" in text for text in texts)
    assert any("again" in text for text in texts)


@pytest.mark.ci
def test_nothing_of_a_cell_stays_behind(bridged: Bridged) -> None:
    """When the CNC is gone, nothing in the server holds its memory."""
    assert seen(bridged.name)
    bridged.lose_cnc()
    until(lambda: gc.collect() >= 0 and not seen(bridged.name))
    bridged.another_cnc()
    until(lambda: bridged.cell.plc_there and bool(seen(bridged.name)))


def seen(name: str) -> list[str]:
    """Mappings of a cell that cannot be written: those of servers."""
    lines = Path("/proc/self/maps").read_text(encoding="ascii").splitlines()
    return [line for line in lines if name in line and " r--s " in line]
