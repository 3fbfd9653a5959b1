"""What other processes ask of a running PLC or CNC: force, unforce, read
(``hli-cosim force`` from another terminal), the answer to a dialog.

A process listens on a Unix socket in Linux's abstract namespace, named after
its side, the user, the segment and a random number: no file is left behind by a
killed process, and nobody can take the name first.  Who has an order finds the
sockets of the segment in ``/proc/net/unix`` and takes the one of its own user.
Both ends check that the other one belongs to the same user.  One connection is
one order: a line of JSON there, a line back.

A thread takes orders and sleeps otherwise.  Those of a PLC are obeyed by the
scan runtime between two scans (also while the PLC waits for a CNC that stands),
so a task never sees a value change in the middle of its logic.
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Any

from .errors import HliAccessError, HliError, HliNotFound, HliTimeout
from .segment import check_name

ANSWER_S = 5.0
"""How long an order waits for a scan."""
_LINE_S = 2.0  # a client that connects and says nothing
_LINE_MAX = 1 << 24  # the list of a large program's symbols
_SOCKETS = "/proc/net/unix"
_LISTENS = 0x10000  # __SO_ACCEPTCON of Linux
_BIND_TRIES, _BIND_PAUSE_S = 10, 0.05  # the process before may just be leaving
# connections that nobody has accepted yet: all tries of one that wants the name
# fit, for where the queue is full nobody seems to listen
_BACKLOG = 64

Order = dict[str, Any]


PLC, CNC = "plc", "cnc"
_SAID = {PLC: "PLC", CNC: "CNC"}


def prefix(name: str, side: str = PLC) -> str:
    """How the sockets of one side on this segment, of this user, begin."""
    return f"hli-cosim-{side}-{os.getuid()}-{name}/"


def listening_on(name: str, side: str = PLC) -> list[str]:
    """Names of the sockets that claim to be of this side, the oldest first.

    Anybody may have bound one.
    """
    begin, found = "@" + prefix(name, side), set[str]()
    with open(_SOCKETS, encoding="utf-8", errors="replace") as file:
        file.readline()  # the heads of the columns
        for line in file:
            fields = line.split(maxsplit=7)
            if (
                len(fields) == 8
                and int(fields[3], 16) & _LISTENS
                and fields[7].startswith(begin)
            ):
                found.add(fields[7].rstrip("\n")[1:])
    return sorted(found)


def _connected(name: str, side: str) -> socket.socket | None:
    """A connection to the process of this user on the segment, if there is one.

    HliAccessError: only other users listen there.
    """
    foreign = False
    for each in listening_on(name, side):
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            # never waits: a full queue is an error at once
            connection.setblocking(False)
            connection.connect("\0" + each)
            _check_user(connection)
        except (OSError, HliAccessError) as error:
            connection.close()
            foreign |= isinstance(error, HliAccessError)
        else:
            return connection
    if foreign:
        raise HliAccessError(f"another user listens on segment {name!r}")
    return None


class Orders:
    """Orders of other processes, kept until the scan runtime has time.

    ``waiting``: whether there is one.  ``side``: whose orders they are.
    """

    side = PLC

    def __init__(self) -> None:
        self.waiting = False
        self._socket: socket.socket | None = None
        self._given: list[tuple[Order, list[Order]]] = []
        self._changed = threading.Condition()

    # -- the runtime's side
    def serve(self, obey: Callable[[Order], Order]) -> None:
        """Obey what waits; what ``obey`` raises is the order's answer and
        nobody else's matter.
        """
        with self._changed:
            given, self._given, self.waiting = self._given, [], False
            for order, answer in given:
                try:
                    answer.append(obey(order))
                except (
                    Exception
                ) as error:  # the other process is told, the PLC goes on
                    answer.append({"error": str(error) or type(error).__name__})
            self._changed.notify_all()

    # -- the socket's side
    def open(self, name: str) -> None:
        """Listen.  HliError: another process of this user listens there already."""
        for _ in range(_BIND_TRIES):
            if not _taken(name, self.side):
                break
            time.sleep(_BIND_PAUSE_S)
        else:
            raise HliError(
                f"orders for the {_SAID[self.side]} on {name!r} cannot be taken: "
                "another process takes them"
            )
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        # the clock first: of two, the older one is asked
        token = f"{time.monotonic_ns():020}-{secrets.token_hex(8)}"
        try:
            listening.bind(f"\0{prefix(name, self.side)}{token}")
            listening.listen(_BACKLOG)
        except OSError as error:
            listening.close()
            raise HliError(
                f"orders for the {_SAID[self.side]} on {name!r} cannot be taken:"
                f" {error.strerror}"
            ) from None
        self._socket = listening
        threading.Thread(
            target=self._listen, args=(listening,), name="orders", daemon=True
        ).start()

    def close(self) -> None:
        """Give the name back."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)  # wakes the thread
            self._socket.close()
            self._socket = None

    def _listen(self, listening: socket.socket) -> None:
        while True:
            try:
                connection, _ = listening.accept()
            except OSError:
                return
            with (
                connection,
                contextlib.suppress(
                    OSError, ValueError, TypeError, RecursionError, HliError
                ),
            ):
                _check_user(connection)
                connection.settimeout(_LINE_S)
                connection.sendall(
                    _line(self._pass_on(json.loads(_read_line(connection))))
                )

    def _pass_on(self, order: Order) -> Order:
        answer: list[Order] = []
        entry = (order, answer)
        with self._changed:
            self._given.append(entry)
            self.waiting = True
            self._changed.wait_for(lambda: answer, ANSWER_S)
            if not answer:  # not obeyed, and not later either
                self._given = [e for e in self._given if e is not entry]
                problem = (
                    f"the PLC has made no scan for {ANSWER_S:g} s; "
                    "does it wait for its CNC?"
                )
                return {"error": problem}
        return answer[0]


