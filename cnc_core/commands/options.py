"""Options that commands share, each written once.

A command takes a dataclass of options as one parameter.
``command`` shows the members of the dataclass as options of their own.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from ..process.options import (
    CLOCKS,
    OUT_FOLDER,
    SERVICES,
    STANDS_CELL_S,
    STANDS_WALL_S,
    RunOptions,
)
from .console import one_of

File = Annotated[Path, typer.Argument(help="NC program")]
Files = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="FILE...",
        help="NC program; several: one a channel, in the cell's order",
        show_default=False,
    ),
]
Symbols = Annotated[
    list[str],
    typer.Argument(
        metavar="SYMBOL...", help="variables of the HLI or of a task"
    ),
]
Json = Annotated[
    bool,
    typer.Option(
        "--json", help="print JSON on standard output and nothing else"
    ),
]
STRICT = typer.Option("--strict", help="warnings are errors")
Strict = Annotated[bool, STRICT]
CONFIG = typer.Option(
    "--config", "--cell", help="cell.toml; default: the built-in machine X Y Z"
)
Config = Annotated[Path | None, CONFIG]
SegmentName = Annotated[
    str, typer.Option("--name", help="name of the shared-memory segment")
]
DIALECT = typer.Option(
    "--dialect",
    help="isg, iso, isons or osai; default: by content and file extension",
)
Dialect = Annotated[str | None, DIALECT]
WATCH = typer.Option(
    "--watch",
    "--symbols",
    metavar="SYMBOL",
    help="record this symbol at every scan; repeatable",
)
FORCE = typer.Option(
    "--force",
    metavar="SYMBOL=VALUE",
    help="hold this symbol at a value; repeatable",
)
Watched = Annotated[list[str] | None, WATCH]
Forced = Annotated[list[str] | None, FORCE]


def _seconds(text: str) -> float:
    """The interval of a task."""
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(
            f"{text}: a number of seconds, 0.001 for 1 ms"
        ) from None


# member of an options dataclass: how it stands on the command line
OPTIONS: dict[str, tuple[Any, Any]] = {
    "interval": (
        float | None,
        typer.Option(
            "--interval",
            metavar="S",
            parser=_seconds,
            help="Structured Text: interval of the only task",
        ),
    ),
    "task": (
        list[str] | None,
        typer.Option(
            "--task",
            metavar="NAME:MS:PRIORITY=PROGRAM,..",
            help="Structured Text: a task with its programs; repeatable",
        ),
    ),
    "define": (
        list[str] | None,
        typer.Option(
            "--define",
            metavar="NAME",
            help="Structured Text: a name for {IF defined (NAME)}; repeatable",
        ),
    ),
    "short_circuit": (
        bool,
        typer.Option(
            "--short-circuit",
            help="Structured Text: AND and OR leave out what does not matter",
        ),
    ),
    "config": (Path | None, CONFIG),
    "dialect": (str | None, DIALECT),
    "channel": (
        str | None,
        typer.Option(
            "--channel",
            metavar="NAME",
            help="of a cell with several channels: whose program it is",
        ),
    ),
    "lenient": (
        bool,
        typer.Option(
            "--lenient",
            help="isg: unknown # commands and undefined M functions are warnings",
        ),
    ),
    "answers": (
        Path | None,
        typer.Option(
            "--answers",
            help="JSON list of answers to the program's dialogs (isons)",
        ),
    ),
    "start_line": (
        int | None,
        typer.Option(
            "--start-line", help="take the program up at this line (isons)"
        ),
    ),
    "start_pass": (
        int,
        typer.Option(
            "--start-pass", min=1, help="which time that line is reached"
        ),
    ),
    "start_marker": (
        str | None,
        typer.Option(
            "--start-marker",
            metavar="NAME=VALUE",
            help="take it up where a variable gets a value",
        ),
    ),
    "clock": (
        str,
        typer.Option("--clock", help="lockstep, freerun or realtime"),
    ),
    "service": (
        str | None,
        typer.Option(
            "--service",
            help="look-ahead service: cyclic or immediate; default: the cell's",
        ),
    ),
    "out": (
        Path,
        typer.Option("--out", help="folder for files the program writes"),
    ),
    "record": (
        Path | None,
        typer.Option(
            "--record",
            help="record to this .parquet, .arrow, .npz, .csv or .mcap",
        ),
    ),
    "record_only": (
        list[str] | None,
        typer.Option(
            "--record-only",
            metavar="COLUMN",
            help="record this table or column of cycles alone; repeatable",
        ),
    ),
    "autostart": (
        bool,
        typer.Option(
            "--autostart/--no-autostart",
            help="start the program, or leave that to the PLC",
        ),
    ),
    "tolerance": (
        float | None,
        typer.Option(
            "--tolerance",
            min=0.0,
            metavar="MM",
            help="allowed path deviation in mm where the program commands none;"
            " 0: exact path; default: the cell's",
        ),
    ),
    "name": (
        str | None,
        typer.Option("--name", help="name of the shared-memory segment"),
    ),
    "strict": (bool, STRICT),
    "max_time": (
        float,
        typer.Option(
            "--max-time",
            min=0.0,
            metavar="CELL_S",
            help="end with an error after so many s of cell time; 0: never",
        ),
    ),
    "max_wall": (
        float,
        typer.Option(
            "--max-wall",
            min=0.0,
            metavar="S",
            help="end with an error after so many s of wall time; 0: never",
        ),
    ),
    "report_wait": (
        tuple[float, float],
        typer.Option(
            "--report-wait",
            metavar="CELL_S WALL_S",
            help="tell what is waited for after so many s of either time",
        ),
    ),
    "watch": (list[str] | None, WATCH),
    "force": (list[str] | None, FORCE),
}
DEFAULTS: dict[str, Any] = {
    "out": OUT_FOLDER,
    "watch": None,
    "force": None,
    "record_only": None,
    "task": None,
    "define": None,
}


@dataclass(frozen=True)
class ReadOptions:
    """Choices for reading a program without running it."""

    config: Path | None = None
    dialect: str | None = None
    lenient: bool = False
    answers: Path | None = None
    channel: str | None = None


@dataclass(frozen=True)
class PlaceOptions(ReadOptions):
    """The same with the place where the program is taken up."""

    start_line: int | None = None
    start_pass: int = 1
    start_marker: str | None = None

    @property
    def place(self) -> tuple[int | None, int, str | None]:
        """Line, pass and marker, as ``Restart.of`` takes them."""
        return self.start_line, self.start_pass, self.start_marker


def _check_words(words: list[str]) -> None:
    from plc_client.st.machine.tasks import options_of  # noqa: PLC0415
    from plc_client.task import PlcError  # noqa: PLC0415

    try:
        options_of(words)
    except PlcError as error:
        raise typer.BadParameter(str(error)) from None


@dataclass(frozen=True)
class StOptions:
    """Choices of a PLC program in Structured Text."""

    interval: float | None = None
    task: tuple[str, ...] = ()
    define: tuple[str, ...] = ()
    short_circuit: bool = False

    def words(self) -> tuple[str, ...]:
        """As the PLC process takes them."""
        found = [f"task={text}" for text in self.task]
        found += [f"define={name}" for name in self.define]
        if self.interval is not None:
            found.append(f"interval={self.interval!r}")
        if self.short_circuit:
            found.append("short-circuit")
        if found:
            _check_words(found)
        return tuple(found)


@dataclass(frozen=True)
class CncSideOptions:
    """Choices of ``cnc``, the CNC side alone."""

    clock: str = "realtime"
    record: Path | None = None
    record_only: tuple[str, ...] = ()
    service: str | None = None
    autostart: bool = True
    dialect: str | None = None
    tolerance: float | None = None
    max_time: float = 0.0
    max_wall: float = 0.0
    report_wait: tuple[float, float] = (STANDS_CELL_S, STANDS_WALL_S)

    def run_options(self) -> RunOptions:
        """The options of the run."""
        return RunOptions(**vars(self)).checked()


def check_choices(options: RunOptions | CncSideOptions) -> None:
    """Wrong usage where clock or service is none of the choices."""
    one_of("--clock", options.clock, CLOCKS)
    if options.service:
        one_of("--service", options.service, SERVICES)


def expanded(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with the members of its options dataclasses as parameters."""
    groups = {
        name: hint
        for name, hint in get_type_hints(function).items()
        if is_dataclass(hint)
    }

    @functools.wraps(function)
    def call(**given: Any) -> Any:
        for name, kind in groups.items():
            members = {member.name for member in _shown(kind)}
            values = {k: given.pop(k) for k in members & given.keys()}
            given[name] = _built(kind, values)
        return function(**given)

    parameters = list(_parameters(function, groups))
    vars(call)["__signature__"] = inspect.Signature(parameters)
    call.__annotations__ = {p.name: p.annotation for p in parameters}
    return call


