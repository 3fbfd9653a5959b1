"""Writing a cycle's program."""

from __future__ import annotations

from collections.abc import Iterable

from cnc_core.frontend.isg.cycles.declaration import Surroundings, number_text
from cnc_core.geometry.shapes.pocket import DOWN, RAPID, Move

# what the lines of a cycle are written for; the caller's functions come back at
# its end
INITIAL = "G90 G17 G162 G94"


class Writer:
    """Lines of a cycle for the machine's own axis names."""

    def __init__(self, around: Surroundings, initial: str = INITIAL) -> None:
        self._axes = around.axes
        self.lines: list[str] = [initial]

    def word(self, axis: int, value: float) -> str:
        """An axis word; ``axis`` 0, 1, 2."""
        name = self._axes[axis]
        assert name is not None
        return f"{name}{'=' if len(name) > 1 else ''}{number_text(value)}"

    def rapid(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> None:
        words = [
            self.word(place, value)
            for place, value in enumerate((x, y, z))
            if value is not None
        ]
        self.lines.append(" ".join(["G00", *words]))

    def moves(
        self,
        moves: Iterable[Move],
        feeds: dict[str, float],
        at: tuple[float, float],
    ) -> None:
        """Motions in the plane from ``at``; ``feeds`` by kind of speed."""
        for move in moves:
            if move.x is not None and move.y is not None:
                before, at = at, (move.x, move.y)
            words = [
                self.word(i, v)
                for i, v in enumerate((move.x, move.y, move.z))
                if v is not None
            ]
            if move.speed == RAPID:
                self.lines.append(" ".join(["G00", *words]))
                continue
            code = "G01"
            if move.centre is not None:
                code = "G03" if move.turn > 0 else "G02"
                words += [
                    f"I{number_text(move.centre[0] - before[0])}",
                    f"J{number_text(move.centre[1] - before[1])}",
                ]
            feed = feeds[DOWN if move.speed == DOWN else move.speed]
            self.lines.append(" ".join([code, *words, f"F{number_text(feed)}"]))
