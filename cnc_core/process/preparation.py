"""The running channel's preparation (SDA): from the front end into the engine,
as far as back-pressure allows.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..blocks import BlockBatch, number_pushed
from ..config import CellConfig
from ..engine import Engine, external
from ..errors import CncError, Place
from ..frontend.machine import External
from ..frontend.operator import Answer, Operator, Question
from ..frontend.port import ExternalValue, Wait
from ..program import Program
from ..program.restart import Restart
from .pausing import Pause

OUT_FOLDER = Path("hli-cosim-out")


class LivePort:
    """The running channel as the front end sees it; positions and time are
    those at the last drain.

    ``areas``: writable buffers of the external variables, "channel" and
    "global", as they were latched. ``put_out``: where a write (area, byte,
    data) goes besides. ``folder``: where files go that the program writes; it
    is made with the first. ``operator``: who answers dialogs.  ``retained``:
    what dialects keep from program to program.
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
        self.live: Callable[[], tuple[npt.NDArray[np.float64], float]] = (
            self._latched
        )
        self.levels = skip_levels
        self._areas = areas or {
            "channel": bytearray(external.AREA_BYTES),
            "global": bytearray(external.AREA_BYTES),
        }
        self._folder = folder
        self.latched = start.copy()
        self.messages: list[str] = []

    @property
    def operator_waiting(self) -> bool:
        return self.operator.waiting

    def moved(self, position: npt.NDArray[np.float64]) -> None:
        """The machine knows its position itself."""

    def written_externals(self) -> dict[tuple[str, str, int], ExternalValue]:
        return {}

    def position(self) -> npt.NDArray[np.float64]:
        return self.latched.copy()

    def live_position(self) -> npt.NDArray[np.float64]:
        return self.live()[0]

    def live_now_s(self) -> float:
        return self.live()[1]

    def _latched(self) -> tuple[npt.NDArray[np.float64], float]:
        return self.latched.copy(), self.latched_s

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

    def write_external(
        self, variable: External, element: int, value: ExternalValue
    ) -> None:
        area = self._areas[variable.scope]
        external.write(area, variable, element, value)
        if self._put_out:
            begin = external.place(variable, element)
            data = bytes(
                area[
                    begin : begin
                    + variable.blocks_per_element * external.BLOCK_BYTES
                ]
            )
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
    """Pumps one program into one engine.

    ``error``: why it ended early; the rows ahead of the error are executed.
    """

    def __init__(
        self,
        path: Path,
        cell: CellConfig,
        dialect: str | None,
        engine: Engine,
        port: LivePort | None = None,
        *,
        lenient: bool = False,
        restart: Restart | None = None,
        held: Callable[[bool], None] = lambda _: None,
    ) -> None:
        position = np.array(list(engine.state.position)[: engine.axes])
        self.port = port or LivePort(position)
        self.port.latched = position.copy()
        self.port.live = self._live
        self._cycle_s = cell.cycle_s
        self.engine = engine
        self.error: CncError | None = None
        self.blocks = 0
        self.waiting = self.done = self._halted = self._stopping = (
            self._stopped
        ) = False
        self._batch, self._first = BlockBatch.empty(), 0
        self._wait: Wait | None = None
        self._cell = cell
        self.pause = Pause(self, lambda: held(True), lambda: held(False))
        try:
            self.program: Program | None = Program(
                path,
                cell,
                dialect,
                self.port,
                lenient=lenient,
                start=position,
                restart=restart,
            )
        except CncError as error:
            self.program = None
            self._end(error)

    def pump(self) -> None:
        """Push rows until the ring is full, the program waits, or it ends."""
        if self.pause.held:
            self.engine.expect_cycle()
            return
        try:
            while (
                not (self.done or self.waiting or self.port.interrupted)
                and self._step()
            ):
                pass
        except CncError as error:
            self._end(error)

    def drained(self) -> None:
        """Everything handed out so far has been executed: go on reading."""
        self._latch()
        self.waiting = False
        if self.pause.drained():
            return
        if self._halted:
            self._halted = False
            self.engine.resync()
            assert self.program is not None
            self.program.resync(self.port.latched)
        elif self._stopping and not self._stopped:
            self._stopped = True
            self.engine.resync()
            assert self.program is not None
            self.program.begin_stop(self.port.latched)

    def _latch(self) -> None:
        self.port.latched, self.port.latched_s = self._live()

    def _live(self) -> tuple[npt.NDArray[np.float64], float]:
        """Position and time as they are now."""
        state = self.engine.state
        return np.array(list(state.position)[: self.engine.axes]), int(
            state.cycle
        ) * self._cycle_s

    def _step(self) -> bool:
        """One piece of work; False when the ring is full."""
        if self._first < len(self._batch):
            return self._push()
        if self.pause.pushed_all():
            return True
        assert self.program is not None
        item = self.program.read()
        if self._pausable:
            self.engine.hold_by_cell(self.program.reader.pauses)  # type: ignore[attr-defined]
        if isinstance(item, BlockBatch):
            self._batch, self._first = item, 0
            self.blocks += number_pushed(item)
        elif item is Wait.DRAINED:
            self.waiting = True
            self.engine.expect_drain()
        elif item is Wait.CYCLE:
            self.engine.expect_cycle()
            return False
        elif item is Wait.STOPPED:
            self.waiting = self._halted = True
            self.engine.halt()
        elif item is None and self.pause.active:
            self.pause.ended()
        elif item is None:
            for text in self.program.filter_texts:
                self.port.message(text)
            self._end(None)
        else:
            raise CncError(
                900003,
                f"the program waits for the {item.value}, which this cell does not answer",
            )
        return True

    @property
    def _pausable(self) -> bool:
        """The dialect has macros for a pause."""
        return (
            self.program is not None
            and hasattr(self.program.reader, "pauses")
            and not self.pause.active
        )

    def _push(self) -> bool:
        if self._first == 0 and self._pausable:
            state = self.engine.state
            self.pause.rows.add(
                int(state.rows_taken), self._batch, int(state.row_done)
            )
        self._first += self.engine.push(self._batch, self._first)
        return self._first >= len(self._batch)

    # pausing

    def hold(self) -> bool:
        """HOLD, where the cell has asked for it; False if the program does not
        allow it (PAUSE_MODE 4).
        """
        reader: Any = self.program.reader if self.program else None
        if reader is None or reader.pause_mode == 4:
            return False
        if not self.pause.begin(reader):
            self.engine.hold(True)
        return True

    def resume(self) -> None:
        """ACTIVE from HOLD."""
        if self.pause.held:
            self._latch()
            self.pause.resume()
        else:
            self.engine.hold(False)

    def retraced(self) -> None:
        """The path is driven forward again: what the program has for that is
        executed beside it and moves nothing.
        """
        reader: Any = self.program.reader if self.program else None
        path = getattr(reader, "retrace_macro", None)
        if path is None or self.pause.active:
            return
        self._latch()
        macro = Program(
            path, self._cell, "isons", self.port, start=self.port.latched,
            reader=lambda machine: reader.macro_reader(path, machine, self.port.latched, run_type=reader.RETRACING),
        )  # fmt: skip
        try:
            while (item := macro.read()) is not None:
                if item is Wait.CYCLE or (
                    isinstance(item, BlockBatch) and len(item)
                ):
                    raise CncError(909174, place=Place(str(path)))
        except CncError as error:
            self._end(error)

    def take_rows(self) -> tuple[BlockBatch, int]:
        out = self._batch, self._first
        self._batch, self._first = BlockBatch.empty(), 0
        return out

    def give_rows(self, batch: BlockBatch) -> None:
        self._batch, self._first = batch, 0

    def macro(self, path: Path, place: npt.NDArray[np.float64]) -> None:
        main: Any = self.program.reader if self.program else None
        main = self._main_reader = getattr(self, "_main_reader", None) or main
        self.program = Program(
            path, self._cell, "isons", self.port, start=self.port.latched,
            reader=lambda machine: main.macro_reader(path, machine, place),
        )  # fmt: skip

    def position(self) -> npt.NDArray[np.float64]:
        return self.port.latched.copy()

    def take_commands(self) -> None:
        """Commands that the path has passed become messages."""
        names = self.program.cell.axis_names if self.program else ()
        for command in self.engine.take_commands():
            place = " ".join(
                f"{name}{value:.4f}"
                for name, value in zip(names, command.position, strict=False)
            )
            self.port.message(
                f"event {command.value:g} at {place}, {command.cycle * self._cycle_s:.6f} s"
            )

    def stop(self) -> bool:
        """Brake, leave out the rest, execute what the program has for a stop;
        False if it has nothing.
        """
        if (
            self.program is None
            or self._stopping
            or not getattr(self.program.reader, "has_stop", False)
        ):
            return False
        self._stopping, self._batch, self._first = True, BlockBatch.empty(), 0
        self.waiting, self.done = True, False
        self.engine.halt()
        return True

    def close(self) -> None:
        """Nothing more is read; the rows pushed so far are executed or have
        been left out.
        """
        self.done = True

    def _end(self, error: CncError | None) -> None:
        self.error = error
        self.done = True
        self.engine.finish()