def _parameters(
    function: Callable[..., Any], groups: dict[str, Any]
) -> Iterator[inspect.Parameter]:
    hints = get_type_hints(function, include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        if name in groups:
            yield from map(_parameter, _shown(groups[name]))
        else:
            yield parameter.replace(
                annotation=hints[name], kind=parameter.KEYWORD_ONLY
            )


def _shown(kind: Any) -> list[Field[Any]]:
    """The members of a dataclass that the command line shows."""
    return [member for member in fields(kind) if member.name in OPTIONS]


def _parameter(member: Field[Any]) -> inspect.Parameter:
    kind, option = OPTIONS[member.name]
    default = DEFAULTS.get(member.name, member.default)
    assert default is not MISSING, member.name
    return inspect.Parameter(
        member.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[kind, option],
    )


def _built(kind: Any, values: dict[str, Any]) -> Any:
    """The dataclass; lists of symbols become what ``RunOptions`` holds."""
    for name in ("watch", "record_only", "task", "define"):
        if name in values:
            values[name] = tuple(values[name] or ())
    if "force" in values:
        values["force"] = dict(map(_forced, values["force"] or ()))
    return kind(**values)


def _forced(text: str) -> tuple[str, Any]:
    from plc_client.online import parse_force  # noqa: PLC0415

    return parse_force(text)
