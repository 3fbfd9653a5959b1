"""Commands on recordings: inspect, compare, replay, show."""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table as Rows

from ..errors import CncError, Place
from .console import app, emit, one_of, out, say_error
from .options import Json, StOptions, expanded

if TYPE_CHECKING:
    from ..recording.reading import Recording

ROWS_ABREAST = 4
RecordingFile = Annotated[
    Path, typer.Argument(help="a recording: .parquet, .arrow or .npz")
]
OneOfThem = Annotated[
    str | None,
    typer.Option("--channel", help="one channel of several, by its name"),
]


def _read(file: Path, channel: str | None) -> Recording:
    """A recording, or one channel of it."""
    from ..recording.reading import Recording  # noqa: PLC0415

    recording = Recording(file)
    return recording.channel(channel) if channel else recording


def _need_one(recording: Recording, why: str) -> None:
    """CncError: what asks for one path, of a recording with several."""
    if recording.channels:
        raise CncError(
            902001,
            f"{why} asks for one channel: --channel, one of"
            f" {', '.join(recording.channels)}",
        )


@app.command()
def inspect(
    file: RecordingFile,
    table: Annotated[
        str | None, typer.Option(help="statistics of this table's columns")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="the state at time=S, cycle=N, line=N or distance=MM",
        ),
    ] = None,
    where: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN>X",
            help="rows of --table that fulfil this (= != < <= > >=); repeatable",
        ),
    ] = None,
    rows: Annotated[
        int, typer.Option(min=0, help="show so many of the rows themselves")
    ] = 0,
    channel: OneOfThem = None,
    as_json: Json = False,
) -> None:
    """Show what a recording holds: tables, columns with units, values.

    Example: hli-cosim inspect run.parquet --at distance=25
    """
    from ..recording import inspect as look  # noqa: PLC0415

    recording = _read(file, channel)
    if at is not None:
        _need_one(recording, "--at")
    if table is not None:
        one_of("--table", table, recording.tables)
    elif where or rows:
        table = "cycles"
    value = look.summary(recording)
    if table is not None:
        found = recording.table(table)
        filters = [look.Filter.of(text, found) for text in where or ()]
        count, figures = look.statistics(found, filters)
        value["tables"] = {table: value["tables"][table]}
        value["statistics"] = {table: figures}
        value["chosen"] = count
        if rows:
            value["rows"] = look.first_rows(found, filters, rows)
    if at is not None:
        value["at"] = look.state_at(recording, *look.parse_at(at))
        if table is not None:
            value["at"] = {table: value["at"].get(table)}
    if as_json:
        emit(value)
    else:
        _print_inspection(value, str(file))


def _print_inspection(value: dict[str, Any], title: str) -> None:
    units = {name: t["columns"] for name, t in value["tables"].items()}
    if "at" in value:
        for name, row in value["at"].items():
            shown = Rows("column", "value", "unit", title=f"{title}: {name}")
            for column, item in (row or {}).items():
                shown.add_row(column, _short(item), units[name].get(column, ""))
            out.print(shown if row else f"{name}: nothing so far")
        return
    if "rows" in value:
        ((name, columns),) = units.items()
        _print_rows(value["rows"], columns)
        return
    if "statistics" in value:
        for name, columns in value["statistics"].items():
            title = f"{name}: {value['chosen']} rows"
            shown = Rows("column", "unit", "min", "max", "mean", title=title)
            for column, figures in columns.items():
                cells = (_short(figures[k]) for k in ("min", "max", "mean"))
                shown.add_row(column, units[name][column], *cells)
            out.print(shown)
        return
    whole = "complete" if value["complete"] else "not complete"
    shown = Rows("table", "rows", "columns", title=f"{title}: {whole}")
    for name, entry in value["tables"].items():
        columns = (f"{c} {u}".strip() for c, u in entry["columns"].items())
        shown.add_row(name, str(entry["rows"]), ", ".join(columns))
    out.print(shown)


def _print_rows(rows: list[dict[str, Any]], units: dict[str, str]) -> None:
    """As many rows beside each other as 80 columns hold, a line a column."""
    for first in range(0, len(rows), ROWS_ABREAST):
        part = rows[first : first + ROWS_ABREAST]
        shown = Rows(
            "column",
            "unit",
            *(f"row {first + i + 1}" for i in range(len(part))),
        )
        for column, unit in units.items():
            shown.add_row(column, unit, *(_short(row[column]) for row in part))
        out.print(shown)
    if not rows:
        out.print("no such row")


def _short(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)


