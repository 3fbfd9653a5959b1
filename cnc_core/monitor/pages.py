"""One open page: what it gets 20 times a second, and what it may ask for."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import time
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from hli.symbol import Symbol
from hli.view import ArrayView, View

from ..observing.plc import RefusedError
from .channel import FIRST_TRAIL
from .hub import FRAME_S, SAMPLE_S, Hub, as_text
from .security import same_token

SYMBOLS_MAX = 64
PATHS_MAX = 400  # that a page may name; each further one gets no answer
SCOPE_MAX = 8
PATH_MAX = 200
HELLO_S = 15.0  # until the token is said; a busy computer needs some of it
WAITING_MAX = 32  # streams that have not said the token yet
SEND_S = 5.0  # a page that takes no frame for so long is left
MESSAGES_A_SECOND = 20
TOO_MANY = f"not shown: a page gets {SYMBOLS_MAX} symbols"
TOO_LONG = f"not shown: a path has at most {PATH_MAX} characters"
WRONG_TOKEN, TOO_MUCH, TOO_SLOW = 4401, 4429, 4408


class Page:
    """A WebSocket with its channel, its symbols and its place in the trail."""

    def __init__(self, socket: WebSocket, hub: Hub) -> None:
        self._socket, self._hub = socket, hub
        self.id = secrets.token_urlsafe(9)
        client = socket.client.host if socket.client else "?"
        self.who = f"page {self.id[:4]} at {client}"
        self._wanted: list[str] = []
        self._symbols: dict[str, Symbol | None] = {}
        self._problems: dict[str, str] = {}
        self._problems_told = False
        self._life = 0
        self._trail = -1
        self._event = 0
        self._scope: list[str] = []
        self._samples: list[list[Any]] = []

    async def serve(self) -> None:
        """Until it is closed, by either side."""
        hub = self._hub
        hub.pages += 1
        hub.chosen[self.id] = 0
        hub.desk.enter(self.id)
        sending = asyncio.create_task(self._send_frames())
        try:
            hello = {"page": self.id, "who": self.who}
            await self._socket.send_text(as_text({"hello": hello}))
            await self._receive()
        except WebSocketDisconnect:
            pass
        finally:
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await sending
            self._want({})
            hub.pages -= 1
            hub.chosen.pop(self.id, None)
            hub.idle_since = time.monotonic()
            await hub.desk.leave(self.id, self.who)

    # -- what it sends
    async def _receive(self) -> None:
        window, count = time.monotonic(), 0
        while True:
            message = await _text_of(self._socket)
            now = time.monotonic()
            if now - window > 1.0:
                window, count = now, 0
            count += 1
            if count > MESSAGES_A_SECOND:
                await self._socket.close(TOO_MUCH, "too many messages")
                return
            try:
                wanted = json.loads(message)
            except (ValueError, RecursionError):
                continue
            if isinstance(wanted, dict):
                self._choose(wanted.get("channel"))
                await self._subscribe(_paths(wanted.get("subscribe")))
                scope = _paths(wanted.get("scope"))[:SCOPE_MAX]
                self._scope, self._samples = scope, []

    def _choose(self, channel: Any) -> None:
        """The channel that is shown from now on."""
        chosen = channel if type(channel) is int and channel >= 0 else 0
        if chosen != self._hub.chosen[self.id]:
            self._hub.chosen[self.id] = chosen
            self._trail = -1

    async def _subscribe(self, wanted: list[str]) -> None:
        self._wanted = wanted
        found: dict[str, Symbol | None] = {}
        self._problems = dict.fromkeys(wanted[SYMBOLS_MAX:], TOO_MANY)
        self._problems_told = False
        for path in wanted[:SYMBOLS_MAX]:
            if len(path) > PATH_MAX:
                self._problems[path] = TOO_LONG
                continue
            try:
                found[path] = await self._hub.symbol(path)
            except RefusedError as error:
                self._problems[path] = str(error)
                self._problems_told = False
        self._life = self._hub.observer.life
        self._want(found)

    def _want(self, found: dict[str, Symbol | None]) -> None:
        """These symbols from now on; the hub asks for those of the PLC."""
        counts = self._hub.wanted
        for path, symbol in self._symbols.items():
            if symbol is None:
                counts[path] -= 1
                if not counts[path]:
                    del counts[path]
                    self._hub.asked.pop(path, None)
        for path, symbol in found.items():
            if symbol is None:
                counts[path] = counts.get(path, 0) + 1
        self._symbols = found

    # -- what it gets
    async def _send_frames(self) -> None:
        try:
            while True:
                text = as_text(await self._frame())
                async with asyncio.timeout(SEND_S):
                    await self._socket.send_text(text)
                end = time.monotonic() + FRAME_S
                while time.monotonic() < end:
                    await asyncio.sleep(SAMPLE_S)
                    self._sample()
        except TimeoutError:
            await self._socket.close(TOO_SLOW, "the page takes no frames")

    def _sample(self) -> None:
        """One row of the scope."""
        sight = self._hub.observer.sight
        if sight is None or not self._scope:
            return
        row = [self._value(path) for path in self._scope]
        self._samples.append([round(sight.cell_s, 4), *row])

    async def _frame(self) -> dict[str, Any]:
        hub = self._hub
        if self._life != hub.observer.life and hub.observer.sight:
            # the memory of the new CNC is another one
            self._trail = -1
            await self._subscribe(self._wanted)
        found = hub.frame(hub.chosen[self.id])
        found["sent_ms"] = round(time.monotonic() * 1e3, 1)
        found |= self._new_trail()
        found["events"] = hub.events.since(self._event)
        self._event = hub.events.last
        found["values"] = self._values() if hub.observer.sight else {}
        if not self._problems_told:  # they may be long: once
            found["problems"], self._problems_told = self._problems, True
        found["scope"], found["samples"] = self._scope, self._samples
        self._samples = []
        return found

    def _new_trail(self) -> dict[str, Any]:
        """The samples behind those that the page has."""
        channel = self._hub.channel(self._hub.chosen[self.id])
        if channel is None:
            return {"trail": [], "trail_new": False}
        end, fresh = channel.trail_end, self._trail < 0
        begin = end - FIRST_TRAIL * 5 if fresh else self._trail
        self._trail = end
        return {"trail": channel.trail(max(0, begin)), "trail_new": fresh}

    def _values(self) -> dict[str, Any]:
        return {path: self._value(path) for path in self._symbols}

    def _value(self, path: str) -> Any:
        symbol = self._symbols.get(path)
        if symbol is None:
            return self._hub.asked.get(path)
        return plain(symbol.value)


def _paths(value: Any) -> list[str]:
    """Symbol paths that a page names, each once."""
    if not isinstance(value, list):
        return []
    found = dict.fromkeys(p for p in value if isinstance(p, str))
    return [*found][:PATHS_MAX]


async def _text_of(socket: WebSocket) -> str:
    """The next message; of one in bytes nothing is understood."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1005))
    return message.get("text") or ""


