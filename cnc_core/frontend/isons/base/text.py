"""Text of one block: tokens, remarks, labels, control words."""

from __future__ import annotations

import itertools
import re

from cnc_core.frontend.base.lexer import Kind, TokenStream, fail

AXIS_LETTERS = "XYZABCUVW"  # the order of all axis indices
PATTERN = re.compile(
    r"""(?P<NUMBER>[0-9]+(?:\.[0-9]*)?|\.[0-9]+)
      | (?P<VARIABLE>\$(?:\s?_|\s)?[A-Za-z0-9][A-Za-z0-9_]*)
      | (?P<NAME>[A-Za-z_]+)
      | (?P<STRING>"[^"]*")
      | (?P<OP>&&|\|\||<>|>=|<=|<<|>>|\S)""",
    re.X,
)
LABEL = re.compile(r"\s*(?:N\s*[0-9]+\s*)?@\s*(.*?)\s*$", re.I)
HEAD = re.compile(r"\s*(?:N\s*[0-9]+\s*)?([A-Za-z_]+)", re.I)
FUNCTION_OR_BRACKET = re.compile(r'[\[\]()"]|(?<![$A-Z_])G\s*([0-9]+)', re.I)
LABEL_SIGNS = frozenset("+-*/^()<>=|&!~ \t")


def strip_remark(text: str) -> str:
    """The text without its remark: ``//``, ``;`` and ``'`` reach to the end of
    the line, outside of quotes.
    """
    quoted = False
    for i, char in enumerate(text):
        if char == '"':
            quoted = not quoted
        elif not quoted and (char in ";'" or text.startswith("//", i)):
            return text[:i]
    return text


def parts_of(
    text: str, owners: frozenset[int], motions: tuple[int, ...]
) -> list[str]:
    """The block cut ahead of functions that own the words behind them, and of
    motions behind those; columns stay.
    """
    places, depth, quoted, owned = [], 0, False, False
    for found in FUNCTION_OR_BRACKET.finditer(text):
        sign = found[0]
        if sign == '"':
            quoted = not quoted
        elif sign in "[(":
            depth += 1
        elif sign in "])":
            depth -= 1
        elif not depth and not quoted and found[1]:
            own = int(found[1]) in owners
            if own or (owned and int(found[1]) in motions):
                places.append(found.start())
                owned = own
    cuts = [
        0,
        *[place for place in places if text[:place].strip()],
        len(text),
    ]
    return [
        " " * begin + text[begin:end] for begin, end in itertools.pairwise(cuts)
    ]


def label_of(text: str) -> str | None:
    """Name in capitals if the block (without its remark) defines a label."""
    found = LABEL.match(text)
    return found[1].upper() if found else None


def head_word(text: str) -> str:
    """The block's first word in capitals, behind its N number."""
    found = HEAD.match(text)
    return found[1].upper() if found else ""


def word_or_text(stream: TokenStream, what: str) -> str:
    """A text in quotes, or one word."""
    token = stream.current
    if token.kind is Kind.STRING:
        stream.next()
        return token.text[1:-1]
    text = stream.text[token.offset :].replace(",", " ").split(None, 1)
    if not text:
        raise fail(900010, f"{what} is expected", token.offset)
    end = token.offset + len(text[0])
    while not stream.at_end and stream.current.offset < end:
        stream.next()
    return text[0]
