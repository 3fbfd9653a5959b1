"""A program that goes round a loop without motion: it asks for something."""

from __future__ import annotations

from collections.abc import Sequence

Lines = tuple[int, int]
"""First and last line of a loop."""


class AskingLoop:
    """Finds the loop from looks at the place where a program is."""

    def __init__(self) -> None:
        self._stands_at: Sequence[float] = ()
        self._since = 0
        self._seen: dict[tuple[str, int], int] = {}
        self._round = False

    def look(
        self,
        position: Sequence[float],
        place: tuple[str, int],
        blocks: int,
        cycle: int,
    ) -> tuple[int, Lines] | None:
        """Since which cycle the axes have stood while the program goes round,
        and its lines seen; None: it does not go round.

        ``place``: file and line.  ``blocks``: how many were read so far.
        """
        if position != self._stands_at:
            self._stands_at, self._since = position, cycle
            self._seen, self._round = {}, False
        before = self._seen.setdefault(place, blocks)
        self._round = self._round or before != blocks
        if not self._round:
            return None
        lines = [line for file, line in self._seen if file == place[0]]
        return self._since, (min(lines), max(lines))
