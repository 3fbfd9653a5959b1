"""Commands without the start of Python.

Reading the packages takes most of a short command.  A server, one for each
pytest process, has read them.  For every command it makes a copy of itself
(fork), which becomes ``hli-cosim``; that one makes copies for the CNC and the
PLC of a run.  Each command has processes of its own, as a user's has.  A copy
can become a script of a user, too.

``-m support.warm_commands SOCKET`` is the server; ``warm_client.py`` is its
client as a program of its own.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import importlib
import json
import os
import pkgutil
import runpy
import select
import shlex
import signal
import socket
import subprocess
import sys
import weakref
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

MESSAGE = 1 << 20
PACKAGES = ("cnc_core", "hli", "plc_client")
NOT_READ = (
    "cnc_core.pytest_plugin",
    "plc_client.pytest_plugin",
    "plc_client.st.pytest_items",
)
MAINS = ("cnc_core.process", "plc_client")
# in front of a script, of a module
SCRIPT, MODULE = "--script", "--module"


class Copy:
    """A process that was made by fork; used as ``subprocess.Popen``."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._handle = os.pidfd_open(pid)
        self._status: int | None = None

    def __del__(self) -> None:
        os.close(self._handle)

    def poll(self) -> int | None:
        try:
            return self.wait(0.0)
        except subprocess.TimeoutExpired:
            return None

    def wait(self, timeout: float) -> int:
        if self._status is None:
            if not select.select([self._handle], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired("copy", timeout)
            _, status = os.waitpid(self.pid, 0)
            self._status = os.waitstatus_to_exitcode(status)
        return self._status

    def terminate(self) -> None:
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        self._signal(signal.SIGKILL)

    def _signal(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, number)


class Copying:
    """In place of ``cnc_core.cell.worker.Worker``, and of starting processes
    anew: copies of this process.
    """

    usable = True

    def __init__(self, mains: dict[str, Callable[[Any], int]]) -> None:
        self._mains = mains

    def close(self) -> None:
        """Nothing to give back."""

    def start(
        self,
        module: str,
        arguments: Sequence[str],
        streams: Sequence[int],
        own_session: bool,
    ) -> Copy:
        launcher = os.getpid()
        handles = [os.dup(stream) for stream in streams]

        def become() -> int:
            if own_session:
                os.setsid()
            return self._mains[module]([*arguments, "--parent", str(launcher)])

        try:
            return _copy(become, handles)
        finally:
            for handle in handles:
                os.close(handle)


def _copy(become: Callable[[], int | None], streams: Sequence[int]) -> Copy:
    """A copy of this process with these streams; it ends with ``become``."""
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return Copy(pid)
    status: Any = 1
    # temporary folders of the process that was copied are not ours to remove
    weakref.finalize._registry.clear()
    try:
        for target, stream in enumerate(streams):
            os.dup2(stream, target)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        status = become() or 0
    except SystemExit as end:
        status = end.code
        if isinstance(status, str):
            sys.stderr.write(status + "\n")
            status = 1
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        with contextlib.suppress(BaseException):
            atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(BaseException):
                stream.flush()
        os._exit(int(status or 0))
    return None


# ---- server
def _read_everything() -> None:
    for name in PACKAGES:
        package = importlib.import_module(name)
        for found in pkgutil.walk_packages(package.__path__, f"{name}."):
            if found.name.startswith(NOT_READ) or "__main__" in found.name:
                continue
            with contextlib.suppress(ImportError):  # of an extra
                importlib.import_module(found.name)


def _become(request: dict[str, Any], mains: dict[str, Any]) -> None:
    """What the client asks for, in its folder and environment."""
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    copying = Copying(mains)
    importlib.import_module("cnc_core.cell.worker")._state["worker"] = copying
    importlib.import_module("cnc_core.cell.child")._started = copying.start
    first, *others = request["arguments"] or [""]
    if first in (SCRIPT, MODULE):
        _run_python(first, *others)
    else:
        sys.argv = ["hli-cosim", *request["arguments"]]
        importlib.import_module("cnc_core.cli").main()


def _run_python(kind: str, name: str, *arguments: str) -> None:
    """As ``python name`` or ``python -m name``."""
    searched = os.environ.get("PYTHONPATH", "")
    here = str(Path(name).parent) if kind == SCRIPT else os.getcwd()
    sys.argv = [name, *arguments]
    sys.path[:1] = [here, *filter(None, [searched])]
    if kind == SCRIPT:
        runpy.run_path(name, run_name="__main__")
    else:
        runpy.run_module(name, run_name="__main__", alter_sys=True)


def of_clients(
    asked: dict[int, tuple[socket.socket, Copy]],
) -> list[socket.socket]:
    return [connection for connection, _ in asked.values()]


def serve(path: str) -> None:
    """Make a process for each connection until standard input is closed."""
    _read_everything()
    mains = {
        name: importlib.import_module(f"{name}.__main__").main for name in MAINS
    }
    sync = importlib.import_module("hli._sync").lib
    server = os.getpid()
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(path)
    listener.listen(16)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()
    asked: dict[int, tuple[socket.socket, Copy]] = {}
    while True:
        ready, _, _ = select.select([0, listener, *asked], [], [], 60)
        for handle in ready:
            if handle == 0:
                os._exit(0)
            elif handle is listener:
                connection, _ = listener.accept()
                text, streams, _, _ = socket.recv_fds(connection, MESSAGE, 3)
                request = json.loads(text)

                kept = [listener, connection, *of_clients(asked)]

                def become(
                    request: dict[str, Any] = request,
                    kept: list[socket.socket] = kept,
                ) -> None:
                    sync.hs_die_with_parent(signal.SIGTERM, server)
                    for ours in kept:
                        ours.close()
                    _become(request, mains)

                copy = _copy(become, streams)
                for stream in streams:
                    os.close(stream)
                connection.send(b"%d\n" % copy.pid)
                asked[copy._handle] = (connection, copy)
                asked[connection.fileno()] = (connection, copy)
            elif handle in asked:
                connection, copy = asked[handle]
                if handle != copy._handle:  # the client is gone
                    copy.kill()
                status = copy.wait(60.0)
                with contextlib.suppress(OSError):
                    connection.send(b"%d\n" % status)
                for number in (connection.fileno(), copy._handle):
                    asked.pop(number, None)
                connection.close()


# ---- client
class Server:
    """The server of this pytest process; started by its first command."""

    def __init__(self, folder: Path) -> None:
        self.socket = folder / "commands"
        here = Path(__file__).resolve().parents[1]
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__, str(self.socket)],
            stdin=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": str(here)},
        )

    def close(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()

    def command(self, *arguments: object) -> list[str]:
        """The client's command line; it hands signals on."""
        client = Path(__file__).with_name("warm_client.py")
        return [
            *(sys.executable, "-I", "-S", str(client), str(self.socket)),
            *map(str, arguments),
        ]

    def programs(self, folder: Path) -> None:
        """Write ``hli-cosim``, ``pytest`` and ``python`` into a folder, for a
        search path; ``python`` takes scripts alone.
        """
        firsts = {"hli-cosim": [], "pytest": [MODULE, "pytest"]}
        for name, first in (firsts | {"python": [SCRIPT]}).items():
            line = shlex.join(self.command(*first))
            (folder / name).write_text(f'#!/bin/sh\nexec {line} "$@"\n')
            (folder / name).chmod(0o700)


if __name__ == "__main__":
    serve(sys.argv[1])
