"""What the shim and the slave say to each other, over a socket pair.

A request is a head and numbers: ``kind``, how many ``cycles``, how many
numbers.  An answer is a head, a text and numbers: ``status``, bytes of text,
how many numbers.  Byte order and sizes are the machine's.  ``shim/wire.h`` says
the same in C.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence
from dataclasses import dataclass

REQUEST = struct.Struct("=IIQ")  # kind, count, cycles
ANSWER = struct.Struct("=III")  # status, text bytes, count
SETUP, STEP, END, HLI = 1, 2, 3, 4
OK, WARNING, ERROR = 0, 1, 3


@dataclass(frozen=True)
class Request:
    """``numbers``: parameters and inputs, or inputs alone."""

    kind: int
    cycles: int
    numbers: tuple[float, ...]


class Wire:
    """The slave's end."""

    def __init__(self, handle: int) -> None:
        self._socket = socket.socket(fileno=handle)

    def request(self) -> Request | None:
        """The next one; None: the importer is gone."""
        head = self._read(REQUEST.size)
        if head is None:
            return None
        kind, count, cycles = REQUEST.unpack(head)
        body = self._read(8 * count) if count else b""
        if body is None:
            return None
        return Request(kind, cycles, struct.unpack(f"={count}d", body))

    def answer(
        self,
        status: int,
        numbers: Sequence[float] = (),
        text: str | bytes = "",
    ) -> None:
        said = text.encode() if isinstance(text, str) else text
        count = len(numbers)
        head = ANSWER.pack(status, len(said), count)
        self._socket.sendall(head + said + struct.pack(f"={count}d", *numbers))

    def _read(self, size: int) -> bytes | None:
        data = self._socket.recv(size, socket.MSG_WAITALL)
        return data if len(data) == size else None
