"""The process of a worker: it makes a copy of itself for each process of a run.

``worker.py`` has the launcher's end of the socket.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import select
import signal
import socket
import sys
from collections.abc import Sequence
from typing import Any

from hli._sync import lib as sync

from hli.export import layout_hash

from .. import frontend
from ..process.options import options_adapter
from .worker import MESSAGE

MODULES = ("cnc_core.process", "plc_client")
WARM = (
    "plc_client.blocks",
    "plc_client.builtin.acknowledge",
    "plc_client.scan",
)


def serve(number: int, launcher: int) -> int:
    """Make processes until the launcher closes the socket; the exit status, in
    a process that was made: its own.
    """
    if sync.hs_die_with_parent(signal.SIGTERM, launcher) != 0:
        return 0
    # a Ctrl-C of the terminal is for the launcher and the processes of the run
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    mains = {
        name: importlib.import_module(f"{name}.__main__") for name in MODULES
    }
    dialects = [f"{frontend.__name__}.{name}" for name in frontend.DIALECTS]
    for name in (*WARM, *dialects):
        importlib.import_module(name)
    options_adapter()
    layout_hash()
    gc.freeze()
    connection = socket.socket(fileno=number)
    running: dict[int, int] = {}  # handle -> process id
    while True:
        ready, _, _ = select.select([number, *running], [], [])
        for handle in ready:
            if handle != number:
                _report_end(connection, running.pop(handle), handle)
        if number not in ready:
            continue
        text, streams = _received(connection)
        if not text:
            return 0
        request = json.loads(text)
        pid = os.fork()
        if pid == 0:
            connection.close()
            _become(request, streams)
            status: int = mains[request["module"]].main(request["arguments"])
            return status
        for stream in streams:
            os.close(stream)
        handle = os.pidfd_open(pid)
        running[handle] = pid
        started = json.dumps({"started": pid}).encode()
        with contextlib.suppress(OSError):  # gone: the next look says so
            socket.send_fds(connection, [started], [handle])


def _received(connection: socket.socket) -> tuple[bytes, list[int]]:
    """The next request with its streams; empty: the launcher is gone.

    A launcher that is killed with answers unread resets the connection.
    """
    try:
        text, streams, _, _ = socket.recv_fds(connection, MESSAGE, 3)
    except ConnectionError:
        return b"", []
    return text, streams


def _report_end(connection: socket.socket, pid: int, handle: int) -> None:
    os.close(handle)
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    with contextlib.suppress(OSError):
        connection.send(json.dumps({"ended": pid, "status": status}).encode())


def _become(request: dict[str, Any], streams: Sequence[int]) -> None:
    """What a process has from its launcher when it is started anew."""
    for target, stream in enumerate(streams):
        os.dup2(stream, target)
        os.close(stream)
    if request["own_session"]:
        os.setsid()
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    signal.signal(signal.SIGINT, signal.default_int_handler)
    numpy = sys.modules.get("numpy")
    if numpy is not None:  # no two runs have the same random numbers
        numpy.random.seed()


if __name__ == "__main__":
    sys.exit(serve(int(sys.argv[1]), int(sys.argv[2])))
