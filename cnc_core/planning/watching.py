"""A plan that gets no further says so, and one that takes too long ends."""

from __future__ import annotations

import time
from collections.abc import Callable

from ..errors import CncError
from ..process.options import STANDS_CELL_S, STANDS_WALL_S
from ..process.scene import computing
from ..process.waiting import Scene, StandWatch
from ..program import Program
from . import Feeder


class PlanWatch:
    """Looks at a plan after each piece of work.

    ``say`` gets a line where no motion came for ``patience_s`` of wall time.
    ``max_wall``: wall time, s, behind which CncError 905025 ends the plan; 0:
    never.
    """

    def __init__(
        self,
        program: Program,
        say: Callable[[str], None],
        max_wall: float = 0.0,
        patience_s: float = STANDS_WALL_S,
    ) -> None:
        self._program, self._max_wall = program, max_wall
        self._began = time.monotonic()
        self._seen: object = None
        self._n, self._time_s = 0, 0.0
        patience = (STANDS_CELL_S, patience_s)
        self._waits = StandWatch(self._scene, say, patience)

    def _scene(self) -> Scene:
        return computing(self._program, self._seen)

    def account(self) -> str:
        """How far the plan is, in a sentence."""
        at = f" at N{self._n}" if self._n else ""
        return f"{self._time_s:.3f} s of cell time{at}"

    def look(self, feeder: Feeder) -> None:
        """After a piece of work."""
        self._n = feeder.n
        state = feeder.engine.state
        self._time_s = int(state.cycle) * self._program.cell.cycle_s
        # the axes, too: rows may be driven for long
        self._seen = feeder.motions, tuple(feeder.engine.state.position)
        self._waits.look()
        if self._max_wall and time.monotonic() - self._began >= self._max_wall:
            (waiting,) = self._waits.now()
            limit = f"{self._max_wall:g} s of wall time (--max-wall)"
            text = f"not planned after {limit}: {waiting.without_place()}"
            raise CncError(905025, text, waiting.place)
