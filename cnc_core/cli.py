"""The command line ``hli-cosim``; every command and every JSON field is named in the README and the docs.

Exit status: 0 success, 1 program or user error, 2 wrong usage, 130 interrupted.
"""

from __future__ import annotations

import json
import math
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from hli.errors import HliError

from .errors import CncError, Place

app = typer.Typer(
    name="hli-cosim",
    help="Open co-simulation of a CNC and a PLC over an emulated ISG/Beckhoff HLI.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
bench_app = typer.Typer(help="Measure this machine beside a raw C reference in the same run.", no_args_is_help=True)
app.add_typer(bench_app, name="bench")
out = Console(highlight=False, soft_wrap=True, markup=False)
err = Console(stderr=True, highlight=False, soft_wrap=True, markup=False)

DIALECT_HELP = "isg, iso, isons or osai; default: by content and file extension"
File = Annotated[Path, typer.Argument(help="NC program")]
Config = Annotated[Path | None, typer.Option("--config", help="cell.toml; default: the built-in machine X Y Z")]
Dialect = Annotated[str | None, typer.Option("--dialect", help=DIALECT_HELP)]
Lenient = Annotated[
    bool, typer.Option("--lenient", help="isg: unknown # commands and undefined M functions are warnings")
]
Answers = Annotated[
    Path | None, typer.Option("--answers", help="JSON list of answers to the program's dialogs (isons)")
]
StartLine = Annotated[int | None, typer.Option("--start-line", help="take the program up at this line (isons)")]
StartPass = Annotated[int, typer.Option("--start-pass", min=1, help="which time that line is reached")]
StartMarker = Annotated[
    str | None, typer.Option("--start-marker", metavar="NAME=VALUE", help="take it up where a variable gets a value")
]
Json = Annotated[bool, typer.Option("--json", help="print JSON on standard output and nothing else")]


_emitted: list[bool] = []


def emit(value: Any) -> None:
    """One JSON value on one line of standard output."""
    _emitted.append(True)
    sys.stdout.write(json.dumps(value) + "\n")


def say_error(error: object) -> None:
    """An error on standard error, as FILE:LINE:COL: CODE: text with the source line under it."""
    sys.stderr.write(f"{error}\n")


@contextmanager
def progress(title: str) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal, nothing in a pipe; call the result with the share done (None-length: pulsing)."""
    with Progress(console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(title, total=None)

        def tick(share: float) -> None:
            bar.update(task, total=1.0, completed=share)

        yield tick


def load(config: Path | None) -> Any:
    from .config import load_config  # noqa: PLC0415

    cell = load_config(config)
    for warning in cell.warnings():
        err.print(f"warning: {warning}")
    return cell


def open_program(
    file: Path,
    config: Path | None,
    dialect: str | None,
    *,
    collect: bool = False,
    lenient: bool = False,
    tolerance: float = 0.0,
    programmed: bool = False,
    answers: Path | None = None,
    restart: tuple[int | None, int, str | None] = (None, 1, None),
) -> Any:
    """The program, its dialect said on standard error when it was not given."""
    from .program import Program  # noqa: PLC0415
    from .restart import Restart  # noqa: PLC0415

    program = Program(
        file,
        load(config),
        dialect,
        collect=collect,
        lenient=lenient,
        tolerance=tolerance,
        programmed=programmed,
        answers=answers,
        restart=Restart.of(*restart),
    )
    if dialect is None:
        err.print(f"dialect: {program.dialect} (by content and name; --dialect chooses another)")
    return program


def say_warnings(program: Any) -> None:
    for warning in program.reader.warnings:
        say_error(f"warning: {warning}")
    for text in program.filter_texts:
        say_error(text)


# ------------------------------------------------------------------------------------------------ programs
@app.command()
def check(
    file: File,
    config: Config = None,
    dialect: Dialect = None,
    lenient: Lenient = False,
    answers: Answers = None,
    as_json: Json = False,
) -> None:
    """Parse and execute a program without motion and report all its errors.

    Example: hli-cosim check part.nc --json
    """
    from .blocks import number_of_blocks  # noqa: PLC0415

    count, errors = 0, []
    setups: list[dict[str, Any]] = []
    try:
        with progress(f"checking {file.name}"):
            program = open_program(
                file, config, dialect, collect=True, lenient=lenient, programmed=True, answers=answers
            )
            count = sum(map(number_of_blocks, program.batches()))
        errors, setups = program.errors, getattr(program.reader, "setups", [])
        say_warnings(program)
    except CncError as error:
        errors = [error]
    for found in errors:
        say_error(found)
    if as_json:
        emit({"errors": [e.as_json() for e in errors], "blocks": count} | ({"setups": setups} if setups else {}))
    elif not errors:
        for setup in setups:
            out.print(f"setup {setup['file']}\n" + "\n".join(f"  {line}" for line in setup["printed"]))
        out.print(f"{file}: {count} blocks, no errors")
    if errors:
        raise typer.Exit(1)


@app.command()
def blocks(
    file: File,
    config: Config = None,
    dialect: Dialect = None,
    lenient: Lenient = False,
    answers: Answers = None,
    start_line: StartLine = None,
    start_pass: StartPass = 1,
    start_marker: StartMarker = None,
    as_json: Json = False,
) -> None:
    """Print the canonical blocks of a program: after all geometry stages, in machine coordinates.

    Example: hli-cosim blocks part.nc --json
    """
    from . import blocks as rows  # noqa: PLC0415

    restart = (start_line, start_pass, start_marker)
    program = open_program(
        file, config, dialect, lenient=lenient, programmed=True, answers=answers, restart=restart
    )
    cell = program.cell
    start = cell.axis_values("start_mm")
    for batch in program.batches():
        for block in rows.blocks(batch, start, cell.axis_names, cell.main_axes):
            if block.row["type"] in rows.SILENT:
                continue
            value = block.as_json()
            if as_json:
                emit(value)
            else:
                out.print(_block_line(value))
    say_warnings(program)


def _block_line(value: dict[str, Any]) -> str:
    """One canonical block as a line for people."""
    head = f"{value['line']:>6} N{value['n']:<6} {value['type']:<10}"
    rest = []
    for key, item in value.items():
        if key in ("type", "line", "n", "count", "start", "rapid"):
            continue
        if isinstance(item, dict):
            rest.append(" ".join(f"{k}{_numbers(v)}" for k, v in item.items()))
        else:
            rest.append(f"{key} {item:.6g}" if isinstance(item, float) else f"{key} {item}")
    return head + "  " + ", ".join(rest)


def _numbers(value: float | list[float]) -> str:
    return f"{value:.4f}" if isinstance(value, float) else "(" + " ".join(f"{v:.6g}" for v in value) + ")"


@app.command()
def plan(
    file: File,
    lookahead: Annotated[
        int | None, typer.Option(min=10, max=10000, help="look-ahead blocks instead of the cell's")
    ] = None,
    no_jerk: Annotated[
        bool, typer.Option("--no-jerk", help="acceleration-limited, whatever the machine's jerk")
    ] = False,
    tolerance: Annotated[float, typer.Option(min=0.0, help="allowed path deviation in mm; 0: exact path")] = 0.0,
    samples: Annotated[Path | None, typer.Option(help="write t, pos, axes, s, v, block to this .npz")] = None,
    picture: Annotated[Path | None, typer.Option(help="draw path, speed, acceleration and jerk to this .png")] = None,
    config: Config = None,
    dialect: Dialect = None,
    lenient: Lenient = False,
    answers: Answers = None,
    start_line: StartLine = None,
    start_pass: StartPass = 1,
    start_marker: StartMarker = None,
    as_json: Json = False,
) -> None:
    """Plan the whole program without a PLC and measure the emitted trajectory.

    Example: hli-cosim plan part.nc --lookahead 190 --samples part.npz
    """
    from .planning import plan_program, save_samples  # noqa: PLC0415
    from .recorder import check_writable  # noqa: PLC0415

    for target in (samples, picture):
        if target:
            check_writable(target)
    program = open_program(
        file, config, dialect, lenient=lenient, tolerance=tolerance, answers=answers,
        restart=(start_line, start_pass, start_marker),
    )  # fmt: skip
    with progress(f"planning {file.name}"):
        result = plan_program(program, window=lookahead, jerk=not no_jerk, keep_samples=bool(samples or picture))
    say_warnings(program)
    if samples and result.samples:
        save_samples(samples, result.samples)
    if picture and result.samples:
        from .picture import plan_picture  # noqa: PLC0415

        plan_picture(picture, result.samples)
    value = result.as_json()
    if as_json:
        emit(value)
        return
    table = Table("figure", "value", title=str(file))
    for key, item in value.items():
        table.add_row(key, json.dumps(item))
    out.print(table)


# ------------------------------------------------------------------------------------------------ co-simulation
@app.command()
def optimize(
    file: Annotated[Path, typer.Argument(metavar="IN", help="program of points")],
    setup: Annotated[Path, typer.Argument(metavar="SETUP", help="HSM setup with SMT (and SMS)")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="program of polynomials; its setup is OUT.setup")],
    compare: Annotated[bool, typer.Option("--compare", help="plan both programs and compare times")] = False,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Turn noisy points into smooth polynomials within a tolerance (Path Optimizer).

    Example: hli-cosim optimize surface.osai CONFIG1 smooth.osai --compare
    """
    from .optimize import optimize as run_optimizer  # noqa: PLC0415

    for path in (file, setup):
        if not path.is_file():
            raise CncError(901001, "file not found", Place(str(path)))
    with progress(f"optimizing {file.name}") as tick:
        value = run_optimizer(file, setup, target, load(config), tick, compared=compare).as_json()
    if as_json:
        emit(value)
        return
    table = Table("figure", "value", title=str(target))
    for key, item in value.items():
        table.add_row(key, json.dumps(item))
    out.print(table)


Watched = Annotated[
    list[str] | None, typer.Option("--watch", metavar="SYMBOL", help="record this symbol at every scan; repeatable")
]
Forced = Annotated[
    list[str] | None, typer.Option("--force", metavar="SYMBOL=VALUE", help="hold this symbol at a value; repeatable")
]


@app.command()
def run(
    file: File,
    plc: Annotated[
        str | None,
        typer.Option(help="PLC program (Python file with @task classes), or none; default: acknowledges everything"),
    ] = None,
    clock: Annotated[str, typer.Option(help="lockstep, freerun or realtime")] = "lockstep",
    service: Annotated[
        str | None, typer.Option(help="look-ahead service: cyclic or immediate; default: the cell's")
    ] = None,
    out_dir: Annotated[Path, typer.Option("--out", help="folder for files the program writes")] = Path("hli-cosim-out"),
    record: Annotated[Path | None, typer.Option(help="record every cycle to this .npz, .csv or .parquet")] = None,
    watch: Watched = None,
    force: Forced = None,
    autostart: Annotated[
        bool, typer.Option("--autostart/--no-autostart", help="start the program, or leave that to the PLC")
    ] = True,
    config: Config = None,
    dialect: Dialect = None,
    lenient: Lenient = False,
    answers: Answers = None,
    start_line: StartLine = None,
    start_pass: StartPass = 1,
    start_marker: StartMarker = None,
    as_json: Json = False,
) -> None:
    """Co-simulate: a CNC process runs the program beside a PLC process.

    Example: hli-cosim run part.nc --plc my_plc.py --record part.npz
    """
    from plc_client.online import parse_force  # noqa: PLC0415

    from .cell import Cell  # noqa: PLC0415

    _one_of("--clock", clock, ("lockstep", "freerun", "realtime"))
    if service:
        _one_of("--service", service, ("cyclic", "immediate"))
    with progress(f"running {file.name}"), Cell(config, clock=clock, service=service) as cell:
        symbols = dict(parse_force(text) for text in force or [])
        result = cell.run(
            file, plc, dialect=dialect, out=out_dir, record=record, lenient=lenient, autostart=autostart,
            watch=watch or (), force=symbols, answers=answers,
            start_line=start_line, start_pass=start_pass, start_marker=start_marker,
        )  # fmt: skip
    if dialect is None and result.dialect:
        err.print(f"dialect: {result.dialect} (by content and name; --dialect chooses another)")
    _say_run_errors(result)
    if as_json:
        emit(result.as_json())
    else:
        _print_run(result, str(file))
    if result.end != "completed":
        raise typer.Exit(1)


def _one_of(option: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise typer.BadParameter(f"{option} {value}: choose from {', '.join(choices)}")


def _say_run_errors(result: Any) -> None:
    for warning in result.warnings:
        say_error(f"warning: {warning}")
    for e in result.errors:
        place = f"{e['file']}:{e['line']}:{e['column']}: " if e["line"] else ""
        say_error(f"{place}{e['code']}: {e['text']}")
        if e["line"] and result.error_text and e["line"] == result.errors[0]["line"]:
            say_error(f"    {result.error_text}")


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
        "recorded",
    ):
        table.add_row(key, json.dumps(value[key]))
    out.print(table)
    for message in result.messages:
        out.print(message)


@app.command()
def demo(
    seconds: Annotated[float, typer.Option(min=1.0, max=3600.0, help="machine time to show")] = 10.0,
    out_dir: Annotated[Path, typer.Option("--out", help="folder for program, recording and picture")] = Path(
        "hli-cosim-demo"
    ),
    as_json: Json = False,
) -> None:
    """Show the main job: both processes, both look-ahead modes, a PLC that sets the override from the coming contour.

    Example: hli-cosim demo --seconds 20 --out demo
    """
    from .demo import run_demo  # noqa: PLC0415

    with progress("co-simulating the bundled part"):
        result = run_demo(seconds, out_dir)
    _say_run_errors(result.run)
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
    table = Table("what", "value", title="hli-cosim demo: CNC and PLC side by side")
    table.add_row("cycles (1 ms)", f"{run.cycles}, {run.sim_time_s:.2f} s of machine time in {run.wall_time_s:.2f} s")
    table.add_row("faster than real time", f"{run.realtime_factor:.0f} x")
    table.add_row("requests", f"mode 1: {run.requests['mode1']}, mode 2: {run.requests['mode2']}")
    table.add_row(
        "contour elements seen ahead",
        f"{plc.get('elements_followed')} by distance, {plc.get('log_entries')} log entries by index",
    )
    table.add_row("lowest override set by the PLC", f"{plc.get('lowest_override')} %")
    table.add_row("handshake over a scan, us", _us(run.handshake_us))
    table.add_row("raw C exchange beside it, us", _us(result.raw_us))
    table.add_row("overruns", str(run.overruns))
    table.add_row("picture", str(result.folder / "demo.png"))
    out.print(table)


@app.command()
def lookahead(
    file: File,
    index: Annotated[float | None, typer.Option(help="mode 1: from this entry of the marked log on")] = None,
    distance: Annotated[
        tuple[float, float] | None, typer.Option(metavar="START LENGTH", help="mode 2: range in 0.1 um")
    ] = None,
    at: Annotated[str, typer.Option(help="start: prepared, no motion yet; end: after the program's end")] = "end",
    config: Config = None,
    dialect: Dialect = None,
    as_json: Json = False,
) -> None:
    """Ask for the contour from the PLC process through the real handshake.

    Example: hli-cosim lookahead part.nc --distance 0 500000 --at start
    """
    from .cell import Cell  # noqa: PLC0415

    _one_of("--at", at, ("start", "end"))
    if (index is None) == (distance is None):
        raise typer.BadParameter("give either --index I or --distance START LENGTH")
    if distance is not None and distance[1] == 0:
        raise typer.BadParameter("--distance: LENGTH 0 selects mode 1 on the control unit; use --index")
    if not all(math.isfinite(x) for x in distance or (index or 0.0,)):
        raise CncError(900012, f"the request {distance or index} is not made of finite numbers")
    query = (
        {"mode": 1, "start": index, "length": 0.0}
        if distance is None
        else {"mode": 2, "start": distance[0], "length": distance[1]}
    )
    with progress(f"running {file.name}"), Cell(config) as cell:
        result = cell.run(file, "builtin:query", plc_args=query | {"at": at}, dialect=dialect, hold_start=at == "start")
    _say_run_errors(result)
    answer = result.plc.get("result")
    if answer is not None and as_json:
        emit(answer)
    elif answer is not None:
        _print_answer(answer)
    if answer is None or result.end != "completed":
        raise typer.Exit(1)


def _print_answer(answer: dict[str, Any]) -> None:
    out.print(f"mode {answer['mode']}, request {answer['request']}, state {answer['state']}")
    names = [
        "block_type",
        "block_number",
        "start_position",
        "length",
        "compensated_radius",
        "circle_angle",
        "tangent_variation",
    ]
    table = Table(*(n.removeprefix("block_").replace("compensated_", "") for n in names), box=None)
    for row in answer["response"]:
        table.add_row(*(f"{row[n]:.6f}" if isinstance(row[n], float) else str(row[n]) for n in names))
    out.print(table)


@app.command()
def cnc(
    file: File,
    name: Annotated[str, typer.Option(help="name of the shared-memory segment")] = "hli-cosim",
    clock: Annotated[str, typer.Option(help="lockstep, freerun or realtime")] = "realtime",
    service: Annotated[str | None, typer.Option(help="look-ahead service: cyclic or immediate")] = None,
    wait: Annotated[
        bool, typer.Option("--wait/--no-wait", help="start the program when a PLC has attached, or at once")
    ] = True,
    autostart: Annotated[
        bool, typer.Option("--autostart/--no-autostart", help="start the program, or leave that to the PLC")
    ] = True,
    config: Config = None,
    dialect: Dialect = None,
) -> None:
    """Run the CNC side alone; a PLC attaches from another terminal and may come back after it died.

    Example: hli-cosim cnc part.nc --name my-cell
    """
    from .cnc_process import CncOptions, run_cnc  # noqa: PLC0415

    _one_of("--clock", clock, ("lockstep", "freerun", "realtime"))
    if service:
        _one_of("--service", service, ("cyclic", "immediate"))
    options = CncOptions(
        file, name, config=config, dialect=dialect, clock=clock, service=service, wait_plc=wait, autostart=autostart
    )
    err.print(f"CNC on segment {name!r}, {clock}; " + ("waiting for a PLC" if wait else "running") + "; Ctrl-C ends it")
    raise typer.Exit(run_cnc(options))


@app.command()
def plc(
    file: Annotated[Path, typer.Argument(help="Python file with @task classes")],
    name: Annotated[str, typer.Option(help="name of the shared-memory segment")] = "hli-cosim",
    report: Annotated[Path | None, typer.Option(help="write statistics and watch list here at the end (JSON)")] = None,
    watch: Watched = None,
    force: Forced = None,
) -> None:
    """Run the PLC side alone: waits for the CNC, re-attaches when it comes back; SIGUSR1 restarts the PLC.

    Example: hli-cosim plc my_plc.py --name my-cell
    """
    from plc_client.__main__ import main as plc_main  # noqa: PLC0415

    if not file.is_file():
        raise CncError(901001, "file not found", Place(str(file)))
    err.print(f"PLC {file.name} on segment {name!r}; Ctrl-C ends it")
    arguments = ["--name", name, "--file", str(file), *(("--report", str(report)) if report else ())]
    arguments += [part for path in watch or [] for part in ("--watch", path)]
    arguments += [part for text in force or [] for part in ("--force", text)]
    raise typer.Exit(plc_main(arguments))


PlcName = Annotated[str, typer.Option("--name", help="segment of the running PLC")]
PlcWait = Annotated[float, typer.Option("--wait", min=0.0, help="seconds to wait for a PLC that is just starting")]


def _order(name: str, wait: float, do: str, symbols: list[Any], as_json: bool) -> None:
    """One order to a running PLC; prints what it reads and what is forced then."""
    from plc_client import orders  # noqa: PLC0415

    answer = orders.send(name, {"do": do, "symbols": symbols}, wait)
    if as_json:
        emit(answer)
        return
    for path, value in answer.get("values", {}).items():
        out.print(f"{path} = {value}")
    for path, value in answer["forced"].items() if do != "read" else ():
        out.print(f"forced: {path} = {value}")
    if do != "read" and not answer["forced"]:
        out.print("nothing is forced")


@app.command()
def force(
    symbols: Annotated[list[str] | None, typer.Argument(metavar="[SYMBOL=VALUE]...", help="none: list")] = None,
    name: PlcName = "hli-cosim",
    wait: PlcWait = 0.0,
    as_json: Json = False,
) -> None:
    """Hold symbols of a running PLC at a value, from another terminal; without symbols, list what is forced.

    Example: hli-cosim force --name my-cell 'gpCh[0]^.bahn_mc_control.override.command_w=500' Slow.gain=2
    """
    from plc_client.online import parse_force  # noqa: PLC0415

    given = [list(parse_force(text)) for text in symbols or []]
    _order(name, wait, "force" if given else "list", given, as_json)


@app.command()
def unforce(
    symbols: Annotated[list[str] | None, typer.Argument(metavar="[SYMBOL]...", help="what to let go")] = None,
    everything: Annotated[bool, typer.Option("--all", help="let all symbols go")] = False,
    name: PlcName = "hli-cosim",
    wait: PlcWait = 0.0,
    as_json: Json = False,
) -> None:
    """Let forced symbols of a running PLC go; each keeps its value until somebody writes it.

    Example: hli-cosim unforce --name my-cell Slow.gain
    """
    if bool(symbols) == everything:
        raise typer.BadParameter("name symbols, or give --all")
    _order(name, wait, "unforce", list(symbols or []), as_json)


@app.command()
def read(
    symbols: Annotated[list[str], typer.Argument(metavar="SYMBOL...", help="variables of the HLI or of a task")],
    name: PlcName = "hli-cosim",
    wait: PlcWait = 0.0,
    as_json: Json = False,
) -> None:
    """Read variables of a running PLC, HLI and tasks, as they are between two scans.

    Example: hli-cosim read --name my-cell 'gpCh[0]^.bahn_state.dist_prog_start' Slow.gain
    """
    _order(name, wait, "read", list(symbols), as_json)


# ------------------------------------------------------------------------------------------------ tools
@app.command()
def types(
    st: Annotated[bool, typer.Option("--st", help="IEC 61131-3 Structured Text")] = False,
    c: Annotated[bool, typer.Option("--c", help="C header")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="JSON")] = False,
    twincat: Annotated[
        Path | None, typer.Option(help="with --st: write .TcDUT and .TcGVL files of a TwinCAT 3 project to this folder")
    ] = None,
) -> None:
    """Print the HLI layout for PLC compilers, C programs and tools.

    Example: hli-cosim types --st > HLI.st
    """
    from hli import export  # noqa: PLC0415

    if st + c + as_json != 1:
        raise typer.BadParameter("give one of --st, --c, --json")
    if twincat is not None:
        if not st:
            raise typer.BadParameter("--twincat goes with --st")
        twincat.mkdir(parents=True, exist_ok=True)
        for name, text in export.twincat_files().items():
            (twincat / name).write_text(text, encoding="utf-8")
        return
    sys.stdout.write(
        export.st_types() if st else export.c_header() if c else json.dumps(export.json_layout(), indent=1) + "\n"
    )


