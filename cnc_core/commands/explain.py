"""explain: what an error number means, why it comes and what helps."""

from __future__ import annotations

import re
from typing import Annotated, Any

import typer

from .console import app, emit, say_wrapped
from .options import Json
from .tables import print_table

NUMBER = re.compile(r"(?:P-)?(?:ERR-?)?0*(\d+):?", re.IGNORECASE)


@app.command()
def explain(
    numbers: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NUMBER]...", help="none: list all"),
    ] = None,
    as_json: Json = False,
) -> None:
    """Tell what an error number means, why it comes and what helps; without a
    number, list all.

    Example: hli-cosim explain 907001
    """
    from ..catalogue import catalogue  # noqa: PLC0415
    from ..catalogue import explain as explained  # noqa: PLC0415

    found = [explained(_code(text)) for text in numbers or []]
    shown = found or [catalogue()[code] for code in sorted(catalogue())]
    if as_json:
        emit([one.as_json() for one in shown])
    elif found:
        for one in found:
            _say(one)
    else:
        rows = ((str(one.code), one.text) for one in shown)
        print_table("error numbers", ("number", "text"), rows)


def _code(text: str) -> int:
    """The number of ``907001``, ``P-ERR-907001`` or ``907001:``."""
    match = NUMBER.fullmatch(text.strip())
    if match is None:
        raise typer.BadParameter(f"{text}: a number is expected, as 907001")
    return int(match[1])


def _say(one: Any) -> None:
    say_wrapped(f"{one.code}: {one.text}")
    say_wrapped(f"  why: {one.cause}")
    say_wrapped(f"  what helps: {one.cure}")
