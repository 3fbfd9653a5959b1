"""Servers beside a cell for programs by others: ads, opcua."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Coroutine
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import CncError
from .console import app, out, say_error

NICE = 5  # the cell comes first
CELL, LOOPBACK = "hli-cosim", "127.0.0.1"
CellName = Annotated[
    str, typer.Argument(metavar="[NAME]", help="the cell to serve")
]
Port = Annotated[
    int, typer.Option(min=0, max=65535, help="port of TCP, 0: any")
]
Host = Annotated[
    str,
    typer.Option(
        help="address to listen at; anything else than loopback is open to"
        " the network"
    ),
]
Allow = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NETID",
        help="AMS net id of a client that is served; repeatable; needed"
        " beyond loopback",
    ),
]


@app.command()
def ads(
    name: CellName = CELL,
    port: Port = 48_898,
    host: Host = LOOPBACK,
    net_id: Annotated[
        str, typer.Option(help="AMS net id of the server")
    ] = "127.0.0.1.1.1",
    allow: Allow = None,
) -> None:
    """Serve a cell over ADS, as a TwinCAT controller would: symbols of HLI and
    PLC at AMS port 851.

    It looks at the cell without writing.  What clients write goes to the PLC.

    Example: hli-cosim ads my-cell
    """
    from ..bridges.ads.frames import net_id as net_id_of  # noqa: PLC0415
    from ..bridges.ads.server import Rules, is_loopback, serve  # noqa: PLC0415
    from ..bridges.symbols.cell import ServedCell  # noqa: PLC0415

    try:
        allowed = {net_id_of(text) for text in allow or ()}
        rules = Rules(net_id_of(net_id), allowed)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    if not allowed and not is_loopback(host):
        raise typer.BadParameter(
            f"--host {host} is open to the network: name the clients with"
            " --allow NETID"
        )
    cell = ServedCell(name)

    def ready(at: str, number: int) -> None:
        _told(
            f"ADS at {at}:{number}, AMS net id {net_id}, ports 851 and"
            f" 550 to 553; {cell.told()}"
        )

    _served(serve(cell, rules, host, port, ready), f"ADS at {host}:{port}")


@app.command()
def opcua(
    name: CellName = CELL,
    port: Port = 4840,
    host: Host = LOOPBACK,
    users: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="lines NAME:PASSWORD of those who may write; the file is"
            " its owner's alone",
        ),
    ] = None,
    certificate: Annotated[
        Path | None,
        typer.Option(help="certificate (PEM or DER): secure policies, too"),
    ] = None,
    key: Annotated[
        Path | None, typer.Option(help="private key of the certificate")
    ] = None,
) -> None:
    """Serve a cell over OPC UA: OPC 40502 for CNC systems, and the symbols of
    HLI and PLC.

    Anonymous clients read.  What others write goes to the PLC.

    Example: hli-cosim opcua my-cell
    """
    need("asyncua", "opcua")
    from ..bridges.opcua.server import Door, serve  # noqa: PLC0415
    from ..bridges.symbols.cell import ServedCell  # noqa: PLC0415

    if (certificate is None) != (key is None):
        raise typer.BadParameter("--certificate and --key come together")
    passwords = _passwords(users) if users else {}
    cell = ServedCell(name)

    def ready(number: int) -> None:
        _told(f"OPC UA at opc.tcp://{host}:{number}/; {cell.told()}")

    say_error("OPC UA: building the address space, some seconds")
    door = Door(host, port, passwords, certificate, key)
    _served(serve(cell, door, ready), f"OPC UA at {host}:{port}")


def need(package: str, extra: str) -> None:
    """CncError if the package of an extra is missing."""
    try:
        import_module(package)
    except ImportError:
        raise CncError(
            902001,
            f"{extra} needs the extra: pip install 'hli-cosim[{extra}]'",
        ) from None


def _passwords(file: Path) -> dict[str, str]:
    """Names and passwords.  CncError: others can read the file."""
    if file.stat().st_mode & 0o077:
        raise CncError(902001, f"{file}: others can read it; chmod 600 {file}")
    lines = file.read_text(encoding="utf-8").splitlines()
    pairs = [line.partition(":") for line in lines if line.strip()]
    return {name.strip(): password for name, _, password in pairs}


def _told(text: str) -> None:
    out.print(text, soft_wrap=True, highlight=False)
    sys.stdout.flush()


def _served(work: Coroutine[Any, Any, None], what: str) -> None:
    """Run a server until a signal ends it."""
    with contextlib.suppress(OSError):
        os.nice(NICE)
    try:
        ended_by = asyncio.run(_until_signal(work))
    except OSError as error:
        raise CncError(902001, f"{what} cannot be served: {error}") from None
    raise typer.Exit(128 + ended_by if ended_by else 1)


async def _until_signal(work: Coroutine[Any, Any, None]) -> int:
    came: list[int] = []
    task = asyncio.ensure_future(work)

    def end(number: int) -> None:
        came.append(number)
        task.cancel()

    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end, number)
    with contextlib.suppress(asyncio.CancelledError):
        await task
    return came[0] if came else 0
