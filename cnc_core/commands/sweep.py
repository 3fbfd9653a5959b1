"""Command ``sweep``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from .console import (
    INTERRUPTED,
    app,
    emit,
    progress,
    say_error,
    told_interrupts,
)
from .options import Json
from .tables import print_table

SHOWN, COLUMNS_SHOWN = 20, 5  # of the table on the terminal


@app.command()
def sweep(
    study: Annotated[Path, typer.Argument(help="study.toml")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="folder of rows and table")
    ] = Path("study"),
    workers: Annotated[
        int | None, typer.Option(min=1, help="processes; default: one a core")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="make the runs that are missing")
    ] = False,
    engine: Annotated[
        Literal["local", "ray"],
        typer.Option(help="who runs them: this machine, or Ray (an extra)"),
    ] = "local",
    ray: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="the Ray cluster, or local: one made here; means --engine ray",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Run a study: programs, cells, PLCs and parameters, into one table.

    Example: hli-cosim sweep study.toml -o study/
    """
    from ..sweep import sweep as run_study  # noqa: PLC0415

    if engine == "ray":
        ray = ray or "local"
    state = [0, 0]
    try:
        with progress(f"sweep {study.name}") as bar:

            def tick(done: int, of: int) -> None:
                state[:] = done, of
                bar(done / of)

            results = run_study(
                study, out, workers=workers, resume=resume, ray=ray, tick=tick
            )
    except KeyboardInterrupt:
        told_interrupts.append(True)
        done, of = state
        say_error(f"interrupted: {done} of {of} runs are complete in {out}")
        raise typer.Exit(INTERRUPTED) from None
    value = {
        "runs": results.runs,
        "done": results.runs - results.failed,
        "failed": results.failed,
        "table": str(results.path),
        "columns": list(results),
    }
    if as_json:
        emit(value)
        return
    _show(results)
    typer.echo(f"{results.path}: {results.runs} runs, {results.failed} failed")


def _show(results: Any) -> None:
    """What differs between the runs, in the width of a terminal."""
    rows = results.rows()[:SHOWN]
    names = [name for name in results if _differs(name, rows)][:COLUMNS_SHOWN]
    names = ["number", *names, *(["error"] if results.failed else [])]
    print_table("runs", names, ([_cell(row[n]) for n in names] for row in rows))


def _differs(name: str, rows: list[dict[str, Any]]) -> bool:
    return (
        name not in ("number", "error")
        and len({str(row[name]) for row in rows}) > 1
    )


def _cell(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
