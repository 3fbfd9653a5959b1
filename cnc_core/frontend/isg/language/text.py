"""Tokens of the dialect, and the head of a block for searches.

A variable is one token: ``V.`` and its name, up to the first bracket.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from cnc_core.frontend.base.block_text import strip_comments

PATTERN = re.compile(
    r"""(?P<NUMBER>[0-9]+(?:\.[0-9]*)?|\.[0-9]+)
      | (?P<VARIABLE>[vV]\.[A-Za-z_]\w*(?:\.(?:[+-](?=[sS][wW][eE]))?@?\w+)*)
      | (?P<NAME>(?:(?![vV]\.[A-Za-z_])[A-Za-z_])+)
      | (?P<STRING>"(?:\\"|[^"])*")
      | (?P<OP>\*\*|&&|\|\||==|!=|>=|<=|\S)""",
    re.X,
)
HEAD = re.compile(
    r"""\s*(?P<skip>/\s*[0-9]*)?
        \s*(?:[nN]\s*=?\s*(?P<n>[0-9]+)\s*:?)?
        \s*(?:\[\s*(?P<label>[^\[\]]*?)\s*\]\s*:?)?
        \s*(?P<sign>[$\#%]\s*(?P<word>[A-Za-z]*)\s*(?P<next>[A-Za-z]*))?""",
    re.X,
)
CONTROL = re.compile(rb"[$%#\\]")
# lines that may be wrong although they are not executed
DOUBTFUL = re.compile(
    rb"[^NGXYZUVWABCIJKRFngxyzuvwabcijkrf0-9.+\- \t\r\n]"
    rb"|[gG](?!0?[0-3](?![0-9])|1[789](?![0-9])|9[01](?![0-9]))"
)
PROGRAMS = re.compile(rb"[%#\\]")
COMMENTS = re.compile(rb"[#\\]")


class Head(NamedTuple):
    """The beginning of a block.

    Skip level (-1 none), N, label, sign, its word and the next one.
    """

    skip: int
    n: int | None
    label: str | None
    sign: str
    word: str
    next: str
    text: str


def head_of(text: str) -> Head:
    """The beginning of a block, comments removed."""
    clean = strip_comments(text)
    found = HEAD.match(clean)
    assert found is not None
    skip = found["skip"]
    level = -1 if skip is None else int(skip[1:].strip() or 1)
    n = None if found["n"] is None else int(found["n"])
    label = None if found["label"] is None else found["label"].upper()
    sign = (found["sign"] or "")[:1]
    return Head(
        level,
        n,
        label,
        sign,
        (found["word"] or "").upper(),
        (found["next"] or "").upper(),
        clean,
    )


def comment_depth(head: Head, depth: int) -> int:
    """Open ``#COMMENT BEGIN`` behind a block, of those in front of it."""
    if head.sign == "#" and head.word == "COMMENT":
        return depth + 1 if head.next == "BEGIN" else max(0, depth - 1)
    return depth
