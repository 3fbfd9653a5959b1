"""Comments and pragmas leave the text, every other character keeps its line and column."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from ..errors import TEXT, StopHere
from .pragmas import Conditions

_INTERESTING = re.compile(
    r"\(\*|//[^\n]*|/\*"
    r"|'(?:\$.|[^'$\n])*'"
    r"|'(?:\$.|[^'$\n;])*(?:\n(?:\$.|:(?!=)|[^'$\n;:])*){1,3}'"
    r"|'(?:\$.|[^'$\n])*"
    r'|"(?:\$.|[^"$\n])*"?'
    r"|\{",
    re.S,
)
_NESTING = re.compile(r"\(\*|\*\)")
_NOT_NEWLINE = re.compile(r"[^\n]")
_ATTRIBUTE = re.compile(r"attribute\s+'([^']*)'(?:\s*:=\s*'([^']*)')?", re.I)


@dataclass(frozen=True)
class Attribute:
    """``{attribute 'name' := 'value'}`` and the line it stands in."""

    name: str
    value: str
    line: int


@dataclass
class CleanText:
    """Text without comments and pragmas, and the attributes it held."""

    text: str
    attributes: list[Attribute] = field(default_factory=list)


def blanked(text: str) -> str:
    """The same number of lines and columns, nothing in them."""
    return _NOT_NEWLINE.sub(" ", text)


class _Cleaner:
    """One pass over a text."""

    def __init__(self, text: str, conditions: Conditions) -> None:
        self._text = text
        self._conditions = conditions
        self._parts: list[str] = []
        self._attributes: list[Attribute] = []
        self._line, self._counted = 1, 0

    def run(self) -> CleanText:
        at = 0
        while (match := _INTERESTING.search(self._text, at)) is not None:
            self._keep(self._text[at : match.start()])
            at = self._one(match)
        self._keep(self._text[at:])
        if self._conditions.depth:
            raise StopHere(TEXT, "{IF} is not closed by {END_IF}", (1, 1))
        return CleanText("".join(self._parts), self._attributes)

    def _keep(self, text: str) -> None:
        self._parts.append(text if self._conditions.active else blanked(text))

    def _one(self, match: re.Match[str]) -> int:
        start, token = match.start(), match[0]
        if token[0] in "'\"":
            self._check_closed(token, start)
            self._keep(token)
            return match.end()
        end = self._end_of(token, start, match.end())
        if token == "{":
            self._pragma(self._text[start + 1 : end - 1].strip(), start)
        self._parts.append(blanked(self._text[start:end]))
        return end

    def _check_closed(self, token: str, start: int) -> None:
        if len(token) < 2 or token[-1] != token[0]:
            text = f"the text is not closed; write {token[0]} at its end"
            raise StopHere(TEXT, text, self._place(start))

    def _end_of(self, token: str, start: int, behind: int) -> int:
        if token == "(*":
            return self._comment_end(start)
        if token == "//" or token.startswith("//"):
            return behind
        closing = "*/" if token == "/*" else "}"
        end = self._text.find(closing, behind)
        if end < 0:
            text = f"{token} is not closed by {closing}"
            raise StopHere(TEXT, text, self._place(start))
        return end + len(closing)

    def _comment_end(self, start: int) -> int:
        depth, at = 0, start
        while (match := _NESTING.search(self._text, at)) is not None:
            depth += 1 if match[0] == "(*" else -1
            at = match.end()
            if depth == 0:
                return at
        end = self._text.find("*)", start + 2)
        if end < 0:
            text = "(* is not closed by *)"
            raise StopHere(TEXT, text, self._place(start))
        return end + 2

    def _pragma(self, text: str, start: int) -> None:
        place = self._place(start)
        if self._conditions.take(text, place):
            return
        match = _ATTRIBUTE.match(text)
        if match and self._conditions.active:
            name, value = match[1].lower(), match[2] or ""
            self._attributes.append(Attribute(name, value, place[0]))

    def _place(self, offset: int) -> tuple[int, int]:
        self._line += self._text.count("\n", self._counted, offset)
        self._counted = offset
        return self._line, offset - self._text.rfind("\n", 0, offset)


def clean(
    text: str,
    defines: Iterable[str] = (),
    declared: frozenset[str] = frozenset(),
) -> CleanText:
    """Take comments and pragmas out.  StopHere: something is not closed.

    ``defines`` are the names of ``{IF defined (NAME)}``; ``declared`` holds
    the names of types and POUs in capitals.
    """
    conditions = Conditions({name.upper() for name in defines}, declared)
    return _Cleaner(text.replace("\r\n", "\n"), conditions).run()
