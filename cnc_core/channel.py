"""The running channel's preparation (SDA): from the front end into the engine, as far as back-pressure allows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import external
from .blocks import BlockBatch
from .config import CellConfig
from .engine import Engine
from .errors import CncError
from .frontend.machine import External
from .operator_answers import Answer, Operator, Question
from .port import ExternalValue, Wait
from .program import Program

OUT_FOLDER = Path("hli-cosim-out")


class LivePort:
    """The running channel as the front end sees it; positions and time are those at the last drain.

    ``areas``: writable buffers of the external variables, "channel" and "global", as they were latched.
    ``put_out``: where a write (area, byte, data) goes besides.
    ``folder``: where files go that the program writes; it is made with the first.
    ``operator``: who answers dialogs.  ``retained``: what dialects keep from program to program.
    """

    answers = True
    manual_data = False

    def __init__(
        self,
        start: npt.NDArray[np.float64],
        areas: dict[str, Any] | None = None,
        folder: Path = OUT_FOLDER,
        skip_levels: int = 0,
        put_out: Callable[[int, int, bytes], None] | None = None,
        retained: dict[str, Any] | None = None,
        operator: Operator | None = None,
    ) -> None:
        self.operator = operator or Operator()
        self.operator.interrupted = lambda: self.interrupted
        self._put_out = put_out
        self.retained = {} if retained is None else retained
        self.interrupted = False
        self.latched_s = 0.0
        self.levels = skip_levels
        self._areas = areas or {"channel": bytearray(external.AREA_BYTES), "global": bytearray(external.AREA_BYTES)}
        self._folder = folder
        self.latched = start.copy()
        self.messages: list[str] = []

    def position(self) -> npt.NDArray[np.float64]:
        return self.latched.copy()

    def message(self, text: str) -> None:
        self.messages.append(text)

    def ask(self, question: Question) -> Answer | None:
        return self.operator.ask(question)

    def now_s(self) -> float:
        return self.latched_s

    def skip_levels(self) -> int:
        return self.levels

    def read_external(self, variable: External, element: int) -> ExternalValue:
        return external.read(self._areas[variable.scope], variable, element)

    def write_external(self, variable: External, element: int, value: ExternalValue) -> None:
        area = self._areas[variable.scope]
        external.write(area, variable, element, value)
        if self._put_out:
            begin = external.place(variable, element)
            data = bytes(area[begin : begin + variable.blocks_per_element * external.BLOCK_BYTES])
            self._put_out(0 if variable.scope == "channel" else 1, begin, data)

    def append_file(self, name: str, text: str) -> None:
        self._put(name, text, "a")

    def write_file(self, name: str, text: str) -> None:
        self._put(name, text, "w")

    def read_file(self, name: str) -> str | None:
        path = self._folder / name
        return path.read_text(encoding="utf-8") if path.is_file() else None

    def _put(self, name: str, text: str, how: str) -> None:
        path = self._folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open(how, encoding="utf-8") as file:
                file.write(text)
        except OSError as error:
            raise CncError(901004, f"{path}: {error.strerror}") from None


class Preparation:
    """Pumps one program into one engine. ``error``: why it ended early; the rows ahead of the error are executed."""

    def __init__(
        self,
        path: Path,
        cell: CellConfig,
        dialect: str | None,
        engine: Engine,
        port: LivePort | None = None,
        *,
        lenient: bool = False,
    ) -> None:
        position = np.array(list(engine.state.position)[: engine.axes])
        self.port = port or LivePort(position)
        self.port.latched = position.copy()
        self._cycle_s = cell.cycle_s
        self.engine = engine
        self.error: CncError | None = None
        self.blocks = 0
        self.waiting = self.done = False
        self._batch, self._first = BlockBatch.empty(), 0
        self._wait: Wait | None = None
        try:
            self.program: Program | None = Program(
                path, cell, dialect, self.port, lenient=lenient, start=position
            )
        except CncError as error:
            self.program = None
            self._end(error)

    def pump(self) -> None:
        """Push rows until the ring is full, the program waits, or it ends."""
        try:
            while not (self.done or self.waiting or self.port.interrupted) and self._step():
                pass
        except CncError as error:
            self._end(error)

    def drained(self) -> None:
        """Everything handed out so far has been executed: go on reading."""
        state = self.engine.state
        self.port.latched_s = int(state.cycle) * self._cycle_s
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
            for report in self.program.filter_reports:
                self.port.message(str(report))
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
