"""ISG front end: plain lines through the C scanner, every other block compiled,
kept if it comes again, executed.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cnc_core.blocks import POLYNOMIAL, BlockBatch
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.files import Folders
from cnc_core.frontend.base.block_text import (
    BlockText,
    check_length,
    read_block,
    strip_comments,
)
from cnc_core.frontend.base.lexer import Kind, TokenStream, digits, fail
from cnc_core.frontend.base.reader import Prepared, located
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.base.variables import Scope
from cnc_core.frontend.isg.cycles.preview import (
    DryPort,
    calls_cycles,
    wrong_calls,
)
from cnc_core.frontend.isg.cycles.running import CycleRunner
from cnc_core.frontend.machine import ProgramMachine

from ..port import ChannelPort, Wait
from .commands.parser import Command, CommandParser
from .executor import Executor
from .flow.control import Control
from .flow.control_parser import parse, parse_old
from .flow.program_levels import Items, ProgramLevels, Run
from .flow.rt_cycle_parser import RtCycleParser, opens_rt_cycle, rt_cycle
from .flow.search import OPENERS, Frame, Searcher
from .language import macros
from .language.calls import Finder, LevelData
from .language.declarations import DeclarationParser
from .language.formulas import Formulas
from .language.text import PATTERN, Head, head_of
from .language.word_block import WordBlock, Words
from .language.words import WordParser
from .state.offsets import Offsets
from .state.state import ProgramState
from .state.store import Store
from .state.system import System

SKIP_LEVELS = 10
PATTERN_WORDS = ("PATTERN", "AT")


class IsgFrontEnd(ProgramLevels):
    """Resumable reader of one program.

    ``lenient``: unknown # commands and undefined M functions are warnings.
    ``static``: V.S variables that survive.
    """

    def __init__(
        self,
        path: Path,
        machine: ProgramMachine,
        port: ChannelPort,
        *,
        collect: bool = False,
        scan: bool = True,
        lenient: bool = False,
        static: Scope | None = None,
    ) -> None:
        modal = Modal(machine)
        super().__init__(path, modal, port, collect=collect, scan=scan)
        store = Store(port, machine.externals, lenient=lenient, static=static)
        self.state = ProgramState(
            machine,
            modal,
            port,
            self.flow,
            store,
            Offsets(machine, modal),
            self._warn_at,
            self._place_now,
            self._has_file,
            lenient,
        )
        self.system = System(self.state)
        self.executor = Executor(self.state)
        self._give_back = self.executor.give_back
        self._axes = self.state.axis_places.names
        self._searcher = Searcher(self.state, lambda: self._skip_mask)
        self.control = Control(self.state, self._searcher)
        self.control.line_behind = lambda: self.modal.line + self._lines_left
        self.flow.folders = Folders(path.parent, named=machine.programs)
        self._finder = Finder(self.state, path.parent, CycleRunner(self.state))
        self._skip_mask = port.skip_levels()
        self._declaring = self._declared_ahead = self._previewed = False
        self._rt_ahead = False
        self._executing = True
        if collect:
            self._searcher.visit = self._visit
        self._main.user = LevelData()

    # reading

    def _take_block(self) -> BlockText | None:
        return read_block(self._source, self.modal.line)

    def _plain(self) -> bool:
        if (
            self._declaring
            or self.state.patterns.opened
            or self.state.rt_cycles.opened
            or self.state.rt_cycles.pending
            or self.state.modal_cycle.call
        ):
            return False
        spaces = self.state.spaces
        return self.state.channel.plain and not (
            spaces.watches_plane or spaces.due
        )

    def _may_drain(self) -> bool:
        return not (
            self.state.channel.compensation.choice.active
            or self.state.loop.is_open
        )

    def _refuse_drain(self) -> Items:
        if self.state.loop.is_open:
            raise CncError(22073, ERRORS[22073])
        raise fail(20651, f"{ERRORS[20651]}: deselect it with G40", 0)

    def _prepare(self, block: BlockText) -> Prepared:
        check_length(block)
        self.block_now = block
        text = strip_comments(block.text)
        if '"' in text and self.state.macros and not _keeps_quotes(text):
            text, origin = macros.expand(text, self.state.macros)
            block = macros.ExpandedBlock(
                block.file, text, block.lines, block.lines_read, tuple(origin)
            )
            self.block_now = block
        try:
            run, drain = self._compile(text)
        except CncError as error:
            if self._executing:
                self._open_frame(text)
            raise located(error, block) from None
        return Prepared(block, run, drain)

    def _visit(self, block: BlockText, head: Head) -> None:
        """Check a block that is not executed."""
        before = self.block_now, self._declaring
        self._executing, self._declaring = False, self._declared_ahead
        self.state.visiting = True
        if head.sign == "#" and head.word in ("VAR", "ENDVAR"):
            self._declared_ahead = head.word == "VAR"
        if head.sign == "#" and rt_cycle(head.text):
            self._rt_ahead = opens_rt_cycle(head.text)
        try:
            self._prepare(block)
        except CncError as error:
            self._error(error, block)
        finally:
            self.block_now, self._declaring = before
            self._executing = True
            self.state.visiting = False

    def _open_frame(self, text: str) -> None:
        """A wrong statement that opens others still needs its end."""
        head = head_of(text)
        if (
            self._collect
            and head.sign == "$"
            and head.word in OPENERS
            and "GOTO" not in head.text.upper()
        ):
            self.flow.level.nest.append(Frame(head.word, self.mark, once=True))

    def _has_file(self, name: str) -> bool:
        return self._finder.has_file(name)

    def _place_now(self, offset: int) -> Place:
        """Where in the file an offset of the present block stands."""
        assert self.block_now is not None
        return self.block_now.place(offset)

    # compiling

    def _compile(self, text: str) -> tuple[Run, bool]:
        """The effect of a block, and whether it waits for all blocks before it."""
        if not text.strip():
            return _nothing, False
        stream = TokenStream(text, PATTERN)
        if stream.is_op("%"):
            return self._program_line(stream), False
        if self._skipped(stream):
            return _nothing, False
        state = self.state
        formulas = Formulas(
            stream, state.store, self.system, state.machine, state.lenient
        )
        made = None if self._declaring else macros.definition(text)
        if made:
            return self._macro(*made), False
        parser = WordParser(stream, self._axes, formulas, self.state)
        if parser.n_number():
            stream.accept(":")
        if self._declaring and _command(stream) != "ENDVAR":
            return self._declarations(stream, formulas), False
        self._label(stream)
        command = _command(stream)
        inside = self._rt_ahead if state.visiting else state.rt_cycles.opened
        if inside or (command == "RT" and rt_cycle(text)):
            run, drain = RtCycleParser(stream, self.system, state).block()
        else:
            run = self._statement(stream, formulas, parser)
            drain = formulas.drain or self._command_drains
        return self._counted(run, command), drain

    def _preview(self) -> None:
        """Refuse wrong cycle calls before any axis moves."""
        self._previewed = True
        state, path = self.state, self._main.file.path
        if not self._port.answers or not calls_cycles(path, self.flow.folders):
            return
        port = DryPort(state.machine.start, self._skip_mask)
        port.axes = self._port.axes.alone() if self._port.axes else None
        static = copy.deepcopy(state.store.static)
        dry = IsgFrontEnd(
            path,
            state.machine.copy(),
            port,
            collect=True,
            lenient=state.lenient,
            static=static,
        )
        dry._searcher.visit = None  # what is not executed does not count
        errors = wrong_calls(dry, port)
        if errors:
            first, *first.also = errors
            self._collect_all(errors)
            self._queue.append(first)
            self._ended = True
            self.flow.close()

    def read(self, rows: int) -> BlockBatch | Wait | None:
        if not self._previewed:
            self._preview()
        item = super().read(rows)
        error = (
            (
                self.state.loop.at_end()
                or self.state.patterns.at_end()
                or self.state.rt_cycles.at_end()
            )
            if item is None
            else None
        )
        if error is not None:
            self._collect_all([error])
            if not self._collect:
                raise error
        return item

    def _statement(
        self, stream: TokenStream, formulas: Formulas, parser: WordParser
    ) -> Run:
        self._command_drains = False
        block = parser.block
        if stream.is_op("$"):
            stream.next()
            control, steps = (
                parse(self.control, stream, formulas, self.mark),
                block.steps,
            )

            def run_control() -> Items:
                self._set_n(steps)
                control()
                return ()

            return run_control
        commands: list[tuple[bool, Command]] = []
        while not stream.at_end:
            if stream.is_op("$"):
                return self._goto_behind(
                    stream, formulas, block, bool(commands)
                )
            if not stream.is_op("#"):
                parser.word()
                continue
            stream.next()
            special = self._special(stream, formulas)
            if special is not None:
                return special
            command = CommandParser(
                stream, formulas, self.state, self._axes
            ).parse()
            commands.append((block.words or command.last, command))
        if not commands:
            return lambda: self._words(block)
        return self._with_commands(commands, parser)

    def _goto_behind(
        self,
        stream: TokenStream,
        formulas: Formulas,
        block: WordBlock,
        commands: bool,
    ) -> Run:
        """``$GOTO`` is the last action of a block of words."""
        offset = stream.next().offset
        if commands or not stream.is_name("GOTO"):
            raise fail(
                900010,
                f"${stream.current.text.upper()} stands alone in its block",
                offset,
            )
        jump = parse(self.control, stream, formulas, self.mark)

        def run() -> Items:
            items = self._words(block)
            if not (self.flow.asked or self._ended):
                jump()
            return items

        return run

    def _set_n(self, steps: list[Callable[[Words], None]]) -> None:
        """The N number of a block that has no other words."""
        if steps:
            words = Words()
            for step in steps:
                step(words)
            self.modal.n = words.motion.n
        else:
            self.modal.n = 0

    def _with_commands(
        self, commands: list[tuple[bool, Command]], parser: WordParser
    ) -> Run:
        """Commands in front of the words, the words, commands behind them."""
        block, offset = parser.block, 0
        self._command_drains = any(command.drain for _, command in commands)
        exempt = any(command.behind or command.last for _, command in commands)
        if (block.words or len(commands) > 1) and not exempt:
            self._warn_at(
                907043,
                "words beside a # command: they are executed too",
                offset,
            )

        number = (
            block.steps[:1]
            if block.words and "N" in block.offsets
            else []
            if block.words
            else block.steps
        )

        def run() -> Items:
            self._set_n(number)
            items: list[Row | Wait] = []
            try:
                for behind, command in commands:
                    if not behind:
                        items += command.run()
                if block.words:
                    items += self._words(block)
                for behind, command in commands:
                    if behind:
                        items += command.run()
            finally:
                for _, command in commands:
                    if command.behind:
                        command.behind()
            return items

        return run

    def _counted(self, run: Run, command: str) -> Run:
        """A comment is no block of the program."""
        if command == "COMMENT":
            return run
        data, patterns = self._data, self.state.patterns
        pattern = command in PATTERN_WORDS

        def counted() -> Items:
            data.statements += 1
            if patterns.opened is not None and not pattern:
                patterns.not_open(0, "a block")
            repeated = self.state.modal_cycle.call is not None
            self.state.rt_cycles.expire()
            items = run()
            self.state.loop.check(items, self._ended)
            items = self._with_end_of_block(items)
            if repeated:
                self._repeat_cycle(items)
            return items

        return counted

    def _with_end_of_block(self, items: Items) -> Items:
        """A real-time cycle that acts on this block alone ends behind it."""
        cycles = self.state.rt_cycles
        if (
            not cycles.pending
            or not self._may_drain()
            or not any(isinstance(item, np.ndarray) for item in items)
        ):
            return items
        cycles.block_over()
        return [*items, Wait.DRAINED]

    def _repeat_cycle(self, items: Items) -> None:
        """A modal cycle comes again behind the block."""
        if self._ended or self.flow.asked:
            return
        motion = any(
            isinstance(item, np.ndarray) and item["type"][0] <= POLYNOMIAL
            for item in items
        )
        call = self.state.modal_cycle.behind(self.flow.level, motion=motion)
        if call is not None:
            self._call(
                call, [item for item in items if isinstance(item, np.ndarray)]
            )

    def _words(self, block: WordBlock) -> Items:
        executor = self.executor
        rows = executor.execute(block)
        if self.state.loop.written:
            return [*self.state.loop.switched(), *rows]
        if block.simple:
            return rows
        if executor.program_end or executor.level_end:
            self._check_nesting(self.control.check_closing)
        if executor.program_end:
            self._program_end()
        elif executor.level_end:
            self._level_end()
        elif executor.calls:
            call = executor.calls[0]
            executor.calls = []
            self._call(call, rows)
        return rows

    # parts of blocks

    def _skipped(self, stream: TokenStream) -> bool:
        """``/`` or ``/1`` ..

        ``/10`` in front of the block, and that level is switched on.
        """
        if not stream.is_op("/"):
            return False
        offset, level = stream.next().offset, 1
        token = stream.current
        if token.kind is Kind.NUMBER:
            stream.next()
            level = int(token.text) if digits(token.text) else 0
        if not 1 <= level <= SKIP_LEVELS:
            raise fail(
                900012,
                f"block skip level out of range 1..{SKIP_LEVELS}",
                offset,
            )
        return bool(self._skip_mask >> (level - 1) & 1)

    def _label(self, stream: TokenStream) -> None:
        """``[NAME]``, with or without a colon behind it."""
        if not stream.is_op("["):
            return
        offset = stream.current.offset
        end = stream.text.find("]", offset)
        if end < 0:
            raise fail(900013, "bracket is not closed", offset)
        if not stream.text[offset + 1 : end].strip():
            raise fail(900004, "label without a name", offset)
        stream.skip_to(end + 1)
        stream.accept(":")

    def _macro(self, name: str, text: str) -> Run:
        def run() -> Items:
            self.state.patterns.not_open(0, "a macro")
            if self.state.macros.get(name) != text:
                self.state.macros[name] = text
                for file in self.flow.known_files:
                    file.blocks.clear()  # they may mean something else now
            return ()

        return run

    def _declarations(self, stream: TokenStream, formulas: Formulas) -> Run:
        lines = DeclarationParser(stream, formulas, self.state.store).parse()

        def run() -> Items:
            for line in lines:
                line()
            return ()

        return run

    def _special(self, stream: TokenStream, formulas: Formulas) -> Run | None:
        """Commands that change how the text is read."""
        word, offset = stream.current.text.upper(), stream.current.offset
        follow = stream.following.text.upper()
        if word in ("VAR", "ENDVAR"):
            return self._var(stream, word, offset)
        if word == "COMMENT":
            return self._comment(stream, follow, offset)
        if word in ("IF", "ELSE", "ENDIF"):
            return _of(parse_old(self.control, stream, formulas, self.mark))
        return None

    def _var(self, stream: TokenStream, word: str, offset: int) -> Run:
        stream.next()
        if not stream.at_end:
            raise fail(
                900010,
                f"unexpected {stream.current.text!r} behind #{word}",
                stream.current.offset,
            )

        def run() -> Items:
            if word == "ENDVAR" and not self._declaring:
                raise fail(907020, "#ENDVAR without #VAR", offset)
            self._declaring = word == "VAR"
            return ()

        return run

    def _comment(self, stream: TokenStream, follow: str, offset: int) -> Run:
        code = 20566 if follow == "BEGIN" else 20569
        if follow not in ("BEGIN", "END"):
            raise fail(900010, "#COMMENT: expected BEGIN or END", offset)
        stream.next()
        stream.next()
        if (
            not stream.at_end
            or stream.text[: offset - 1].replace("#", "").strip()
        ):
            raise fail(
                code, f"#COMMENT {follow} stands alone in its block", offset
            )
        if follow == "END":
            raise fail(20569, "#COMMENT END without #COMMENT BEGIN", offset)
        return _of(self.control.comment(offset))


def _command(stream: TokenStream) -> str:
    """The first word behind a ``#`` that stands next; else nothing."""
    return stream.following.text.upper() if stream.is_op("#") else ""


def _nothing() -> Items:
    return ()


def _of(run: Callable[[], None]) -> Run:
    def items() -> Items:
        run()
        return ()

    return items


def _keeps_quotes(text: str) -> bool:
    """Blocks whose quoted texts are no macros: definitions and messages."""
    head = head_of(text)
    texts = head.sign == "#" and head.word in (
        "MSG",
        "ERROR",
        "FILE",
        "FILENAME",
        "MC_MOVEPATH",
    )
    return texts or macros.definition(text) is not None
