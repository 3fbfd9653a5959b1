"""Frames on the wire: the head of AMS/TCP, the head of AMS, what follows."""

from __future__ import annotations

import struct
from dataclasses import dataclass

TCP_HEAD = struct.Struct("<HI")  # what it is, bytes that follow
AMS_HEAD = struct.Struct("<6sH6sHHHIII")
FRAME_MAX = 4 << 20
"""Bytes of the longest frame that is read or sent."""
AMS = 0
PORT_CLOSE = 1
PORT_CONNECT = 0x1000
NET_ID = 0x1002
RESPONSE = 0x0001
ADS = 0x0004
FILETIME_1970 = 116_444_736_000_000_000
"""Steps of 100 ns from 1601 to 1970."""


class BadFrameError(Exception):
    """Bytes that are no frame; the connection cannot go on."""


@dataclass(frozen=True)
class Frame:
    """A command of a client."""

    target: bytes
    target_port: int
    source: bytes
    source_port: int
    command: int
    flags: int
    invoke: int
    data: bytes

    def answer(self, data: bytes, error: int = 0) -> bytes:
        """The response as it is sent."""
        head = AMS_HEAD.pack(
            self.source,
            self.source_port,
            self.target,
            self.target_port,
            self.command,
            ADS | RESPONSE,
            len(data),
            error,
            self.invoke,
        )
        return TCP_HEAD.pack(AMS, len(head) + len(data)) + head + data


def split(buffer: bytearray) -> tuple[int, bytes] | None:
    """Take a whole frame from the front: kind and what follows; None: wait.

    BadFrameError: it is too long, or of an unknown kind.
    """
    if len(buffer) < TCP_HEAD.size:
        return None
    kind, length = TCP_HEAD.unpack_from(buffer)
    if kind not in (AMS, PORT_CLOSE, PORT_CONNECT, NET_ID):
        raise BadFrameError(f"kind {kind:#x}")
    if length > FRAME_MAX:
        raise BadFrameError(f"{length} bytes")
    end = TCP_HEAD.size + length
    if len(buffer) < end:
        return None
    body = bytes(buffer[TCP_HEAD.size : end])
    del buffer[:end]
    return kind, body


def frame_of(body: bytes) -> Frame:
    """The command in a frame.  BadFrameError: its head is wrong."""
    if len(body) < AMS_HEAD.size:
        raise BadFrameError("no head of AMS")
    target, to_port, source, from_port, command, flags, length, _, invoke = (
        AMS_HEAD.unpack_from(body)
    )
    data = body[AMS_HEAD.size :]
    if length != len(data):
        raise BadFrameError(f"{len(data)} bytes of {length}")
    return Frame(
        target, to_port, source, from_port, command, flags, invoke, data
    )


def notification(to: Frame, data: bytes) -> bytes:
    """A notification to the client that asked for it by this frame."""
    head = AMS_HEAD.pack(
        to.source,
        to.source_port,
        to.target,
        to.target_port,
        8,
        ADS,
        len(data),
        0,
        0,
    )
    return TCP_HEAD.pack(AMS, len(head) + len(data)) + head + data


def filetime(unix_ns: int) -> int:
    """A time stamp of ADS."""
    return unix_ns // 100 + FILETIME_1970


def net_id(text: str) -> bytes:
    """``127.0.0.1.1.1`` as six bytes.  ValueError."""
    parts = [int(part) for part in text.split(".")]
    if len(parts) != 6 or not all(0 <= part <= 255 for part in parts):
        raise ValueError(f"AMS net id {text!r}: six numbers 0..255 with dots")
    return bytes(parts)
