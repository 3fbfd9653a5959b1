"""The OPC UA server with the client of asyncua, and with node-opcua."""

from __future__ import annotations

import asyncio
import contextlib
import random
import socket
from typing import Any

import pytest

from hli import layout
from support import bridged, clients, malformed
from support.malformed import GROWTH_MAX, resident

asyncua: Any = pytest.importorskip("asyncua")
ua: Any = asyncua.ua
opcua_client: Any = pytest.importorskip("support.opcua_client")
Session, Told = opcua_client.Session, opcua_client.Told
session, until = opcua_client.session, opcua_client.until
CH = "HLI_Global_Variables.gpCh[0]^"
FEED = f"{CH}.bahn_state.active_feed_r"
CHANNEL = "CncInterface.CncChannelList.Channel1"
AXIS = "CncInterface.CncAxisList.X"
WAIT_S = 20.0
TRIES = 20
pytestmark = [
    pytest.mark.ci,
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings(
        "ignore::pytest.PytestUnraisableExceptionWarning"
    ),
]


def test_the_model_shows_the_channel(served: Any) -> None:
    """Feed, override and program with the units of the specification."""
    state = served.channel.bahn_state
    state.active_feed_r, state.override_r = 12_500, 800
    state.prog_name_r = "wheel.nc"
    mode = served.channel.channel_mc_control.mode_and_state.state_r
    mode.mode = layout.HLI_IMCM_AUTOMATIC_MODE
    mode.state = layout.HLI_IMCM_PROCESS_ACTIVE

    async def look() -> dict[str, Any]:
        async with session(served.url) as one:
            names = ("ActFeedrate", "ActOverride", "ActProgramName")
            names += ("ActProgramStatus", "ActOperationMode", "ActStatus")
            found = {
                n: await one.cnc(f"{CHANNEL}.{n}").read_value() for n in names
            }
            unit = one.cnc(f"{CHANNEL}.ActFeedrate.EngineeringUnits")
            found["unit"] = (await unit.read_value()).DisplayName.Text
            return found

    assert asyncio.run(look()) == {
        "ActFeedrate": 12.5,
        "ActOverride": 80.0,
        "ActProgramName": "wheel.nc",
        "ActProgramStatus": 1,
        "ActOperationMode": 2,
        "ActStatus": 0,
        "unit": "mm/s",
    }


def test_positions_are_structures_that_clients_decode(served: Any) -> None:
    """With their parts as variables, too."""
    coord = served.channel.bahn_state.coord_r[0]
    coord.current_position_r = 100_000
    coord.act_position_r, coord.cmd_position_r = 110_000, 150_000

    async def look() -> tuple[Any, float]:
        async with session(served.url) as one:
            place = await one.cnc(f"{AXIS}.PosDirect").read_value()
            rest = await one.cnc(f"{AXIS}.PosDirect.RemDist").read_value()
            return place, rest

    place, rest = asyncio.run(look())
    assert (place.ActPos, place.CmdPos, place.RemDist) == (10.0, 11.0, 4.0)
    assert rest == 4.0


def test_types_are_those_of_the_published_nodeset(served: Any) -> None:
    """Ids, names and data types, as the nodeset in node-opcua's package has
    them; every mandatory member is there.
    """
    import xml.etree.ElementTree as ET  # noqa: PLC0415

    modules = clients.installed("node-opcua-nodesets")
    folder = modules / "node-opcua-nodesets" / "nodesets"
    root = ET.parse(folder / "Opc.Ua.CNC.NodeSet.xml").getroot()
    space = "{http://opcfoundation.org/UA/2011/03/UANodeSet.xsd}"
    from cnc_core.bridges.opcua import model  # noqa: PLC0415

    def plain(text: str | None) -> str:
        return (text or "").partition(":")[2]

    ids = {}
    for one in root.findall(f"{space}UAObjectType"):
        number = one.get("NodeId", "").partition(";i=")[2]
        ids[one.get("NodeId")] = plain(one.get("BrowseName"))
        assert model.OBJECT_TYPES[plain(one.get("BrowseName"))][0] == int(
            number
        )
    assert set(ids.values()) == set(model.OBJECT_TYPES)
    for one in root.findall(f"{space}UAVariable"):
        owner = ids.get(one.get("ParentNodeId"))
        rules = [r.text for r in one.find(f"{space}References") or ()]
        if owner is None or "i=78" not in rules:
            continue
        known = {n: t for n, t, _, _ in model.members_of(owner)}
        name = plain(one.get("BrowseName"))
        array = "[]" if one.get("ValueRank") == "1" else ""
        assert known[name] == f"{one.get('DataType')}{array}", (owner, name)


