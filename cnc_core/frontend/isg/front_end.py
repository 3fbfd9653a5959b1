"""ISG front end: plain lines through the C scanner, every other block through the parser, rows out in batches."""

from __future__ import annotations

from pathlib import Path

from cnc_core.blocks import BlockBatch
from cnc_core.frontend.base.block_text import BlockText, check_length, read_block, strip_comments
from cnc_core.frontend.base.expression import NoVariables, VariableSource
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.reader import BlockReader
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.isg.commands import CommandParser
from cnc_core.frontend.isg.execute import Executor
from cnc_core.frontend.isg.rt_loop import RealTimeLoop
from cnc_core.frontend.isg.words import WordParser
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.port import ChannelPort, Wait

NAME_CHARACTERS = 83


class IsgFrontEnd(BlockReader):
    """Resumable reader of one program."""

    def __init__(
        self, path: Path, machine: ProgramMachine, port: ChannelPort, *, collect: bool = False, scan: bool = True
    ) -> None:
        super().__init__(path, Modal(machine), port, collect=collect, scan=scan)
        self.executor = Executor(machine, self.modal)
        self.program_name: str | None = None
        self._axes = {name.upper(): machine.axes.index(name) for name in sorted(machine.axes, key=len, reverse=True)}
        self._variables: VariableSource = NoVariables()
        self._statements = 0
        self._loop = RealTimeLoop(self.modal)

    def _take_block(self) -> BlockText | None:
        return read_block(self._source, self.modal.line)

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
            items = self._command(stream, block, parser.words.motion.n)
        else:
            items = [*self.executor.execute(parser.parse())]
            self._ended = self._ended or self.executor.ended
        self._loop.check(items, self.executor.ended)
        return items

    def _command(self, stream: TokenStream, block: BlockText, n: int) -> list[Row | Wait]:
        if stream.is_name("RT"):
            return self._loop.command(stream, n, block.place(stream.current.offset))
        return CommandParser(stream, self.modal, self._variables, n).execute()

    def read(self, rows: int) -> BlockBatch | Wait | None:
        item = super().read(rows)
        error = self._loop.at_end() if item is None else None
        if error is not None:
            self.errors.append(error)
            if not self._collect:
                raise error
        return item

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
