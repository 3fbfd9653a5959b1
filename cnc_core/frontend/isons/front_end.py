"""IsoNs front end: plain lines through the C scanner, every other block
compiled, kept if it comes again, executed.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cnc_core.blocks import POLYNOMIAL, BlockBatch
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.frontend.base.block_text import (
    BlockText,
    PhysicalLine,
    check_length,
    read_line,
)
from cnc_core.frontend.base.flow import START, Level, Mark
from cnc_core.frontend.base.lexer import fail
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
from cnc_core.units import FloatArray

from ..front_end import Restartable
from ..port import ChannelPort, Wait
from .base.machine import IsonsCell
from .base.parameters import Parameters
from .base.store import Store, UserScope
from .base.text import strip_remark
from .base.words import WordBlock
from .devices.canopen import Nodes
from .devices.clock import Clock
from .devices.positioners import Positioners
from .flow.compiler import Compiler
from .flow.control import Control
from .flow.endless import Endless
from .flow.files import RunFiles
from .flow.levels import MACRO, MAIN, SUBROUTINE, LevelData, call_macro
from .flow.retained import take_over
from .flow.searching import GO_BLOCK, NORMAL, RETRACE, Search
from .language.formulas import BEHIND_MOTION, TIMED
from .language.macros import Macros
from .motion.executor import Executor
from .motion.output import OFF
from .motion.state import ChannelState
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
SPEED_GENERIC = 9  # $_K9 shows S (WR_SPD)
PAUSE_EVENTS = ("M_PAUSE", "M_GOPAUSE")
NOWHERE = np.zeros(0)
Items = Sequence[Row | Wait]


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
        modal = Modal(machine, Rules(RULE_BITS, centre_ratio=0.0))
        super().__init__(path, modal, port, collect=collect, scan=scan)
        self.port = port
        self.clock = Clock(port)
        self.store = Store(self.warn)
        self.forms = Forms(port)
        self.macros = Macros(path, cell)
        self.flow.folders = self.macros.folders
        self.nodes = Nodes(cell.canopen)
        self._set_up_channel(machine, modal, cell)
        modal.apply(MotionWords(exact_stop=not self.parameters["USE_G60"]))
        self._take_over(caller)
        self._queue.extend(self.channel.mode_rows(0))
        self._endless = Endless(self)
        self.control = Control(
            self.flow,
            lambda: self.modal.line,
            self._error if collect else None,
            self.visit if collect else None,
            self._endless.jumped_back,
        )
        self._compiler = Compiler(self, self._words)
        self.idle_blocks_max = min(self.idle_blocks_max, IDLE_BLOCKS)
        self._ticks = 0  # waits so far: time has passed between them
        # when a block has read the running machine last
        self._read_at: dict[tuple[int, int], int] = {}
        self.search = Search(self)
        self.steps = 0
        self._block_mark = START  # of the block that is being executed
        self.tool_place: tuple[int, Mark, list[Any]] | None = None
        self.waits: dict[int, float] = {}
        self._files = RunFiles(port, self.macros.folders)
        self.flow.level.user = LevelData(MAIN, self.store.scope)
        self._closing = False
        self._failed: CncError | None = None
        if caller is None:
            self.call_event("M_START")
        else:
            self.store.common = caller.store.common
            self.macros.events = {}

    def _set_up_channel(
        self, machine: ProgramMachine, modal: Modal, cell: IsonsCell
    ) -> None:
        """Channel, system variables and executor, each with the one below."""
        parameters, clock = self.parameters, self.clock
        self.channel = ChannelState(machine, modal, cell, parameters, self.warn)
        positioners = Positioners(cell.positioners, parameters, clock)
        self.system = System(self.port, self.channel, clock, positioners)
        self.system.message_result = lambda: self.forms.result
        self.channel.positioner_offset = positioners.set_offset
        self.channel.speed_copied = self._copy_speed
        self.executor = Executor(
            self.channel, self.port, clock, self._has_macro
        )

    def _copy_speed(self, speed: float) -> None:
        self.system.shared.write("K", SPEED_GENERIC, speed, 0)

    def _has_macro(self, kind: str, number: int) -> bool:
        return self.macros.find(kind, number) is not None

    def _take_over(self, caller: IsonsFrontEnd | None) -> None:
        """Go on from the caller's state, or from that of the program before."""
        before: ChannelState | None = (
            caller.channel if caller else self.port.retained.get("isons")
        )
        if before is not None:
            take_over(self.channel, before)
        if caller is None:
            self.port.retained["isons"] = self.channel

    @property
    def answers(self) -> bool:
        return self._port.answers

    @property
    def waits_passed(self) -> int:
        return self._ticks

    @property
    def asks(self) -> bool:
        """An operator may change what the program sees."""
        return self.forms.shown or self.port.operator.waiting

    @property
    def collecting(self) -> bool:
        """The program is only checked: its errors are collected."""
        return self._collect

    @property
    def place_found(self) -> bool:
        """No place is searched for, or it has been reached."""
        return self.search.found

    @property
    def compensated(self) -> bool:
        """Tool radius compensation holds rows back that it needs for what follows."""
        return self.channel.output.side != OFF

    @property
    def _data(self) -> LevelData:
        data: LevelData = self.flow.level.user
        return data

    # reading

    def _take_block(self) -> BlockText | None:
        return read_line(self._source, self.modal.line)

    def _plain(self) -> bool:
        return self.channel.plain

    def _prepare(self, block: BlockText) -> Prepared:
        check_length(block)
        self.block_now = block
        try:
            made = self._compiler.compile(strip_remark(block.text))
        except CncError as error:
            raise located(error, block) from None
        return Prepared(block, made.run, made.drain, live=made.live)

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
        failure, self.channel.failure = self.channel.failure, None
        if failure is not None:
            self._queue.extend(items)
            raise failure
        if self.executor.ended:
            items += self.held_rows()
            self.end_program()
        elif self.executor.calls:
            kind, number, offset, arguments = self.executor.calls[0]
            items += self._before_macro()
            call_macro(self, kind, number, arguments, offset)
        return items

    def _before_macro(self) -> list[Row | Wait]:
        """M and HM wait until everything before has been executed; not while
        the tool is compensated.
        """
        if self.channel.output.side != 40:
            return []
        return [*self.held_rows(), Wait.DRAINED]

    def put_out(self, items: Items) -> None:
        """Rows and waits in front of the next block."""
        self._queue.extend(items)

    def scan_plain_lines(self, on: bool) -> None:
        """Whether the scanner reads plain lines, or the parser every line."""
        self._scan = on

    def held_rows(self) -> list[Row | Wait]:
        """What the corners still hold."""
        return [*self.channel.output.flush()]

    def visit(self, begin: Mark, end: Mark) -> None:
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
            and self.channel.output.side == OFF
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
        output = self.channel.output
        bounds = output.bounds
        file = self.flow.file
        start = self.modal.position if bounds.low is not None else NOWHERE
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
            self.end_program()
        elif len(self.flow.levels) == 1:
            self.control.index() if self._collect else None
            self.end_program()
        else:
            super()._level_ended()

    # events and the end

    def call_event(self, name: str) -> bool:
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

    def end_program(self) -> None:
        """Nothing follows but the rows held back and the macro M_END.

        The end of a macro or of an imported file ends the program too.
        """
        self._queue.extend(self.held_rows())
        self.forms.close()
        if self.channel.output.side != OFF and not self._closing:
            place = Place(str(self.flow.file.path), max(1, self.modal.line))
            text = f"{ERRORS[906008]}: G40 is missing"
            self._warn(906008, text, place)
        self.channel.completed = self._failed is None
        if self._closing:
            self._ended = True
            return
        self._closing = True
        self._leave_levels()
        if self.macros.event("M_END") is None:
            self._ended = True
            return
        self._end_here()

    def _end_here(self) -> None:
        """Nothing of the main file follows behind the END macro."""
        self._to_end_of_file()
        if not self.call_event("M_END"):
            self._ended = True

    def _leave_levels(self) -> None:
        """Back on the main program."""
        self.flow.forget()
        del self.flow.levels[1:]
        self.flow.level = self.flow.levels[0]

    def _to_end_of_file(self) -> None:
        file = self.flow.file
        file.source.seek(file.path.stat().st_size)

    def revive(self) -> None:
        """The program goes on although its end has begun."""
        self._closing, self._failed = False, None

    # pausing

    @property
    def restartable(self) -> Restartable:
        return self

    @property
    def pause_mode(self) -> int:
        """PAUSE_MODE."""
        return self.channel.pause_mode

    def pause_macro(self, event: str) -> Path | None:
        """File of an event's macro, None if there is none."""
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
        place: FloatArray,
        *,
        run_type: int = NORMAL,
    ) -> IsonsFrontEnd:
        """A macro that is executed beside the program: its own variables, the
        program's GLOBAL ones; ``place``: $_C.

        ``run_type``: $_X7 in the macro.
        """
        reader = IsonsFrontEnd(path, machine, self.port, caller=self)
        reader.channel.counter = self.channel.tip.programmed(place)
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

    def begin_stop(self, position: FloatArray) -> None:
        """STOP: the axes stand at ``position``; the macro M_STOP is executed,
        then the program ends.
        """
        self._queue.clear()
        self.channel.output.stopped(position)
        self.modal.set_position(self.channel.tip.programmed(position))
        self.modal.set_compensated(False)
        self._closing, self._ended, self._drained = True, False, False
        self._leave_levels()
        self._to_end_of_file()
        self.call_event("M_STOP")

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
        self._leave_levels()
        self._to_end_of_file()
        self.call_event("M_ERROR")

    def read(self, rows: int) -> BlockBatch | Wait | None:
        if self.channel.stopping and self._port.answers and not self._queue:
            self.modal.set_position(
                self.channel.tip.programmed(self._port.position())
            )
        self.channel.stopping = self.channel.stopping and bool(self._queue)
        item = super().read(rows)
        if isinstance(item, Wait):
            self._ticks += 1
        if item is None and self._failed is not None:
            raise self._failed
        return item

    # files and messages

    def text_of(self, name: str, offset: int) -> str | None:
        """Text of a file that the program reads, None if there is none."""
        return self._files.text_of(name, offset)

    def write_file(self, name: str, text: str) -> None:
        self._files.write(name, text)

    def warn(self, code: int, text: str, offset: int) -> None:
        block = self.block_now
        if block is not None:
            self._warn(code, text, block.place(offset))
