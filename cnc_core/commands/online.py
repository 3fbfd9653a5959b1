"""Orders to a PLC that runs: force, unforce, read."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from .console import (
    app,
    emit,
    err,
    out,
)
from .options import Json, Symbols
from .tables import value_lines

PlcName = Annotated[
    str, typer.Option("--name", help="segment of the running PLC")
]
PlcWait = Annotated[
    float,
    typer.Option(
        "--wait",
        min=0.0,
        help="seconds to wait for a PLC that is just starting",
    ),
]


def _order(
    name: str, wait: float, do: str, symbols: list[Any], as_json: bool
) -> None:
    """One order to a running PLC; prints what it reads and what is forced then."""
    from hli import orders  # noqa: PLC0415

    answer = orders.send(name, {"do": do, "symbols": symbols}, wait)
    if as_json:
        emit(answer)
        return
    for line in value_lines(answer.get("values", {})):
        out.print(line)
    for text in answer.get("warnings", ()):
        err.print(f"warning: {text}", soft_wrap=True, highlight=False)
    for line in value_lines(answer["forced"]) if do != "read" else ():
        out.print(f"forced: {line}")
    if do != "read" and not answer["forced"]:
        out.print("nothing is forced")


@app.command()
def force(
    symbols: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SYMBOL=VALUE]...", help="none: list"),
    ] = None,
    name: PlcName = "hli-cosim",
    wait: PlcWait = 0.0,
    as_json: Json = False,
) -> None:
    """Hold symbols of a running PLC at a value, from another terminal; without
    symbols, list what is forced.

    Example: hli-cosim force --name my-cell
    'gpCh[0]^.bahn_mc_control.override.command_w=500' Slow.gain=2
    """
    from plc_client.online import parse_force  # noqa: PLC0415

    given = [list(parse_force(text)) for text in symbols or []]
    _order(name, wait, "force" if given else "list", given, as_json)


@app.command()
def unforce(
    symbols: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SYMBOL]...", help="what to let go"),
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="let all symbols go")
    ] = False,
    name: PlcName = "hli-cosim",
    wait: PlcWait = 0.0,
    as_json: Json = False,
) -> None:
    """Let forced symbols of a running PLC go; each keeps its value until
    somebody writes it.

    Example: hli-cosim unforce --name my-cell Slow.gain
    """
    if bool(symbols) == everything:
        raise typer.BadParameter("name symbols, or give --all")
    _order(name, wait, "unforce", list(symbols or []), as_json)


@app.command()
def read(
    symbols: Symbols,
    name: PlcName = "hli-cosim",
    wait: PlcWait = 0.0,
    as_json: Json = False,
) -> None:
    """Read variables of a running PLC, HLI and tasks, as they are between two
    scans.

    Example: hli-cosim read --name my-cell 'gpCh[0]^.bahn_state.dist_prog_start'
    Slow.gain
    """
    _order(name, wait, "read", list(symbols), as_json)
