"""Commands that look at a program: check, blocks, plan, optimize."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from ..errors import CncError, Place
from .console import (
    COLUMNS,
    SHOWN_ERRORS,
    app,
    emit,
    interrupted,
    load,
    out,
    say_causes,
    say_dialect,
    say_error,
    say_errors,
    say_warnings,
    say_wrapped,
)
from .options import (
    OPTIONS,
    Config,
    File,
    Files,
    Json,
    PlaceOptions,
    ReadOptions,
    StOptions,
    Strict,
    expanded,
)
from .progressing import program_bar
from .tables import number, say_figures

if TYPE_CHECKING:
    from ..planning import Feeder, PlanResult

NO_PLACE = PlaceOptions().place


def channel_of(cell: Any, name: str | None) -> tuple[Any, Any]:
    """The channel that a program is for, and the signals of the others.

    CncError: the cell has several and none is named, or none of this name.
    """
    from ..config import setups_of  # noqa: PLC0415
    from ..frontend.signals import OpenSignals  # noqa: PLC0415

    setups = {setup.place.name: setup for setup in setups_of(cell)}
    known = ", ".join(setups)
    if len(setups) == 1 and name is None:
        return next(iter(setups.values())), None
    if name not in setups or not name:
        asked = f"no channel {name!r}" if name else "several channels"
        raise CncError(
            902001,
            f"the cell has {asked}: --channel NAME, one of {known or 'none'}",
        )
    signals = OpenSignals(list(setups)) if len(setups) > 1 else None
    return setups[name], signals


def open_program(
    file: Path,
    options: ReadOptions,
    *,
    collect: bool = False,
    tolerance: float | None = None,
    programmed: bool = False,
) -> Any:
    """The program, its dialect said on standard error when it was not given."""
    from ..config import setups_of  # noqa: PLC0415
    from ..config.exchange import axes_of, places_of  # noqa: PLC0415
    from ..frontend.axes import OpenAxes  # noqa: PLC0415
    from ..program import Program  # noqa: PLC0415
    from ..program.restart import Restart  # noqa: PLC0415

    place = options.place if isinstance(options, PlaceOptions) else NO_PLACE
    cell = load(options.config)
    setup, signals = channel_of(cell, options.channel)
    program = Program(
        file,
        setup.cell,
        options.dialect or setup.dialect,
        collect=collect,
        lenient=options.lenient,
        tolerance=tolerance,
        programmed=programmed,
        answers=options.answers,
        restart=Restart.of(*place),
        signals=signals,
        axes=OpenAxes(axes_of(setups_of(cell)), places_of(setup)),
        channel=setup.place.index + 1,
    )
    if options.dialect is None:
        say_dialect(program.dialect)
    return program


class Checked(NamedTuple):
    """What a check of one program has found."""

    errors: list[CncError]
    blocks: int
    setups: list[dict[str, Any]]
    warned: bool = False


def checked(file: Path, options: ReadOptions) -> Checked:
    """Read and execute it without motion."""
    from ..blocks import number_of_blocks, number_of_last  # noqa: PLC0415

    count = 0
    try:
        with program_bar(f"checking {file.name}", file) as bar:
            program = open_program(file, options, collect=True, programmed=True)
            for batch in program.batches():
                count += number_of_blocks(batch)
                bar.program(program, number_of_last(batch))
        say_warnings(program)
    except CncError as error:
        return Checked([error], count, [])
    return Checked(
        program.errors,
        count,
        program.reader.setups,
        bool(program.reader.warnings),
    )


@app.command()
@expanded
def check(
    file: File,
    options: ReadOptions,
    st: StOptions,
    more: Annotated[
        list[Path] | None,
        typer.Argument(help="programs of further channels of the cell"),
    ] = None,
    everything: Annotated[
        bool,
        typer.Option("--all", help=f"all errors, not the first {SHOWN_ERRORS}"),
    ] = False,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Parse and execute a program without motion and report its errors.

    Without --channel the programs of all channels of a cell are checked.

    Example: hli-cosim check part.nc --json
    """
    from plc_client.task import is_st  # noqa: PLC0415

    from .check_cell import check_cell, takes_all  # noqa: PLC0415

    if is_st(file):
        from .structured_text import check_st  # noqa: PLC0415

        check_st(file, st.words(), strict, as_json)
        return
    files = [file, *(more or ())]
    shown = None if everything else SHOWN_ERRORS
    if takes_all(files, options):
        check_cell(files, options, checked, shown, strict, as_json)
        return
    errors, count, setups, warned = checked(file, options)
    say_errors(errors, shown)
    if as_json:
        emit(
            {"errors": [e.as_json() for e in errors], "blocks": count}
            | ({"setups": setups} if setups else {})
        )
    elif not errors:
        for setup in setups:
            out.print(
                f"setup {setup['file']}\n"
                + "\n".join(f"  {line}" for line in setup["printed"])
            )
        out.print(f"{file}: {count} blocks, no errors")
    if errors or (strict and warned):
        raise typer.Exit(1)


