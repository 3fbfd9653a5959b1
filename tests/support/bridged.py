"""A cell in this process, with servers for clients of others beside it.

The CNC stands, so values are what a test writes.  The PLC scans in a thread,
the servers run in the loop of another one.
"""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

import numpy as np

import plc_client
from cnc_core.bridges.ads.server import Rules, Server
from cnc_core.bridges.symbols.cell import ServedCell
from hli import layout
from hli.orders import Orders
from plc_client.program import Program
from plc_client.scan import Scanner
from plc_client.st.machine.tasks import load_st
from support.fake_cnc import FakeCnc

WAIT_S = 60.0  # for a machine that has other work
ADS_PORT = 48898  # the one that AdsLib knows
# an address of its own, so that tests may run beside each other
ADS_HOST = f"127.48.{os.getpid() // 250 % 250}.{os.getpid() % 250 + 1}"
ST = """
TYPE ST_Pair : STRUCT a : INT; b : ARRAY [1..3] OF REAL; END_STRUCT END_TYPE
PROGRAM MAIN
VAR
    count : DINT;
    ready : BOOL;
    title : STRING(20) := 'spindle';
    grid : ARRAY [0..1, 1..2] OF INT := [1, 2, 3, 4];
    pair : ST_Pair;
    timer : TON;
END_VAR
count := count + 1;
END_PROGRAM
"""


class Inner:
    """A part of a task that is an object."""

    def __init__(self) -> None:
        self.q = False
        self.et = 1.5


@plc_client.task(interval=0.005)
class Slow:
    """Variables of all kinds that are listed."""

    def __init__(self) -> None:
        self.gain = 2.5
        self.n = 0
        self.text = "hello"
        self.table = np.arange(6.0).reshape(2, 3)
        self.flags = [True, False]
        self.inner = Inner()
        self._hidden = 1

    def cyclic(self) -> None:
        self.n += 1


class Plc:
    """The PLC of a cell, in a thread."""

    def __init__(self, name: str, programs: list[Program]) -> None:
        self.hli = plc_client.connect(name, present=False)
        self.scanner = Scanner(self.hli, programs, may_finish=False)
        self.scanner.orders = Orders()
        self.scanner.orders.open(name)
        self._thread = threading.Thread(target=self.scanner.run)
        self._thread.start()

    def stop(self) -> None:
        """Leave the cell."""
        self.scanner.stop()
        self._thread.join()
        self.scanner.orders.close()
        self.hli.close()


class Loop:
    """An event loop in a thread."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()

    def run(self, work: Coroutine[Any, Any, Any]) -> Any:
        """The result of what runs in the loop."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(WAIT_S)

    def start(self, work: Coroutine[Any, Any, Any]) -> Any:
        """Let it run on."""
        return asyncio.run_coroutine_threadsafe(work, self._loop)

    def close(self) -> None:
        """End the loop and all that runs in it."""
        self.run(_cancel_all())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


async def _cancel_all() -> None:
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


class Bridged:
    """A cell with an ADS server; ``cnc`` is its memory."""

    def __init__(self, folder: Path, rules: Rules | None = None) -> None:
        self._source = folder / "main.st"
        self._source.write_text(ST)
        self._st = load_st(self._source)
        self.cnc = FakeCnc(clock=layout.HLI_CLOCK_REALTIME)
        self.name = self.cnc.name
        self.programs = self._programs()
        self.plc = Plc(self.name, self.programs)
        self.loop = Loop()
        self.cell = ServedCell(self.name)
        self.server: Server = self.loop.run(self._serve(rules or Rules()))

    def _programs(self) -> list[Program]:
        return [Program.of(Slow), *(Program.of(st) for st in self._st)]

    async def _serve(self, rules: Rules) -> Server:
        server = Server(self.cell, rules)
        while not self.cell.plc.spaces:
            await self.cell.look()
            await asyncio.sleep(0.01)
        await server.start(ADS_HOST, ADS_PORT)
        self.looking = asyncio.ensure_future(self.cell.run())
        return server

    @property
    def task(self) -> Slow:
        """The task of Python."""
        return next(
            p.instance for p in self.programs if isinstance(p.instance, Slow)
        )

    @property
    def channel(self) -> Any:
        """The channel, as the CNC sees it."""
        return self.cnc.areas.gpCh[0]

    def restart_plc(self, text: str = "") -> None:
        """Another PLC comes, with another program of Structured Text."""
        self.plc.stop()
        if text:
            self._source.write_text(text)
            self._st = load_st(self._source)
        self.programs = self._programs()
        self.plc = Plc(self.name, self.programs)

    def lose_cnc(self) -> None:
        """CNC and PLC end, and the memory is gone."""
        self.cnc.side.cnc.phase = layout.HLI_PHASE_SHUTDOWN
        self.plc.stop()
        self.cnc.remove()

    def another_cnc(self) -> None:
        """A CNC of the same name comes, and a PLC."""
        self.cnc = FakeCnc(name=self.name, clock=layout.HLI_CLOCK_REALTIME)
        self.programs = self._programs()
        self.plc = Plc(self.name, self.programs)

    def close(self) -> None:
        """Servers, PLC and CNC, in this order."""
        self.loop.run(self.server.close())
        self.loop.close()
        self.plc.stop()
        self.cnc.remove()