def test_symbols_stand_beside_the_model(served: Any) -> None:
    """Of HLI and PLC: numbers, texts and arrays."""
    served.channel.bahn_state.dist_prog_start = 321.5

    async def look() -> list[Any]:
        async with session(served.url) as one:
            paths = [f"{CH}.bahn_state.dist_prog_start", "Slow.text"]
            paths += ["MAIN.title", "MAIN.grid", f"{CH}.head.plc_present_w"]
            return [await one.symbol(p).read_value() for p in paths]

    found = asyncio.run(look())
    assert found == [321.5, "hello", "spindle", [1, 2, 3, 4], True]


def test_anonymous_clients_read_and_others_write(served: Any) -> None:
    """What the CNC owns nobody writes; a wrong password is refused."""
    unit = f"{CH}.bahn_mc_control.override.command_w"

    async def code(one: Any, path: str, value: Any, kind: str) -> str:
        variant = ua.Variant(value, ua.VariantType[kind])
        try:
            await one.symbol(path).write_value(ua.DataValue(variant))
        except ua.UaStatusCodeError as error:
            return str(ua.status_codes.get_name_and_doc(error.code)[0])
        return "Good"

    async def look() -> list[str]:
        async with session(served.url) as one:
            found = [await code(one, "Slow.gain", 1.0, "Double")]
        async with session(served.url, "op") as one:
            found.append(await code(one, "Slow.gain", 3.25, "Double"))
            found.append(await code(one, unit, 650, "UInt16"))
            found.append(await code(one, unit, 650.0, "Double"))
            feed = f"{CH}.bahn_state.active_feed_r"
            found.append(await code(one, feed, 1, "Int32"))
        return found

    wanted = ["BadUserAccessDenied", "Good", "Good", "BadTypeMismatch"]
    assert asyncio.run(look()) == [*wanted, "BadNotWritable"]
    assert served.task.gain == 3.25
    assert served.channel.bahn_mc_control.override.command_w == 650

    async def wrong() -> None:
        client = asyncua.Client(served.url)
        client.set_user("op")
        client.set_password("guess")
        async with client:
            pass

    with pytest.raises(ua.UaStatusCodeError):
        asyncio.run(wrong())


def test_subscriptions_tell_each_change(served: Any) -> None:
    """Of a member of the HLI, in order."""
    served.channel.bahn_state.command_feed_r = 0

    async def look() -> list[Any]:
        told = Told()
        async with session(served.url) as one:
            subscription = await one.client.create_subscription(10, told)
            node = one.symbol(f"{CH}.bahn_state.command_feed_r")
            await subscription.subscribe_data_change(node)
            for value in range(1, 6):
                await until(lambda wanted=value - 1: wanted in told.values)  # type: ignore[misc]
                served.channel.bahn_state.command_feed_r = value
            await until(lambda: 5 in told.values)
            await subscription.delete()
        return told.values

    assert asyncio.run(look()) == [0, 1, 2, 3, 4, 5]


def test_variables_are_looked_at_as_often_as_was_asked(served: Any) -> None:
    """A change waits until the interval is over."""
    path = f"{CH}.bahn_state.block_number_r"

    async def look() -> tuple[list[Any], set[float]]:
        told = Told()
        served.channel.bahn_state.block_number_r = 1
        async with session(served.url) as one:
            subscription = await one.client.create_subscription(10, told)
            for name, pace_ms in ((path, 3.6e6), (FEED, 0.0)):
                await subscription.subscribe_data_change(
                    one.symbol(name), sampling_interval=pace_ms
                )
            await until(lambda: 1 in told.values)
            paces = {*served.bridge.space.paces.values()}
            served.channel.bahn_state.block_number_r = 2
            served.channel.bahn_state.active_feed_r = 777
            await until(lambda: 777 in told.values)
            await subscription.delete()
        return told.values, paces

    values, paces = asyncio.run(look())
    assert {0.0, 3600.0} <= paces
    assert 2 not in values


def test_subscriptions_outlive_the_plc(served: Any) -> None:
    """Another PLC comes; the symbol is told of again."""

    async def look() -> list[Any]:
        told = Told()
        async with session(served.url) as one:
            subscription = await one.client.create_subscription(10, told)
            served.task.gain = 5.5
            await subscription.subscribe_data_change(one.symbol("Slow.gain"))
            await until(lambda: 5.5 in told.values)
            await asyncio.to_thread(served.restart_plc)
            await until(lambda: 2.5 in told.values)
            served.task.gain = 6.5
            await until(lambda: 6.5 in told.values)
            await subscription.delete()
        return told.values

    assert asyncio.run(look())[-1] == 6.5


