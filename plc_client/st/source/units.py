"""A text is cut into units: one POU, type, interface or list of global variables each."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from ..errors import SYNTAX, Log, Origin, StopHere
from .text import Attribute, CleanText

_WORD = re.compile(
    r"'(?:\$.|[^'$\n])*'|\"(?:\$.|[^\"$\n])*\"|[A-Za-z_]\w*|\S", re.S
)
_ENDS = {
    "PROGRAM": "END_PROGRAM",
    "FUNCTION": "END_FUNCTION",
    "FUNCTION_BLOCK": "END_FUNCTION_BLOCK",
    "INTERFACE": "END_INTERFACE",
    "TYPE": "END_TYPE",
    "VAR_GLOBAL": "END_VAR",
    "VAR_CONFIG": "END_VAR",
    "CONFIGURATION": "END_CONFIGURATION",
    "ACTION": "END_ACTION",
    "METHOD": "END_METHOD",
    "PROPERTY": "END_PROPERTY",
}
_TOP = frozenset(_ENDS) - {"ACTION", "METHOD", "PROPERTY", "VAR_CONFIG"}


@dataclass
class Unit:
    """A stretch of clean text to be parsed on its own.

    ``kind`` is the start symbol of the grammar: ``unit``, or ``head`` and
    ``body`` for the two halves of a TwinCAT object.  ``children`` are the
    methods, properties and actions of a TwinCAT object.
    """

    kind: str
    text: str
    origin: Origin
    line: int
    column: int = 1
    attributes: list[Attribute] = field(default_factory=list)
    body: Unit | None = None
    children: list[Unit] = field(default_factory=list)
    role: str = ""
    namespace: str = ""


def split(clean: CleanText, origin: Origin, log: Log) -> list[Unit]:
    """The units of a text; what stands outside of them is an error."""
    return _Splitter(clean, origin, log).run()


class _Splitter:
    def __init__(self, clean: CleanText, origin: Origin, log: Log) -> None:
        self._text, self._origin, self._log = clean.text, origin, log
        self._attributes = sorted(clean.attributes, key=lambda a: a.line)
        self._units: list[Unit] = []
        self._begin, self._kind, self._end_word = -1, "", ""
        self._line, self._counted = origin.first_line, 0
        self._told = False

    def run(self) -> list[Unit]:
        for match in _WORD.finditer(self._text):
            self._word(match[0].upper(), match)
        if self._begin >= 0:
            self._close(len(self._text))
        return self._units

    def _word(self, word: str, match: re.Match[str]) -> None:
        if self._begin < 0:
            self._outside(word, match)
        elif word == self._end_word:
            self._close(match.end())
        elif self._starts_anew(word, match):
            self._close(match.start())
            self._open(word, match)

    def _starts_anew(self, word: str, match: re.Match[str]) -> bool:
        if word not in _TOP or self._kind == "CONFIGURATION":
            return False
        start = match.start()
        line = self._text.rfind("\n", 0, start) + 1
        return not self._text[line:start].strip()

    def _outside(self, word: str, match: re.Match[str]) -> None:
        if word in _ENDS:
            self._open(word, match)
            self._told = False
        elif word != ";" and not self._told:
            self._told = True
            text = f"{match[0]!r} stands outside of every POU"
            hint = "begin with PROGRAM, FUNCTION, FUNCTION_BLOCK or TYPE"
            place = self._place(match.start())
            self._log.error(
                self._origin, StopHere(SYNTAX, f"{text}; {hint}", place)
            )

    def _open(self, word: str, match: re.Match[str]) -> None:
        self._begin = match.start()
        self._kind, self._end_word = word, _ENDS[word]

    def _close(self, end: int) -> None:
        line, column = self._place(self._begin)
        text = self._text[self._begin : end]
        unit = Unit("unit", text, self._origin, line, column)
        last = line + text.count("\n")
        while self._attributes and self._attributes[0].line <= last:
            unit.attributes.append(self._attributes.pop(0))
        self._units.append(unit)
        self._begin = -1

    def _place(self, offset: int) -> tuple[int, int]:
        self._line += self._text.count("\n", self._counted, offset)
        self._counted = offset
        return self._line, offset - self._text.rfind("\n", 0, offset)
