"""``check`` of PLC programs in Structured Text."""

from __future__ import annotations

from pathlib import Path

import typer

from plc_client import st
from plc_client.st.machine.tasks import options_of
from plc_client.task import PlcError

from .console import emit, err, out


def check_st(
    path: Path, words: tuple[str, ...], strict: bool, as_json: bool
) -> None:
    """All errors of an ST program; exit 1 when anything is refused or wrong, or
    with ``strict`` warned of.
    """
    try:
        sources = st.sources_of([path])
        if path.is_dir() and not sources:
            raise PlcError(f"{path}: no Structured Text in this folder")
        found = st.check(sources, options_of(words))
        report, errors = found.as_json(), found.log.errors
        warnings = found.log.warnings
    except st.StError as error:
        errors, warnings = error.problems, []
        report = {
            "errors": [problem.as_json() for problem in errors],
            "pous": 0,
            "refused": [],
            "warnings": [],
        }
    except PlcError as error:
        raise typer.BadParameter(str(error)) from None
    for problem in errors:
        err.print(str(problem), markup=False, highlight=False)
    if as_json:
        emit(report)
    else:
        for problem in warnings:
            text = f"warning: {problem}"
            err.print(text, markup=False, highlight=False)
        if not errors:
            out.print(f"{path}: {report['pous']} POUs, no errors")
    if errors or (strict and warnings):
        raise typer.Exit(1)
