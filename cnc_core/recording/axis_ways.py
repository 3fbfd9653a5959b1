"""Where each axis of a cell was while a run with several channels was recorded.

A channel records what stands at its places.  An axis may go from channel to
channel; its column follows it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cnc_core.units import AnyArray

from .schema import AXES_PLACED
from .source import Source

Values = AnyArray
Spot = tuple[int, str] | None
"""Number of the part and its column; None: the axis is nowhere and stands."""


@dataclass
class Way:
    """Where one axis was: from behind which cycle on it was at which spot."""

    since: list[int] = field(default_factory=list)
    spots: list[Spot] = field(default_factory=list)

    def go(self, cycle: int, spot: Spot) -> None:
        """It is there behind this cycle."""
        if self.since and self.since[-1] == cycle:
            self.spots[-1] = spot
        else:
            self.since.append(cycle)
            self.spots.append(spot)

    def values(self, cycles: Values, heads: Sequence[Any]) -> Values:
        """Its positions in these cycles (n,); NaN where it is nowhere."""
        out = np.full(len(cycles), np.nan)
        if not len(cycles):
            return out
        first = max(bisect_right(self.since, int(cycles[0]) - 1) - 1, 0)
        for i in range(first, len(self.since)):
            begin = int(np.searchsorted(cycles, self.since[i], "right"))
            end = len(cycles)
            if i + 1 < len(self.since):
                end = int(np.searchsorted(cycles, self.since[i + 1], "right"))
            spot = self.spots[i]
            if spot is not None and end > begin:
                column = heads[spot[0]].column(spot[1]).to_numpy()
                out[begin:end] = column[begin:end]
        return out


def ways_of(sources: Sequence[Source]) -> dict[str, Way]:
    """The way of every axis by its column ``CHANNEL.axis``."""
    columns = [list(source.meta["axes"]) for source in sources]
    ways: dict[int, Way] = {}
    names: dict[int, str] = {}
    for part, source in enumerate(sources):
        for place, number in enumerate(source.meta["channel"]["numbers"]):
            if number:
                ways[number] = Way([-1], [(part, columns[part][place])])
                name = source.meta["channel"]["name"]
                names[number] = f"{name}.{columns[part][place]}"
    at = {
        (part, place): number
        for part, source in enumerate(sources)
        for place, number in enumerate(source.meta["channel"]["numbers"])
    }
    for cycle, moves in _exchanges(sources):
        for part, place, _ in moves:
            if gone := at.get((part, place), 0):
                ways[gone].go(cycle, None)
            at[part, place] = 0
        for part, place, number in moves:
            if number:
                at[part, place] = number
                ways[number].go(cycle, (part, columns[part][place]))
    return {names[number]: way for number, way in ways.items()}


def _exchanges(
    sources: Sequence[Source],
) -> list[tuple[int, list[tuple[int, int, int]]]]:
    """By cycle: part, place and the logical number that came there, 0: none."""
    found: dict[int, list[tuple[int, int, int]]] = {}
    for part, source in enumerate(sources):
        if "events" not in source.tables:
            continue
        for chunk in source.chunks("events", ["cycle", "kind", "text"]):
            for row in chunk.to_pylist():
                if row["kind"] != AXES_PLACED:
                    continue
                moves = found.setdefault(int(row["cycle"]), [])
                for word in row["text"].split():
                    place, _, number = word.partition("=")
                    moves.append((part, int(place), int(number)))
    return sorted(found.items())
