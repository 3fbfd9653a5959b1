"""Looking at monitored variables, each as often as its clients asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asyncua import ua

from ..symbols.cell import ServedCell
from .sessions import CellServer
from .space import Space

LIST_S = 0.05
"""Between two looks which variables are monitored."""
MISSING = object()


@dataclass
class Watched:
    """A monitored variable: when to look next, and what was seen last."""

    due: float
    seen: Any = MISSING


class Sampling:
    """Tells subscriptions of variables that changed."""

    def __init__(
        self, inner: CellServer, space: Space, cell: ServedCell
    ) -> None:
        self._inner, self._space, self._cell = inner, space, cell
        self._watched: dict[ua.NodeId, Watched] = {}
        self._listed = 0.0

    @property
    def monitored(self) -> list[ua.NodeId]:
        """The variables that somebody monitors."""
        if not self._inner.subscription_service.subscriptions:
            return []
        return [
            node
            for node, held in self._space.values.items()
            if held.datachange_callbacks
        ]

    async def look(self, now: float) -> None:
        """Tell of what changed among those that are due at ``now``, s."""
        if now >= self._listed:
            self._listed = now + LIST_S
            await self._space.tell_gone()
            self._list(now)
        for node, watched in [*self._watched.items()]:
            if watched.due <= now:
                pace = self._space.paces.get(node, 0.0)
                watched.due = max(watched.due + pace, now)
                await self._tell(node, watched)

    def _list(self, now: float) -> None:
        """Whoever is new was told the first value when it was made."""
        before, self._watched = self._watched, {}
        for node in self.monitored:
            due = now + self._space.paces.get(node, 0.0)
            watched = before.get(node) or Watched(due)
            if node in self._space.made_again:
                watched = Watched(now)
            watched.due = min(watched.due, due)  # somebody asks for more
            self._watched[node] = watched
        self._space.made_again.clear()
        for node in [*self._space.paces]:
            if node not in self._watched:
                del self._space.paces[node]

    async def _tell(self, node: ua.NodeId, watched: Watched) -> None:
        entry: Any = self._space.entries.get(node)
        if entry is None:  # its CNC has gone in the meantime
            return
        sample = entry.sample(self._cell)
        if sample != watched.seen:
            watched.seen = sample
            await self._inner.write_attribute_value(node, entry.value(sample))
