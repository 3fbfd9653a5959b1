"""The text of one block: its physical lines joined, comments blanked, every
column traceable to its line.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from cnc_core.errors import CncError, Place
from cnc_core.frontend.base.source import Source

BLOCK_CHARACTERS = 4096
OWN_N_NUMBER = re.compile(r"\s*[nN]\s*[0-9]+")


@dataclass
class PhysicalLine:
    """One line of the file; ``start`` is the offset of its first character in
    the block's text.
    """

    start: int
    number: int
    text: str


@dataclass
class BlockText:
    """The text of one block, all physical lines in one.

    Offsets into ``text`` are 0-based, columns in errors 1-based.
    ``lines_read`` counts physical lines. A block that is too long drops the
    text of its later lines, but counts them.
    """

    file: str
    text: str = ""
    lines: list[PhysicalLine] = field(default_factory=list)
    lines_read: int = 0

    def place(self, offset: int) -> Place:
        """Where in the file the character at ``offset`` of the text stands."""
        line = next(
            (p for p in reversed(self.lines) if p.start <= offset),
            self.lines[0],
        )
        return Place(self.file, line.number, offset - line.start + 1, line.text)


def read_block(source: Source, lines_read: int) -> BlockText | None:
    r"""Read physical lines up to one that does not end with ``\``.

    None: the end of the file.  ``lines_read``: physical lines read before.
    The length is checked by ``check_length``. A block that is too long is read
    to its end, and its later lines are dropped.
    """
    block = BlockText(str(source.path))
    while (line := source.line()) is not None:
        block.lines_read += 1
        text, continued = _continued(line)
        if len(block.text) <= BLOCK_CHARACTERS:
            block.lines.append(
                PhysicalLine(
                    len(block.text), lines_read + block.lines_read, line
                )
            )
            block.text += _part(text, continued, first=block.lines_read == 1)
        if not continued:
            break
    return block if block.lines else None


def read_line(source: Source, lines_read: int) -> BlockText | None:
    r"""One physical line as a block, for dialects in which ``\`` joins nothing.

    None: the end of the file.
    """
    text = source.line()
    if text is None:
        return None
    return BlockText(
        str(source.path), text, [PhysicalLine(0, lines_read + 1, text)], 1
    )


def _continued(text: str) -> tuple[str, bool]:
    r"""The line, and whether ``\`` ends it; a comment behind the ``\`` is blanked."""
    if text.endswith("\\") or "\\" not in text:
        return text, text.endswith("\\")
    clean = strip_comments(text).rstrip()
    return (clean, True) if clean.endswith("\\") else (text, False)


def _part(text: str, continued: bool, first: bool) -> str:
    r"""A line's share of the block: ``\`` becomes a blank, as does the N number
    of a continuation line.
    """
    if continued:
        text = text[:-1] + " "
    own = None if first else OWN_N_NUMBER.match(text)
    return " " * own.end() + text[own.end() :] if own else text


def check_length(block: BlockText) -> None:
    """Error 20301 if the block has more characters than a block may have."""
    if len(block.text) > BLOCK_CHARACTERS:
        place = block.place(BLOCK_CHARACTERS)
        place.source = place.source[:80]
        raise CncError(
            20301, f"block longer than {BLOCK_CHARACTERS} characters", place
        )


def strip_comments(text: str) -> str:
    """The text with comments replaced by blanks: ``( )`` nest, an open ``(``
    and ``;`` reach to the end.
    """
    out: list[str] = []
    depth = 0
    quoted = False
    for i, char in enumerate(text):
        if not depth and char == '"' and text[i - 1 : i] != "\\":
            quoted = not quoted and '"' in text[i + 1 :]
        if not depth and not quoted and char == ";":
            break
        depth += not quoted and char == "("
        out.append(" " if depth else char)
        depth -= depth > 0 and char == ")"
    return "".join(out)