@app.command()
@expanded
def blocks(
    file: File,
    options: PlaceOptions,
    as_json: Json = False,
) -> None:
    """Print the canonical blocks of a program: after all geometry stages, in
    machine coordinates.

    Example: hli-cosim blocks part.nc --json
    """
    from .. import blocks as rows  # noqa: PLC0415

    program = open_program(file, options, programmed=True)
    cell = program.cell
    start = cell.axis_values("start_mm")
    with program_bar(f"reading {file.name}", file, printing=True) as bar:
        for batch in program.batches():
            bar.program(program, rows.number_of_last(batch))
            for block in rows.blocks(
                batch, start, cell.axis_names, cell.main_axes
            ):
                if block.row["type"] in rows.SILENT:
                    continue
                value = block.as_json()
                if as_json:
                    emit(value)
                else:
                    out.print(_block_lines(value))
    say_warnings(program)


BLOCK_UNITS = {
    "length": "mm",
    "feed": "mm/s",
    "radius": "mm",
    "programmed_radius": "mm",
    "angle": "rad",
    "seconds": "s",
}
UNTOLD = ("type", "line", "n", "count", "start", "rapid")
INDENT = 27  # of what a block's line goes on with


def _block_lines(value: dict[str, Any]) -> str:
    """One canonical block for people, in 80 columns."""
    head = f"{value['line']:>6} N{value['n']:<6} {value['type']:<10}"
    rest = []
    for key, item in value.items():
        if key in UNTOLD or item is None:
            continue
        if isinstance(item, dict):
            places = " ".join(f"{k}{_numbers(v)}" for k, v in item.items())
            rest.append(places if key == "end" else f"{key} {places}")
        else:
            text = number(item) if isinstance(item, float) else str(item)
            rest.append(f"{key} {text} {BLOCK_UNITS.get(key, '')}".rstrip())
    line = head + "  " + ", ".join(rest)
    if len(line) <= COLUMNS:
        return line
    return textwrap.fill(line, COLUMNS, subsequent_indent=" " * INDENT)


def _numbers(value: float | list[float]) -> str:
    return (
        f"{value:.4f}"
        if isinstance(value, float)
        else "(" + " ".join(map(number, value)) + ")"
    )


# why a ratio may lie above 1, which no limit of the path is
ABOVE_ONE = {
    "velocity": "an axis is faster than v_max_mm_s",
    "acceleration": "an axis exceeds a_max_mm_s2",
    "jerk": "an axis exceeds j_max_mm_s3",
    "feed": "the tool is faster than F: it cuts a corner within the tolerance,"
    " or other axes than the main ones move",
}
ROUNDED = 1.0 + 1e-6
CHECKED = 1.012  # of a limit: what the planner's own check allows


def say_ratios(ratios: dict[str, float | None]) -> list[str]:
    """A line for each limit that a sample of the trajectory exceeds."""
    return [
        f"max_ratio {name} {value:.4g}: "
        + (
            "within the planner's own tolerance of 1.2 %, seen between samples"
            if value <= CHECKED
            else ABOVE_ONE[name]
        )
        for name, value in ratios.items()
        if value is not None and value > ROUNDED
    ]


SamplesFile = Annotated[
    Path | None,
    typer.Option(help="write t, pos, axes, s, v, block to this .npz or .csv"),
]
RecordFile = Annotated[Path | None, OPTIONS["record"][1]]
RecordOnly = Annotated[list[str] | None, OPTIONS["record_only"][1]]
MaxWall = Annotated[float, OPTIONS["max_wall"][1]]
PictureFile = Annotated[
    Path | None,
    typer.Option(help="draw path, speed, acceleration and jerk to this .png"),
]