def test_subscriptions_outlive_another_type(served: Any) -> None:
    """The new PLC has the symbol as LREAL; the one behind has none; then it is back."""
    program = "PROGRAM MAIN VAR {} END_VAR {} END_PROGRAM\n"
    real = program.format("count : LREAL := 0.5;", "count := count + 1;")
    none = program.format("other : INT;", "")
    back = program.format("count : DINT := 10000;", "count := count + 1;")

    async def look() -> None:
        told = Told()
        status: list[str] = []

        class Heard(Told):  # type: ignore[misc, valid-type]
            def datachange_notification(
                self, node: Any, value: Any, data: Any
            ) -> None:
                told.values.append(value)
                status.append(data.monitored_item.Value.StatusCode.name)

        async with session(served.url) as one:
            subscription = await one.client.create_subscription(10, Heard())
            await subscription.subscribe_data_change(one.symbol("MAIN.count"))
            await until(
                lambda: bool(told.values) and told.values[-1] is not None
            )
            await asyncio.to_thread(served.restart_plc, real)
            await until(lambda: (told.values[-1] or 0) % 1 == 0.5)
            await asyncio.to_thread(served.restart_plc, none)
            await until(lambda: status[-1] == "BadNodeIdUnknown")
            await asyncio.to_thread(served.restart_plc, back)
            await until(lambda: (told.values[-1] or 0) > 10000)
            await subscription.delete()

    try:
        asyncio.run(look())
    finally:
        served.restart_plc(bridged.ST)


def test_an_error_of_the_channel_is_an_alarm(served: Any) -> None:
    """With its number, its line and the way to its cure."""

    async def look() -> Any:
        told = Told()
        async with session(served.url) as one:
            subscription = await one.client.create_subscription(10, told)
            await subscription.subscribe_events(
                one.cnc("CncInterface"),
                ua.NodeId(1006, one._cnc),
            )
            head = served.channel.mc_error.satz_r.kopf
            head.line, head.cycle, head.error_id = 17, 5, 270061
            await until(lambda: bool(told.events))
            await subscription.delete()
        return told.events[0]

    event = asyncio.run(look())
    assert event.AlarmIdentifier == "270061"
    assert event.AuxParameters == ["17"]
    assert "explain 270061" in event.HelpSource


def throw(served: Any, seed: int, count: int) -> None:
    """Malformed messages, each over a connection of its own."""
    rng = random.Random(seed)
    port = int(served.url.rpartition(":")[2].strip("/"))
    for _ in range(count):
        with (
            contextlib.suppress(OSError),
            socket.create_connection(("127.0.0.1", port), 20.0) as connection,
        ):
            connection.sendall(malformed.opcua(rng))


@pytest.mark.long
def test_ten_thousand_malformed_messages_and_no_growth(served: Any) -> None:
    """The memory of the server does not grow with them."""
    throw(served, 50, 2000)
    before = resident()
    for seed in range(5):
        throw(served, seed, 2000)
    test_malformed_messages_do_no_harm(served)
    assert resident() - before < GROWTH_MAX


def test_malformed_messages_do_no_harm(served: Any) -> None:
    """The server answers right behind them."""
    throw(served, 3, 150)

    async def look() -> Any:
        clients = served.bridge.server.bserver.clients
        for _ in range(TRIES):
            await until(lambda: not clients)  # those that have left
            # who waits to be accepted comes first, and no more than 64 at a time
            with contextlib.suppress(ConnectionError):
                async with session(served.url) as one:
                    return await one.symbol("MAIN.title").read_value()
        raise AssertionError("it lets nobody in")

    assert asyncio.run(look()) == "spindle"


@pytest.mark.ci
def test_a_session_of_node_opcua(served: Any) -> None:
    """Another stack reads, decodes, writes with a password, and monitors."""
    served.channel.bahn_state.active_feed_r = 2000
    served.channel.bahn_state.dist_prog_start = 77.0
    served.channel.bahn_state.coord_r[0].current_position_r = 100_000
    served.task.gain = 2.5
    found = clients.run("node-opcua-client", "opcua.js", served.url)
    assert found["feed"] == 2.0
    assert found["distance"] == 77.0
    assert found["gain"] == 2.5
    assert {"CncAxisList", "CncChannelList"} <= set(found["lists"])
    assert found["anonymous"] == "BadUserAccessDenied"
    assert (found["named"], found["written"]) == ("Good", 9.5)
    assert found["told"] == sorted(set(found["told"]))
