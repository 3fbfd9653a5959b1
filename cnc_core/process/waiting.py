"""A run that stands says so: one line, where it stands, what for, since when
and who could end it.

The engine tells when the path has stood for some cell time.
Wall time is looked at here, a few times a second.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ..engine import Engine
from ..errors import CncError, Place
from .options import STANDS_CELL_S, STANDS_WALL_S, RunOptions
from .stands import Reason

LOOK_S = 0.25  # between two looks, wall time
NO_LIMIT = 1 << 62  # cycles
GAP_S, LAST_GAP_S = 4.0, 60.0  # between two lines, wall time
EARLY_LINES = 5  # behind them the gap doubles from line to line


@dataclass(frozen=True)
class Waiting:
    """One thing that the run waits for.

    ``line`` 0: no block is active.  ``since_s``: for so many seconds, cell
    time where it passes, else wall time.
    """

    file: str
    line: int
    n: int
    what: str
    since_s: float
    who: str
    channel: str = ""

    @property
    def place(self) -> Place:
        return Place(self.file, self.line, 1 if self.line else 0)

    def as_json(self) -> dict[str, Any]:
        found = asdict(self)
        if not self.channel:
            del found["channel"]
        return found

    def __str__(self) -> str:
        where = f"{Path(self.file).name}:{self.line}: " if self.line else ""
        if self.channel:
            where = f"channel {self.channel}: {where}"
        return where + self.without_place()

    def without_place(self) -> str:
        """The line behind the name of the file."""
        block = f"N{self.n}: " if self.n else ""
        return (
            f"{block}waits for {self.what} for {self.since_s:.1f} s; {self.who}"
        )


@dataclass(frozen=True)
class Scene:
    """What the run waits for now.

    ``place``: file, line and N of the block.
    ``cell_s``: how long already, cell time; None where none passes.
    ``key``: another one is another wait; None: place and reasons are it.
    ``by_wall``: it ends by itself, and is told behind its wall time alone.
    """

    reasons: list[Reason]
    place: tuple[str, int, int] = ("", 0, 0)
    cell_s: float | None = None
    key: object = None
    by_wall: bool = False


def gap_s(told: int) -> float:
    """Wall time from one line to the next, when so many have been told."""
    doubled = min(max(told - EARLY_LINES, 0), 4)
    return min(GAP_S * 2.0**doubled, LAST_GAP_S)


class StandWatch:
    """Tells of waits that last.

    ``scene`` looks at the run.  ``say`` gets each line.
    ``patience``: cell and wall time, s, after which a wait is told.
    ``channel``: its name, in a cell with several.
    ``cell_time``: s, now.
    """

    def __init__(
        self,
        scene: Callable[[], Scene],
        say: Callable[[str], None],
        patience: tuple[float, float] = (STANDS_CELL_S, STANDS_WALL_S),
        channel: str = "",
        cell_time: Callable[[], float] = float,
    ) -> None:
        self._scene, self._say, self._channel = scene, say, channel
        self._cell_time, self._looked_at = cell_time, 0.0
        self._cell_s, self._wall_s = patience
        self._key: object = None
        self._since = self._next_look = time.monotonic()
        self._told_at, self._told = 0.0, 0
        self.last: list[Waiting] = []  # as of the last look

    def look(self) -> None:
        """Called often: looks now and then, tells what has to be told."""
        now = time.monotonic()
        if now < self._next_look:
            return
        self.look_now(now)

    def look_now(self, now: float | None = None) -> None:
        """Look at once: the engine says that the path has stood for long."""
        now = time.monotonic() if now is None else now
        self._next_look = now + LOOK_S
        scene = self._seen(now)
        self.last = self._waiting(scene, now)
        if not self.last:
            return
        cell_s = 0.0 if scene.by_wall else scene.cell_s or 0.0
        lasts = cell_s >= self._cell_s or now - self._since >= self._wall_s
        if self._told_at:
            if now - self._told_at < gap_s(self._told):
                return
        elif not lasts:
            return
        self._told_at = now
        self._told += 1
        for waiting in self.last:
            self._say(str(waiting))

    def now(self) -> list[Waiting]:
        """What the run waits for at this moment."""
        now = time.monotonic()
        self.last = self._waiting(self._seen(now), now)
        return self.last

    def kept(self) -> list[Waiting]:
        """What the last look saw, as if it lasted until now: the PLC may have
        gone meanwhile, which would be another wait.
        """
        passed = self._cell_time() - self._looked_at
        return [
            replace(one, since_s=round(one.since_s + passed, 6))
            for one in self.last
        ]

    def _seen(self, now: float) -> Scene:
        scene = self._scene()
        key = scene.key
        if key is None:
            key = (scene.place, tuple(what for what, _ in scene.reasons))
        if key != self._key:
            self._key, self._since = key, now
            self._told_at, self._told = 0.0, 0
        return scene

    def _waiting(self, scene: Scene, now: float) -> list[Waiting]:
        self._looked_at = self._cell_time()
        wall_s = now - self._since
        since_s = wall_s if scene.cell_s is None else scene.cell_s
        return [
            Waiting(*scene.place, what, round(since_s, 6), who, self._channel)
            for what, who in scene.reasons
        ]


def _by_channel(waiting: Waiting) -> str:
    text = waiting.without_place()
    return f"channel {waiting.channel}: {text}" if waiting.channel else text


class TimeLimits:
    """``max_time`` and ``max_wall`` of a run."""

    def __init__(self, run: RunOptions, cycle_s: float) -> None:
        self._run = run
        self._last_cycle = round(run.max_time / cycle_s)
        self._began = time.monotonic()

    def cycles_left(self, engine: Engine) -> int:
        """How many cycles may still run."""
        if not self._last_cycle:
            return NO_LIMIT
        return self._last_cycle - int(engine.state.cycle)

    def spent(
        self,
        engine: Engine,
        waits: Callable[[], list[Waiting]],
        moves: Callable[[], str],
    ) -> CncError | None:
        """The error of a run that has used up its time: what it waits for.

        ``waits``: looks for that.  ``moves``: what it does if it waits for
        nothing.
        """
        run = self._run
        if self.cycles_left(engine) <= 0:
            limit = f"{run.max_time:g} s of cell time (--max-time)"
        elif run.max_wall and time.monotonic() - self._began >= run.max_wall:
            limit = f"{run.max_wall:g} s of wall time (--max-wall)"
        else:
            return None
        waiting = waits()
        why = "; ".join(_by_channel(w) for w in waiting) or moves()
        place = waiting[0].place if waiting else Place()
        return CncError(905025, f"not ended after {limit}: {why}", place)
