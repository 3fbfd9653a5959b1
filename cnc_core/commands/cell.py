"""Commands that run the two processes: run, demo, lookahead, cnc, plc."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from ..errors import CncError, Place
from ..process.options import CncOptions, RunOptions
from .console import (
    app,
    emit,
    err,
    one_of,
    out,
    progress,
    say_dialect,
    say_run_errors,
)
from .options import (
    CncSideOptions,
    Config,
    Dialect,
    File,
    Forced,
    Json,
    SegmentName,
    Watched,
    check_choices,
    expanded,
)


@app.command()
@expanded
def run(
    file: File,
    options: RunOptions,
    plc: Annotated[
        str | None,
        typer.Option(
            help="PLC program (Python file with @task classes), or none;"
            " default: acknowledges everything"
        ),
    ] = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Co-simulate: a CNC process runs the program beside a PLC process.

    Example: hli-cosim run part.nc --plc my_plc.py --record part.npz
    """
    from ..cell import Cell  # noqa: PLC0415

    check_choices(options)
    with progress(f"running {file.name}"), Cell(config) as cell:
        result = cell.run_with(options, file, plc)
    if options.dialect is None and result.dialect:
        say_dialect(result.dialect)
    say_run_errors(result)
    if as_json:
        emit(result.as_json())
    else:
        _print_run(result, str(file))
    if result.end != "completed":
        raise typer.Exit(1)


def _print_run(result: Any, title: str) -> None:
    value = result.as_json()
    table = Table("figure", "value", title=title)
    for key in (
        "end",
        "cycles",
        "sim_time_s",
        "wall_time_s",
        "realtime_factor",
        "blocks",
        "requests",
        "handshake_us",
        "overruns",
        "planner_late",
        "recorded",
    ):
        table.add_row(key, json.dumps(value[key]))
    out.print(table)
    for message in result.messages:
        out.print(message)


@app.command()
def demo(
    seconds: Annotated[
        float, typer.Option(min=1.0, max=3600.0, help="machine time to show")
    ] = 10.0,
    out_dir: Annotated[
        Path,
        typer.Option("--out", help="folder for program, recording and picture"),
    ] = Path("hli-cosim-demo"),
    as_json: Json = False,
) -> None:
    """Show the main job: both processes, both look-ahead modes, a PLC that sets
    the override from the coming contour.

    Example: hli-cosim demo --seconds 20 --out demo
    """
    from .demo_run import run_demo  # noqa: PLC0415

    with progress("co-simulating the bundled part"):
        result = run_demo(seconds, out_dir)
    say_run_errors(result.run)
    if as_json:
        emit(result.as_json())
    else:
        _print_demo(result)
    if result.run.end != "completed":
        raise typer.Exit(1)


def _us(values: dict[str, float | None]) -> str:
    return ", ".join(f"{k} {v:.1f}" for k, v in values.items() if v is not None)


def _print_demo(result: Any) -> None:
    run, plc = result.run, result.plc
    table = Table(
        "what", "value", title="hli-cosim demo: CNC and PLC side by side"
    )
    table.add_row(
        "cycles (1 ms)",
        f"{run.cycles}, {run.sim_time_s:.2f} s of machine time in {run.wall_time_s:.2f} s",
    )
    table.add_row("faster than real time", f"{run.realtime_factor:.0f} x")
    table.add_row(
        "requests",
        f"mode 1: {run.requests['mode1']}, mode 2: {run.requests['mode2']}",
    )
    table.add_row(
        "contour elements seen ahead",
        f"{plc.get('elements_followed')} by distance, "
        f"{plc.get('log_entries')} log entries by index",
    )
    table.add_row(
        "lowest override set by the PLC", f"{plc.get('lowest_override')} %"
    )
    table.add_row("handshake over a scan, us", _us(run.handshake_us))
    table.add_row("raw C exchange beside it, us", _us(result.raw_us))
    table.add_row("overruns", str(run.overruns))
    table.add_row("picture", str(result.folder / "demo.png"))
    out.print(table)


