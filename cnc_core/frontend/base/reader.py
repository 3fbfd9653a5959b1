"""The resumable reader under the front ends: plain lines through the C scanner,
other blocks through the dialect.

Program levels, jumps and repeated blocks: ``cnc_core.frontend.base.flow``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cnc_core.blocks import COMPENSATION, NC_BLOCK, NO_ROWS, BlockBatch
from cnc_core.blocks.pool import rows_of
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.frontend.base import scanner
from cnc_core.frontend.base.block_text import BlockText
from cnc_core.frontend.base.flow import START, Flow, Mark, ProgramFile
from cnc_core.frontend.base.lexer import NO_AXIS
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.base.source import Source

from ..front_end import Restartable
from ..port import ChannelPort, Wait

Item = Row | Wait | CncError
LEVELS_MAX = 21  # the main program and 20 subprograms in each other
# blocks without a row before ``read`` returns, empty-handed
BREATH_BLOCKS = 1000
WAIT_BLOCKS = 1000  # what a wait counts for where nobody answers
WARNINGS_MAX = 1000  # of one number
# blocks without a row (and, where somebody answers, without a wait): error
# 907001. Where nobody answers nothing can change behind them
IDLE_BLOCKS_MAX, IDLE_ALONE_MAX = 5_000_000, 500_000
# of the room for rows: what is handed out with it; less is copied
SHARE_HANDED_OUT = 8
ERRORS_MAX = 1000  # that a check collects
ALIKE_MAX = 10  # of one number and line, with texts of their own
# what a check follows where blocks come again: without a row; all of them
IDLE_CHECKED, REPEATS_CHECKED = 50_000, 40_000
# what a block counts for that is no plain motion, and each of its settings: all
# stages begin anew behind one
COMPUTED_WORK, SETTING_WORK = 4, 40
VALUES_A_BLOCK = 150  # of a file that cost as much as one
# all of them, in a program that will not run: behind an error
REPEATS_BEHIND_ERROR = 8_000

# of an error: code, file, line, column, text
Key = tuple[int, str, int, int, str] | tuple[int, str, int]


@dataclass
class Prepared:
    """A block, ready to be executed any number of times.

    ``begin``, ``end``: its places in the file.
    ``live``: values of the running machine that it reads, in the dialect's
    terms.
    ``drain``: everything before it has to be executed first, each time.
    """

    text: BlockText
    run: Callable[[], Sequence[Row | Wait]]
    drain: bool = False
    end: int = 0
    begin: int = 0
    live: int = 0


class BlockReader(ABC):
    """Reads one program; a dialect takes blocks from the text and executes
    them.

    A dialect whose blocks come only once implements ``_execute``. A dialect
    with loops and subprograms overrides ``_prepare`` and asks ``flow`` for
    jumps and calls. Its ``_level_ended`` says what the end of a text means.

    ``collect``: an erroneous block is put into ``errors`` and skipped.
    Otherwise ``read`` raises its error, behind the rows of all blocks before
    it.
    ``scan=False``: every line goes through the parser (tests).
    """

    levels_max, too_deep = LEVELS_MAX, 907002

    def __init__(
        self,
        path: Path,
        modal: Modal,
        port: ChannelPort,
        *,
        collect: bool,
        scan: bool,
    ) -> None:
        self.errors: list[CncError] = []
        self._of_line: Counter[Hashable] = Counter()
        self.warnings: list[CncError] = []
        self.setups: list[dict[str, object]] = []
        self.flow = Flow(path, self.levels_max, self.too_deep)
        self.files = self.flow.files
        self.modal = modal
        self.idle_blocks_max = (
            IDLE_BLOCKS_MAX if port.answers else IDLE_ALONE_MAX
        )
        self._port = port
        self._collect = collect
        self._scan = scan
        self._queue: deque[Item] = deque()
        self._room = NO_ROWS  # for the rows of ``read``
        self._ended = False
        self._drained = (
            False  # the wait in front of the next block has come true
        )
        # blocks, waits included, since the last row; without waits; in all
        self._idle = self._computed = self._repeated = 0
        self._breath = 0
        self._moved_again = 0
        self._moved_again_max = (
            0 if port.answers or collect else modal.machine.repeated_blocks_max
        )
        self.block_now: BlockText | None = None  # being prepared or executed
        # of the block that is being executed, behind its first one
        self._lines_left = 0
        self.mark = START  # where the block begins that is being prepared
        self._shown: dict[int, int] = {}
        self._seen: set[Key] = set()
        self.flow.source  # noqa: B018  the file is opened here, so that its absence shows at once

    def _prepare(self, block: BlockText) -> Prepared:
        """The effect of a block, not executed yet."""
        return Prepared(block, lambda: self._execute(block))

    @abstractmethod
    def _take_block(self) -> BlockText | None:
        """The next block's text; None at the end of the file."""

    def _execute(self, block: BlockText) -> Sequence[Row | Wait]:
        """Rows and waits of one block; sets ``_ended`` behind the program's end."""
        raise NotImplementedError

    def _plain(self) -> bool:
        """The scanner understands plain lines as the dialect does."""
        return True

    def _stop_here(self) -> bool:
        """``read`` is to return in front of the next block."""
        return False

    def _may_drain(self) -> bool:
        """The program may wait here until everything before is executed."""
        return True

    def _refuse_drain(self) -> Sequence[Row | Wait]:
        """It may not: the error that says why."""
        raise NotImplementedError

    def _level_ended(self) -> None:
        """The file of the current level has ended: back to the caller, or the
        program's end.
        """
        if len(self.flow.levels) == 1:
            self._ended = True
            return
        self.flow.leave()
        self._move()

    @property
    def block_count(self) -> int:
        """Physical lines read so far."""
        return self.modal.count

    @property
    def _source(self) -> Source:
        return self.flow.level.file.source

    @_source.setter
    def _source(self, source: Source) -> None:
        self.flow.file.source = source

    def read(self, rows: int) -> BlockBatch | Wait | None:
        """Up to ``rows`` rows, a reason to wait, or None at the program's end.

        No row at all: nothing yet, ask again.  So a program that computes for a
        long time can be interrupted.
        """
        if rows < 1:
            raise ValueError("rows must be positive")
        out = (
            self._room if len(self._room) == rows else np.empty(rows, NC_BLOCK)
        )
        self._breath = 0
        filled = self._fill(out)
        if filled > rows // SHARE_HANDED_OUT:
            self._room = NO_ROWS
            return BlockBatch(out[:filled])
        self._room = out
        if filled:
            return BlockBatch(rows_of(out[:filled].tobytes()))
        if not self._queue:
            return None if self._ended else BlockBatch.empty()
        if isinstance(self._queue[0], CncError):
            raise self._queue[0]
        wait = self._queue.popleft()
        assert isinstance(wait, Wait)
        self._idle = (
            0
            if self._port.answers
            else self._idle + WAIT_BLOCKS * self.flow.level.repeats
        )
        return wait

    @property
    def bytes_read(self) -> int:
        """Bytes of the main program's file in front of the next block."""
        if self._ended:  # the file is closed
            return self.flow.files[0].stat().st_size
        return self.flow.levels[0].file.source.position

    @property
    def place_now(self) -> Place:
        """The block that is being executed, or the next line."""
        block = self.block_now
        return block.place(0) if block and block.lines else self._here()

    @property
    def restartable(self) -> Restartable | None:
        """A dialect with macros for pauses and restarts returns itself."""
        return None

    def close(self) -> None:
        self.flow.close()

    def _fill(self, out: Row) -> int:
        """Rows into ``out`` until it is full, or a wait, an error or the end is
        next.
        """
        filled = 0
        while filled < len(out):
            if self._queue:
                item = self._queue[0]
                if not isinstance(item, np.ndarray):
                    break
                out[filled] = item[0]
                filled += 1
                self._idle = self._computed = 0
                self._queue.popleft()
            elif (
                self._ended
                or self._breath >= BREATH_BLOCKS
                or self._stop_here()
            ):
                break
            else:
                filled += self._advance(out[filled:])
        return filled

    def _advance(self, out: Row) -> int:
        """Plain lines into ``out``, then one block of another kind into the
        queue.

        Returns the number of rows in ``out``.
        """
        file = self.flow.level.file
        if self._run_again(file):
            return 0
        stop, rows, begin = scanner.OTHER, 0, file.source.position
        if self._scan and self._plain():
            rows, stop = self.modal.scan(file.source, out)
        if rows:
            self._idle = self._computed = 0
            self._count_repeated(rows, begin, file.source.position)
            self._count_moved_again(rows)
        if stop in (scanner.OTHER, scanner.ERROR):
            if not self._run_again(file):
                self._block(file)
        elif stop == scanner.MORE and file.source.exhausted:
            self._level_ended()
        elif stop == scanner.MORE:
            file.source.refill()
        if self._ended:
            self.flow.close()
        return rows

    def _run_again(self, file: ProgramFile) -> bool:
        """Execute the next block as it was prepared before, if it was."""
        if not file.blocks:
            return False
        prepared = file.blocks.get(file.source.position)
        if prepared is None:
            return False
        self._run(prepared)
        if self._ended:
            self.flow.close()
        return True

    def _block(self, file: ProgramFile) -> None:
        """One block through the parser: its rows, waits or error into the queue."""
        position = file.source.position
        self.mark = Mark(position, self.modal.line)
        block = self._take_block()
        if block is None:
            self._level_ended()
            return
        try:
            prepared = self._prepare(block)
        except CncError as error:
            self.modal.count_lines(block.lines_read)
            self._error(error, block)
            self._count_repeated(1, position, file.source.position)
            return
        prepared.begin, prepared.end = position, file.source.position
        if self.flow.level.repeats:
            file.keep_block(position, prepared)
        if prepared.drain and not self._drained and self._may_drain():
            file.source.seek(position)
        self._run(prepared)

    def _run(self, prepared: Prepared) -> None:
        """Execute a block, or wait first."""
        if prepared.drain and not self._drained and self._may_drain():
            self._queue.append(Wait.DRAINED)
            self._drained = True
            return
        refused, self._drained = prepared.drain and not self._drained, False
        self._breathe()
        self._count_repeated(COMPUTED_WORK, prepared.begin, prepared.end)
        block, modal = prepared.text, self.modal
        self.flow.source.seek(prepared.end)
        modal.count_lines(1)
        self._lines_left = block.lines_read - 1
        self.block_now = block
        try:
            items = self._refuse_drain() if refused else prepared.run()
            if items:
                self._queue.extend(items)
                self._count_moved_again(1)
                self._count_settings(items)
        except CncError as error:
            self.flow.forget()
            self._error(error, block)
        if self._lines_left:
            modal.count_lines(self._lines_left)
        if self.flow.asked:
            self._move()

    def _move(self) -> None:
        """Go where the block has asked to go."""
        mark, read = self.flow.apply(
            Mark(self._source.position, self.modal.line)
        )
        self.modal.go_to(self.flow.file.number, mark.line, read)

    def _breathe(self) -> None:
        """Count the blocks since the last row, where blocks may come again: any
        other program ends by itself.
        """
        self._breath += 1
        repeats = self.flow.level.repeats
        self._idle += repeats
        self._computed += repeats
        checked = self._collect and self._computed > IDLE_CHECKED
        if checked or self._idle > self.idle_blocks_max:
            most = IDLE_CHECKED if checked else self.idle_blocks_max
            error = CncError(
                907001,
                f"{ERRORS[907001]}: {most} blocks without a motion",
                self._here(),
            )
            self._keep(_key_of(error), error)
            if not self._collect:
                self._queue.append(error)
            self._ended = True

    def _count_repeated(self, blocks: int, begin: int, end: int) -> None:
        """Blocks from ``begin`` to ``end`` of the file are executed."""
        level = self.flow.level
        level.reach(begin, end)
        if level.again and self._collect and not self._ended:
            self._repeated += blocks
            self._end_check()

    def count_values(self, count: int) -> None:
        """A block reads or writes so many values: it costs as much as some."""
        if self._collect and self.flow.level.again:
            self._repeated += count // VALUES_A_BLOCK

    def _count_settings(self, items: Sequence[Row | Wait]) -> None:
        """They cost a check much more than a motion does."""
        if self._collect and self.flow.level.again:
            self._repeated += SETTING_WORK * sum(map(_is_setting, items))

    def _count_moved_again(self, blocks: int) -> None:
        """Blocks with rows: no machine follows those that come again for ever."""
        if not self.flow.level.again or not self._moved_again_max:
            return
        self._moved_again += blocks
        if self._moved_again > self._moved_again_max:
            text = (
                f"{ERRORS[907001]}: {self._moved_again_max} blocks moved again"
                " ([channel] repeated_blocks_max of the cell file)"
            )
            error = CncError(907001, text, self._here())
            self._keep(_key_of(error), error)
            self._queue.append(error)
            self._ended = True

    def _end_check(self) -> None:
        """A check ends where blocks have come again too often."""
        if self.errors:
            ends = self._repeated > REPEATS_BEHIND_ERROR
        else:
            ends = (
                self._repeated > REPEATS_CHECKED
                and COMPUTED_WORK * self._computed < REPEATS_CHECKED
            )  # what only computes is an error, later
        if ends:
            most = REPEATS_BEHIND_ERROR if self.errors else REPEATS_CHECKED
            behind = " behind an error" if self.errors else ""
            text = f"a check follows {most} repeated blocks{behind}"
            self._warn(909173, f"{ERRORS[909173]}: {text}", self._here())
            self._ended = True

    def _here(self) -> Place:
        return Place(str(self.flow.file.path), self.modal.line + 1, 1)

    def _error(self, error: CncError, block: BlockText) -> None:
        """Report an error of a block; a repeated block reports it once."""
        error = located(error, block)
        self._keep(_key_of(error), error)
        if error.code == 900006:
            self.modal.assume_feed()  # one error for one missing feed
        for other in error.also:
            self._further(other, block)
        if not self._collect:
            self._queue.append(error)
            self._ended = True

    def _further(self, error: CncError, block: BlockText) -> None:
        """A further error of a block whose first one stops the program."""
        found = located(error, block)
        self._keep(_key_of(found), found)

    def collect_once(self, error: CncError) -> None:
        """An error of a stage: of a line that comes again, only the first of a
        kind.
        """
        place = error.place
        self._keep((error.code, place.file, place.line), error)
        if self._ended:
            self.flow.close()

    def _collect_all(self, errors: Sequence[CncError]) -> None:
        """Errors that have their place already."""
        for error in errors:
            self._keep(_key_of(error), error)

    def _keep(self, key: Key, error: CncError) -> None:
        """Collect an error that is new; a check ends behind ERRORS_MAX."""
        if key in self._seen or len(self.errors) > ERRORS_MAX:
            return
        self._of_line[key[:3]] += 1
        if self._of_line[key[:3]] > ALIKE_MAX:
            return  # a line that comes again with other values
        if len(self.errors) == ERRORS_MAX:
            text = f"{ERRORS[900022]} {ERRORS_MAX} errors"
            error = CncError(900022, text, error.place)
            self._ended = True
        else:
            self._seen.add(key)
        # its traceback holds the frames of the block, some kilobytes an error
        self.errors.append(error.with_traceback(None))

    def _warn(self, code: int, text: str, place: Place) -> None:
        """A warning; a repeated block reports it once."""
        key = (code, place.file, place.line, place.column, text)
        shown = self._shown.get(code, 0)
        if shown > WARNINGS_MAX or key in self._seen:
            return
        self._shown[code] = shown + 1
        if shown == WARNINGS_MAX:
            text = f"{text} (further warnings of this number are not shown)"
        self._seen.add(key)
        warning = CncError(code, text, place)
        self.warnings.append(warning)
        self._port.message(str(warning))


def _is_setting(item: Row | Wait) -> bool:
    return isinstance(item, np.ndarray) and item["type"][0] >= COMPENSATION


def _key_of(error: CncError) -> Key:
    place = error.place
    if error.text.endswith(NO_AXIS):  # once, however often it is written
        return (error.code, error.text, 0)
    return (error.code, place.file, place.line, place.column, error.text)


def located(error: CncError, block: BlockText) -> CncError:
    """The error with its place in the file.

    Before, it may know only the offset in the block's text.
    """
    return error.at(block.place(error.place.column))
