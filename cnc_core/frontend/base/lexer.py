"""Tokens of one block.

DIN words need no blanks between them: ``G01X10Y-5``, ``XSIN[30]``. A run of
letters is one NAME token, and the parser may split it.
``TokenStream.take_letters(1)`` takes the address and leaves the other letters.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from cnc_core.errors import CncError, Place

Warn = Callable[[int, str, int], None]  # number, text, offset in the block


class Kind(Enum):
    NUMBER = "number"
    NAME = "name"
    VARIABLE = "variable"  # of the dialects whose pattern has this group
    STRING = "string"
    OP = "operator"
    END = "end"


@dataclass(frozen=True)
class Token:
    """``offset`` is 0-based in the block's text."""

    kind: Kind
    text: str
    offset: int


PATTERN = re.compile(
    r"""(?P<NUMBER>[0-9]+(?:\.[0-9]*)?|\.[0-9]+)
      | (?P<NAME>[A-Za-z_]+)
      | (?P<STRING>"(?:\\"|[^"])*")
      | (?P<OP>\*\*|&&|\|\||==|!=|>=|<=|\S)""",
    re.X,
)


def digits(text: str) -> bool:
    """Digits 0 to 9 alone: no sign of another alphabet."""
    return text.isascii() and text.isdigit()


NO_AXIS = " is no axis of the cell; [axes] of the cell file adds one"
"""End of the text about an axis that is missing."""


def fail(code: int, text: str, offset: int) -> CncError:
    """An error at an offset of the block's text.

    The front end turns the offset into a place of the file.
    """
    return CncError(code, text, Place(column=offset))


def tokenize(text: str, pattern: re.Pattern[str] = PATTERN) -> list[Token]:
    """All tokens of ``text``, ended by one END token; comments are blanked
    before.

    Groups of ``pattern`` are named as kinds.
    """
    found = [
        Token(Kind[m.lastgroup or "OP"], m.group(), m.start())
        for m in pattern.finditer(text)
    ]
    return [*found, Token(Kind.END, "", len(text.rstrip()))]


def shown(text: str) -> str:
    """A token's text as a message quotes it."""
    return repr(text) if text else "the end of the block"


class TokenStream:
    """A cursor over the tokens of one block."""

    def __init__(self, text: str, pattern: re.Pattern[str] = PATTERN) -> None:
        self.text = text
        self._tokens = tokenize(text, pattern)
        self._at = 0

    @property
    def current(self) -> Token:
        return self._tokens[self._at]

    @property
    def following(self) -> Token:
        """The token behind the current one."""
        return self._tokens[min(self._at + 1, len(self._tokens) - 1)]

    @property
    def at_end(self) -> bool:
        return self.current.kind is Kind.END

    def is_op(self, *texts: str) -> bool:
        return self.current.kind is Kind.OP and self.current.text in texts

    def is_name(self, *names: str) -> bool:
        """The current token is one of these words as a whole; ``names`` in capitals."""
        return (
            self.current.kind is Kind.NAME
            and self.current.text.upper() in names
        )

    def next(self) -> Token:
        token = self.current
        if token.kind is not Kind.END:
            self._at += 1
        return token

    @property
    def place(self) -> int:
        """Where the cursor stands, for ``go_to``."""
        return self._at

    def go_to(self, place: int) -> None:
        self._at = place

    def accept(self, *texts: str) -> Token | None:
        return self.next() if self.is_op(*texts) else None

    def accept_name(self, *names: str) -> Token | None:
        return self.next() if self.is_name(*names) else None

    def expect(self, text: str, code: int) -> Token:
        """The operator ``text``, or error ``code``."""
        if not self.is_op(text):
            raise fail(
                code,
                f"expected {text!r}, found {self.describe()}",
                self.current.offset,
            )
        return self.next()

    def take_letters(self, count: int) -> Token:
        """The first letters of the current NAME; what is left of it stays current."""
        token = self.current
        head = Token(Kind.NAME, token.text[:count].upper(), token.offset)
        if len(token.text) <= count:
            self._at += 1
        else:
            self._tokens[self._at] = Token(
                Kind.NAME, token.text[count:], token.offset + count
            )
        return head

    def skip_to(self, offset: int) -> None:
        """Go on with the first token at or behind ``offset``, which must not
        lie inside a token.
        """
        while not self.at_end and self.current.offset < offset:
            self._at += 1

    def describe(self) -> str:
        return shown("" if self.at_end else self.current.text)

    def no_value(self) -> CncError:
        """The error where a value has to stand and nothing like it does."""
        text = f"expected a number or an expression, found {self.describe()}"
        return fail(900004, text, self.current.offset)