@app.command()
def compare(
    a: RecordingFile,
    b: RecordingFile,
    by: Annotated[
        str,
        typer.Option(
            help="time: cycle by cycle; distance or line: at the same place"
        ),
    ] = "time",
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN=X",
            help="largest difference allowed in this column; repeatable",
        ),
    ] = None,
    channel: OneOfThem = None,
    as_json: Json = False,
) -> None:
    """Tell where two recordings differ first, and how often; exit 1 if they do.

    Example: hli-cosim compare old.parquet new.parquet --tolerance X=0.001
    """
    from ..recording.compare import PLACES  # noqa: PLC0415
    from ..recording.compare import compare as side_by_side  # noqa: PLC0415

    one_of("--by", by, tuple(PLACES))
    bounds = dict(_tolerance(text) for text in tolerance or ())
    both = _read(a, channel), _read(b, channel)
    if by != "time":
        for recording in both:
            _need_one(recording, f"--by {by}")
    found = side_by_side(*both, by, bounds)
    if as_json:
        emit(found.as_json())
    else:
        _print_comparison(found.as_json())
    if not found.equal:
        raise typer.Exit(1)


def _tolerance(text: str) -> tuple[str, float]:
    column, equals, value = text.partition("=")
    try:
        bound = float(value)
    except ValueError:
        bound = -1.0
    if not equals or not bound >= 0.0:
        raise CncError(902001, f"--tolerance {text}: COLUMN=X, X not below 0")
    return column, bound


def _print_comparison(value: dict[str, Any]) -> None:
    first = value["first"]
    if first is None:
        out.print("equal")
        return
    place = f", line {first['line']}" if first["line"] else ""
    column = first["column"] or "number of rows"
    out.print(
        f"first difference: {first['table']} row {first['row']}, {column}:"
        f" {json.dumps(first['a'])} and {json.dumps(first['b'])}{place}",
        soft_wrap=True,
    )
    shown = Rows("table", "column", "rows that differ")
    for table, columns in value["counts"].items():
        for column, count in columns.items():
            shown.add_row(table, column or "(rows)", str(count))
    out.print(shown)


@app.command()
@expanded
def replay(
    file: RecordingFile,
    st: StOptions,
    plc: Annotated[
        str,
        typer.Option(
            metavar="PLC",
            help="PLC program: file (.py, .st) or builtin:NAME",
        ),
    ],
    as_json: Json = False,
) -> None:
    """Run a PLC against a recorded CNC; exit 1 where it writes something else.

    Example: hli-cosim replay run.parquet --plc new.py
    """
    from plc_client.task import PlcError, is_st  # noqa: PLC0415

    from ..recording.reading import Recording  # noqa: PLC0415
    from ..recording.replay import programs_of  # noqa: PLC0415
    from ..recording.replay import replay as run_again  # noqa: PLC0415

    if not plc.startswith("builtin:") and not Path(plc).exists():
        raise CncError(901001, "PLC program not found", Place(plc))
    recording = Recording(file)
    about = recording.meta.get("plc", {})
    words = st.words() or (about.get("st", ()) if is_st(plc) else ())
    try:
        # what the program prints goes where a PLC process sends it
        with contextlib.redirect_stdout(sys.stderr):
            found = run_again(
                recording, programs_of(plc, about.get("args"), words)
            )
    except PlcError as error:
        raise CncError(905003, str(error)) from None
    if as_json:
        emit(found.as_json())
    else:
        _print_replay(found.as_json())
    if not found.equal:
        raise typer.Exit(1)


def _print_replay(value: dict[str, Any]) -> None:
    for text in value["warnings"]:
        say_error(f"warning: {text}")
    factor = f"{value['realtime_factor']:.3g} times real time"
    first = value["first"]
    if first is None:
        out.print(f"equal: {value['scans']} scans, {factor}")
        return
    place = f", line {first['line']}" if first["line"] else ""
    out.print(
        f"first difference: scan {first['scan']}, t = {first['t']:.9g} s{place},"
        f" {first['member']}: {json.dumps(first['old'])} was recorded,"
        f" {json.dumps(first['new'])} is written now",
        soft_wrap=True,
    )
    shown = Rows("member", "scans that differ")
    for member, count in value["counts"].items():
        shown.add_row(member, str(count))
    out.print(shown)
    out.print(f"{value['scans']} scans, {factor}")


@app.command()
def show(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...", help="recordings, drawn over each other"
        ),
    ],
    target: Annotated[
        Path, typer.Option("-o", "--output", help="picture: .html or .png")
    ],
    channel: OneOfThem = None,
) -> None:
    """Draw a recording: speed, acceleration, jerk, override, symbols, the path.

    Example: hli-cosim show run.parquet -o run.html
    """
    from ..recording import show as drawing  # noqa: PLC0415
    from ..recording.parts import check_writable  # noqa: PLC0415

    check_writable(target)
    drawing.show([_read(file, channel) for file in files], target)
    out.print(str(target), soft_wrap=True)
