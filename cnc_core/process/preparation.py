"""The running channel's preparation (SDA): from the front end into the engine,
as far as back-pressure allows.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..blocks import BlockBatch, number_pushed
from ..config import CellConfig
from ..engine import Engine
from ..errors import CncError, Place
from ..frontend.front_end import FrontEnd, Restartable
from ..frontend.machine import ProgramMachine
from ..frontend.port import MESSAGES_KEPT, Wait, keep
from ..program import Program
from ..program.restart import Restart
from ..units import FloatArray
from .live_port import LivePort
from .pausing import Pause

COMPUTE_S = 0.1  # of wall time without a row, before the run is looked at
NO_PAUSE = 4  # pause_mode: the program allows no pause


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
        tolerance: float | None = None,
        held: Callable[[bool], None] = lambda _: None,
    ) -> None:
        """The program begins as soon as the channel has its own axes."""
        position = np.array(list(engine.state.position)[: engine.axes])
        self.port = port or LivePort(position)
        self.port.latched = position.copy()
        self.port.put_cycle = engine.rt_cycle
        self.port.live = self._live
        self.told: Callable[..., None] = lambda *_, **__: None
        self._cycle_s = cell.cycle_s
        self.engine = engine
        self.error: CncError | None = None
        self.blocks = 0
        self.computes = False  # for long, without a row
        self._idle = False  # the last read gave none
        self.waiting = self.done = self._halted = self._stopping = (
            self._stopped
        ) = False
        self._batch, self._first = BlockBatch.empty(), 0
        # what the program waits for from cycle to cycle
        self._awaited: Callable[[], bool] | None = None
        self._main_reader: Restartable | None = None
        self._cell = cell
        self.pause = Pause(self, lambda: held(True), lambda: held(False))
        self.program: Program | None = None

        def make() -> Program:
            return Program(
                path,
                cell,
                dialect,
                self.port,
                lenient=lenient,
                start=self.port.latched.copy(),
                restart=restart,
                tolerance=tolerance,
            )

        self._make = make
        try:
            if not self._begin():
                self._awaited = self._begin
        except CncError as error:
            self._end(error)

    def _begin(self) -> bool:
        """Open the program; False: another channel still has an axis of this
        one.
        """
        axes = self.port.axes
        if axes is not None and not axes.came():
            return False
        if self._awaited is not None:
            self.engine.resync()
        self.port.latched = self._live()[0]
        self.program = self._make()
        return True

    def pump(self) -> None:
        """Push rows until the ring is full, the program waits, or it ends.

        A program that computes for long is left for a look at the run; the
        engine asks for its rows again.
        """
        self._go_on_paused()
        if self.pause.held:
            self.engine.expect_cycle()
            return
        self.computes, until = False, time.monotonic() + COMPUTE_S
        try:
            while (
                not (self.done or self.waiting or self.port.interrupted)
                and self._step()
            ):
                if self._idle and time.monotonic() > until:
                    self.computes = True
                    return
        except CncError as error:
            if not self.done:  # else it was ended in a dialog
                self._end(error)

    def drained(self) -> None:
        """Everything handed out so far has been executed: go on reading."""
        self._latch()
        self.waiting = False
        if self._stopping:
            if not self._stopped:
                self._stopped = True
                self.engine.resync()
                assert self.program is not None
                self.program.begin_stop(self.port.latched)
        elif self._halted:
            self._halted = False
            self.engine.resync()
            self.engine.await_functions()
            assert self.program is not None
            self.program.resync(self.port.latched)
            self.pause.forget_rows()
            self.pause.drained()
        else:
            self.pause.drained()

    def _latch(self) -> None:
        self.port.latched, self.port.latched_s = self._live()
        state = self.engine.state
        self.port.latched_loop = bool(state.rt_loop), int(state.rt_loop_count)

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
        if self._awaited is not None and not self._goes_on(self._awaited):
            return False
        assert self.program is not None
        item = self.program.read()
        reader = self._restartable
        if reader is not None and not self.pause.active:
            self.engine.hold_by_cell(reader.pauses)
        self._idle = isinstance(item, BlockBatch) and not len(item)
        if isinstance(item, BlockBatch):
            self._batch, self._first = item, 0
            self.blocks += number_pushed(item)
        elif isinstance(item, Wait):
            return self._begin_wait(item)
        elif self.pause.active:
            self.pause.ended()
        else:
            for text in self.program.filter_texts:
                self.port.message(text)
            self._end(None)
        return True

    def _begin_wait(self, item: Wait) -> bool:
        """False: nothing can be done before the next cycle."""
        if item is Wait.DRAINED:
            self.waiting = True
            self.engine.expect_drain()
        elif item is Wait.SIGNAL:
            assert self.port.signals is not None
            return self._goes_on(self.port.signals.came)
        elif item is Wait.AXES:
            return self._goes_on(self._axes_came)
        elif item is Wait.CONDITION:
            return self._goes_on(self._condition_true)
        elif item is Wait.CYCLE:
            self.engine.expect_cycle()
            return False
        elif item is Wait.STOPPED:
            self.waiting = self._halted = True
            self.engine.halt()
        else:
            raise CncError(
                900003,
                f"the program waits for the {item.value}, which this cell does not answer",
            )
        return True

    def _goes_on(self, came: Callable[[], bool]) -> bool:
        """Whether the program has what it waits for; else the next look is in
        the next cycle.
        """
        self._awaited = None if came() else came
        if self._awaited is None:
            return True
        self.engine.expect_cycle()
        return False

    def _condition_true(self) -> bool:
        self._latch()
        condition = self.port.condition
        if condition is None or condition.true():
            self.port.condition = None
            return True
        return False

    def _axes_came(self) -> bool:
        """The axes of an exchange; the path goes on from where they stand."""
        assert self.port.axes is not None
        assert self.program is not None
        if not self.port.axes.came():
            return False
        self.engine.resync()
        self._latch()
        self.program.axes_exchanged()
        return True

    @property
    def _pausable(self) -> bool:
        """The dialect has macros for a pause."""
        return self._restartable is not None and not self.pause.active

    @property
    def _restartable(self) -> Restartable | None:
        """The program's reader, if its dialect has macros for pauses."""
        return self.program.reader.restartable if self.program else None

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
        reader, state = self._restartable, self.engine.state
        if reader is None or reader.pause_mode == NO_PAUSE or state.program_end:
            return False
        # macros are for the way forward of the program itself
        if state.off_program or not self.pause.begin(reader):
            self.engine.hold(True)
        return True

    def resume(self) -> None:
        """ACTIVE from HOLD."""
        if self.pause.active:
            self.pause.resume_soon()
            self._go_on_paused()
        else:
            self.engine.hold(False)

    def _go_on_paused(self) -> None:
        """Behind ACTIVE, once the path stands where it has paused."""
        if self.pause.due and not self.engine.state.retraced:
            self._latch()
            self.pause.resume()

    def retraced(self) -> None:
        """The path is driven forward again: what the program has for that is
        executed beside it and moves nothing.
        """
        reader = self._restartable
        path = reader.retrace_macro if reader else None
        if reader is None or path is None or self.pause.active:
            return
        self._latch()
        macro = self._macro_program(
            reader, path, self.port.latched, reader.RETRACING
        )
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
        self._main_reader = self._main_reader or self._restartable
        assert self._main_reader is not None
        self.program = self._macro_program(self._main_reader, path, place)

    def _macro_program(
        self,
        main: Restartable,
        path: Path,
        place: FloatArray,
        run_type: int = 0,
    ) -> Program:
        """A macro of the program, from where the axes stand."""
        assert self.program is not None

        def macro_reader(machine: ProgramMachine) -> FrontEnd:
            return main.macro_reader(path, machine, place, run_type=run_type)

        return Program(
            path,
            self._cell,
            self.program.dialect,
            self.port,
            start=self.port.latched,
            reader=macro_reader,
        )

    def position(self) -> npt.NDArray[np.float64]:
        return self.port.latched.copy()

    def take_commands(self) -> None:
        """Commands that the path has passed become messages."""
        names = self.program.cell.axis_names if self.program else ()
        for command in self.engine.take_commands():
            if self._sends(command.value):
                continue
            place = " ".join(
                f"{name}{value:.4f}"
                for name, value in zip(names, command.position, strict=False)
            )
            at_s = command.cycle * self._cycle_s
            text = f"event {command.value:g} at {place}, {at_s:.6f} s"
            keep(self.port.messages, text, MESSAGES_KEPT)
            self.told("command", text, 0, command.line, cycle=command.cycle)

    def _sends(self, value: float) -> bool:
        """A command on the path that is a signal to other channels."""
        signals = self.port.signals
        try:
            return signals is not None and signals.passed(value)
        except CncError as error:
            self._end(error)
            return True

    def stop(self) -> bool:
        """Brake, leave out the rest, execute what the program has for a stop;
        False if it has nothing, or asks in a dialog.
        """
        self.pause.leave()
        reader = self._restartable
        if reader is None or self._stopping or not reader.has_stop:
            return False
        if self.port.asks:
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