@app.command()
@expanded
def plan(
    options: PlaceOptions,
    files: Files = None,
    lookahead: Annotated[
        int | None,
        typer.Option(
            min=10, max=10000, help="look-ahead blocks instead of the cell's"
        ),
    ] = None,
    no_jerk: Annotated[
        bool,
        typer.Option(
            "--no-jerk",
            help="acceleration-limited, whatever the machine's jerk",
        ),
    ] = False,
    tolerance: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            help="allowed path deviation in mm; 0: exact path;"
            " default: the cell's",
        ),
    ] = None,
    samples: SamplesFile = None,
    picture: PictureFile = None,
    record: RecordFile = None,
    record_only: RecordOnly = None,
    max_wall: MaxWall = 0.0,
    as_json: Json = False,
) -> None:
    """Plan the whole program without a PLC and measure the emitted trajectory.

    Without --channel the channels of a cell are planned together: a time each,
    with what it waits for the others, and that of the whole.

    Example: hli-cosim plan part.nc --lookahead 190 --samples part.npz
    """
    from .plan_cell import only_file, plan_cell  # noqa: PLC0415

    file = only_file(files or [], options)
    if file is None:
        refused = {
            "--samples": samples,
            "--picture": picture,
            "--record": record,
            "--lookahead": lookahead,
            "--no-jerk": no_jerk,
        }
        plan_cell(
            files or [],
            options,
            refused,
            tolerance=tolerance,
            max_wall=max_wall,
            as_json=as_json,
        )
        return
    _check_targets(samples, picture)
    program = open_program(file, options, tolerance=tolerance)
    recording = _recording(record, program, options, record_only)
    result = _planned(
        program,
        max_wall,
        recording,
        window=lookahead,
        jerk=not no_jerk,
        keep_samples=bool(samples or picture),
    )
    say_warnings(program)
    _save(result, samples, picture)
    value = result.as_json()
    if as_json:
        emit(value)
        return
    say_figures(str(file), value)
    say_causes(result.time_by_cause)
    for line in say_ratios(result.max_ratio):
        say_wrapped(line)


def _recording(
    target: Path | None,
    program: Any,
    options: PlaceOptions,
    only: list[str] | None,
) -> Any:
    """None: nothing is recorded."""
    if not target:
        return None
    from ..planning.recording import PlanRecording  # noqa: PLC0415

    return PlanRecording(target, program, options.config, tuple(only or ()))


def _check_targets(samples: Path | None, picture: Path | None) -> None:
    """CncError: a file cannot be written."""
    from ..planning import check_samples_target  # noqa: PLC0415
    from ..recording.parts import check_writable  # noqa: PLC0415

    if samples:
        check_samples_target(samples)
    if picture:
        from ..planning.picture import need_matplotlib  # noqa: PLC0415

        need_matplotlib()
    for target in (samples, picture):
        if target:
            check_writable(target)


def _save(
    result: PlanResult, samples: Path | None, picture: Path | None
) -> None:
    from ..planning import save_samples  # noqa: PLC0415

    if samples and result.samples:
        save_samples(samples, result.samples)
    if picture and result.samples:
        from ..planning.picture import plan_picture  # noqa: PLC0415

        plan_picture(picture, result.samples, result.time_by_cause)


def _planned(
    program: Any, max_wall: float, recording: Any, **chosen: Any
) -> PlanResult:
    """The plan of a program that tells where it is."""
    from ..planning import plan_program  # noqa: PLC0415
    from ..planning.watching import PlanWatch  # noqa: PLC0415

    watch = PlanWatch(program, say_error, max_wall)
    path = program.path
    with program_bar(f"planning {path.name}", path) as bar:

        def look(feeder: Feeder) -> None:
            cycle = int(feeder.engine.state.cycle)
            bar.program(program, feeder.n, cycle * program.cell.cycle_s)
            watch.look(feeder)

        try:
            return plan_program(
                program, look=look, recording=recording, **chosen
            )
        except KeyboardInterrupt:
            written = recording.written if recording else None
            raise interrupted(watch.account(), written) from None


@app.command()
def optimize(
    file: Annotated[
        Path, typer.Argument(metavar="IN", help="program of points")
    ],
    setup: Annotated[
        Path,
        typer.Argument(metavar="SETUP", help="HSM setup with SMT (and SMS)"),
    ],
    target: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help="program of polynomials; its setup is OUT.setup"
        ),
    ],
    compare: Annotated[
        bool,
        typer.Option("--compare", help="plan both programs and compare times"),
    ] = False,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Turn noisy points into smooth polynomials within a tolerance (Path Optimizer).

    Example: hli-cosim optimize surface.osai CONFIG1 smooth.osai --compare
    """
    from ..optimize import optimize as run_optimizer  # noqa: PLC0415

    for path in (file, setup):
        if not path.is_file():
            raise CncError(901001, "file not found", Place(str(path)))
    with program_bar(f"optimizing {file.name}", file) as bar:
        value = run_optimizer(
            file, setup, target, load(config), bar.share, compared=compare
        ).as_json()
    if as_json:
        emit(value)
        return
    for warning in value.pop("warnings"):
        say_error(f"warning: {warning}")
    say_figures(str(target), value)