@app.command()
def lookahead(
    file: File,
    index: Annotated[
        float | None,
        typer.Option(help="mode 1: from this entry of the marked log on"),
    ] = None,
    distance: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="START LENGTH", help="mode 2: range in 0.1 um"),
    ] = None,
    at: Annotated[
        str,
        typer.Option(
            help="start: prepared, no motion yet; end: after the program's end"
        ),
    ] = "end",
    config: Config = None,
    dialect: Dialect = None,
    as_json: Json = False,
) -> None:
    """Ask for the contour from the PLC process through the real handshake.

    Example: hli-cosim lookahead part.nc --distance 0 500000 --at start
    """
    from ..cell import Cell  # noqa: PLC0415

    one_of("--at", at, ("start", "end"))
    query = _query(index, distance) | {"at": at}
    options = RunOptions(dialect=dialect, hold_start=at == "start")
    with progress(f"running {file.name}"), Cell(config) as cell:
        result = cell.run_with(options, file, "builtin:query", query)
    say_run_errors(result)
    answer = result.plc.get("result")
    if answer is not None and as_json:
        emit(answer)
    elif answer is not None:
        _print_answer(answer)
    if answer is None or result.end != "completed":
        raise typer.Exit(1)


def _query(
    index: float | None, distance: tuple[float, float] | None
) -> dict[str, Any]:
    """The request as the built-in PLC takes it."""
    if (index is None) == (distance is None):
        raise typer.BadParameter(
            "give either --index I or --distance START LENGTH"
        )
    if distance is not None and distance[1] == 0:
        raise typer.BadParameter(
            "--distance: LENGTH 0 selects mode 1 on the control unit; use --index"
        )
    asked = distance or (index or 0.0,)
    if not all(map(math.isfinite, asked)):
        raise CncError(
            900012,
            f"the request {distance or index} is not made of finite numbers",
        )
    if distance is None:
        return {"mode": 1, "start": index, "length": 0.0}
    return {"mode": 2, "start": distance[0], "length": distance[1]}


def _print_answer(answer: dict[str, Any]) -> None:
    out.print(
        f"mode {answer['mode']}, request {answer['request']}, state {answer['state']}"
    )
    names = [
        "block_type",
        "block_number",
        "start_position",
        "length",
        "compensated_radius",
        "circle_angle",
        "tangent_variation",
    ]
    table = Table(
        *(n.removeprefix("block_").replace("compensated_", "") for n in names),
        box=None,
    )
    for row in answer["response"]:
        table.add_row(
            *(
                f"{row[n]:.6f}" if isinstance(row[n], float) else str(row[n])
                for n in names
            )
        )
    out.print(table)


@app.command()
@expanded
def cnc(
    file: File,
    options: CncSideOptions,
    name: SegmentName = "hli-cosim",
    wait: Annotated[
        bool,
        typer.Option(
            "--wait/--no-wait",
            help="start the program when a PLC has attached, or at once",
        ),
    ] = True,
    config: Config = None,
) -> None:
    """Run the CNC side alone; a PLC attaches from another terminal.

    The PLC may come back after it died.

    Example: hli-cosim cnc part.nc --name my-cell
    """
    from ..process.__main__ import run_cnc  # noqa: PLC0415

    check_choices(options)
    chosen = CncOptions(
        file, name, options.run_options(), config=config, wait_plc=wait
    )
    doing = "waiting for a PLC" if wait else "running"
    err.print(
        f"CNC on segment {name!r}, {options.clock}; {doing}; Ctrl-C ends it"
    )
    raise typer.Exit(run_cnc(chosen))


@app.command()
def plc(
    file: Annotated[
        Path, typer.Argument(help="Python file with @task classes")
    ],
    name: SegmentName = "hli-cosim",
    report: Annotated[
        Path | None,
        typer.Option(
            help="write statistics and watch list here at the end (JSON)"
        ),
    ] = None,
    watch: Watched = None,
    force: Forced = None,
) -> None:
    """Run the PLC side alone: waits for the CNC, re-attaches when it comes
    back; SIGUSR1 restarts the PLC.

    Example: hli-cosim plc my_plc.py --name my-cell
    """
    from plc_client.__main__ import main as plc_main  # noqa: PLC0415

    if not file.exists():
        raise CncError(901001, "file not found", Place(str(file)))
    err.print(f"PLC {file.name} on segment {name!r}; Ctrl-C ends it")
    arguments = [
        "--name",
        name,
        "--file",
        str(file),
        *(("--report", str(report)) if report else ()),
    ]
    arguments += [part for path in watch or [] for part in ("--watch", path)]
    arguments += [part for text in force or [] for part in ("--force", text)]
    raise typer.Exit(plc_main(arguments))
