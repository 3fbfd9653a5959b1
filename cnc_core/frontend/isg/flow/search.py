"""Searching the text of a program level without executing it: branches, ends,
labels.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from cnc_core.errors import CncError, Place
from cnc_core.frontend.base.block_text import BlockText, read_block
from cnc_core.frontend.base.flow import Mark
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.base.variables import Value

from ..language.text import (
    CONTROL,
    DOUBTFUL,
    Head,
    comment_depth,
    head_of,
)
from ..state.state import ProgramState

OPENERS = {
    "IF": "IF",
    "SWITCH": "SWITCH",
    "FOR": "FOR",
    "WHILE": "WHILE",
    "DO": "DO",
    "REPEAT": "REPEAT",
}
CLOSERS = {
    "ENDIF": "IF",
    "ENDSWITCH": "SWITCH",
    "ENDFOR": "FOR",
    "ENDWHILE": "WHILE",
    "ENDDO": "DO",
    "UNTIL": "REPEAT",
}
MIDDLES = {
    "ELSEIF": "IF",
    "IFELSE": "IF",
    "ELSE": "IF",
    "CASE": "SWITCH",
    "DEFAULT": "SWITCH",
}
OLD_OPENERS, OLD_CLOSERS, OLD_MIDDLES = (
    {"IF": "#IF"},
    {"ENDIF": "#IF"},
    {"ELSE": "#IF"},
)
LOOPS = ("FOR", "WHILE", "DO", "REPEAT")


@dataclass
class Frame:
    """An open control statement.  ``head``: place of its first line.

    ``taken``: a branch of it has been chosen.  ``last``: its $ELSE or $DEFAULT
    has been passed.
    """

    kind: str
    head: Mark
    taken: bool = True
    last: bool = False
    value: Value = 0.0
    default: Mark | None = None
    end: float = 0.0
    step: float = 1.0
    once: bool = False  # its statement was wrong: the loop ends at its end


@dataclass(frozen=True)
class Found:
    """A statement found by a search: where it begins and ends."""

    head: Head
    before: Mark
    after: Mark
    text: BlockText


class Searcher:
    """Looks through the text of the current program level without executing it."""

    def __init__(
        self, state: ProgramState, skip_mask: Callable[[], int]
    ) -> None:
        self._flow, self._skip_mask = state.flow, skip_mask
        # receives the skipped blocks (check)
        self.visit: Callable[[BlockText, Head], None] | None = None

    def skipped(self, begin: Mark) -> Iterator[Found]:
        """As ``statements``, of text that will not be executed now."""
        if self.visit is None:
            yield from self.statements(begin)
            return
        for found in self.statements(begin, DOUBTFUL):
            yield found
            self.visit(found.text, found.head)

    def check_closed(self, begin: Mark) -> None:
        """Go through text that is not executed.

        Raises an error if its statements do not nest, or stay open.
        """
        inner, opened = [""], [Place()]
        wrong: CncError | None = None
        for found in self.skipped(begin):
            closer = closer_of(found.head)
            try:
                if closer and len(inner) == 1:
                    place = found.text.place(
                        found.head.text.index(found.head.sign) + 1
                    )
                    code, opener = (
                        (20590, "#IF")
                        if closer == "#IF"
                        else (907020, f"${closer}")
                    )
                    raise CncError(
                        code,
                        f"{found.head.sign}{found.head.word} without {opener}",
                        place,
                    )
                follow(inner, found)
            except CncError as error:
                wrong = wrong or error
            if len(inner) > len(opened):
                opened.append(
                    found.text.place(found.head.text.index(found.head.sign) + 1)
                )
            del opened[len(inner) :]
        if wrong is None and len(inner) > 1:
            wrong = unclosed(inner[-1]).at(opened[-1])
        if wrong:
            raise wrong

    def statements(
        self, begin: Mark, pattern: re.Pattern[bytes] = CONTROL
    ) -> Iterator[Found]:
        """Blocks from ``begin`` on whose text ``pattern`` finds something in,
        to the end of the level.
        """
        source: Source = self._flow.source
        before = source.position
        try:
            source.seek(begin.position)
            line, comment = begin.line, 0
            while True:
                line += source.hop(pattern)
                here = Mark(source.position, line)
                block = read_block(source, line)
                if block is None:
                    return
                line += block.lines_read
                head = head_of(block.text)
                comment = comment_depth(head, comment)
                if comment or (head.skip >= 0 and self._skipped(head.skip)):
                    continue
                if (
                    head.sign == "%"
                    and here.position > self._flow.level.start.position
                ):
                    return
                after = Mark(source.position, line)
                yield Found(head, here, after, block)
                source.seek(after.position)
        finally:
            source.seek(before)

    def _skipped(self, level: int) -> bool:
        return bool(self._skip_mask() >> (level - 1) & 1) if level else False


def opener_of(head: Head) -> str | None:
    if head.sign == "#":
        return OLD_OPENERS.get(head.word)
    if head.sign != "$" or (
        head.word == "IF" and "$" in head.text[head.text.index("$") + 1 :]
    ):
        return None  # $IF .. $GOTO closes itself
    return OPENERS.get(head.word)


def closer_of(head: Head) -> str | None:
    if head.sign == "#":
        return OLD_CLOSERS.get(head.word)
    return CLOSERS.get(head.word) if head.sign == "$" else None


def middle_of(head: Head) -> str | None:
    if head.sign == "#":
        return OLD_MIDDLES.get(head.word)
    return MIDDLES.get(head.word) if head.sign == "$" else None


def unclosed(kind: str) -> CncError:
    """The error of a statement without its end; the caller adds the place."""
    return (
        fail(20590, "#IF without #ENDIF", 0)
        if kind == "#IF"
        else fail(907021, f"${kind} is not closed", 0)
    )


def follow(inner: list[str], found: Found) -> None:
    """Follow one statement in the list of open ones.

    An end that fits none of them is an error.
    """
    opener, closer = opener_of(found.head), closer_of(found.head)
    if opener:
        inner.append(opener)
    elif closer and inner[-1] == closer:
        inner.pop()
    elif closer and "#IF" not in (closer, inner[-1]):
        place = found.text.place(found.head.text.index(found.head.sign))
        raise CncError(
            907020,
            f"${found.head.word} does not end ${inner[-1]}, which is open",
            place,
        )


def label_pattern(target: str | int) -> re.Pattern[bytes]:
    if isinstance(target, int):
        return re.compile(
            rb"[$%#\\]|[nN][ \t]*=?[ \t]*0*"
            + str(target).encode()
            + rb"(?![0-9])"
        )
    return re.compile(
        rb"[$%#\\]|\[[ \t]*" + re.escape(target.encode()) + rb"[ \t]*\]", re.I
    )
