"""The text of one block to what it does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from cnc_core.errors import CncError
from cnc_core.frontend.base.lexer import TokenStream
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.port import Wait

from ..base import codes
from ..base.text import HEAD, PATTERN, label_of, parts_of
from ..base.words import WordBlock
from ..language.formulas import FUNCTION_NAMES, Formulas
from ..language.words import VALUES, WordParser
from ..operator.dialogs import WORDS
from .instructions import TABLE, Instructions
from .lookahead import look_ahead_command
from .program import Program
from .spelling import spelt

Items = Sequence[Row | Wait]
Run = Callable[[], Items]
BLOCKS_KEPT = 4096
# words with these are compiled anew: a warning belongs to each of them
COMPUTED = frozenset("$[")
# errors of words that several functions of the block would take
SHARED_WORDS = (900005, 900011, 908005)


@dataclass(frozen=True)
class Compiled:
    """A block, ready to run.

    ``drain``: everything before has to be executed first.  ``live``: what the
    block reads of the running machine.
    """

    run: Run
    drain: bool = False
    live: int = 0


class Compiler:
    """Compiles the blocks of one program.  ``words``: executes a block of words."""

    def __init__(
        self, program: Program, words: Callable[[WordBlock], Items]
    ) -> None:
        self._program, self._words = program, words
        self._kept: dict[str, Compiled] = {}

    def compile(self, text: str) -> Compiled:
        """A block without its remark."""
        kept = self._kept.get(text)
        if kept is not None:
            return kept
        if not text.strip():
            return Compiled(_nothing)
        if label_of(text) is not None:
            self._program.control.index()
            return Compiled(_nothing)
        stream = TokenStream(text, PATTERN)
        program = self._program
        formulas = Formulas(stream, program.store, program.system)
        parser = WordParser(stream, formulas, program.channel.axes)
        parser.n_number()
        try:
            made = self._instruction(stream, formulas, parser)
            if made is None:
                made = self._block(text, formulas, parser)
                self._keep(text, made)
            return made
        except CncError as error:
            head = HEAD.match(text)
            if head and head[1].upper() == "LOOP":
                program.control.loop_refused(program.mark.position)
            raise spelt(
                error, text, (*TABLE, *VALUES, *WORDS), FUNCTION_NAMES
            ) from None

    def _keep(self, text: str, made: Compiled) -> None:
        """The same words stand in many blocks: M and HM calls, modes."""
        if COMPUTED.isdisjoint(text):
            if len(self._kept) >= BLOCKS_KEPT:
                self._kept.clear()
            self._kept[text] = made

    def _instruction(
        self, stream: TokenStream, formulas: Formulas, parser: WordParser
    ) -> Compiled | None:
        """A block that begins with a word of its own, None for axis words."""
        channel, number = self._program.channel, parser.block.n
        command = look_ahead_command(stream, formulas, channel, number)
        if command is not None:
            return Compiled(command, formulas.drain, formulas.live)
        instructions = Instructions(self._program, stream, formulas)
        run = instructions.parse()
        if run is None:
            return None
        drain = formulas.drain or instructions.drain
        return Compiled(run, drain, formulas.live | instructions.live)

    def _block(
        self, text: str, formulas: Formulas, parser: WordParser
    ) -> Compiled:
        try:
            block = parser.parse()
        except CncError as error:
            parts = _parts(error, text)
            if len(parts) < 2:
                raise
            return _in_turn([self.compile(part) for part in parts])
        return Compiled(
            lambda: self._words(block), formulas.drain, formulas.live
        )


def _parts(error: CncError, text: str) -> list[str]:
    """The block by the functions that take its words."""
    if error.code not in SHARED_WORDS:
        return [text]
    return parts_of(text, codes.TAKERS, codes.MOTIONS)


def _in_turn(parts: list[Compiled]) -> Compiled:
    """Functions one behind the other in a block, each with its own words."""

    def run() -> Items:
        return [item for part in parts for item in part.run()]

    live = 0
    for part in parts:
        live |= part.live
    return Compiled(run, any(part.drain for part in parts), live)


def _nothing() -> Items:
    return ()