def plain(value: Any) -> Any:
    """A single value as JSON has it; what has members tells so."""
    if isinstance(value, bytes):
        return value.decode("latin-1")
    if isinstance(value, (View, ArrayView, tuple)):
        return "(has members)"
    return value


class Gate:
    """Where streams wait until they have said the token.

    Of too many the one goes that has waited for longest.
    """

    def __init__(self) -> None:
        self._waiting: dict[asyncio.Task[str | None], None] = {}

    async def pass_(self, socket: WebSocket, token: str) -> bool:
        """Accept, and wait for the token as the first message."""
        await socket.accept()
        hearing = asyncio.ensure_future(_first_words(socket))
        self._waiting[hearing] = None
        if len(self._waiting) > WAITING_MAX:
            next(iter(self._waiting)).cancel()
        try:
            given = await hearing
        except WebSocketDisconnect:
            return False
        except TimeoutError:  # not wrong: the page may come again
            await socket.close(TOO_SLOW, "no token came in time")
            return False
        except asyncio.CancelledError:
            if not hearing.cancelled():
                raise  # the server ends
            await socket.close(TOO_SLOW, "too many streams wait")
            return False
        finally:
            hearing.cancel()
            self._waiting.pop(hearing, None)
        if same_token(given, token):
            return True
        await socket.close(WRONG_TOKEN, "the token is wrong")
        return False


async def _first_words(socket: WebSocket) -> str | None:
    """The token that a stream says; None: what it says holds none.

    TimeoutError: it says nothing.
    """
    try:
        async with asyncio.timeout(HELLO_S):
            first = json.loads(await _text_of(socket))
    except (ValueError, RecursionError):
        return None
    given = first.get("token") if isinstance(first, dict) else None
    return given if isinstance(given, str) else None
