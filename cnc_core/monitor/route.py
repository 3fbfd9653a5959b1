"""The path of a program as a polyline over its path distance, and its lines."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.units import AnyArray

from ..blocks import (
    CIRCULAR,
    DISTANCE_RESET,
    MARKER,
    PIECE,
    POLYNOMIAL,
    BlockBatch,
)
from ..config import load_config, setups_of
from ..config.exchange import axes_of, places_of
from ..errors import CncError
from ..files import open_regular
from ..frontend.axes import OpenAxes
from ..frontend.signals import OpenSignals
from ..observing.sight import spatial
from ..program import Program
from .source import Source

READ_S = 3.0  # wall time for a program; the rest of a longer one is not drawn
POINTS = 20_000
LINES = 20_000
LINE_CHARACTERS = 200
ARC_STEP = 0.1  # rad between two points of an arc
CURVE_POINTS = 8  # of a polynomial
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}


@dataclass
class Route:
    """What the page draws of a program.

    ``points``: [x, y, z mm, path mm, line, count, epoch].
    ``whole``: the program was read to its end.
    """

    name: str = ""
    points: list[list[float]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    marked: list[int] = field(default_factory=list)
    whole: bool = False
    problem: str = ""

    def as_json(self) -> dict[str, Any]:
        return vars(self)


def read_route(source: Source) -> Route:
    """The route of a program; ``problem`` tells what cannot be read."""
    route = Route(source.program.name, lines=_lines(source.program))
    try:
        program = _program(source)
        walker = _Walker(spatial(list(program.cell.axes)), program)
        end = time.monotonic() + READ_S
        rows = 0
        for batch in program.batches():
            walker.add(batch)
            rows += len(batch)
            if time.monotonic() > end or rows > 20 * POINTS:
                break
        else:
            route.whole = not program.errors
        route.problem = str(program.errors[0]) if program.errors else ""
        route.points = _thinned(walker.points)
        route.marked = sorted(walker.marked)
    except (CncError, OSError, ValueError) as error:
        route.problem = str(error)
    return route


def _program(source: Source) -> Program:
    """The program, read alone: what it waits for counts as there."""
    setups = setups_of(load_config(source.config))
    if source.channel >= len(setups):
        raise ValueError(f"the cell file has {len(setups)} channels")
    setup = setups[source.channel]
    names = [each.place.name for each in setups]
    return Program(
        source.program,
        setup.cell,
        source.dialect or setup.dialect,
        collect=True,
        signals=OpenSignals(names) if len(setups) > 1 else None,
        axes=OpenAxes(axes_of(setups), places_of(setup)),
        channel=setup.place.index + 1,
    )


def _lines(path: Path) -> list[str]:
    try:
        with open_regular(path) as file:
            return [
                raw.decode("latin-1").rstrip("\r\n")[:LINE_CHARACTERS]
                for raw in itertools.islice(file, LINES)
            ]
    except (CncError, OSError):
        return []


def _thinned(points: list[list[float]]) -> list[list[float]]:
    if len(points) <= POINTS:
        return points
    keep = np.linspace(0, len(points) - 1, POINTS).astype(int)
    return [points[i] for i in keep]


class _Walker:
    """Follows the rows of a program."""

    def __init__(self, axes: list[int], program: Program) -> None:
        self.points: list[list[float]] = []
        self.marked: set[int] = set()
        self._axes = axes
        start = program.cell.axis_values("start_mm")
        self._place = self._of(start)
        self._distance = 0.0
        self._epoch = 0

    def _of(self, axes: AnyArray) -> npt.NDArray[np.float64]:
        return np.array([axes[i] if i >= 0 else 0.0 for i in self._axes])

    def add(self, batch: BlockBatch) -> None:
        for row in batch.rows:
            kind = row["type"]
            if kind == MARKER:
                self.marked.add(int(row["line"]))
            elif kind == DISTANCE_RESET:
                self._distance = 0.0
                self._epoch += 1
            elif kind <= POLYNOMIAL and not row["flags"] & PIECE:
                self._motion(row, batch)

    def _motion(self, row: Any, batch: BlockBatch) -> None:
        if not self.points:
            self._note(self._place, 0.0, row)
        length = float(row["length"])
        for share, place in self._places(row, batch):
            self._note(place, self._distance + share * length, row)
        self._distance += length
        self._place = self._of(row["end"])

    def _note(
        self, place: npt.NDArray[np.float64], distance: float, row: Any
    ) -> None:
        x, y, z = (round(float(value), 4) for value in place)
        numbers = int(row["line"]), int(row["count"]), self._epoch
        self.points.append([x, y, z, round(distance, 4), *numbers])

    def _places(
        self, row: Any, batch: BlockBatch
    ) -> Iterator[tuple[float, npt.NDArray[np.float64]]]:
        """Share of the length and place of the points behind the start."""
        if row["type"] == CIRCULAR:
            yield from self._arc(row)
        elif row["type"] == POLYNOMIAL and len(batch.pool):
            yield from self._polynomial(row, batch)
        yield 1.0, self._of(row["end"])

    def _arc(self, row: Any) -> Iterator[tuple[float, npt.NDArray[np.float64]]]:
        first, second, _ = PLANES.get(int(row["plane"]), PLANES[17])
        centre, angle = row["center"], float(row["angle"])
        rest = self._of(row["end"]) - self._place
        arm = self._place[first] - centre[0], self._place[second] - centre[1]
        count = max(2, min(200, int(abs(angle) / ARC_STEP) + 1))
        for k in range(1, count):
            share = k / count
            c, s = np.cos(angle * share), np.sin(angle * share)
            place = self._place + share * rest
            place[first] = centre[0] + c * arm[0] - s * arm[1]
            place[second] = centre[1] + s * arm[0] + c * arm[1]
            yield share, place

    def _polynomial(
        self, row: Any, batch: BlockBatch
    ) -> Iterator[tuple[float, npt.NDArray[np.float64]]]:
        terms = int(row["degree"]) + 1
        first, end = int(row["pool"]), float(row["angle"])
        for k in range(1, CURVE_POINTS):
            share = k / CURVE_POINTS
            powers = (share * end) ** np.arange(terms)
            place = np.zeros(3)
            for axis, i in enumerate(self._axes):
                at = first + i * terms
                if i >= 0 and at + terms <= len(batch.pool):
                    place[axis] = batch.pool[at : at + terms] @ powers
            yield share, place
