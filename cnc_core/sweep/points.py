"""The runs of a study, in their order."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import CncError, Place
from .study import RUNS_MAX, Span, Study


@dataclass(frozen=True)
class Point:
    """One run: what is run, with which parameters."""

    number: int
    program: str
    cell: str
    plc: str
    parameters: dict[str, Any] = field(default_factory=dict)


def points(study: Study) -> list[Point]:
    """Every run of the study; CncError if they are more than RUNS_MAX."""
    if study.mode == "random":
        return [_drawn(study, number) for number in range(study.count)]
    names = tuple(study.parameters)
    values = [_steps(study.parameters[name]) for name in names]
    choices: list[list[Any]] = [
        study.programs,
        study.cells,
        study.plcs,
        study.rows or [{}],
        *values,
    ]
    if math.prod(map(len, choices)) > RUNS_MAX:
        raise CncError(902001, f"study: more than {RUNS_MAX} runs")
    return [
        _chosen(number, names, *one)
        for number, one in enumerate(itertools.product(*choices))
    ]


def _chosen(
    number: int,
    names: tuple[str, ...],
    program: str,
    cell: str,
    plc: str,
    row: dict[str, Any],
    *values: Any,
) -> Point:
    together = row | dict(zip(names, values, strict=True))
    return Point(number, program, cell, plc, together)


def _steps(values: list[Any] | Span) -> list[Any]:
    if not isinstance(values, Span):
        return values
    low, high, last = values.low, values.high, values.count - 1
    return [
        _between(values, i / last if last else 0.0) for i in range(last)
    ] + [high if last else low]


def _between(span: Span, share: float) -> float:
    if span.scale == "linear":
        return span.low + share * (span.high - span.low)
    return float(span.low * (span.high / span.low) ** share)


def _drawn(study: Study, number: int) -> Point:
    """The same draw whatever is drawn beside it: a generator of its own each."""

    def of(name: str) -> random.Random:
        return random.Random(f"{study.seed}/{number}/{name}")

    def one(name: str, values: list[Any] | Span) -> Any:
        if isinstance(values, Span):
            return _between(values, of(name).random())
        return of(name).choice(values)

    row = one("row", study.rows) if study.rows else {}
    return Point(
        number,
        one("program", study.programs),
        one("cell", study.cells),
        one("plc", study.plcs),
        row | {name: one(name, v) for name, v in study.parameters.items()},
    )


def files_of(study: Study, folder: Path) -> Iterator[Path]:
    """The files that the study names; CncError names a missing one."""
    plcs = (plc for plc in study.plcs if not _is_built_in(plc))
    for name in dict.fromkeys([*study.programs, *study.cells, *plcs]):
        if not name:
            continue
        path = folder / name
        if not path.exists():
            raise CncError(901001, "file not found", Place(str(path)))
        yield path


def plc_of(name: str, folder: Path) -> str | None:
    """As ``Cell.run`` takes it: a file of the study's folder, or a built-in one."""
    if not name:
        return None
    return name if _is_built_in(name) else str(folder / name)


def _is_built_in(plc: str) -> bool:
    return plc in ("", "none") or plc.startswith("builtin:")
