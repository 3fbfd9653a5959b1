"""A scanner of the monitor's server changes nothing and crashes nothing."""

from __future__ import annotations

import json
import os
import random
import socket
import subprocess
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from http.client import HTTPConnection

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

import hli
from cnc_core.monitor.pages import TOO_SLOW, WAITING_MAX
from cnc_core.monitor.server import CONNECTIONS, FRAME_BYTES
from support.command_line import command
from support.fake_cnc import unique_name
from support.seeds import few

ROUTES = (
    "/",
    "/page/main.js",
    "/api/start",
    "/api/cells",
    "/api/layout",
    "/api/route?cell=",
    "/api/recording?name=",
    "/api/recording/contour?time=0",
    "/api/act",
    "/api/raw",
    "/api/live?cell=",
    "/none",
)
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "TRACE", "OPTIONS", "X")
WAIT_S = 20.0


@dataclass
class Server:
    """A monitor beside a segment, as a process."""

    name: str
    port: int
    token: str
    process: subprocess.Popen[str]
    root: bytes  # of the memory, when it began
    segment: hli.Segment

    def ask(self, method: str, path: str, **headers: str) -> int:
        """The status of an answer."""
        asked = HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)
        with closing(asked) as connection:
            names = {k.replace("_", "-"): v for k, v in headers.items()}
            connection.request(method, path, "{}", names)
            return connection.getresponse().status

    @property
    def descriptors(self) -> int:
        """Files that the process holds open."""
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def lives(self) -> None:
        """It answers, and no byte of the cell has changed."""
        ours = f"Bearer {self.token}"
        assert self.ask("GET", "/api/cells", authorization=ours) == 200
        assert self.process.poll() is None
        assert self.segment.memory is not None
        assert self.segment.memory[:] == self.root


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """The server of one cell."""
    name = unique_name()
    with hli.create(name) as segment:
        process = subprocess.Popen(
            command("monitor", name, "--port", 0),
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout is not None
            address = process.stdout.readline().strip()
            base, _, token = address.partition("/#token=")
            port = int(base.rpartition(":")[2])
            assert segment.memory is not None
            root = segment.memory[:]
            yield Server(name, port, token, process, root, segment)
        finally:
            process.terminate()
            process.communicate()


@pytest.mark.ci_cases
@pytest.mark.parametrize("method", METHODS)
def test_every_route_by_every_method(server: Server, method: str) -> None:
    """Without a token, with a wrong one, from elsewhere: no fact, no deed."""
    cases: tuple[dict[str, str], ...] = (
        {},
        {"authorization": "Bearer x"},
        {"origin": "http://evil.example"},
        {"host": "evil.example"},
    )
    for path in ROUTES:
        for case in cases:
            status = server.ask(method, path, **case)
            public = path in ROUTES[:2] and method in ("GET", "HEAD")
            foreign = "origin" in case or "host" in case
            wanted = (200,) if public and not foreign else range(400, 500)
            assert status in wanted, (path, case)
    server.lives()


def test_oversized_frames_end_the_stream(server: Server) -> None:
    """Code 1009, ahead of the token and behind it."""
    address = f"ws://127.0.0.1:{server.port}/api/live?cell={server.name}"
    for greeted in (False, True):
        with connect(address, proxy=None) as live:
            if greeted:
                live.send(json.dumps({"token": server.token}))
                assert "hello" in json.loads(live.recv(WAIT_S))
            with suppress(ConnectionClosed):
                live.send("x" * (FRAME_BYTES + 1))
            with suppress(ConnectionClosed):
                while True:
                    live.recv(WAIT_S)
            assert live.close_code == 1009
    server.lives()


def test_a_foreign_origin_gets_no_stream(server: Server) -> None:
    """Refused before it is accepted."""
    address = f"ws://127.0.0.1:{server.port}/api/live?cell={server.name}"
    origin = Origin("https://evil.example")
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(address, origin=origin, proxy=None),
    ):
        pass
    assert refused.value.response.status_code == 403
    server.lives()


