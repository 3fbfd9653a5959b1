"""Front end: plain lines through the C scanner, every other line through the
parser, rows out in batches.
"""

from __future__ import annotations

import re
from pathlib import Path

from cnc_core.errors import CncError, Place
from cnc_core.frontend.base.block_text import BlockText, check_length, read_line
from cnc_core.frontend.base.lexer import Kind, TokenStream, digits, fail
from cnc_core.frontend.base.reader import BlockReader
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.iso.codes import RULES
from cnc_core.frontend.iso.execute import Executor
from cnc_core.frontend.iso.text import PATTERN, Line, squeeze
from cnc_core.frontend.iso.words import WordParser
from cnc_core.frontend.machine import ProgramMachine

from ..port import ChannelPort, Wait

SWITCHES = 10
_NUMBER = re.compile(
    rb"(?:[\s%]|\([^()\n]*\)|;[^\n]*)*?O\s*[0-9]+(?=\s*(?:[(;]|$))",
    re.I | re.M,
)
SHOWN = ("DEBUG", "PRINT")  # with the values of parameters in the text
REFUSED_COMMENTS = (
    "LOG",
    "LOGOPEN",
    "LOGAPPEND",
    "LOGCLOSE",
    "PROBEOPEN",
    "PROBECLOSE",
)


class IsoFrontEnd(BlockReader):
    """Resumable reader of one program.

    Lines that begin with ``/`` are skipped while their switch is on.
    """

    def __init__(
        self,
        path: Path,
        machine: ProgramMachine,
        port: ChannelPort,
        *,
        collect: bool = False,
        scan: bool = True,
    ) -> None:
        super().__init__(
            path, Modal(machine, RULES), port, collect=collect, scan=scan
        )
        self.executor = Executor(machine, self.modal, self._warn_here)
        self._switches = port.skip_levels()
        self._axes = {
            name.upper(): i
            for i, name in enumerate(machine.axes)
            if len(name) == 1
        }
        self._statements = 0
        self._number_line = self._line_of_number()
        self._place = Place()

    def _plain(self) -> bool:
        return self.executor.plain

    def _take_block(self) -> BlockText | None:
        return read_line(self._source, self.modal.line)

    def _execute(self, block: BlockText) -> list[Row | Wait]:
        check_length(block)
        self._place = block.place(0)
        line = squeeze(block.text)
        try:
            return self._line(line)
        except CncError as error:
            if (
                not error.place.line
            ):  # so far it knows the offset in the squeezed text
                error.place.column = line.columns[
                    min(error.place.column, len(line.columns) - 1)
                ]
            raise

    def _line(self, line: Line) -> list[Row | Wait]:
        stream = TokenStream(line.text, PATTERN)
        if stream.accept("%"):
            self._percent(stream)
            return []
        if stream.accept("/") and self._switched_on(stream):
            return []
        if self._place.line == self._number_line:
            self._program_number(stream)
        words = WordParser(
            stream, self._axes, self.executor.frame.parameters
        ).parse()
        for key, value in words.assignments:
            self.executor.frame.parameters.assign(key, value)
        self.executor.frame.update()
        self._messages(line)
        self._statements += bool(line.text)
        rows = self.executor.execute(words)
        self._ended = self._ended or self.executor.ended
        return [*rows]

    def _switched_on(self, stream: TokenStream) -> bool:
        """Whether the block delete switch, 1 if no number is given, is on
        (program_block_ignore, skip_levels).
        """
        switch = 1
        if stream.current.kind is Kind.NUMBER:
            token = stream.next()
            switch = int(token.text) if digits(token.text) else 0
            if not 1 <= switch <= SWITCHES:
                raise fail(
                    900012,
                    f"block delete switch out of range 1..{SWITCHES}",
                    token.offset,
                )
        return bool(self._switches >> (switch - 1) & 1)

    def _line_of_number(self) -> int:
        """Where the program number stands, if there is one ahead of all blocks."""
        head = self._source.buffer
        found = _NUMBER.match(head, self._source.offset)
        return head.count(b"\n", 0, found.end()) + 1 if found else 0

    def _program_number(self, stream: TokenStream) -> None:
        """``O1001``, as CAM systems write it; it has no effect."""
        stream.next()
        stream.next()
        if not stream.at_end:
            raise fail(
                900003,
                "text behind the program number is not supported",
                stream.current.offset,
            )

    def _percent(self, stream: TokenStream) -> None:
        """The first line may be ``%``; a later one ends the program."""
        if not stream.at_end:
            raise fail(
                900003, "text behind % is not supported", stream.current.offset
            )
        self._ended = bool(self._statements)
        self._statements += 1

    def _messages(self, line: Line) -> None:
        for text, _ in line.comments:
            kind, comma, message = text.partition(",")
            name = "".join(kind.split()).upper()
            if comma and name == "MSG":
                self._port.message(message.strip())
            elif comma and name in SHOWN:
                self._port.message(
                    self.executor.frame.parameters.substitute(
                        message.strip(), 0
                    )
                )
            elif name in REFUSED_COMMENTS and (comma or name.endswith("CLOSE")):
                raise fail(900003, f"comment ({name}) is not supported", 0)

    def _warn_here(self, text: str) -> None:
        self._warn(908006, text, self._place)
