"""Frames that are wrong: refused or ignored, and the cell goes on."""

from __future__ import annotations

import contextlib
import gc
import os
import random
import socket
import struct
import time
from pathlib import Path

import pytest

from support import malformed
from support.bridged import ADS_HOST, ADS_PORT, Bridged

FEED = b"gpCh[0]^.bahn_state.active_feed_r\0"
PAGE = os.sysconf("SC_PAGE_SIZE")
WAIT_S = 20.0
GROWTH_MAX = 24 << 20


def resident() -> int:
    """Bytes of this process in memory, with the server in it."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def question(command: int, data: bytes) -> bytes:
    """A right frame."""
    body = malformed.HEAD.pack(
        bytes([127, 0, 0, 1, 1, 1]),
        851,
        bytes(6),
        1,
        command,
        4,
        len(data),
        0,
        7,
    )
    body += data
    return struct.pack("<HI", 0, len(body)) + body


def value_by_name(connection: socket.socket, name: bytes) -> bytes:
    """The data of an answer."""
    head = struct.pack("<4I", 0xF004, 0, 4, len(name))
    connection.sendall(question(9, head + name))
    data = b""
    while len(data) < 38 + 8 + 4:
        part = connection.recv(4096)
        assert part, "the server has left"
        data += part
    return data[38 + 8 :]


def connected() -> socket.socket:
    """A connection to the server."""
    return socket.create_connection((ADS_HOST, ADS_PORT), 20.0)


def throw(seed: int, count: int) -> None:
    """Malformed frames over connections that are made anew when they are lost."""
    rng = random.Random(seed)
    connection = connected()
    for _ in range(count):
        with contextlib.suppress(OSError):
            connection.sendall(malformed.ads(rng))
            if rng.random() < 0.9:
                continue
        connection.close()
        connection = connected()
    connection.close()


def unharmed(bridged: Bridged) -> None:
    """The server answers right, the PLC scans on."""
    bridged.channel.bahn_state.active_feed_r = 1357
    with connected() as connection:
        found = value_by_name(connection, FEED)
    assert struct.unpack("<i", found) == (1357,)
    with connected() as connection:
        assert value_by_name(connection, b"MAIN.count\0")


@pytest.mark.parametrize("seed", [1, 2])
def test_malformed_frames_do_no_harm(bridged: Bridged, seed: int) -> None:
    """Right questions are answered right behind them."""
    throw(seed, 200)
    unharmed(bridged)


@pytest.mark.long
def test_ten_thousand_malformed_frames_and_no_growth(bridged: Bridged) -> None:
    """The memory of the server does not grow with them."""
    throw(100, 1000)
    before = resident()
    for seed in range(10):
        throw(seed, 1000)
    unharmed(bridged)
    assert resident() - before < GROWTH_MAX
    assert len(bridged.server.connections) <= 2


def test_a_client_that_does_not_read_is_left(bridged: Bridged) -> None:
    """What it asked for does not pile up in the server."""
    upload = struct.pack("<III", 0xF00B, 0, 1 << 24)
    with connected() as connection:
        left = bridged.server.refused
        with contextlib.suppress(OSError):
            connection.sendall(question(2, upload) * 2000)
        end = time.monotonic() + WAIT_S
        while bridged.server.refused == left:
            assert time.monotonic() < end, "the server keeps the client"
            time.sleep(0.005)
    unharmed(bridged)


def test_frames_may_come_in_pieces(bridged: Bridged) -> None:
    """Byte by byte, and several at once."""
    bridged.channel.bahn_state.active_feed_r = 24
    head = struct.pack("<4I", 0xF004, 0, 4, len(FEED))
    frame = question(9, head + FEED)
    with connected() as connection:
        for byte in frame:
            connection.sendall(bytes([byte]))
        connection.sendall(frame * 3)
        data = b""
        while len(data) < 4 * 50:
            data += connection.recv(4096)
    answers = [data[k : k + 50] for k in range(0, 200, 50)]
    assert [one[-4:] for one in answers] == [struct.pack("<i", 24)] * 4


def test_answers_keep_the_order_of_the_questions(bridged: Bridged) -> None:
    """Also where the PLC has to be asked for the first one."""
    names = [b"Slow.n\0", FEED, b"MAIN.count\0", FEED]
    with connected() as connection:
        for k, name in enumerate(names):
            head = struct.pack("<4I", 0xF004, 0, 4, len(name))
            frame = bytearray(question(9, head + name))
            frame[34:38] = struct.pack("<I", 100 + k)
            connection.sendall(frame)
        data = b""
        while len(data) < 4 * 50:
            data += connection.recv(4096)
    invoked = [struct.unpack_from("<I", data, 50 * k + 34)[0] for k in range(4)]
    assert invoked == [100, 101, 102, 103]
