"""The running channel's preparation (SDA): from the front end into the engine, as far as back-pressure allows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from .blocks import BlockBatch
from .config import CellConfig
from .engine import Engine
from .errors import CncError
from .port import Wait
from .program import Program


class LivePort:
    """The running channel as the front end sees it; positions are those at the last drain."""

    def __init__(self, start: npt.NDArray[np.float64], skip_levels: int = 0) -> None:
        self.latched = start.copy()
        self._skip_levels = skip_levels
        self.messages: list[str] = []

    def position(self) -> npt.NDArray[np.float64]:
        return self.latched.copy()

    def skip_levels(self) -> int:
        """Bit n - 1: blocks of skip level n are left out (program_block_ignore, as it was at program start)."""
        return self._skip_levels

    def message(self, text: str) -> None:
        self.messages.append(text)


class Preparation:
    """Pumps one program into one engine. ``error``: why it ended early; the rows ahead of the error are executed."""

    def __init__(
        self, path: Path, cell: CellConfig, dialect: str | None, engine: Engine, skip_levels: int = 0
    ) -> None:
        position = np.array(list(engine.state.position)[: engine.axes])
        self.port = LivePort(position, skip_levels)
        self.engine = engine
        self.error: CncError | None = None
        self.blocks = 0
        self.waiting = self.done = False
        self._batch, self._first = BlockBatch.empty(), 0
        self._wait: Wait | None = None
        try:
            self.program: Program | None = Program(path, cell, dialect, self.port, start=position)
        except CncError as error:
            self.program = None
            self._end(error)

    def pump(self) -> None:
        """Push rows until the ring is full, the program waits, or it ends."""
        try:
            while not self.done and not self.waiting and self._step():
                pass
        except CncError as error:
            self._end(error)

    def drained(self) -> None:
        """Everything handed out so far has been executed: go on reading."""
        state = self.engine.state
        self.port.latched = np.array(list(state.position)[: self.engine.axes])
        self.waiting = False

    def _step(self) -> bool:
        """One piece of work; False when the ring is full."""
        if self._first < len(self._batch):
            taken = self.engine.push(self._batch, self._first)
            self._first += taken
            return self._first >= len(self._batch)
        assert self.program is not None
        item = self.program.read()
        if isinstance(item, BlockBatch):
            self._batch, self._first = item, 0
            self.blocks += len(item)
        elif item is Wait.DRAINED:
            self.waiting = True
            self.engine.expect_drain()
        elif item is None:
            self._end(None)
        else:
            raise CncError(900003, f"the program waits for the {item.value}, which this cell does not answer")
        return True

    def close(self) -> None:
        """Nothing more is read; the rows pushed so far are executed or have been left out."""
        self.done = True

    def _end(self, error: CncError | None) -> None:
        self.error = error
        self.done = True
        self.engine.finish()
