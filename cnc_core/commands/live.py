"""What runs and what it holds: ps, watch."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Annotated, Any

import typer
from rich.table import Table

from .console import app, emit, err, out
from .options import Json, SegmentName


@app.command()
def ps(as_json: Json = False) -> None:
    """List the running cells of this user.

    Example: hli-cosim ps --json
    """
    from hli.cells import running_cells  # noqa: PLC0415

    found = running_cells()
    if as_json:
        emit([cell.as_json() for cell in found])
        return
    if not found:
        out.print("no cell runs")
        return
    table = Table("name", "pid", "clock", "program", "state", "plc")
    for cell in found:
        plc = str(cell.plc) if cell.plc else "none"
        table.add_row(
            cell.name,
            str(cell.pid),
            cell.clock,
            cell.program,
            cell.state,
            plc,
        )
    out.print(table)


class Watched:
    """Symbols of a running cell: those of the HLI from the memory, those of
    tasks by asking the PLC.
    """

    def __init__(self, name: str, paths: list[str]) -> None:
        from hli.areas import Areas  # noqa: PLC0415
        from hli.segment import attach  # noqa: PLC0415
        from hli.symbol import SymbolError  # noqa: PLC0415

        self._name, self._paths = name, paths
        self._segment = attach(name)
        areas = Areas(self._segment)
        self._symbols: dict[str, Any] = {}
        asked: list[str] = []
        errors: dict[str, SymbolError] = {}
        for path in paths:
            try:
                self._symbols[path] = areas.symbol(path)
            except SymbolError as error:
                asked.append(path)
                errors[path] = error
        self._asked = asked
        if asked and not self._segment.root.sidecar.plc.attached:
            raise errors[asked[0]]

    @property
    def alive(self) -> bool:
        """The cell goes on."""
        from hli import layout  # noqa: PLC0415

        ended = layout.HLI_PHASE_SHUTDOWN
        phase = self._segment.root.sidecar.cnc.phase
        return self._segment.owner_alive() and phase != ended

    def row(self) -> dict[str, Any]:
        """``t`` (cell time, s) and the value of each symbol."""
        now = self._segment.root.sidecar.cnc.cell_time_ns * 1e-9
        values = {
            path: plain(symbol.value) for path, symbol in self._symbols.items()
        }
        if self._asked:
            from plc_client import orders  # noqa: PLC0415

            order = {"do": "read", "symbols": self._asked}
            values |= orders.send(self._name, order)["values"]
        return {"t": now} | {path: values[path] for path in self._paths}

    def unit(self, path: str, member: str = "") -> str:
        """Unit of a symbol, or of a member of the structure it names."""
        from hli.units import unit_of  # noqa: PLC0415
        from hli.view import View  # noqa: PLC0415

        symbol = self._symbols.get(path)
        if symbol is None:
            return ""
        holder = symbol.value if member else symbol._holder
        key = member or symbol._key
        if not isinstance(holder, View):
            return ""
        return unit_of(type(holder)._structure.__name__, str(key))


def plain(value: Any) -> Any:
    """Numbers, texts, and structures and arrays of them, as JSON has them."""
    from hli.view import ArrayView, View  # noqa: PLC0415

    if isinstance(value, View):
        return {n: plain(getattr(value, n)) for n in value._members()}
    if isinstance(value, (ArrayView, tuple, list)):
        return [plain(item) for item in value]
    if isinstance(value, bytes):
        return value.decode("latin-1")
    return value


def _lines(watched: Watched, row: dict[str, Any]) -> Iterator[str]:
    """A row for people: a line a value, members below their structure."""
    yield f"t = {row['t']:.3f} s"
    for path, value in list(row.items())[1:]:
        if not isinstance(value, dict):
            yield f"  {path} = {_text(value)} {watched.unit(path)}".rstrip()
            continue
        yield f"  {path}"
        for member, item in value.items():
            unit = watched.unit(path, member)
            yield f"    {member} = {_text(item)} {unit}".rstrip()


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, float):
        return f"{value:.6g}"
    text = str(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}.."


SHOWN = 60  # characters of a value


@app.command()
def watch(
    symbols: Annotated[
        list[str],
        typer.Argument(
            metavar="SYMBOL...", help="variables of the HLI or of a task"
        ),
    ],
    name: SegmentName = "hli-cosim",
    interval: Annotated[
        float, typer.Option(min=0.001, help="s between two readings")
    ] = 0.5,
    count: Annotated[
        int, typer.Option(min=0, help="readings; 0: until Ctrl-C")
    ] = 0,
    as_json: Json = False,
) -> None:
    """Show values of a running cell again and again; a structure shows its
    members, --json prints a line of JSON each time.

    Example: hli-cosim watch --name my-cell --count 5 gpCh[0].bahn_state
    """
    watched = Watched(name, symbols)
    due, taken = time.monotonic(), 0
    while watched.alive:
        row = watched.row()
        if as_json:
            emit(row, flush=True)
        else:
            out.print("\n".join(_lines(watched, row)))
        taken += 1
        if taken == count:
            return
        due = max(due + interval, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    err.print(f"the cell {name!r} has ended")
