"""Commands that run the two processes: run, demo, lookahead, cnc, plc."""

from __future__ import annotations

import contextlib
import json
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hli import segment

from ..errors import CncError, Place
from ..process.options import CncOptions, RunOptions
from .console import (
    SHOWN_ERRORS,
    app,
    emit,
    err,
    one_of,
    out,
    progress,
    say_dialect,
    say_error,
    say_errors,
    say_run_errors,
    telling_interrupts,
)
from .monitor import MonitorToo, beside, own_name
from .options import (
    CncSideOptions,
    Config,
    Dialect,
    File,
    Files,
    Forced,
    Json,
    SegmentName,
    StOptions,
    Watched,
    check_choices,
    expanded,
)
from .progressing import run_bar
from .tables import number, print_answer, print_run, print_table

if TYPE_CHECKING:
    from ..config import ChannelSetup

DEMO_S, DEMO_SHOWN_S = 10.0, 60.0


@app.command()
@expanded
def run(
    options: RunOptions,
    st: StOptions,
    files: Files = None,
    plc: Annotated[
        str | None,
        typer.Option(
            help="PLC program (Python file with @task classes), or none;"
            " default: acknowledges everything"
        ),
    ] = None,
    config: Config = None,
    monitor: MonitorToo = False,
    as_json: Json = False,
) -> None:
    """Co-simulate: a CNC process runs the program beside a PLC process.

    A cell with several channels takes a program for each, in its order; a
    channel without one executes what the cell file names.

    Example: hli-cosim run part.nc --plc my_plc.py --record part.npz
    """
    from ..cell import Cell  # noqa: PLC0415

    check_choices(options)
    file = _first(files or [], config)
    options = replace(options, st=st.words())
    tell_unwritable(options.record)
    if monitor:
        options = replace(options, name=options.name or own_name())
    with (
        telling_interrupts(as_json),
        beside(monitor, options.name, file, config),
        run_bar(f"running {file.name}", file) as look,
        Cell(config) as cell,
    ):
        result = cell.run_with(
            options, files or [], plc, look=look, attended=monitor
        )
    if options.dialect is None and result.dialect:
        say_dialect(result.dialect)
    if as_json:
        emit(result.as_json())
    else:
        print_run(result, " ".join(map(str, files or [file])))
    say_run_errors(result)
    if result.failed:
        raise typer.Exit(1)


def _first(files: list[Path], config: Path | None) -> Path:
    """The program whose way is shown while it runs: the first channel's, or the
    first that there is.
    """
    programs = _programs(files, config)
    return next(file for file in programs if file is not None)


def _programs(
    files: list[Path], config: Path | None
) -> tuple[Path | None, ...]:
    """One program a channel; wrong usage where there is none at all."""
    from ..cell.programs import programs_of  # noqa: PLC0415
    from ..config import load_config, setups_of  # noqa: PLC0415

    cell = load_config(config)
    if not files and not any(setup.program for setup in setups_of(cell)):
        raise typer.BadParameter("Missing argument 'FILE...'.")
    return programs_of(cell, files, config)


@app.command()
def demo(
    seconds: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            max=3600.0,
            help=f"machine time to show; default: {DEMO_S:g}, with --monitor"
            f" {DEMO_SHOWN_S:g}",
        ),
    ] = None,
    out_dir: Annotated[
        Path,
        typer.Option("--out", help="folder for program, recording and picture"),
    ] = Path("hli-cosim-demo"),
    monitor: MonitorToo = False,
    as_json: Json = False,
) -> None:
    """Show the main job: both processes, both look-ahead modes, a PLC that sets
    the override from the coming contour.

    Example: hli-cosim demo --seconds 20 --out demo
    """
    from .demo_run import run_demo, show_demo  # noqa: PLC0415

    if monitor:
        show_demo(seconds or DEMO_SHOWN_S, out_dir)
        return
    with (
        telling_interrupts(as_json),
        progress("co-simulating the bundled part"),
    ):
        result = run_demo(seconds or DEMO_S, out_dir)
    if as_json:
        emit(result.as_json())
    else:
        _print_demo(result)
    say_run_errors(result.run)
    if result.run.failed:
        raise typer.Exit(1)


def _print_demo(result: Any) -> None:
    from ..planning.picture import EXTRA  # noqa: PLC0415

    run, plc = result.run, result.plc
    if not run.cycles:
        return
    rows = [
        [
            "cell's time",
            f"{number(run.sim_time_s)} s, {run.cycles} cycles of 1 ms",
        ],
        [
            "wall time",
            f"{number(run.wall_time_s)} s,"
            f" {number(run.realtime_factor)} x real time",
        ],
        [
            "look-ahead requests",
            f"by index (mode 1) {run.requests['mode1']},"
            f" by distance (mode 2) {run.requests['mode2']}",
        ],
        [
            "contour elements seen ahead",
            f"{plc.get('elements_followed')} by distance, "
            f"{plc.get('log_entries')} log entries by index",
        ],
        ["lowest override set by the PLC", f"{plc.get('lowest_override')} %"],
        ["handshake over a scan", _us(run.handshake_us)],
        ["raw C exchange beside it", _us(result.raw_us)],
        ["overruns", str(run.overruns)],
    ]
    picture = str(result.folder / "demo.png") if result.drawn else EXTRA
    rows.append(["picture", picture])
    title = "hli-cosim demo: CNC and PLC side by side"
    print_table(title, ("what", "value"), rows)
    out.print("\n".join(_next_steps(result)))


