"""What happened, with the time and who did it: the last of it only."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

KEPT = 500
TEXT_MAX = 400


class Events:
    """Numbered events; ``since`` gives those that a page has not seen."""

    def __init__(self, kept: int = KEPT) -> None:
        self._kept: deque[dict[str, Any]] = deque(maxlen=kept)
        self.last = 0

    def add(
        self,
        kind: str,
        text: str,
        who: str = "",
        cell_s: float | None = None,
        wall: float | None = None,
    ) -> None:
        """One event; ``cell_s``: the cell's time, s; ``wall``: None: now."""
        self.last += 1
        self._kept.append(
            {
                "number": self.last,
                "wall": time.time() if wall is None else wall,
                "cell_s": cell_s,
                "kind": kind,
                "who": who,
                "text": text[:TEXT_MAX],
            }
        )

    def since(self, number: int) -> list[dict[str, Any]]:
        """The events behind this one, the oldest first."""
        return [event for event in self._kept if event["number"] > number]
