"""How fast clients of others are served: ADS and OPC UA beside a live cell.

``python bench/bridges.py`` starts a cell in real time, both servers, and the
test server that comes with pyads, which is the reference in the same run.
Prints JSON.  Targets: one symbol by ADS p50 <= 250 us, 100 in a sum <= 1.5 ms,
1000 notifications a second without loss; OPC UA read and write <= 2.5 ms,
500 monitored items at 100 ms without loss.  ``cnc`` is the CPU time of a cycle
of the CNC with and without clients, in turns: their ratio is the cost.
"""

from __future__ import annotations

import asyncio
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import asyncua
import pyads
from pyads import constants

from hli.segment import observe

ua: Any = asyncua.ua
HOSTS = {"hli-cosim": "127.0.48.1", "pyads": "127.0.48.2"}
IDS = {"hli-cosim": "127.0.48.1.1.1", "pyads": "127.0.48.2.1.1"}
OPCUA_PORT = 48_440
CH = "HLI_Global_Variables.gpCh[0]^"
FEED = f"{CH}.bahn_state.active_feed_r"
READS, SUMS, WRITES = 3000, 300, 200
LISTEN_S = 5.0
ITEMS, PERIOD_MS = 500, 100
TURNS, TURN_S = 4, 2.0
PART = "%p\n$FOR P1 = 0, 100000, 1\nG01 X100 Y5 F6000\nX0 Y0\n$ENDFOR\nM30\n"
PLC = """
from plc_client import task

@task(interval=0.001)
class Counter:
    def __init__(self):
        self.gain = 1.0
        for k in range({items}):
            setattr(self, f"n{k}", 0)

    def cyclic(self):
        for k in range({items}):
            setattr(self, f"n{k}", getattr(self, f"n{k}") + 1)
"""
REFERENCE = """
import sys, time
from pyads.testserver import AdsTestServer, AdvancedHandler, PLCVariable
from pyads import constants
handler = AdvancedHandler()
for k in range(100):
    handler.add_variable(PLCVariable(f"v{k}", 1, constants.ADST_INT32, "DINT"))
with AdsTestServer(handler, sys.argv[1], logging=False):
    print("ready", flush=True)
    time.sleep(1e6)
"""


def quantiles(work: Callable[[], object], count: int) -> dict[str, float]:
    """us of one call."""
    taken = []
    for _ in range(count):
        begin = time.perf_counter()
        work()
        taken.append((time.perf_counter() - begin) * 1e6)
    return told(taken)


