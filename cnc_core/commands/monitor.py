"""The machine in the browser: monitor, and the option --monitor of others."""

from __future__ import annotations

import contextlib
import os
import secrets
import select
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from hli._sync import lib

from ..errors import CncError
from .console import app, err, out

if TYPE_CHECKING:
    from ..monitor.app import Served

MonitorToo = Annotated[
    bool,
    typer.Option(
        "--monitor", help="serve a page in the browser; needs the extra"
    ),
]
PAGE_OPEN = "a page is open"
EXTRA = "the monitor needs the extra: pip install 'hli-cosim[monitor]'"
PORT = 8765
RECORDINGS = (".parquet", ".arrow", ".npz")
READY_S = 120.0  # on a machine that does much else; one that fails ends at once
END_S = 20.0
NICE = 5  # the cell comes first


def need_server() -> None:
    """CncError if the page cannot be served."""
    try:
        for package in ("starlette", "uvicorn", "websockets"):
            import_module(package)
    except ImportError:
        raise CncError(902001, EXTRA) from None


NameOrRecording = Annotated[
    str | None,
    typer.Argument(
        metavar="[NAME]",
        help="a cell, or a recording; none: every cell of this user",
    ),
]
Port = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=65535,
        help=f"port of the page, 0: any; default {PORT}, or a free one",
    ),
]
Host = Annotated[
    str,
    typer.Option(
        help="address to listen at; anything else than loopback is open to"
        " the network"
    ),
]
Token = Annotated[
    str | None,
    typer.Option(
        envvar="HLI_COSIM_TOKEN",
        show_envvar=False,
        help="token of the page; default: that of HLI_COSIM_TOKEN, or a new one",
    ),
]
AllowHost = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME[:PORT]",
        help="name of a reverse proxy in front of the page; repeatable",
    ),
]
ProgramFile = Annotated[
    Path | None,
    typer.Option(
        help="program of the cell, to be drawn; default: from its command line"
    ),
]
Recordings = Annotated[
    list[Path] | None,
    typer.Option(
        "--recording", help="a recording that the page can open; repeatable"
    ),
]
KeepForces = Annotated[
    bool,
    typer.Option(
        "--keep-forces", help="symbols stay forced when their page is closed"
    ),
]


@app.command()
def monitor(
    name: NameOrRecording = None,
    port: Port = None,
    host: Host = "127.0.0.1",
    token: Token = None,
    allow_host: AllowHost = None,
    program: ProgramFile = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", "--cell", help="cell.toml of the cell"),
    ] = None,
    recording: Recordings = None,
    keep_forces: KeepForces = False,
    parent: Annotated[int | None, typer.Option(hidden=True)] = None,
) -> None:
    """Serve a page with a running cell: path, scope, symbols, operator panel.

    It looks at the cell without writing.  Acting goes through the PLC.

    Example: hli-cosim monitor my-cell
    """
    need_server()
    import asyncio  # noqa: PLC0415

    from ..monitor.app import Monitor, Served  # noqa: PLC0415
    from ..monitor.security import host_names, new_token  # noqa: PLC0415
    from ..monitor.server import listening, serve  # noqa: PLC0415
    from ..monitor.source import Source  # noqa: PLC0415

    recordings = list(recording or [])
    if name is not None and Path(name).suffix in RECORDINGS:
        recordings.insert(0, Path(name))
        name = None
    served = Served(
        token or new_token(), name, recordings=recordings, keep=keep_forces
    )
    if parent is not None:
        _belong_to(parent, served)
    if program is not None:
        served.source = Source(program.resolve(), config)
    exactly = port is not None
    at = listening(host, PORT if port is None else port, exactly=exactly)
    number = at.getsockname()[1]
    with contextlib.suppress(OSError):
        os.nice(NICE)
    everywhere = host in ("0.0.0.0", "::")
    shown = "127.0.0.1" if everywhere else f"[{host}]" if ":" in host else host
    # behind # a browser keeps it: no server and no proxy is told
    out.print(f"http://{shown}:{number}/#token={served.token}")
    sys.stdout.flush()
    hosts = host_names(host, number, allow_host or ())
    ended_by = asyncio.run(serve(Monitor(served).app(hosts), at))
    raise typer.Exit(128 + ended_by if ended_by else 1)


def _belong_to(parent: int, served: Served) -> None:
    """End with another command, and tell it of the first page."""
    if lib.hs_die_with_parent(signal.SIGTERM, parent) != 0:
        raise typer.Exit(1)
    served.on_first_page = lambda: print(PAGE_OPEN, flush=True)


class Beside:
    """A monitor in a process of its own beside a cell."""

    def __init__(
        self,
        name: str,
        program: Path,
        config: Path | None,
        recording: Path | None = None,
    ) -> None:
        need_server()
        words = ["monitor", name, "--program", str(program.resolve())]
        words += ["--config", str(config.resolve())] if config else []
        words += ["--recording", str(recording)] if recording else []
        words += ["--parent", str(os.getpid())]
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "cnc_core.cli", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def __enter__(self) -> Beside:
        address = self._line(READY_S)
        if not address:
            self.__exit__()
            raise CncError(902001, "the monitor did not start")
        err.print(f"monitor: {address}")
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def wait_for_page(self, seconds: float) -> None:
        """Until somebody has opened the page, or so long."""
        self._line(seconds)

    def _line(self, seconds: float) -> str:
        """What it says next; empty if it says nothing."""
        stdout = self._process.stdout
        assert stdout is not None
        ready, _, _ = select.select([stdout], [], [], seconds)
        return stdout.readline().strip() if ready else ""


def beside(
    wanted: bool, name: str | None, program: Path, config: Path | None
) -> contextlib.AbstractContextManager[Any]:
    """The monitor beside a cell if it is wanted."""
    if not wanted:
        return contextlib.nullcontext()
    assert name is not None
    return Beside(name, program, config)


def own_name() -> str:
    """A name for a cell that a monitor shall find."""
    return f"hli-cosim-{os.getpid()}-{secrets.token_hex(4)}"


def stay() -> None:
    """Until Ctrl-C."""
    err.print("the page stays open; Ctrl-C ends it")
    while True:
        time.sleep(1.0)
