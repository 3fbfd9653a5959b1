"""ISG front end: plain lines through the C scanner, every other block through the parser, rows out in batches."""

from __future__ import annotations

from collections import deque
from pathlib import Path

import numpy as np

from cnc_core.blocks import NC_BLOCK, BlockBatch
from cnc_core.errors import CncError, Place
from cnc_core.frontend.base import scanner
from cnc_core.frontend.base.block_text import BlockText, check_length, read_block, strip_comments
from cnc_core.frontend.base.expression import NoVariables, VariableSource
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.isg.commands import CommandParser
from cnc_core.frontend.isg.execute import Executor
from cnc_core.frontend.isg.words import WordParser
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.port import ChannelPort, Wait

NAME_CHARACTERS = 83
Item = Row | Wait | CncError


class IsgFrontEnd:
    """Resumable reader of one program.

    ``collect``: an erroneous block is put into ``errors`` and skipped; otherwise ``read`` raises its error, after the
    rows of all blocks before it.  ``scan=False`` sends every line through the parser (tests).
    """

    def __init__(
        self, path: Path, machine: ProgramMachine, port: ChannelPort, *, collect: bool = False, scan: bool = True
    ) -> None:
        self.errors: list[CncError] = []
        self.warnings: list[CncError] = []
        self.files: list[Path] = [path]
        self.modal = Modal(machine)
        self.executor = Executor(machine, self.modal)
        self.program_name: str | None = None
        self._port = port
        self._collect = collect
        self._scan = scan
        self._source = Source(path)
        self._axes = {name.upper(): machine.axes.index(name) for name in sorted(machine.axes, key=len, reverse=True)}
        self._variables: VariableSource = NoVariables()
        self._queue: deque[Item] = deque()
        self._ended = False
        self._statements = 0

    @property
    def block_count(self) -> int:
        """Physical lines read so far."""
        return self.modal.count

    def read(self, rows: int) -> BlockBatch | Wait | None:
        """Up to ``rows`` rows, a reason to wait, or None at the program's end."""
        if rows < 1:
            raise ValueError("rows must be positive")
        out = np.empty(rows, NC_BLOCK)
        filled = self._fill(out)
        if filled:
            return BlockBatch(out[:filled])
        if not self._queue:
            return None
        if isinstance(self._queue[0], CncError):
            raise self._queue[0]
        wait = self._queue.popleft()
        assert isinstance(wait, Wait)
        return wait

    def close(self) -> None:
        self._source.close()

    def _fill(self, out: Row) -> int:
        """Rows into ``out`` until it is full, or a wait, an error or the end is next."""
        filled = 0
        while filled < len(out):
            if self._queue:
                item = self._queue[0]
                if not isinstance(item, np.ndarray):
                    break
                out[filled] = item[0]
                filled += 1
                self._queue.popleft()
            elif self._ended:
                break
            else:
                filled += self._advance(out[filled:])
        return filled

    def _advance(self, out: Row) -> int:
        """Plain lines into ``out``, then one block of another kind into the queue; rows written to ``out``."""
        stop, rows = scanner.OTHER, 0
        if self._scan:
            rows, stop = self.modal.scan(self._source, out)
        if stop in (scanner.OTHER, scanner.ERROR):
            self._block()
        elif stop == scanner.MORE:
            self._ended = self._source.exhausted
            if not self._ended:
                self._source.refill()
        if self._ended:
            self._source.close()
        return rows

    def _block(self) -> None:
        """One block through the parser: its rows, waits or error into the queue."""
        block = read_block(self._source, self.modal.line)
        if block is None:
            self._ended = True
            return
        self.modal.count_lines(1)
        try:
            self._queue.extend(self._execute(block))
        except CncError as error:
            self._error(error, block)
        self._ended = self._ended or self.executor.ended
        self.modal.count_lines(block.lines_read - 1)

    def _error(self, error: CncError, block: BlockText) -> None:
        error = located(error, block)
        self.errors.append(error)
        if error.code == 900006:
            self.modal.assume_feed()  # one error for one missing feed
        if not self._collect:
            self._queue.append(error)
            self._ended = True

    def _warn(self, code: int, text: str, place: Place) -> None:
        warning = CncError(code, text, place)
        self.warnings.append(warning)
        self._port.message(str(warning))

    def _execute(self, block: BlockText) -> list[Row | Wait]:
        check_length(block)
        stream = TokenStream(strip_comments(block.text))
        if stream.at_end:
            return []
        if stream.is_op("%"):
            self._program_line(stream, block)
            return []
        self._statements += 1
        parser = WordParser(stream, self._axes, self._variables)
        parser.n_number()
        if stream.accept("#"):
            return CommandParser(stream, self.modal, self._variables, parser.words.motion.n).execute()
        return [*self.executor.execute(parser.parse())]

    def _program_line(self, stream: TokenStream, block: BlockText) -> None:
        """``%NAME`` opens the main program; a later one ends it."""
        offset = stream.next().offset
        name = stream.text[offset + 1 :].strip()
        if self.program_name is not None:
            self._warn(900020, f"the main program ends at %{name}", block.place(offset))
            self._ended = True
            return
        if stream.is_name("L") and stream.following.kind is not Kind.END and _blank_behind(stream):
            raise fail(900003, f"local subprogram %{name} is not supported", offset)
        if self.modal.programmed or self._statements:
            raise fail(900017, f"%{name}: a command stands before the first program definition", offset)
        if len(name) > NAME_CHARACTERS:
            raise fail(900012, f"program name longer than {NAME_CHARACTERS} characters", offset)
        self.program_name = name


def _blank_behind(stream: TokenStream) -> bool:
    """A blank follows the current token."""
    return stream.text[stream.current.offset + len(stream.current.text) :][:1].isspace()


def located(error: CncError, block: BlockText) -> CncError:
    """The error with its place in the file; so far it may know only the offset in the block's text."""
    return error.at(block.place(error.place.column))
