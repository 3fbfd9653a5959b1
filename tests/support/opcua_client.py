"""Short ways of asyncua's client to the nodes of a cell; needs asyncua."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import asyncua

ua: Any = asyncua.ua
CNC = "http://opcfoundation.org/UA/CNC"
SYMBOLS = "urn:hli-cosim:symbols"
WAIT_S = 20.0


class Session:
    """A client with short ways to nodes."""

    def __init__(self, client: Any, names: list[str]) -> None:
        self.client = client
        self._cnc, self._own = names.index(CNC), names.index(SYMBOLS)

    def cnc(self, path: str) -> Any:
        """A node of OPC 40502."""
        return self.client.get_node(ua.NodeId(path, self._cnc))

    def symbol(self, path: str) -> Any:
        """A node of a symbol."""
        return self.client.get_node(ua.NodeId(path, self._own))


@asynccontextmanager
async def session(
    url: str, user: str = "", security: str = ""
) -> AsyncIterator[Session]:
    """A client's session, anonymous or not; ``security`` as asyncua has it."""
    client = asyncua.Client(url)
    if user:
        client.set_user(user)
        client.set_password("secret")
    if security:
        await client.set_security_string(security)
    async with client:
        yield Session(client, await client.get_namespace_array())


class Told:
    """What a subscription tells."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.events: list[Any] = []

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        self.values.append(value)

    def event_notification(self, event: Any) -> None:
        self.events.append(event)


async def until(condition: Callable[[], bool]) -> None:
    """Wait for it; it fails after a while."""
    for _ in range(int(WAIT_S / 0.01)):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("it did not come")