def _next_steps(result: Any) -> list[str]:
    """What to open and to try behind the demo."""
    folder = result.folder
    steps = []
    if result.drawn:
        steps.append((f"open {folder / 'demo.png'}", result.told))
    page = folder / "demo.html"
    steps += [
        (
            f"hli-cosim show {folder / 'demo.npz'} -o {page}",
            "writes a page with curves, cursor and zoom",
        ),
        ("hli-cosim new my-cell", "begins a cell of your own"),
    ]
    return ["Next:", *(f"  {one}\n    {what}" for one, what in steps)]


def _us(values: dict[str, float | None]) -> str:
    known = [f"{k} {number(v)}" for k, v in values.items() if v is not None]
    return f"{', '.join(known)} us"


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
    with (
        telling_interrupts(as_json),
        progress(f"running {file.name}"),
        Cell(config) as cell,
    ):
        cell.config.of_one_channel()
        result = cell.run_with(options, file, "builtin:query", query)
    say_run_errors(result)
    answer = result.plc.get("result")
    if answer is not None and as_json:
        emit(answer)
    elif answer is not None:
        print_answer(answer)
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


@app.command()
@expanded
def cnc(
    options: CncSideOptions,
    files: Files = None,
    name: SegmentName = "hli-cosim",
    wait: Annotated[
        bool,
        typer.Option(
            "--wait/--no-wait",
            help="start the program when a PLC has attached, or at once",
        ),
    ] = True,
    config: Config = None,
    monitor: MonitorToo = False,
) -> None:
    """Run the CNC side alone; a PLC attaches from another terminal.

    The PLC may come back after it died.

    Example: hli-cosim cnc part.nc --name my-cell
    """
    from ..cell.programs import refuse_mcap  # noqa: PLC0415
    from ..config import load_config, setups_of  # noqa: PLC0415
    from ..files import need_program  # noqa: PLC0415
    from ..process.__main__ import run_cnc  # noqa: PLC0415

    check_choices(options)
    segment.check_name(name)
    cell = load_config(config)
    programs = _programs(files or [], config)
    for path in filter(None, programs):
        need_program(path)
    file = next(path for path in programs if path is not None)
    if len(programs) > 1:
        refuse_mcap(options.record)
    chosen = CncOptions(
        programs[0],
        name,
        options.run_options(),
        config=config,
        wait_plc=wait,
        attended=monitor,
        more=programs[1:],
    )
    recording = None
    if options.record:
        from ..process.recording import SoleRecording  # noqa: PLC0415

        tell_unwritable(options.record)
        recording = SoleRecording(options.record, config, options.record_only)
        chosen = recording.options(chosen)
    for setup, program in zip(setups_of(cell), programs, strict=True):
        if wait and program is not None:
            _check_ahead(program, setup, options.dialect)
    doing = "waiting for a PLC" if wait else "running"
    err.print(
        f"CNC on segment {name!r}, {options.clock}; {doing}; Ctrl-C ends it"
    )
    with (
        beside(monitor, name, file, config),
        recording or contextlib.nullcontext(),
    ):
        status = run_cnc(chosen)
    for text in recording.told if recording else ():
        say_error(f"warning: {text}")
    raise typer.Exit(status)


def tell_unwritable(record: Path | None) -> None:
    """Warn ahead of a run of a recording that nobody can write; the run goes on."""
    if record is None:
        return
    from ..recording.parts import why_unwritable  # noqa: PLC0415

    why = why_unwritable(record)
    if why:
        say_error(
            f"warning: recording {record}: {why}; the run goes on without it"
        )


CHECK_S = 2.0  # of wall time; the rest of a long program is read while it runs


def _check_ahead(file: Path, setup: ChannelSetup, dialect: str | None) -> None:
    """Tell the program's errors before somebody waits for a PLC to start it.

    The CNC goes on: a PLC may select another program.
    """
    from ..program import Program  # noqa: PLC0415

    end = time.monotonic() + CHECK_S
    errors: list[CncError] = []
    try:
        program = Program(
            file, setup.cell, dialect or setup.dialect, collect=True
        )
        for _ in program.batches():
            if time.monotonic() > end:
                break
        errors = program.errors
    except CncError as error:
        errors = [error]
    say_errors(errors, SHOWN_ERRORS)


@app.command()
@expanded
def plc(
    file: Annotated[
        Path,
        typer.Argument(help="Python file with @task classes, or ST program"),
    ],
    st: StOptions,
    name: SegmentName = "hli-cosim",
    report: Annotated[
        Path | None,
        typer.Option(
            help="write statistics and watch list here at the end (JSON)"
        ),
    ] = None,
    watch: Watched = None,
    force: Forced = None,
    config: Annotated[
        Path | None,
        typer.Option(
            "--config", "--cell", help="cell.toml, for its simulated inputs"
        ),
    ] = None,
) -> None:
    """Run the PLC side alone: waits for the CNC, re-attaches when it comes
    back; SIGUSR1 restarts the PLC.

    Example: hli-cosim plc my_plc.py --name my-cell
    """
    from plc_client.__main__ import main as plc_main  # noqa: PLC0415

    from ..config import load_config  # noqa: PLC0415

    if not file.exists():
        raise CncError(901001, "file not found", Place(str(file)))
    if watch and not report:
        err.print(
            "warning: --watch without --report: the values go nowhere; add"
            " --report FILE.json, or use hli-cosim watch"
        )
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
    arguments += [part for word in st.words() for part in ("--st", word)]
    if config is not None:
        inputs = load_config(config).simulated_inputs
        arguments += ["--inputs", json.dumps(inputs)]
    raise typer.Exit(plc_main(arguments))
