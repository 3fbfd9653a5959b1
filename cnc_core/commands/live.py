"""What runs and what it holds: ps, watch."""

from __future__ import annotations

import time
from typing import Annotated, Any

import typer

from .console import app, emit, err, out
from .options import Json, SegmentName, Symbols
from .tables import print_table, value_lines


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
    head = ("name", "pid", "clock", "program", "state", "planner us/ms", "plc")
    print_table(
        "",
        head,
        (
            (c.name, str(c.pid), c.clock, *_of_channels(c), _plc(c.plc))
            for c in found
        ),
    )


def _of_channels(cell: Any) -> tuple[str, str, str]:
    """Programs, states and what the planners take (p50, p99, max); of several
    channels one below the other.
    """
    channels = cell.channels or (cell.as_json(),)
    programs, states = (
        "\n".join(one[key] for one in channels) for key in ("program", "state")
    )
    paces = (one["planner_us_per_ms"].values() for one in channels)
    planners = "\n".join(" ".join(f"{us:.3g}" for us in pace) for pace in paces)
    return programs, states, planners


def _plc(pid: int | None) -> str:
    return str(pid) if pid else "none"


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
            from hli import orders  # noqa: PLC0415

            order = {"do": "read", "symbols": self._asked}
            values |= orders.send(self._name, order)["values"]
        return {"t": now} | {path: values[path] for path in self._paths}


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


@app.command()
def watch(
    symbols: Symbols,
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
            out.print(f"t = {row.pop('t'):.3f} s")
            out.print("\n".join(value_lines(row, indent=2)))
        taken += 1
        if taken == count:
            return
        due = max(due + interval, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    err.print(f"the cell {name!r} has ended")