class OrdersAtOnce(Orders):
    """Orders that the listening thread obeys itself, as they come."""

    def __init__(self, side: str, obey: Callable[[Order], Order]) -> None:
        super().__init__()
        self.side, self._obey = side, obey

    def _pass_on(self, order: Order) -> Order:
        try:
            return self._obey(order)
        except (
            Exception
        ) as error:  # the other process is told, this one goes on
            return {"error": str(error) or type(error).__name__}


def send(
    name: str, order: Order, wait_s: float = 0.0, side: str = PLC
) -> Order:
    """Give an order to the PLC on this segment, waiting ``wait_s`` seconds for
    it to be there, and wait for its answer.  ``side`` CNC: to the CNC.

    Raises HliNotFound (no such process there), HliTimeout, HliAccessError;
    ValueError with the other's words: it refuses.
    """
    end = time.monotonic() + wait_s
    check_name(name)
    while (connection := _connected(name, side)) is None:
        if time.monotonic() >= end:
            running = f"is hli-cosim {side} running?"
            raise HliNotFound(
                f"no {_SAID[side]} process listens on segment {name!r}; {running}"
            )
        time.sleep(_BIND_PAUSE_S)
    with connection:
        connection.settimeout(2.0 * ANSWER_S)
        try:
            connection.sendall(_line(order))
            answer: Order = json.loads(_read_line(connection))
            if not isinstance(answer, dict):
                raise ValueError("an answer is a table")
        except (OSError, ValueError, RecursionError):
            raise HliTimeout(
                f"the {_SAID[side]} on segment {name!r} did not answer"
            ) from None
    if "error" in answer:
        raise ValueError(answer["error"])
    return answer


def _taken(name: str, side: str) -> bool:
    """A process of this user takes orders for the segment already."""
    try:
        connection = _connected(name, side)
    except HliAccessError:
        return False
    if connection is None:
        return False
    connection.close()
    return True


def _line(value: Order) -> bytes:
    return json.dumps(value).encode() + b"\n"


def _read_line(connection: socket.socket) -> bytes:
    """Up to the line's end.  ValueError: none came, or too much."""
    data = b""
    while not data.endswith(b"\n"):
        part = connection.recv(65536)
        data += part
        if not part or len(data) > _LINE_MAX:
            raise ValueError("no whole line")
    return data


def _check_user(connection: socket.socket) -> None:
    credentials = connection.getsockopt(
        socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i")
    )
    _, user, _ = struct.unpack("3i", credentials)
    if user != os.getuid():
        raise HliAccessError(
            "the process at the other end belongs to another user"
        )