Seconds = Annotated[float, typer.Option(min=1.0, max=600.0, help="about how long to measure")]


def _bench(measure: Callable[..., dict[str, Any]], title: str, as_json: bool) -> None:
    with progress(title) as tick:
        value = measure(tick)
    if as_json:
        emit(value)
        return
    table = Table("figure", "value", title=title)
    for key, item in value.items():
        table.add_row(key, json.dumps(item))
    out.print(table)


@bench_app.command("handshake")
def bench_handshake(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Handshake round trips: raw C, immediate service, Python on both sides, cyclic service.

    Example: hli-cosim bench handshake --seconds 30 --json
    """
    from . import benchmarks  # noqa: PLC0415

    _bench(lambda tick: benchmarks.handshake(seconds, tick), "bench handshake", as_json)


@bench_app.command("cycle")
def bench_cycle(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Real-time cycle: what it costs and how late it wakes, beside a bare clock_nanosleep loop.

    Example: hli-cosim bench cycle --seconds 20 --json
    """
    from . import benchmarks  # noqa: PLC0415

    _bench(lambda _tick: benchmarks.cycle(seconds), "bench cycle", as_json)


@bench_app.command("planner")
def bench_planner(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Planner: blocks per second, motion time, limits, per workload and look-ahead.

    Example: hli-cosim bench planner --json
    """
    from . import benchmarks  # noqa: PLC0415

    _bench(lambda _tick: benchmarks.planner(seconds), "bench planner", as_json)


@bench_app.command("parser")
def bench_parser(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Reader: lines per second from text to canonical rows.

    Example: hli-cosim bench parser --json
    """
    from . import benchmarks  # noqa: PLC0415

    _bench(lambda _tick: benchmarks.parser(seconds), "bench parser", as_json)


def main() -> None:
    """Entry point: runs a command and turns every expected failure into its exit status."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the caller had it ignored
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that what runs is ended and the recording kept
    try:
        code = app(standalone_mode=False)
        sys.exit(code if isinstance(code, int) else 0)
    except (KeyboardInterrupt, typer.Abort):
        sys.stderr.write("interrupted\n")
        sys.exit(130)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except Exception as error:
        sys.exit(_failed(error))


def _numbered(error: Exception) -> CncError:
    """An expected failure as an error with a number."""
    if isinstance(error, CncError):
        return error
    if isinstance(error, HliError):
        return CncError(error.code, str(error))
    if isinstance(error, OSError):
        return CncError(901004 if error.filename else 901002, f"{error.filename or ''}: {error.strerror}")
    return CncError(905015 if "segment name" in str(error) else 900012, str(error))


def _failed(error: Exception) -> int:
    """Print an expected failure and give its status; anything else is a bug and keeps its traceback.

    With --json standard output gets one object all the same, unless the command has printed something already.
    """
    if hasattr(error, "show") and hasattr(error, "exit_code"):  # wrong usage, found by the command-line parser
        error.show()
        return int(error.exit_code)
    if not isinstance(error, CncError | HliError | OSError | ValueError):
        raise error
    numbered = _numbered(error)
    for each in (numbered, *numbered.also):
        say_error(each)
    if "--json" in sys.argv and not _emitted:
        emit(_empty_result(numbered))
    return 1


def _empty_result(error: CncError) -> dict[str, Any]:
    """What --json prints when a command ends before it has a result: ``errors``, for ``run`` the whole run object."""
    if "run" in sys.argv[1:2]:
        from .cell import RunResult  # noqa: PLC0415

        return RunResult(end="error", errors=[e.as_json() for e in (error, *error.also)]).as_json()
    return {"errors": [e.as_json() for e in (error, *error.also)]}


if __name__ == "__main__":
    main()
