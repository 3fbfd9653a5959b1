"""IsoNs front end: plain lines through the C scanner, every other block
compiled, kept if it comes again, executed.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import POLYNOMIAL, BlockBatch
from cnc_core.errors import CncError
from cnc_core.frontend.base.block_text import (
    BlockText,
    PhysicalLine,
    check_length,
    read_line,
)
from cnc_core.frontend.base.flow import START, Level, Mark
from cnc_core.frontend.base.lexer import TokenStream, fail
from cnc_core.frontend.base.reader import (
    WAIT_BLOCKS,
    BlockReader,
    Prepared,
    located,
)
from cnc_core.frontend.base.scanner import (
    CENTRE_DISTANCE,
    FEED_POSITIVE,
    KEEP_CENTRE,
    NO_BRACKETS,
    NO_EQUALS,
    NO_PITCH,
    NO_PLANES,
    PLANE_CENTRE,
    RADIUS_ONCE,
    Modal,
    MotionWords,
    Row,
    Rules,
)
from cnc_core.frontend.machine import ProgramMachine

from ..front_end import Restartable
from ..port import ChannelPort, Wait
from .base import codes
from .base.machine import IsonsCell
from .base.parameters import Parameters
from .base.store import Store, UserScope
from .base.text import PATTERN, label_of, parts_of, strip_remark
from .devices.canopen import Nodes
from .devices.clock import Clock
from .devices.positioners import Positioners
from .flow.control import Control
from .flow.endless import Endless
from .flow.instructions import Instructions
from .flow.levels import MACRO, MAIN, SUBROUTINE, LevelData, call_macro
from .flow.lookahead import look_ahead_command
from .flow.retained import take_over
from .flow.searching import GO_BLOCK, NORMAL, RETRACE, Search
from .language.formulas import BEHIND_MOTION, TIMED, Formulas
from .language.macros import Macros
from .language.words import WordBlock, WordParser
from .motion.executor import Executor
from .motion.output import OFF
from .motion.system import System
from .operator.forms import Forms

RULE_BITS = (
    RADIUS_ONCE
    | NO_PITCH
    | KEEP_CENTRE
    | NO_EQUALS
    | PLANE_CENTRE
    | CENTRE_DISTANCE
    | NO_BRACKETS
    | NO_PLANES
)
RULE_BITS |= FEED_POSITIVE
LEVELS_MAX = 101
IDLE_BLOCKS = 1_000_000  # blocks without a row: error 907001
SHARED_WORDS = (
    900005,
    900011,
    908005,
)  # words of several functions in one block
PAUSE_EVENTS = ("M_PAUSE", "M_GOPAUSE")
Items = Sequence[Row | Wait]
Run = Callable[[], Items]


class IsonsFrontEnd(BlockReader):
    """Resumable reader of one program."""

    levels_max, too_deep = LEVELS_MAX, 907002

    def __init__(
        self,
        path: Path,
        machine: ProgramMachine,
        port: ChannelPort,
        *,
        collect: bool = False,
        scan: bool = True,
        caller: IsonsFrontEnd | None = None,
    ) -> None:
        cell = machine.settings(IsonsCell)
        self.parameters = Parameters(cell.parameters)
        modal = Modal(
            machine,
            Rules(
                RULE_BITS,
                centre_limit_mm=self.parameters.length("SGLR"),
                centre_ratio=0.0,
            ),
        )
        super().__init__(path, modal, port, collect=collect, scan=scan)
        self.port = port
        self.clock = Clock(port)
        self.store = Store(self.warn)
        self.forms = Forms(port)
        self.macros = Macros(path, cell)
        self.nodes = Nodes(cell.canopen)
        positioners = Positioners(cell.positioners, self.parameters, self.clock)
        self.system = System(port, cell, self.clock, positioners)
        self.executor = Executor(
            machine, modal, port, cell, self.parameters, self.clock, self.warn,
            lambda kind, number: self.macros.find(kind, number) is not None,
        )  # fmt: skip
        self.system.executor = self.executor
        self.system.message_result = lambda: self.forms.result
        self.executor.positioner_offset = positioners.set_offset
        self.executor.speed_copied = lambda speed: self.system.shared.write(
            "K", 9, speed, 0
        )
        modal.apply(MotionWords(exact_stop=not self.parameters["USE_G60"]))
        before: Executor | None = (
            caller.executor if caller else port.retained.get("isons")
        )
        if before is not None:
            take_over(self.executor, before)
        if caller is None:
            port.retained["isons"] = self.executor
        self._queue.extend(self.executor.mode_rows(0))
        self._endless = Endless(self)
        self.control = Control(
            self.flow,
            lambda: self.modal.line,
            self._error if collect else None,
            self._visit if collect else None,
            self._endless.jumped_back,
        )
        self.idle_blocks_max = IDLE_BLOCKS
        self._ticks = 0  # waits so far: time has passed between them
        # when a block has read the running machine last
        self._read_at: dict[tuple[int, int], int] = {}
        self.search = Search(self)
        self.steps = 0  # blocks executed
        self._block_mark = START  # of the block that is being executed
        # of the last T: level, block, open loops
        self.tool_place: tuple[int, Mark, list[Any]] | None = None
        self.waits: dict[
            int, float
        ] = {}  # when a WAIT_INPUT has begun, by its place
        self._written: set[str] = set()  # files of this program
        self.flow.level.user = LevelData(MAIN, self.store.scope)
        self._closing = False
        self._failed: CncError | None = None
        if caller is None:
            self._event("M_START")
        else:
            self.store.common, self.macros.events = caller.store.common, {}

    @property
    def answers(self) -> bool:
        return self._port.answers

    @property
    def waits_passed(self) -> int:
        return self._ticks

    @property
    def asks(self) -> bool:
        """An operator may change what the program sees."""
        return self.forms.shown or self.port.operator_waiting

    @property
    def compensated(self) -> bool:
        """Tool radius compensation holds rows back that it needs for what follows."""
        return self.executor.output.side != OFF

    @property
    def _data(self) -> LevelData:
        data: LevelData = self.flow.level.user
        return data

    # reading

    def _take_block(self) -> BlockText | None:
        return read_line(self._source, self.modal.line)

    def _plain(self) -> bool:
        return self.executor.plain

    def _prepare(self, block: BlockText) -> Prepared:
        check_length(block)
        self.block_now = block
        try:
            run, drain, live = self._compile(strip_remark(block.text))
        except CncError as error:
            raise located(error, block) from None
        return Prepared(block, run, drain, live=live)

    def _compile(self, text: str) -> tuple[Run, bool, int]:
        """What the block does, whether everything before has to be executed
        first, and what it reads live.
        """
        if not text.strip():
            return _nothing, False, 0
        if label_of(text) is not None:
            self.control.index()
            return _nothing, False, 0
        stream = TokenStream(text, PATTERN)
        formulas = Formulas(stream, self.store, self.system)
        parser = WordParser(stream, formulas, self.executor.axes)
        parser.n_number()
        command = look_ahead_command(
            stream, formulas, self.executor, parser.block.n
        )
        if command is not None:
            return command, formulas.drain, formulas.live
        instructions = Instructions(self, stream, formulas)
        run = instructions.parse()
        if run is not None:
            return (
                run,
                formulas.drain or instructions.drain,
                formulas.live | instructions.live,
            )
        try:
            block = parser.parse()
        except CncError as error:
            parts = (
                parts_of(text, codes.TAKERS, codes.MOTIONS)
                if error.code in SHARED_WORDS
                else [text]
            )
            if len(parts) < 2:
                raise
            return self._parts([self._compile(part) for part in parts])
        return (lambda: self._words(block)), formulas.drain, formulas.live

    def _parts(
        self, parts: list[tuple[Run, bool, int]]
    ) -> tuple[Run, bool, int]:
        """Functions one behind the other in a block, each with its own words."""

        def run() -> Items:
            return [item for part, _, _ in parts for item in part()]

        live = 0
        for _, _, reads in parts:
            live |= reads
        return run, any(drain for _, drain, _ in parts), live

    def _words(self, block: WordBlock) -> Items:
        for target, value in block.assignments:
            target(value())
        if block.empty:
            return ()
        if "T" in block.values:
            self.tool_place = (
                len(self.flow.levels),
                self._block_mark,
                copy.deepcopy(self.flow.level.nest),
            )
        items = self.executor.execute(block)
        rows = [item for item in items if not isinstance(item, Wait)]
        self._endless.rows += len(rows)
        self._endless.motions += sum(
            int(row["type"][0]) <= POLYNOMIAL for row in rows
        )
        failure, self.executor.failure = self.executor.failure, None
        if failure is not None:
            self._queue.extend(items)
            raise failure
        if self.executor.ended:
            items += self.held_rows()
            self._finish()
        elif self.executor.calls:
            kind, number, offset, arguments = self.executor.calls[0]
            items += self._before_macro()
            call_macro(self, kind, number, arguments, offset)
        return items

    def _before_macro(self) -> list[Row | Wait]:
        """M and HM wait until everything before has been executed; not while
        the tool is compensated.
        """
        if self.executor.output.side != 40:
            return []
        return [*self.held_rows(), Wait.DRAINED]

    def held_rows(self) -> list[Row | Wait]:
        """What the corners still hold."""
        return [*self.executor.output.flush()]

    def _visit(self, begin: Mark, end: Mark) -> None:
        """Check the blocks that a branch leaves out."""
        before, mark = self.block_now, self.mark
        source = self._source
        place, line = source.position, begin.line
        while source.position < end.position:
            self.mark = Mark(source.position, line)
            block = read_line(source, line)
            if block is None:
                break
            line += 1
            try:
                self._prepare(block)
            except CncError as error:
                self._error(error, block)
        source.seek(place)
        self.block_now, self.mark = before, mark

    def _run(self, prepared: Prepared) -> None:
        """As the base; what the corners hold comes before a wait, and what is
        read live is never read twice a cycle.
        """
        if prepared.live and not self._drained and self._not_yet(prepared):
            self.flow.source.seek(prepared.begin)
            return
        self.steps += 1
        self._block_mark = Mark(prepared.begin, self.modal.line)
        if prepared.drain and not self._drained:
            self._queue.extend(self.held_rows())
        super()._run(prepared)

    def _not_yet(self, prepared: Prepared) -> bool:
        """A block that reads the running machine waits: for standstill under
        G61, and for a cycle if it comes again.
        """
        key = (self.flow.file.number, prepared.begin)
        if (
            prepared.live & TIMED
            and not self._port.answers
            and key in self._read_at
        ):
            return False  # time passes with every look, a loop that waits for it ends
        standstill = prepared.live & BEHIND_MOTION and self.modal.exact_stop
        if (
            standstill
            and not prepared.drain
            and self.executor.output.side == OFF
        ):
            self._queue.extend([*self.held_rows(), Wait.DRAINED])
            self._drained = True
            self._read_at[key] = self._ticks
            return True
        # nothing changes: a loop that looks again and again does not end
        if not self._port.answers:
            self._idle += (
                0
                if prepared.live & TIMED
                else WAIT_BLOCKS * self.flow.level.repeats
            )
            return False
        if self._read_at.get(key) == self._ticks:
            self._queue.extend([*self.held_rows(), Wait.CYCLE])
            return True
        self._read_at[key] = self._ticks
        return False

    def _advance(self, out: Row) -> int:
        """As the base; scanned rows are bounded by feed and limits."""
        output = self.executor.output
        bounds, file, start = output.bounds, self.flow.file, self.modal.position
        rows = super()._advance(out)
        if not rows:
            return 0
        self._endless.rows += rows
        self._endless.motions += rows
        wrong = bounds.check(out[:rows], output.names, start, output.main)
        if wrong is None:
            return rows
        line = int(out[wrong[0]]["line"])
        error = CncError(903001, wrong[1])
        self._queue.clear()
        self._error(
            error, BlockText(str(file.path), lines=[PhysicalLine(0, line, "")])
        )
        if self._collect:
            return rows
        self.flow.close()
        return wrong[0]

    def _stop_here(self) -> bool:
        return self.search.stop_here()

    def _move(self) -> None:
        super()._move()
        self.store.scope = self._data.scope
        self.search.arrived()

    def _level_ended(self) -> None:
        """The end of a file."""
        if self._data.kind == SUBROUTINE:
            last = BlockText(
                str(self.flow.file.path),
                lines=[PhysicalLine(0, max(1, self.modal.line), "")],
            )
            self._error(fail(909123, "the subroutine has no RETURN", 0), last)
            self._finish()
        elif len(self.flow.levels) == 1:
            self.control.index() if self._collect else None
            self._finish()
        else:
            super()._level_ended()

    def end_program(self) -> None:
        """END_PROGRAM: of a macro or an imported file too it ends the program."""
        self._finish()

    # events and the end

    def _event(self, name: str) -> bool:
        """Call the macro of an event now; False if there is none."""
        number = self.macros.event(name)
        if number is None:
            return False
        path = self.macros.find("M", number)
        if path is None:
            text = f"{name}: macro M{number} not found beside the program or in the macro folder"
            self._error(
                CncError(909124, text),
                BlockText(
                    str(self.flow.file.path), lines=[PhysicalLine(0, 1, "")]
                ),
            )
            return False
        self.flow.call(
            Level(
                self.flow.file_of(path),
                START,
                MACRO,
                user=LevelData(MACRO, UserScope()),
            )
        )
        BlockReader._move(self)
        self.store.scope = self._data.scope
        return True

    def _finish(self) -> None:
        """The program has ended: rows held back, the END macro, then nothing more."""
        self._queue.extend(self.held_rows())
        self.forms.close()
        self.executor.completed = self._failed is None
        if self._closing:
            self._ended = True
            return
        self._closing = True
        self.flow.forget()
        del self.flow.levels[1:]
        self.flow.level = self.flow.levels[0]
        if self.macros.event("M_END") is None:
            self._ended = True
            return
        self._end_here()

    def _end_here(self) -> None:
        """Nothing of the main file follows behind the END macro."""
        file = self.flow.file
        file.source.seek(file.path.stat().st_size)
        if not self._event("M_END"):
            self._ended = True

    # pausing

    @property
    def restartable(self) -> Restartable:
        return self

    @property
    def pause_mode(self) -> int:
        """PAUSE_MODE."""
        return self.executor.pause_mode

    def pause_macro(self, event: str) -> Path | None:
        """Macro of M_PAUSE, M_GOPAUSE, M_GOBLOCK or M_GORETRACE, None if there
        is none.
        """
        number = self.macros.event(event)
        return None if number is None else self.macros.find("M", number)

    RETRACING, SEARCHING = RETRACE, GO_BLOCK

    @property
    def retrace_macro(self) -> Path | None:
        """The macro M_GORETRACE, None if there is none."""
        return self.pause_macro("M_GORETRACE")

    @property
    def pauses(self) -> bool:
        """Pausing is more than to stand still."""
        return self.pause_mode == 4 or any(
            self.pause_macro(event) for event in PAUSE_EVENTS
        )

    def macro_reader(
        self,
        path: Path,
        machine: ProgramMachine,
        place: npt.NDArray[np.float64],
        *,
        run_type: int = NORMAL,
    ) -> IsonsFrontEnd:
        """A macro that is executed beside the program: its own variables, the
        program's GLOBAL ones; ``place``: $_C.

        ``run_type``: $_X7 in the macro.
        """
        reader = IsonsFrontEnd(path, machine, self.port, caller=self)
        reader.executor.counter = self.executor.tip.programmed(place)
        reader.system.run_type = run_type
        return reader

    def return_speed(self) -> float:
        """VRIPOSO in mm/s, the programmed feed if it is not given."""
        speed = (
            self.parameters.speed("VRIPOSO")
            or self.modal.feed * self.parameters["FEEDRES"]
        )
        return speed / 60.0

    @property
    def has_stop(self) -> bool:
        """The cell or the program has a macro for a stop."""
        number = self.macros.event("M_STOP")
        return number is not None and self.macros.find("M", number) is not None

    def begin_stop(self, position: npt.NDArray[np.float64]) -> None:
        """STOP: the axes stand at ``position``; the macro M_STOP is executed,
        then the program ends.
        """
        self._queue.clear()
        self.executor.output.stopped(position)
        self.modal.set_position(self.executor.tip.programmed(position))
        self.modal.set_compensated(False)
        self._closing, self._ended, self._drained = True, False, False
        self.flow.forget()
        del self.flow.levels[1:]
        self.flow.level = self.flow.levels[0]
        file = self.flow.file
        file.source.seek(file.path.stat().st_size)
        self._event("M_STOP")

    def _error(self, error: CncError, block: BlockText) -> None:
        """Behind an error that ends the program the ERROR macro is executed;
        the error comes last.
        """
        super()._error(error, block)
        if self._collect or self._closing:
            return
        number = self.macros.event("M_ERROR")
        if number is None or self.macros.find("M", number) is None:
            return
        self._closing = True
        failed = self._queue.pop()
        assert isinstance(failed, CncError)
        self._failed = failed
        self._ended = False
        self.flow.forget()
        del self.flow.levels[1:]
        self.flow.level = self.flow.levels[0]
        file = self.flow.file
        file.source.seek(file.path.stat().st_size)
        self._event("M_ERROR")

    def read(self, rows: int) -> BlockBatch | Wait | None:
        if self.executor.stopping and self._port.answers and not self._queue:
            self.modal.set_position(
                self.executor.tip.programmed(self._port.position())
            )
        self.executor.stopping = self.executor.stopping and bool(self._queue)
        item = super().read(rows)
        if isinstance(item, Wait):
            self._ticks += 1
        if item is None and self._failed is not None:
            raise self._failed
        return item

    # files and messages

    def text_of(self, name: str) -> str | None:
        """A file that the program reads: written by itself, beside the program,
        in the folder of the run.
        """
        if name in self._written:
            return self._port.read_file(name)
        text = name.replace("\\", "/")
        path = (
            Path(text)
            if Path(text).is_absolute()
            else self.flow.files[0].parent / text
        )
        if path.is_file():
            return path.read_text(encoding="utf-8", errors="replace")
        return (
            None
            if Path(text).is_absolute() or ".." in Path(text).parts
            else self._port.read_file(text)
        )

    def write_file(self, name: str, text: str) -> None:
        self._written.add(name)
        self._port.write_file(name, text)

    def warn(self, code: int, text: str, offset: int) -> None:
        block = self.block_now
        if block is not None:
            self._warn(code, text, block.place(offset))


def _nothing() -> Items:
    return ()