def told(taken: list[float]) -> dict[str, float]:
    """p50, p99 and the longest."""
    taken.sort()
    n = len(taken)
    middle, late = taken[n // 2], taken[n * 99 // 100]
    return {
        "p50": round(middle, 1),
        "p99": round(late, 1),
        "max": round(taken[-1], 1),
    }


# -- processes
def started(stack: ExitStack, *words: str, waits: str = "") -> int:
    """Id of a process that ends with the run; it has said a word by now."""
    process = subprocess.Popen(
        [sys.executable, "-P", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    stack.callback(process.wait)
    stack.callback(process.terminate)
    assert process.stdout is not None
    while waits not in process.stdout.readline():
        assert process.poll() is None, words
    return process.pid


@contextmanager
def everything() -> Iterator[tuple[str, int]]:
    """Cell, servers and reference: name of the cell, process of the CNC."""
    name = f"hli-bench-{os.getpid()}"
    cli = ("-m", "cnc_core.cli")
    with TemporaryDirectory() as text, ExitStack() as stack:
        folder = Path(text)
        (folder / "part.nc").write_text(PART)
        (folder / "plc.py").write_text(PLC.replace("{items}", str(ITEMS)))
        users = folder / "users"
        users.touch(0o600)
        users.write_text("op:secret\n")
        part, plc = str(folder / "part.nc"), str(folder / "plc.py")
        cnc = started(stack, *cli, "cnc", part, "--name", name, waits="CNC")
        started(stack, *cli, "plc", plc, "--name", name, waits="PLC")
        host = ("--host", HOSTS["hli-cosim"])
        own = ("--net-id", IDS["hli-cosim"])
        started(stack, *cli, "ads", name, *host, *own, waits="ADS")
        port = ("--port", str(OPCUA_PORT), "--users", str(users))
        started(stack, *cli, "opcua", name, *port, waits="opc.tcp")
        started(stack, "-c", REFERENCE, HOSTS["pyads"], waits="ready")
        for host in HOSTS.values():
            listens(host)
        yield name, cnc


def listens(host: str) -> None:
    """Until somebody listens there."""
    end = time.monotonic() + 20.0
    while True:
        try:
            socket.create_connection((host, 48_898)).close()
        except OSError:
            assert time.monotonic() < end, host
            time.sleep(0.05)
        else:
            return


# -- ADS
def connection(server: str) -> Any:
    """An open connection of pyads."""
    pyads.add_route(IDS[server], HOSTS[server])
    found = pyads.Connection(IDS[server], 851, HOSTS[server])
    found.open()
    return found


def reads(plc: Any, name: str, many: list[str]) -> dict[str, Any]:
    """One symbol by its handle, 100 in a sum."""
    handle = plc.get_handle(name)

    def one() -> None:
        plc.read_by_name("", pyads.PLCTYPE_DINT, handle=handle)

    plc.read_list_by_name(many)
    return {
        "read_us": quantiles(one, READS),
        "sum_100_us": quantiles(lambda: plc.read_list_by_name(many), SUMS),
    }


def notifications(plc: Any) -> dict[str, Any]:
    """1000 a second: how many came, and how even their stamps are."""
    stamps: list[int] = []

    @plc.notification(pyads.PLCTYPE_DINT, timestamp_as_filetime=True)
    def came(handle: int, name: str, stamp: int, value: int) -> None:
        stamps.append(stamp)

    wish = pyads.NotificationAttrib(
        4, constants.ADSTRANS_SERVERCYCLE, cycle_time=1
    )
    handles = plc.add_device_notification(FEED, wish, came)
    time.sleep(LISTEN_S)
    plc.del_device_notification(*handles)
    cycles = round((stamps[-1] - stamps[0]) / 10_000)
    return {"came": len(stamps), "lost": cycles + 1 - len(stamps)}


def ads() -> dict[str, Any]:
    """This server and the reference."""
    pyads.open_port()
    own, other = connection("hli-cosim"), connection("pyads")
    dints = [s.name for s in own.get_all_symbols() if s.symbol_type == "DINT"]
    found = {
        "hli-cosim": reads(own, FEED, dints[:100]),
        "pyads": reads(other, "v0", [f"v{k}" for k in range(100)]),
    }
    found["hli-cosim"]["notifications_1000_hz"] = notifications(own)
    write = f"{CH}.bahn_mc_control.override.command_w"
    found["hli-cosim"]["write_us"] = quantiles(
        lambda: own.write_by_name(write, 1000, pyads.PLCTYPE_UINT), WRITES
    )
    own.close()
    other.close()
    return found


# -- what it costs the CNC
def cnc_now(name: str, process: int) -> tuple[int, int]:
    """CPU time of the CNC, ns, and its cycles."""
    tasks = Path(f"/proc/{process}/task").iterdir()
    spent = sum(int((t / "schedstat").read_text().split()[0]) for t in tasks)
    with observe(name) as segment:
        return spent, int(segment.root.sidecar.cnc.cycle)


def cycle_us(name: str, process: int) -> float:
    """CPU time of a cycle over the next while."""
    spent, cycles = cnc_now(name, process)
    time.sleep(TURN_S)
    later, more = cnc_now(name, process)
    return (later - spent) / (more - cycles) / 1e3


@contextmanager
def busy_client() -> Iterator[None]:
    """Somebody reads 100 symbols again and again, and is told 1000 a second."""
    plc = connection("hli-cosim")
    dints = [s.name for s in plc.get_all_symbols() if s.symbol_type == "DINT"]
    over = threading.Event()

    def read() -> None:
        while not over.is_set():
            plc.read_list_by_name(dints[:100])

    wish = pyads.NotificationAttrib(
        4, constants.ADSTRANS_SERVERCYCLE, cycle_time=1
    )
    handles = plc.add_device_notification(FEED, wish, lambda *_: None)
    reader = threading.Thread(target=read)
    reader.start()
    yield
    over.set()
    reader.join()
    plc.del_device_notification(*handles)
    plc.close()


def cost(name: str, process: int) -> dict[str, float]:
    """us of CPU in a cycle of the CNC, in turns alone and with a client."""
    pyads.open_port()
    alone, served = [], []
    for _ in range(TURNS):
        alone.append(cycle_us(name, process))
        with busy_client():
            served.append(cycle_us(name, process))
    without, beside = min(alone), min(served)
    return {
        "alone_us": round(without, 1),
        "with_client_us": round(beside, 1),
        "ratio": round(beside / without, 3),
    }


# -- OPC UA
class Told:
    """Counts what a subscription tells, by node."""

    def __init__(self) -> None:
        self.values: dict[Any, list[int]] = {}

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        self.values.setdefault(node.nodeid, []).append(value)


async def timed(work: Callable[[], Any], count: int) -> dict[str, float]:
    """us of one call."""
    taken = []
    for _ in range(count):
        begin = time.perf_counter()
        await work()
        taken.append((time.perf_counter() - begin) * 1e6)
    return told(taken)


async def opcua() -> dict[str, Any]:
    """Reads, writes, and 500 monitored items."""
    address = f"opc.tcp://127.0.0.1:{OPCUA_PORT}/"
    client = asyncua.Client(address, timeout=60.0, watchdog_intervall=60.0)
    client.set_user("op")
    client.set_password("secret")
    async with client:
        names = await client.get_namespace_array()
        own = names.index("urn:hli-cosim:symbols")

        def node(path: str) -> Any:
            return client.get_node(ua.NodeId(path, own))

        feed, gain = node(FEED), node("Counter.gain")
        counters = [node(f"Counter.n{k}") for k in range(ITEMS)]
        found: dict[str, Any] = {
            "read_us": await timed(feed.read_value, 1000),
            "write_us": await timed(lambda: gain.write_value(2.0), WRITES),
        }
        coords = [
            node(f"{CH}.bahn_state.coord_r[{k}].{name}")
            for k in range(32)
            for name in (await _coordinates(node))
        ]
        members = [*coords[: ITEMS - 1], feed]
        found["monitored"] = await monitored(client, members, feed)
        found["all_change"] = await monitored(client, counters, counters[0])
        return found


async def monitored(client: Any, items: list[Any], one: Any) -> dict[str, int]:
    """How many items are told of, how often the least, and how often one."""
    seen = Told()
    subscription = await client.create_subscription(PERIOD_MS, seen)
    await subscription.subscribe_data_change(items, sampling_interval=PERIOD_MS)
    await asyncio.sleep(LISTEN_S)
    await subscription.delete()
    counts = [len(values) for values in seen.values.values()]
    return {
        "items": len(items),
        "told": len(counts),
        "least": min(counts),
        "one_that_changes": len(seen.values[one.nodeid]),
    }


async def _coordinates(node: Callable[[str], Any]) -> list[str]:
    """Members of one axis of the channel."""
    found = []
    for inner in ("", "hb_display_r."):
        path = f"{CH}.bahn_state.coord_r[0].{inner}".rstrip(".")
        names = [
            (await part.read_browse_name()).Name
            for part in await node(path).get_children()
        ]
        plain = [n for n in names if n not in ("hb_display_r", "axis_name_r")]
        found += [f"{inner}{name}" for name in plain]
    return found


def main() -> None:
    """Print what was measured."""
    with everything() as (name, process):
        found = {
            "load": os.getloadavg()[0],
            "cnc": cost(name, process),
            "ads": ads(),
            "opcua": asyncio.run(opcua()),
        }
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
