"""Command ``fmu``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .console import app, emit
from .options import Json


@app.command()
def fmu(
    file: Annotated[Path, typer.Argument(help="NC program")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="the FMU, as cell.fmu")
    ] = Path("cell.fmu"),
    cell: Annotated[
        Path | None,
        typer.Option(
            "--cell",
            "--config",
            help="cell.toml; default: the built-in machine",
        ),
    ] = None,
    plc: Annotated[
        Path | None,
        typer.Option(
            help="PLC program, Python or Structured Text;"
            " default: acknowledges everything"
        ),
    ] = None,
    input_symbol: Annotated[
        list[str] | None,
        typer.Option(
            "--input", metavar="SYMBOL", help="a symbol as input; repeatable"
        ),
    ] = None,
    output_symbol: Annotated[
        list[str] | None,
        typer.Option(
            "--output", metavar="SYMBOL", help="a symbol as output; repeatable"
        ),
    ] = None,
    fmi: Annotated[
        int, typer.Option(min=2, max=3, help="FMI 2.0 or FMI 3.0")
    ] = 2,
    as_json: Json = False,
) -> None:
    """Export a cell as an FMU for co-simulation.

    Example: hli-cosim fmu part.nc --cell cell.toml -o cell.fmu
    """
    from ..fmu import export_fmu  # noqa: PLC0415

    if out.suffix != ".fmu":
        raise typer.BadParameter(f"--out {out}: the name must end in .fmu")

    target = export_fmu(
        file,
        out,
        config=cell,
        plc=plc,
        input_symbols=input_symbol or (),
        output_symbols=output_symbol or (),
        fmi=fmi,
    )
    if as_json:
        emit({"fmu": str(target), "bytes": target.stat().st_size})
        return
    typer.echo(f"{target}: FMI {fmi}.0, co-simulation")