@pytest.mark.parametrize("count", few([300, 10_000], 1))
def test_many_connections_at_once(server: Server, count: int) -> None:
    """Silent ones: no more are open than are allowed, and whoever asks is
    answered beside them.
    """
    held: deque[socket.socket] = deque()
    server.lives()  # the first request opens what the server keeps
    before = server.descriptors
    with ExitStack() as stack:
        for k in range(count):
            held.append(silent(server, stack))
            if len(held) > 2 * CONNECTIONS:
                held.popleft().close()
            if k % 100 == 99:
                server.lives()
        assert sum(not is_closed(each) for each in held) <= CONNECTIONS
        assert settles(server, before + CONNECTIONS)
    assert settles(server, before)
    server.lives()


def settles(server: Server, most: int) -> bool:
    """So many descriptors at most, once those on their way out are closed."""
    until = time.monotonic() + WAIT_S
    while server.descriptors > most and time.monotonic() < until:
        time.sleep(0.05)
    return server.descriptors <= most


def silent(server: Server, stack: ExitStack) -> socket.socket:
    """A connection that says nothing."""
    address = "127.0.0.1", server.port
    return stack.enter_context(socket.create_connection(address, WAIT_S))


def is_closed(each: socket.socket) -> bool:
    """Whether the server has ended a connection."""
    each.setblocking(False)
    try:
        return each.recv(1) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


def test_silent_streams_keep_no_page_out(server: Server) -> None:
    """More streams wait for a token than pages may be open: a page with the
    token gets its frames, and those that waited for longest are left.
    """
    address = f"ws://127.0.0.1:{server.port}/api/live?cell={server.name}"
    with ExitStack() as stack:
        waiting = [
            stack.enter_context(connect(address, proxy=None))
            for _ in range(WAITING_MAX + 1)
        ]
        live = stack.enter_context(connect(address, proxy=None))
        live.send(json.dumps({"token": server.token}))
        assert "hello" in json.loads(live.recv(WAIT_S))
        with pytest.raises(ConnectionClosed):
            waiting[0].recv(WAIT_S)
        assert waiting[0].close_code == TOO_SLOW
    server.lives()


@pytest.mark.ci
def test_an_order_that_does_not_end_is_left(server: Server) -> None:
    """Its body stays out: status 408, with the token, too."""
    head = (
        f"POST /api/act HTTP/1.1\r\nhost: 127.0.0.1:{server.port}\r\n"
        f"authorization: Bearer {server.token}\r\n"
        "content-type: application/json\r\ncontent-length: 60000\r\n\r\n{"
    )
    at = "127.0.0.1", server.port
    with socket.create_connection(at, timeout=WAIT_S) as connection:
        connection.sendall(head.encode())
        assert connection.recv(4096).startswith(b"HTTP/1.1 408")
    server.lives()


def test_bytes_that_are_no_request(server: Server) -> None:
    """Noise, endless heads and half requests are answered by 400 or an end."""
    noise = random.Random(1)
    heads = [
        noise.randbytes(500),
        b"GET / HTTP/1.1\r\n" + b"x: " + b"y" * 100_000 + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\nhost: a\r\nhost: b\r\n\r\n",
        b"POST /api/act HTTP/1.1\r\ncontent-length: -1\r\n\r\n",
        b"GET /api/live HTTP/1.1\r\nupgrade: websocket\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ]
    for head in heads:
        at = "127.0.0.1", server.port
        with (
            socket.create_connection(at, timeout=WAIT_S) as connection,
            suppress(OSError),
        ):
            connection.sendall(head)
            connection.shutdown(socket.SHUT_WR)
            answer = connection.recv(4096)
            assert not answer.startswith(b"HTTP/1.1 200"), head[:60]
    server.lives()
