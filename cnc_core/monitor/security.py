"""Who may ask what: token, Host and Origin, headers of every answer, sizes."""

from __future__ import annotations

import asyncio
import hmac
import secrets
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[MutableMapping[str, Any], Receive, Send], Awaitable[None]]

TOKEN_BYTES = 24
BODY_MAX = 64 * 1024
BODY_S = 5.0  # that an order may take to come
POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "connect-src 'self'",
        "img-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
HEADERS = [
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-store"),
]
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(TOKEN_BYTES)


def same_token(given: object, token: str) -> bool:
    """Compared in constant time."""
    if not isinstance(given, str):
        return False
    # half a surrogate pair, which JSON may hold, is no character
    return hmac.compare_digest(given.encode(errors="replace"), token.encode())


def bearer(headers: Any) -> str:
    """The token of an ``Authorization: Bearer`` header, or an empty text."""
    kind, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if kind.lower() == "bearer" else ""


def host_names(host: str, port: int, more: Iterable[str] = ()) -> set[str]:
    """What the Host header may say: address and port, and names of a proxy."""
    names = {*LOOPBACK, f"[{host}]" if ":" in host else host}
    return {f"{name}:{port}" for name in names} | {n.lower() for n in more}


class Guard:
    """Refuses foreign hosts and origins before anything else looks at them.

    A page of another site has another origin; a name that was bent to this
    address has another host.
    """

    def __init__(self, app: App, hosts: set[str]) -> None:
        self._app, self._hosts = app, hosts

    async def __call__(
        self, scope: MutableMapping[str, Any], receive: Receive, send: Send
    ) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        problem = self._problem(scope["headers"])
        if problem:
            await _refuse(scope, receive, send, problem)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", ()), *HEADERS]
            await send(message)

        await self._app(scope, receive, with_headers)

    def _problem(self, headers: list[tuple[bytes, bytes]]) -> str:
        hosts = _values(headers, b"host")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return "this host is not served"
        for origin in _values(headers, b"origin"):
            _, _, host = origin.partition("://")
            if host not in self._hosts:
                return "this origin is not served"
        return ""


def _values(headers: list[tuple[bytes, bytes]], name: bytes) -> list[str]:
    found = [value for key, value in headers if key == name]
    return [value.decode("latin-1").lower() for value in found]


async def _refuse(
    scope: MutableMapping[str, Any], receive: Receive, send: Send, text: str
) -> None:
    if scope["type"] == "websocket":
        await receive()
        # before it is accepted: the client sees status 403
        await send({"type": "websocket.close", "code": 4403, "reason": text})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), *HEADERS]
    start = {"type": "http.response.start", "status": 403, "headers": headers}
    await send(start)
    await send({"type": "http.response.body", "body": text.encode()})


async def body_of(request: Any) -> bytes | None:
    """The body of a request; None: it is too large.

    TimeoutError: it does not come to its end.
    """
    found = b""
    async with asyncio.timeout(BODY_S):
        async for part in request.stream():
            found += part
            if len(found) > BODY_MAX:
                return None
    return found
