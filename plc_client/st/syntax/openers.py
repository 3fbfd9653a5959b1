"""Which keyword of a text is not closed: for the error where the parser stops."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass

from .keywords import KEYWORDS

_WORD = re.compile(
    r"'(?:\$.|[^'$\n])*'|\"(?:\$.|[^\"$\n])*\"|[.#]?\b[A-Za-z_]\w*"
)
_FIRST = frozenset(
    [
        *("PROGRAM", "FUNCTION", "FUNCTION_BLOCK", "INTERFACE", "TYPE"),
        "CONFIGURATION",
    ]
)
"""They open at the beginning of a unit alone."""
_PARTS = frozenset({"METHOD", "PROPERTY", "ACTION"})
_STATEMENTS = frozenset({"IF", "CASE", "FOR", "WHILE", "REPEAT"})
_GROUPS = frozenset({"STRUCT", "UNION", "RESOURCE"})
_NAMED = re.compile(r"\s+[A-Za-z_]")
_ACCESSORS = frozenset({"GET", "SET"})
_ALIKE = 0.8


@dataclass
class Unclosed:
    """A keyword without its end: where it stands, where that is noticed.

    ``typo``: a word there that was meant to close it.
    """

    word: str
    at: int
    found: int = -1
    typo: str = ""

    @property
    def closer(self) -> str:
        """The keyword that is missing."""
        declares = KEYWORDS.get(self.word) == "VAR_KIND"
        return "END_VAR" if declares else f"END_{self.word}"

    def causes(self, text: str, offset: int) -> bool:
        """Whether the parser stops at an offset because of it."""
        if self.typo or self.word in _PARTS:  # parts may stand in parts
            return offset >= self.found
        if self.closer == "END_VAR":
            return self.at < offset <= self.found
        return offset >= self.found and "\n" not in text[self.found : offset]


def unclosed(text: str, whole: bool) -> list[Unclosed]:
    """All of a text without comments, in the order in which they are noticed.

    ``whole``: a POU with its end; otherwise its head or body alone.
    """
    scan = _Scan(text, whole)
    for match in _WORD.finditer(text):
        scan.see(match[0], match.start())
    scan.close_all(len(text))
    return scan.found


class _Scan:
    def __init__(self, text: str, whole: bool) -> None:
        self._text, self._whole = text, whole
        self._open: list[Unclosed] = []
        self.found: list[Unclosed] = []

    def see(self, word: str, at: int) -> None:
        key = word.upper()
        if key.startswith("END"):
            self._end(word, key, at)
        elif KEYWORDS.get(key) == "VAR_KIND" or key in _STATEMENTS:
            if self._inside("VAR"):
                self._miss(at)
            self._open.append(Unclosed(key, at))
        elif key in _PARTS and self._begins_part(word, at):
            while len(self._open) > 1:
                self._miss(at)
            self._open.append(Unclosed(key, at))
        elif self._begins(key, at):
            self._open.append(Unclosed(key, at))

    def _begins(self, key: str, at: int) -> bool:
        if key in _ACCESSORS:
            return self._inside("PROPERTY")
        first = key in _FIRST and at == 0 and self._whole
        return first or key in _GROUPS

    def _inside(self, name: str) -> bool:
        """Whether a keyword is the last one that is open."""
        return bool(self._open) and self._open[-1].closer == f"END_{name}"

    def _begins_part(self, word: str, at: int) -> bool:
        ahead = self._text[self._text.rfind("\n", 0, at) + 1 : at]
        named = _NAMED.match(self._text, at + len(word))
        return self._whole and not ahead.strip() and named is not None

    def _end(self, word: str, key: str, at: int) -> None:
        if any(one.closer == key for one in self._open):
            while self._open[-1].closer != key:
                self._miss(at)
            self._open.pop()
        elif self._open and key not in KEYWORDS:
            closer = self._open[-1].closer
            if difflib.SequenceMatcher(None, key, closer).ratio() >= _ALIKE:
                self._miss(at, word)

    def _miss(self, at: int, typo: str = "") -> None:
        one = self._open.pop()
        one.found, one.typo = at, typo
        self.found.append(one)

    def close_all(self, at: int) -> None:
        """The text ends."""
        while self._open:
            self._miss(at)
