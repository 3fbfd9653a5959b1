"""The web server: one address, few connections, no patience for idle ones."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
from collections.abc import Iterator
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from ..errors import CncError
from .security import App

CONNECTIONS = 64
BACKLOG = 512  # that wait to be looked at
FIRST_REQUEST_S = 5.0
KEEP_ALIVE_S = 15
FRAME_BYTES = 64 * 1024
HEADER_BYTES = 16 * 1024
END_S = 2


class FewConnections(H11Protocol):
    """Closes a connection that says nothing for long, and one too many.

    Where there are too many, the one goes that has been idle for longest, so
    silent ones do not keep a page out; where all are busy, the new one goes.
    """

    _patience: asyncio.TimerHandle | None = None
    _since = 0.0

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._since = self.loop.time()
        if len(self.connections) > CONNECTIONS:
            self._make_room()
        if not transport.is_closing():
            self._patience = self.loop.call_later(FIRST_REQUEST_S, self._look)

    def _make_room(self) -> None:
        idle = [
            each
            for each in self.connections
            if isinstance(each, FewConnections)
            and each.idle
            and each is not self
        ]
        oldest = min(idle, key=lambda each: each._since, default=self)
        self.connections.discard(oldest)
        oldest.transport.abort()

    @property
    def idle(self) -> bool:
        """No request of it is being answered."""
        return self.cycle is None or self.cycle.response_complete

    def _look(self) -> None:
        if self.cycle is None and not self.transport.is_closing():
            self.transport.abort()

    def _be_patient(self) -> None:
        if self._patience is not None:
            self._patience.cancel()

    def handle_websocket_upgrade(self, event: Any) -> None:
        self._be_patient()  # from here on it is the stream's
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        self._be_patient()
        super().connection_lost(exc)


def listening(host: str, port: int, *, exactly: bool) -> socket.socket:
    """A socket at the address; not ``exactly``: at a free port if it is taken.

    CncError: the address cannot be used.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in (port,) if exactly else (port, 0):
        found = socket.socket(family, socket.SOCK_STREAM)
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            found.bind((host, number))
            found.listen(BACKLOG)
        except (OSError, OverflowError) as error:
            found.close()
            problem = error
        else:
            return found
    raise CncError(
        902001, f"the page cannot be served at {host}:{port}: {problem}"
    )


class _Server(uvicorn.Server):
    """Leaves signals to ``serve``."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


async def serve(app: App, at: socket.socket) -> int:
    """Serve until a signal comes; its number, 0 if the server ended by itself."""
    config = uvicorn.Config(
        app,
        http=FewConnections,
        ws="websockets-sansio",
        loop="asyncio",
        lifespan="on",
        log_level="error",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=FRAME_BYTES,
        ws_ping_interval=20.0,
        ws_ping_timeout=20.0,
        h11_max_incomplete_event_size=HEADER_BYTES,
        timeout_keep_alive=KEEP_ALIVE_S,
        timeout_graceful_shutdown=END_S,
        backlog=BACKLOG,
    )
    server = _Server(config)
    came: list[int] = []

    def end(number: int) -> None:
        came.append(number)
        server.should_exit = True

    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end, number)
    try:
        await server.serve(sockets=[at])
    finally:
        at.close()
    return came[0] if came else 0
