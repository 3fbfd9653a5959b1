"""A warm process that becomes the CNC or the PLC of a run.

Starting Python and reading the packages takes most of a short run.  With the
first ``Cell.run`` of a program a worker reads them once.  It makes a copy of
itself (fork) for each process of a run, so that nothing goes from one run to
the next.

Launcher and worker talk over a socket: a request starts a process, and each
process's end comes back.  The worker ends with the launcher, the processes of a
run end with the worker.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

from hli.interrupts import interrupts_held

MESSAGE = 1 << 20


class WarmProcess:
    """A process that a worker has made; used as ``subprocess.Popen``."""

    def __init__(self, worker: Worker, pid: int, handle: int) -> None:
        self.pid = pid
        self._worker, self._handle = worker, handle

    def poll(self) -> int | None:
        """Exit status, below 0 the signal that ended it; None: it runs."""
        return self._worker.ended(self.pid, 0.0)

    def wait(self, timeout: float) -> int:
        """Raises subprocess.TimeoutExpired."""
        status = self._worker.ended(self.pid, timeout)
        if status is None:
            raise subprocess.TimeoutExpired("worker", timeout)
        return status

    def terminate(self) -> None:
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        self._signal(signal.SIGKILL)

    def _signal(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, number)

    def __del__(self) -> None:
        with contextlib.suppress(OSError):
            os.close(self._handle)


class Worker:
    """The launcher's end."""

    def __init__(self) -> None:
        self._socket, theirs = socket.socketpair(
            socket.AF_UNIX, socket.SOCK_SEQPACKET
        )
        number = theirs.fileno()
        self.launcher = os.getpid()
        with interrupts_held():
            self._process = subprocess.Popen(
                [
                    *(sys.executable, "-P", "-m", f"{__package__}.warm"),
                    *(str(number), str(self.launcher)),
                ],
                pass_fds=[number],
                stdin=subprocess.DEVNULL,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            )
        theirs.close()
        self.python = _python_settings()
        self._ended: dict[int, int] = {}

    @property
    def usable(self) -> bool:
        """It lives, this process has made it, and Python is set as it was."""
        return (
            self.launcher == os.getpid()
            and self._process.poll() is None
            and self.python == _python_settings()
        )

    def close(self) -> None:
        """End the worker; in a copy of the launcher: give the socket up."""
        self._socket.close()
        if self.launcher == os.getpid():
            self._process.wait()

    def start(
        self,
        module: str,
        arguments: Sequence[str],
        streams: Sequence[int],
        own_session: bool,
    ) -> WarmProcess:
        """A process of this module with standard input, output and error.

        ``own_session``: a Ctrl-C of the terminal does not reach it.
        """
        request = {
            "module": module,
            "arguments": [*arguments, "--parent", str(self._process.pid)],
            "folder": os.getcwd(),
            "own_session": own_session,
            "environment": os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        }
        socket.send_fds(
            self._socket, [json.dumps(request).encode()], list(streams)
        )
        while True:
            text, handles, _, _ = socket.recv_fds(self._socket, MESSAGE, 1)
            if not text:
                raise OSError("the worker has ended")
            message = json.loads(text)
            if handles:
                return WarmProcess(self, message["started"], handles[0])
            self._ended[message["ended"]] = message["status"]

    def ended(self, pid: int, seconds: float) -> int | None:
        """The status of a process, waiting so long for its end."""
        until = time.monotonic() + seconds
        while pid not in self._ended:
            left = max(until - time.monotonic(), 0.0)
            if not select.select([self._socket], [], [], left)[0]:
                return None
            text = self._socket.recv(MESSAGE)
            if not text:
                return -signal.SIGTERM  # the worker ends, and its processes
            message = json.loads(text)
            self._ended[message["ended"]] = message["status"]
        return self._ended[pid]


def _python_settings() -> dict[str, str]:
    return {k: v for k, v in os.environ.items() if k.startswith("PYTHON")}


@atexit.register
def _end() -> None:
    worker: Worker | None = _state["worker"]
    _state["worker"] = None
    if worker is not None:
        worker.close()


_state: dict[str, Any] = {"worker": None, "starts": 0}


def worker_for_start() -> Worker | None:
    """The worker for a CNC process alone; None for the first one, which starts
    faster without it.
    """
    _state["starts"] += 1
    if _state["worker"] is None and _state["starts"] == 1:
        return None
    return worker_for_run()


def worker_for_run() -> Worker:
    """The worker for the processes of one more run."""
    worker: Worker | None = _state["worker"]
    if worker is None or not worker.usable:
        _end()
        worker = _state["worker"] = Worker()
    return worker
