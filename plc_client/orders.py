"""What other processes ask of a running PLC: force, unforce, read (``hli-cosim
force`` from another terminal).

A PLC process listens on a Unix socket in Linux's abstract namespace, named
after the user and the segment: no file is left behind by a killed process, and
the name is free again the moment the process is gone.  Both ends check that the
other one belongs to the same user.  One connection is one order: a line of JSON
there, a line back.

A thread takes orders and sleeps otherwise; they are obeyed by the scan runtime
between two scans (also while the PLC waits for a CNC that stands), so a task
never sees a value change in the middle of its logic.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Any

from hli.errors import HliAccessError, HliError, HliNotFound, HliTimeout
from hli.segment import check_name

ANSWER_S = 5.0
"""How long an order waits for a scan."""
_LINE_S = 2.0  # a client that connects and says nothing
_LINE_MAX = 1 << 20
_BIND_TRIES, _BIND_PAUSE_S = 10, 0.05  # the process before may just be leaving

Order = dict[str, Any]


def address(name: str) -> str:
    """The socket of the PLC on this segment, of this user."""
    return f"\0hli-cosim-plc-{os.getuid()}-{name}"


class Orders:
    """Orders of other processes, kept until the scan runtime has time.

    ``waiting``: whether there is one.
    """

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
        for turn in range(_BIND_TRIES):
            listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            try:
                listening.bind(address(name))
                listening.listen(8)
                break
            except OSError as error:
                listening.close()
                if turn == _BIND_TRIES - 1:
                    raise HliError(
                        f"orders for the PLC on {name!r} cannot be taken: {error.strerror}"
                    ) from None
                time.sleep(_BIND_PAUSE_S)
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
                contextlib.suppress(OSError, ValueError, TypeError, HliError),
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


def send(name: str, order: Order, wait_s: float = 0.0) -> Order:
    """Give an order to the PLC on this segment, waiting ``wait_s`` seconds for
    it to be there, and wait for its answer.

    Raises HliNotFound (no PLC process there), HliTimeout, HliAccessError;
    ValueError with the PLC's words: it refuses.
    """
    end = time.monotonic() + wait_s
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        while True:
            try:
                connection.connect(address(check_name(name)))
                break
            except OSError:
                if time.monotonic() >= end:
                    problem = (
                        f"no PLC process listens on segment {name!r}; "
                        "is hli-cosim plc running?"
                    )
                    raise HliNotFound(problem) from None
                time.sleep(_BIND_PAUSE_S)
        _check_user(connection)
        connection.settimeout(2.0 * ANSWER_S)
        try:
            connection.sendall(_line(order))
            answer: Order = json.loads(_read_line(connection))
        except (OSError, ValueError):
            raise HliTimeout(
                f"the PLC on segment {name!r} did not answer"
            ) from None
    if "error" in answer:
        raise ValueError(answer["error"])
    return answer


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
