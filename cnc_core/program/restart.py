"""Where a program is to be taken up again, and the port while that place is
searched for.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.units import AnyArray

from ..blocks import (
    ELEMENT,
    EXACT_STOP,
    LINEAR,
    NC_BLOCK,
    PATH_FEED,
    PIECE,
    POLYNOMIAL,
    RAPID,
    BlockBatch,
)
from ..errors import CncError
from ..frontend.machine import External
from ..frontend.operator import Answer, Question
from ..frontend.port import ChannelPort, ExternalValue

SAME_MM = 1e-9
MARKER = re.compile(r"\$?(\w+)\s*=\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)")


@dataclass(frozen=True)
class Restart:
    """In front of ``line`` of the main file when it is reached for the
    ``passes``-th time, or behind the block that gives the variable ``marker``
    its ``value``.
    """

    line: int = 0
    passes: int = 1
    marker: str = ""
    value: float = 0.0

    @classmethod
    def of(
        cls, line: int | None, passes: int, marker: str | None
    ) -> Restart | None:
        """From the options of a command; None if none of them is given."""
        if line is not None and marker is not None:
            raise CncError(902001, "restart: a line or a marker, not both")
        if line is not None:
            if line < 1 or passes < 1:
                raise CncError(902001, "restart: line and pass count from 1")
            return cls(line, passes)
        if marker is None:
            return None
        found = MARKER.fullmatch(marker.strip())
        if not found:
            raise CncError(
                902001, f"restart: NAME=VALUE is expected, not {marker!r}"
            )
        return cls(marker=found[1].upper(), value=float(found[2]))

    def __str__(self) -> str:
        return (
            f"line {self.line}, pass {self.passes}"
            if self.line
            else f"${self.marker} = {self.value:g}"
        )


class SearchingPort:
    """A port whose machine does not move while ``searching``: waits are true at
    once, outputs wait for the end.

    Everything else is the port's own.
    """

    def __init__(self, port: ChannelPort) -> None:
        self._port, self.searching = port, True
        self._written: dict[tuple[External, int], ExternalValue] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._port, name)

    @property
    def answers(self) -> bool:
        return not self.searching and self._port.answers

    def read_external(self, variable: External, element: int) -> ExternalValue:
        if (variable, element) in self._written:
            return self._written[variable, element]
        return self._port.read_external(variable, element)

    def ask(self, question: Question) -> Answer | None:
        """While the place is searched for, a dialog that nobody answers counts
        as acknowledged.
        """
        answer = self._port.ask(question)
        return (
            Answer(given=False) if answer is None and self.searching else answer
        )

    def write_external(
        self, variable: External, element: int, value: ExternalValue
    ) -> None:
        if self.searching:
            self._written[variable, element] = value
        else:
            self._port.write_external(variable, element, value)

    def found(self) -> None:
        """The place has been found: what the program has written until there is
        put out.
        """
        self.searching = False
        written, self._written = self._written, {}
        for (variable, element), value in written.items():
            self._port.write_external(variable, element, value)


def way_to(
    place: npt.NDArray[np.float64],
    here: npt.NDArray[np.float64],
    speed: float,
    like: Any,
) -> BlockBatch:
    """A straight way back at ``speed`` mm/s (0: rapid), told as the row
    ``like``; empty if the axes stand there.
    """
    delta = place - here
    length = float(np.linalg.norm(delta))
    if length < SAME_MM:
        return BlockBatch.empty()
    row = np.zeros(1, NC_BLOCK)
    for name in ("n", "line", "count", "file"):
        row[name] = like[name]
    row["type"], row["end"][0, : len(place)] = LINEAR, place
    row["length"] = row["length_min"] = length
    row["feed"], row["flags"] = (
        speed,
        EXACT_STOP | PATH_FEED | (0 if speed > 0.0 else RAPID),
    )
    return BlockBatch(row)


class Uncovered:
    """Elements that the pieces so far do not cover to their ends, as rows of
    what is left of them.
    """

    def __init__(self) -> None:
        self._elements: deque[tuple[int, AnyArray]] = deque()

    def take(
        self, moving: AnyArray, numbers: npt.NDArray[np.int64] | None = None
    ) -> None:
        """Motions in order; their ``numbers``, if anybody asks for them."""
        if not (moving["flags"] & (ELEMENT | PIECE)).any():
            if len(moving):
                self._elements.clear()
            return
        for i in range(len(moving)):
            row = moving[i : i + 1]
            if row["flags"][0] & ELEMENT:
                number = 0 if numbers is None else int(numbers[i])
                self._elements.append((number, row.copy()))
            elif row["flags"][0] & PIECE:
                self.drive(float(row["value"][0]))
            else:
                self._elements.clear()

    def drive(self, way: float) -> None:
        """A piece covers so much of the elements, mm."""
        while self._elements:
            _, row = self._elements[0]
            rest = float(row["length"][0]) - way
            if rest > SAME_MM:
                share = rest / float(row["length"][0])
                for name in ("length", "length_min", "angle"):
                    row[name] *= share
                return
            self._elements.popleft()
            way = -rest
            if way <= SAME_MM:
                return

    def rows(self) -> AnyArray:
        """All of them; forgotten then."""
        return self.numbered()[1]

    def numbered(self) -> tuple[npt.NDArray[np.int64], AnyArray]:
        """All of them with their numbers; forgotten then."""
        numbers = np.array([number for number, _ in self._elements], np.int64)
        rows = [row for _, row in self._elements]
        self._elements.clear()
        return numbers, np.concatenate([*rows, np.empty(0, NC_BLOCK)])


class Passed:
    """Rows of the stretch that is searched are left out; what begins behind
    ``count`` goes on from where they end.

    ``place``: (axes,) end of what has been left out.
    """

    def __init__(self, place: npt.NDArray[np.float64]) -> None:
        self.place, self.count = place.copy(), -1
        self._uncovered = Uncovered()

    def rest(self, batch: BlockBatch) -> BlockBatch:
        """What stands behind the place; empty while nothing does."""
        behind = (
            np.flatnonzero(batch.rows["count"] > self.count)
            if self.count >= 0
            else np.empty(0, np.int64)
        )
        first = int(behind[0]) if len(behind) else len(batch)
        self._leave_out(batch.rows[:first])
        if not len(behind):
            return BlockBatch.empty()
        return BlockBatch(
            np.concatenate([self._uncovered.rows(), batch.rows[first:]]),
            batch.pool,
        )

    def _leave_out(self, rows: AnyArray) -> None:
        moving = rows[rows["type"] <= POLYNOMIAL]
        if not len(moving):
            return
        driven = moving[(moving["flags"] & ELEMENT) == 0]
        if len(driven):
            self.place = driven["end"][-1, : len(self.place)].copy()
        self._uncovered.take(moving)
