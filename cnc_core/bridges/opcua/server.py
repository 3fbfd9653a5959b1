"""The server: address space, monitored variables, alarms, end."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from asyncua import Server, ua

from ..symbols.cell import LOOK_S, ServedCell
from . import model
from .instances import Cnc
from .sampling import Sampling
from .sessions import CellServer, Users, ask_plc
from .space import Space
from .symbol_nodes import URI, SymbolNodes
from .types import Types

PORT = 4840
CONNECTIONS_MAX = 64
MESSAGE_MAX = 16 << 20
CYCLE_MIN_S = 0.002
REST = 1.0
"""The sampling sleeps at least so many times as long as it works."""
ASK_S = 0.05
SEVERITY = 800
POLICIES = [
    ua.SecurityPolicyType.NoSecurity,
    ua.SecurityPolicyType.Basic256Sha256_Sign,
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
]


@dataclass
class Door:
    """Where and how clients come in."""

    host: str = "127.0.0.1"
    port: int = PORT
    passwords: dict[str, str] = field(default_factory=dict)
    certificate: Path | None = None
    key: Path | None = None


class Bridge:
    """One cell over OPC UA."""

    def __init__(self, cell: ServedCell, door: Door) -> None:
        self.cell, self.door = cell, door
        users: Any = Users(door.passwords)
        self._inner = CellServer(user_manager=users)
        self._inner.allow_remote_admin = False
        self._inner.max_connections = CONNECTIONS_MAX
        self.server = Server(iserver=self._inner)
        self._alarm: Any = None
        self._message: Any = None
        self._error = (0, 0)
        self._seen = 0
        self._life = 0

    async def start(self) -> None:
        """Build the address space and listen.  OSError."""
        server, door = self.server, self.door
        await server.init()
        await server.set_application_uri(f"urn:hli-cosim:{self.cell.name}")
        server.name = f"hli-cosim cell {self.cell.name}"
        host = f"[{door.host}]" if ":" in door.host else door.host
        server.set_endpoint(f"opc.tcp://{host}:{door.port}/")
        server.limits.max_message_size = MESSAGE_MAX
        await self._secure()
        cnc = await server.register_namespace(model.URI)
        own = await server.register_namespace(URI)
        self.space = self._inner.space = Space(self._inner, self.cell)
        self.sampling = Sampling(self._inner, self.space, self.cell)
        self.types = Types(self.space, cnc)
        self.types.add_all()
        self.cnc = Cnc(self.space, self.types, self.cell.name)
        self.cnc.add_interface()
        self.symbols = SymbolNodes(self.space, self.cell, own)
        self.symbols.add_folder()
        await self._generators()
        await self.look()
        await server.start()

    async def _secure(self) -> None:
        door = self.door
        if door.certificate is None or door.key is None:
            self.server.set_security_policy([POLICIES[0]])
            return
        await self.server.load_certificate(str(door.certificate))
        await self.server.load_private_key(str(door.key))
        self.server.set_security_policy(POLICIES)

    async def _generators(self) -> None:
        node = self.server.get_node(self.cnc.interface)
        alarm = self.types.object_type("CncAlarmType")
        event = await self.server.get_event_generator(alarm, node)
        for name, *_ in model.members_of("CncAlarmType"):
            event.event.data_types[name] = ua.VariantType.String
        self._alarm = event
        message = self.types.object_type("CncMessageType")
        self._message = await self.server.get_event_generator(message, node)

    @property
    def port(self) -> int:
        """The port it listens at."""
        listening: Any = self.server.bserver
        number: int = listening._server.sockets[0].getsockname()[1]
        return number

    async def stop(self) -> None:
        """Leave all clients."""
        await self.server.stop()

    # -- following the cell
    async def look(self) -> None:
        """Whether CNC and PLC are there, what they have, what went wrong."""
        await self.cell.look()
        areas = self.cell.observer.areas
        if areas is not None and self.cell.observer.life != self._life:
            self._life = self.cell.observer.life
            self.cnc.build(areas.segment.root)
        self.symbols.follow()
        await self._tell()

    async def _tell(self) -> None:
        """Alarms of the channel, and who came and went, as events."""
        for event in self.cell.events.since(self._seen):
            self._seen = event["number"]
            await self._message.trigger(message=event["text"])
        areas = self.cell.observer.areas
        if areas is None:
            return
        head: Any = areas.segment.root.channel[0].mc_error.satz_r.kopf
        found = int(head.error_id), int(head.cycle)
        if found[0] and found != self._error:
            event = self._alarm.event
            event.AlarmIdentifier = str(found[0])
            event.AuxParameters = [str(head.line)]
            event.HelpSource = f"hli-cosim explain {found[0]}"
            event.Severity = SEVERITY
            await self._alarm.trigger(message=f"error {found[0]}")
        self._error = found

    async def run(self) -> None:
        """Look and sample until it is cancelled."""
        asking = asyncio.ensure_future(self._ask())
        next_look = 0.0
        try:
            while True:
                begin = time.monotonic()
                if begin >= next_look:
                    await self.look()
                    next_look = begin + LOOK_S
                await self.sampling.look(begin)
                spent = time.monotonic() - begin
                cycle = max(self.cell.cycle_s, CYCLE_MIN_S)
                await asyncio.sleep(max(cycle - spent, REST * spent, 0.0005))
        finally:
            asking.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await asking
            self.cell.observer.close()

    async def _ask(self) -> None:
        """Fetch monitored symbols of the PLC."""
        while True:
            await asyncio.sleep(ASK_S)
            await ask_plc(self.space, self.sampling.monitored)


async def serve(
    cell: ServedCell, door: Door, ready: Callable[[int], None]
) -> None:
    """Serve until it is cancelled; ``ready`` gets the port.  OSError."""
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    bridge = Bridge(cell, door)
    await bridge.start()
    try:
        ready(bridge.port)
        await bridge.run()
    finally:
        await bridge.stop()
