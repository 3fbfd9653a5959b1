"""types: the HLI layout for others."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from .console import (
    app,
)


@app.command()
def types(
    st: Annotated[
        bool, typer.Option("--st", help="IEC 61131-3 Structured Text")
    ] = False,
    c: Annotated[bool, typer.Option("--c", help="C header")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="JSON")] = False,
    twincat: Annotated[
        Path | None,
        typer.Option(
            help="with --st: write .TcDUT and .TcGVL files of a TwinCAT 3 project to this folder"
        ),
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
        export.st_types()
        if st
        else export.c_header()
        if c
        else json.dumps(export.json_layout(), indent=1) + "\n"
    )
