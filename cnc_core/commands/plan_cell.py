"""``plan`` of a cell with several channels: all of them in one call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from ..config import setups_of
from ..errors import CncError
from .console import emit, load, out, say_error
from .options import PlaceOptions
from .tables import number, print_table

HEAD = ("channel", "program", "time, s", "waits, s", "blocks", "end")


def plan_cell(
    files: list[Path],
    options: PlaceOptions,
    refused: dict[str, Any],
    *,
    tolerance: float | None,
    max_wall: float,
    as_json: bool,
) -> None:
    """Drive the channels together, without a PLC, and print a table.

    ``refused``: options that are for one channel, with their values.
    """
    from ..cell import Cell  # noqa: PLC0415

    place = {
        "--start-line": options.start_line,
        "--start-marker": options.start_marker,
    }
    given = [name for name, value in (refused | place).items() if value]
    if given:
        raise CncError(
            902001, f"{given[0]} plans one channel: name it, --channel NAME"
        )
    with Cell(options.config) as cell:
        result = cell.run(
            files,
            "none",
            clock="freerun",
            dialect=options.dialect,
            lenient=options.lenient,
            answers=options.answers,
            tolerance=tolerance,
            max_wall=max_wall,
        )
    rows = [_row(channel) for channel in result.channels]
    whole = max(row["time_s"] for row in rows)
    for text in result.warnings:
        say_error(f"warning: {text}")
    value = {"channels": rows, "time_s": whole, "end": result.end}
    if as_json:
        emit(value)
    else:
        _show(rows, whole)
        result.check()
    if result.end != "completed":
        raise typer.Exit(1)


def only_file(files: list[Path], options: PlaceOptions) -> Path | None:
    """The program to plan; None: those of several channels together.

    CncError: more programs than channels.
    """
    from ..cell.programs import programs_of  # noqa: PLC0415

    cell = load(options.config)
    if options.channel is None and cell.channels:
        return None
    if not files:
        raise typer.BadParameter("Missing argument 'FILE...'.")
    if len(files) > 1:
        programs_of(setups_of(cell)[0].cell, files)
    return files[0]


def _row(channel: dict[str, Any]) -> dict[str, Any]:
    causes = channel["time_by_cause"]
    return {
        "name": channel["name"],
        "program": channel["program"],
        "end": channel["end"],
        "time_s": sum(causes.values()),
        "wait_s": causes["wait"],
        "blocks": channel["blocks"],
        "time_by_cause": causes,
        "errors": channel["errors"],
    }


def _show(rows: list[dict[str, Any]], whole: float) -> None:
    print_table(
        "the channels together",
        HEAD,
        [
            (
                row["name"],
                Path(row["program"]).name if row["program"] else "-",
                number(row["time_s"]),
                number(row["wait_s"]),
                number(row["blocks"]),
                row["end"],
            )
            for row in rows
        ],
    )
    out.print(f"the cell takes {number(whole)} s")
