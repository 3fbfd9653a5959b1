"""``check`` of a cell with several channels: the programs of all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from ..config import setups_of
from ..errors import CncError
from .console import emit, load, out, say_errors
from .options import ReadOptions


def takes_all(files: list[Path], options: ReadOptions) -> bool:
    """Whether the channels are meant together.

    CncError: more programs than channels.
    """
    from ..cell.programs import programs_of  # noqa: PLC0415

    try:
        cell = load(options.config)
    except CncError:
        return False  # it is told with the program
    if options.channel is None and cell.channels:
        return True
    if len(files) > 1:
        programs_of(setups_of(cell)[0].cell, files)
    return False


def check_cell(
    files: list[Path],
    options: ReadOptions,
    checked: Callable[[Path, ReadOptions], Any],
    shown: int | None,
    strict: bool,
    as_json: bool,
) -> None:
    """Check each channel's program, those that the cell file names included.

    ``checked``: checks one.  ``shown``: so many errors at most.  ``strict``: a
    warning ends with 1, too.
    """
    from ..cell.programs import programs_of  # noqa: PLC0415

    cell = load(options.config)
    programs = programs_of(cell, files, options.config)
    rows, errors, warned = [], [], False
    for setup, program in zip(setups_of(cell), programs, strict=True):
        if program is None:
            continue
        name = setup.place.name
        found = checked(program, replace(options, channel=name))
        errors += found.errors
        warned = warned or found.warned
        rows.append(
            {"name": name, "program": str(program), "blocks": found.blocks}
            | {"errors": [error.as_json() for error in found.errors]}
        )
    say_errors(errors, shown)
    if as_json:
        blocks = sum(row["blocks"] for row in rows)
        told = [error.as_json() for error in errors]
        emit({"errors": told, "blocks": blocks, "channels": rows})
    else:
        for row in rows:
            _say(row)
    if errors or (strict and warned):
        raise typer.Exit(1)


def _say(row: dict[str, Any]) -> None:
    count = len(row["errors"])
    told = f"{count} errors" if count else "no errors"
    out.print(
        f"channel {row['name']}: {row['program']}: {row['blocks']} blocks, {told}"
    )
