"""The server: connections, who may connect, how much each may hold."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import struct
from collections import deque
from collections.abc import Awaitable
from dataclasses import dataclass, field
from typing import Any

from ..symbols.cell import ServedCell
from .codes import AdsError, Code, Command
from .devices import Devices
from .frames import (
    ADS,
    AMS,
    NET_ID,
    PORT_CLOSE,
    PORT_CONNECT,
    RESPONSE,
    TCP_HEAD,
    BadFrameError,
    Frame,
    frame_of,
    split,
)
from .session import Session
from .values import UINT

PORT = 48_898
CONNECTIONS_MAX = 64
UNSENT_MAX = 8 << 20
"""Bytes that a client may leave unread before it is left."""
WAITING_MAX = 256
WITH_NUMBER = (Command.READ, Command.READ_WRITE, Command.ADD_NOTIFICATION)
"""Commands whose answers have a length or a handle behind the result."""
FIRST_LOCAL_PORT = 32_768


@dataclass
class Rules:
    """Who may ask: AMS net ids; none given: everybody who can connect."""

    own_id: bytes = bytes([127, 0, 0, 1, 1, 1])
    allowed: set[bytes] = field(default_factory=set)

    def allows(self, source: bytes) -> bool:
        """A client with this AMS net id is served."""
        return not self.allowed or source in self.allowed


class Server:
    """Serves one cell over AMS/TCP."""

    def __init__(self, cell: ServedCell, rules: Rules) -> None:
        self.devices = Devices(cell)
        self.rules = rules
        self.connections: set[Connection] = set()
        self.refused = 0  # frames and clients
        self._ports = 0
        self._server: asyncio.Server | None = None

    async def start(self, host: str, port: int) -> tuple[str, int]:
        """Listen; the address.  OSError."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: Connection(self), host, port, backlog=CONNECTIONS_MAX
        )
        found: tuple[str, int] = self._server.sockets[0].getsockname()[:2]
        return found

    async def close(self) -> None:
        """Leave all clients."""
        if self._server is not None:
            self._server.close()
        for connection in [*self.connections]:
            connection.leave()
        await asyncio.sleep(0)

    def next_port(self) -> int:
        """An AMS port for a client that has no router of its own."""
        self._ports = (self._ports + 1) % 16_384
        return FIRST_LOCAL_PORT + self._ports


class Connection(asyncio.Protocol):
    """One TCP connection; clients behind a router share it."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._buffer = bytearray()
        self._session: Session | None = None
        self._transport: Any = None
        self._later: deque[Frame] = deque()
        self._task: asyncio.Task[None] | None = None

    # -- life
    def connection_made(self, transport: Any) -> None:
        self._transport = transport
        server = self._server
        if len(server.connections) >= CONNECTIONS_MAX:
            server.refused += 1
            transport.abort()
            return
        server.connections.add(self)
        self._session = Session(server.devices, self.send)

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.connections.discard(self)
        if self._task is not None:
            self._task.cancel()
        if self._session is not None:
            self._session.close()
        self._later.clear()
        self._buffer.clear()

    def leave(self) -> None:
        """Close the connection."""
        self._transport.abort()

    def send(self, data: bytes) -> None:
        """Send; a client that does not read is left."""
        transport = self._transport
        if transport.is_closing():
            return
        transport.write(data)
        if transport.get_write_buffer_size() > UNSENT_MAX:
            self._server.refused += 1
            transport.abort()

    # -- frames
    def data_received(self, data: bytes) -> None:
        if self._session is None:
            return
        self._buffer += data
        try:
            while (found := split(self._buffer)) is not None:
                self._take(*found)
                if self._transport.is_closing():
                    return
        except BadFrameError:
            self._server.refused += 1
            self.leave()

    def _take(self, kind: int, body: bytes) -> None:
        if kind == AMS:
            frame = frame_of(body)
            if not self._server.rules.allows(frame.source):
                raise BadFrameError("not allowed")
            if frame.flags & RESPONSE or not frame.flags & ADS:
                return  # nobody was asked
            self._serve(frame)
        elif kind in (PORT_CONNECT, NET_ID):
            own = self._server.rules.own_id
            if kind == PORT_CONNECT:
                own += struct.pack("<H", self._server.next_port())
            self.send(TCP_HEAD.pack(kind, len(own)) + own)
        elif kind == PORT_CLOSE:
            self.send(TCP_HEAD.pack(kind, 0))
            self._transport.close()

    def _serve(self, frame: Frame) -> None:
        if self._later:  # answers keep the order of the questions
            self._keep(frame)
            return
        assert self._session is not None
        try:
            answer = self._session.answer(frame)
        except AdsError as error:
            self._refuse(frame, error.code)
            return
        if isinstance(answer, bytes):
            self.send(frame.answer(answer))
            return
        self._later.append(frame)
        self._task = asyncio.ensure_future(self._work(answer))

    def _keep(self, frame: Frame) -> None:
        if len(self._later) >= WAITING_MAX:
            raise BadFrameError("too many frames wait")
        self._later.append(frame)

    async def _work(self, first: Awaitable[bytes]) -> None:
        """The PLC is asked; what came meanwhile is answered after it."""
        assert self._session is not None
        answer: bytes | Awaitable[bytes] | None = first
        while self._later:
            frame = self._later[0]
            try:
                if answer is None:
                    answer = self._session.answer(frame)
                data = answer if isinstance(answer, bytes) else await answer
            except AdsError as error:
                self._refuse(frame, error.code)
            else:
                self.send(frame.answer(data))
            answer = None
            self._later.popleft()

    def _refuse(self, frame: Frame, code: Code) -> None:
        """The error as the result of the command."""
        self._server.refused += 1
        if code in (Code.NO_TARGET_PORT, Code.SERVICE_NOT_SUPPORTED):
            self.send(frame.answer(b"", code))
            return
        self.send(frame.answer(UINT.pack(code).ljust(_shortest(frame), b"\0")))


def _shortest(frame: Frame) -> int:
    """Bytes of an answer that has nothing but its result."""
    return 8 if frame.command in WITH_NUMBER else 4


async def serve(
    cell: ServedCell, rules: Rules, host: str, port: int, ready: Any
) -> None:
    """Serve until it is cancelled; ``ready`` gets the address.  OSError."""
    server = Server(cell, rules)
    await cell.look()
    address = await server.start(host, port)
    ready(*address)
    looking: asyncio.Task[None] = asyncio.ensure_future(cell.run())
    try:
        await looking
    finally:
        await server.close()
        looking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await looking


def is_loopback(host: str) -> bool:
    """Nobody else can reach the address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
