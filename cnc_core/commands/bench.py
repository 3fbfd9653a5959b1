"""bench handshake, cycle, planner, parser."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer

from .console import (
    app,
    emit,
    progress,
)
from .options import Json
from .tables import say_figures

bench_app = typer.Typer(
    help="Measure this machine beside a raw C reference in the same run.",
    no_args_is_help=True,
)


app.add_typer(bench_app, name="bench")


Seconds = Annotated[
    float, typer.Option(min=1.0, max=600.0, help="about how long to measure")
]


def _bench(
    measure: Callable[..., dict[str, Any]], title: str, as_json: bool
) -> None:
    with progress(title) as tick:
        value = measure(tick)
    if as_json:
        emit(value)
        return
    say_figures(title, value)


@bench_app.command("handshake")
def bench_handshake(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Handshake round trips: raw C, immediate service, Python on both sides,
    cyclic service.

    Example: hli-cosim bench handshake --seconds 30 --json
    """
    from .. import benchmarks  # noqa: PLC0415

    _bench(
        lambda tick: benchmarks.handshake(seconds, tick),
        "bench handshake",
        as_json,
    )


@bench_app.command("cycle")
def bench_cycle(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Real-time cycle: what it costs and how late it wakes, beside a bare
    clock_nanosleep loop.

    Example: hli-cosim bench cycle --seconds 20 --json
    """
    from .. import benchmarks  # noqa: PLC0415

    _bench(lambda _tick: benchmarks.cycle(seconds), "bench cycle", as_json)


@bench_app.command("planner")
def bench_planner(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Planner: blocks per second, motion time, limits, per workload and look-ahead.

    Example: hli-cosim bench planner --json
    """
    from .. import benchmarks  # noqa: PLC0415

    _bench(lambda _tick: benchmarks.planner(seconds), "bench planner", as_json)


@bench_app.command("parser")
def bench_parser(seconds: Seconds = 10.0, as_json: Json = False) -> None:
    """Reader: lines per second from text to canonical rows.

    Example: hli-cosim bench parser --json
    """
    from .. import benchmarks  # noqa: PLC0415

    _bench(lambda _tick: benchmarks.parser(seconds), "bench parser", as_json)
