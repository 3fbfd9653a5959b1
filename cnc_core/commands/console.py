"""What all commands share: the app, the two consoles, options, programs and
errors as they are printed.
"""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from rich.console import Console
from rich.progress import Progress
from typer.core import TyperCommand, TyperOption

Function = TypeVar("Function", bound=Callable[..., Any])
SHOWN_ERRORS = 20


def _say_version(wanted: bool) -> None:
    if wanted:
        sys.stdout.write(f"hli-cosim {version('hli-cosim')}\n")
        raise typer.Exit


class _Command(TyperCommand):
    """A command that takes each option once, but for those of lists."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        for param in self.params:
            if not isinstance(param, TyperOption):
                continue
            if param.multiple or param.is_flag:
                continue
            names = [name for name in param.opts if name.startswith("--")]
            given = [arg for arg in args if arg.partition("=")[0] in names]
            if len(given) > 1:
                raise typer.BadParameter(f"{given[0]} is given twice", ctx)
        return super().parse_args(ctx, args)


class _App(typer.Typer):
    """Its commands are ``_Command``s."""

    def command(
        self, *names: Any, **given: Any
    ) -> Callable[[Function], Function]:
        """As of typer."""
        return super().command(*names, **{"cls": _Command, **given})


app = _App(
    name="hli-cosim",
    help="Open co-simulation of a CNC and a PLC over an emulated ISG/Beckhoff HLI.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback()
def _options(
    version_wanted: Annotated[
        bool,
        typer.Option(
            "--version",
            is_eager=True,
            callback=_say_version,
            help="print the version",
        ),
    ] = False,
) -> None:
    """Open co-simulation of a CNC and a PLC over an emulated ISG/Beckhoff HLI."""


COLUMNS = 80
out = Console(highlight=False, soft_wrap=True, markup=False)
err = Console(stderr=True, highlight=False, soft_wrap=True, markup=False)

emitted: list[bool] = []
told_interrupts: list[bool] = []  # a command has told of Ctrl-C itself
INTERRUPTED = 130


def emit(value: Any, *, flush: bool = False) -> None:
    """One JSON value on one line of standard output."""
    emitted.append(True)
    sys.stdout.write(json.dumps(value) + "\n")
    if flush:
        sys.stdout.flush()


def say_error(error: object) -> None:
    """An error on standard error, as FILE:LINE:COL: CODE: text with the source
    line under it.
    """
    sys.stderr.write(f"{escaped(str(error))}\n")


def say_errors(errors: Sequence[object], most: int | None) -> None:
    """The first errors, and how many there are more."""
    for error in errors[:most]:
        say_error(error)
    left = len(errors[most:]) if most else 0
    if left:
        say_error(f"and {left} more errors; --all shows them")


def escaped(text: str) -> str:
    """Control characters as their codes: a terminal must not obey them."""
    return "".join(
        c
        if c.isprintable() or c in "\n\t"
        else c.encode("unicode_escape").decode()
        for c in text
    )


@contextmanager
def progress(title: str) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal, nothing in a pipe; call the result with the share
    done (None-length: pulsing).
    """
    with Progress(
        console=err, transient=True, disable=not err.is_terminal
    ) as bar:
        task = bar.add_task(title, total=None)

        def tick(share: float) -> None:
            bar.update(task, total=1.0, completed=share)

        yield tick


def load(config: Path | None) -> Any:
    from ..config import load_config  # noqa: PLC0415

    cell = load_config(config)
    for warning in cell.warnings():
        err.print(f"warning: {warning}")
    return cell


def say_dialect(dialect: str) -> None:
    """Which dialect was found where none was given."""
    err.print(
        f"dialect: {dialect} (by content and name; --dialect chooses another)"
    )


def say_warnings(program: Any) -> None:
    for warning in program.reader.warnings:
        say_error(f"warning: {warning}")
    for text in program.filter_texts:
        say_error(text)


def one_of(option: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise typer.BadParameter(
            f"{option} {value}: choose from {', '.join(choices)}"
        )


def say_run_errors(result: Any) -> None:
    for warning in result.warnings:
        say_error(f"warning: {warning}")
    for e in result.errors:
        place = f"{e['file']}:{e['line']}:{e['column']}: " if e["line"] else ""
        say_error(f"{place}{e['code']}: {e['text']}")
        if (
            e["line"]
            and result.error_text
            and e["line"] == result.errors[0]["line"]
        ):
            say_error(f"    {result.error_text}")


def say_causes(seconds: dict[str, float]) -> None:
    """Where the time went, and what helps where much went to one cause."""
    from ..engine.causes import hints, summary  # noqa: PLC0415

    text = summary(seconds)
    if text:
        say_wrapped(f"time: {text}")
    for hint in hints(seconds):
        say_wrapped(f"hint: {hint}")


def say_wrapped(text: str) -> None:
    """A sentence in lines of 80 columns."""
    out.print(textwrap.fill(text, COLUMNS, subsequent_indent="  "))


def interrupted(done: str, written: Path | None) -> typer.Exit:
    """Ctrl-C: one line with how far it was, and the exit for the command."""
    told_interrupts.append(True)
    say_error(f"interrupted after {done}; written: {written or 'nothing'}")
    return typer.Exit(INTERRUPTED)


@contextmanager
def telling_interrupts(as_json: bool) -> Iterator[None]:
    """Ctrl-C during a run: one line with where it stood and what was written,
    with --json the run object, status 130.
    """
    from ..cell import RunInterrupted  # noqa: PLC0415

    try:
        yield
    except RunInterrupted as stop:
        told_interrupts.append(True)
        say_error(stop)
        if as_json:
            emit(stop.result.as_json())
        raise typer.Exit(INTERRUPTED) from None
