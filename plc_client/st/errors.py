"""Errors of ST sources: place, number, reason and what to do.

Many errors are collected before one is raised.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..task import PlcError

SYNTAX = 951001
TEXT = 951002
FILE = 951003
NAME = 952001
TYPE = 952002
TARGET = 952003
ARGUMENT = 952004
TWICE = 952005
CONSTANT = 952006
REFUSED = 952007
RANGE = 952008
CLASS = 952009
LOSSY = 953001
OWNER = 953002
UNHEARD = 953003

ST_ERRORS: dict[int, str] = {
    SYNTAX: "the text is no Structured Text",
    TEXT: "a comment, text or pragma is not closed",
    FILE: "a project file cannot be read",
    NAME: "the name is unknown",
    TYPE: "the types do not fit",
    TARGET: "the place cannot be written",
    ARGUMENT: "the arguments do not fit",
    TWICE: "the name is declared twice",
    CONSTANT: "a constant is needed",
    REFUSED: "the construct is not supported",
    RANGE: "the value is out of range",
    CLASS: "inheritance or interface is wrong",
    LOSSY: "the implicit conversion may lose information",
    OWNER: "the CNC writes this member of the HLI",
    UNHEARD: "the CNC does not look at this command",
}
"""Number -> what it means, without the particulars of one place."""

SHOWN = 50
"""Errors in one message."""

Position = tuple[int, int]


@dataclass(frozen=True)
class Origin:
    """A stretch of source text: its file and where its first line stands there."""

    file: str
    lines: tuple[str, ...]
    first_line: int = 1

    def source_line(self, line: int) -> str:
        """The text of a line of the file, counted from 1."""
        index = line - self.first_line
        return self.lines[index] if 0 <= index < len(self.lines) else ""


@dataclass(frozen=True)
class Problem:
    """One error or warning at one place."""

    code: int
    text: str
    file: str = ""
    line: int = 0
    column: int = 0
    source: str = ""
    pou: str = ""
    construct: str = ""

    def __str__(self) -> str:
        head = self.file
        if self.line:
            head += f":{self.line}:{self.column}"
        text = f"{head}: {self.code}: {self.text}"
        return f"{text}\n    {self.source}" if self.source else text

    def as_json(self) -> dict[str, Any]:
        """``{file, line, column, code, text}``."""
        names = ("file", "line", "column", "code", "text")
        return {name: getattr(self, name) for name in names}

    def refused(self) -> dict[str, Any]:
        """``{pou, construct, file, line}`` of a refused construct."""
        names = ("pou", "construct", "file", "line")
        return {name: getattr(self, name) for name in names}


class StError(PlcError):
    """The ST program is wrong; ``problems`` holds all that was found."""

    def __init__(self, problems: list[Problem]) -> None:
        self.problems = problems
        shown = [str(problem) for problem in problems[:SHOWN]]
        if len(problems) > SHOWN:
            shown.append(f"and {len(problems) - SHOWN} more errors")
        super().__init__("\n".join(shown))


class StopHere(Exception):  # noqa: N818
    """Ends the work on one statement or declaration after its error is noted."""

    def __init__(
        self, code: int, text: str, pos: Position, construct: str = ""
    ) -> None:
        super().__init__(text)
        self.code, self.text, self.pos = code, text, pos
        self.construct = construct


def refuse(construct: str, pos: Position, instead: str = "") -> StopHere:
    """The error for a construct that is known and not supported."""
    text = f"{construct} is not supported"
    return StopHere(
        REFUSED, f"{text}; {instead}" if instead else text, pos, construct
    )


@dataclass
class Log:
    """Collects problems; a place is reported once."""

    errors: list[Problem] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)
    _seen: set[tuple[str, int, int]] = field(default_factory=set)

    def error(self, origin: Origin, stop: StopHere, pou: str = "") -> None:
        """Note an error."""
        place = (origin.file, *stop.pos)
        if place in self._seen:
            return
        self._seen.add(place)
        self.errors.append(problem_at(origin, stop, pou))

    def warn(self, origin: Origin, stop: StopHere, pou: str = "") -> None:
        """Note a warning."""
        self.warnings.append(problem_at(origin, stop, pou))


def problem_at(origin: Origin, stop: StopHere, pou: str) -> Problem:
    """A problem with the line it stands in."""
    line, column = stop.pos
    source = origin.source_line(line).rstrip()
    return Problem(
        stop.code,
        stop.text,
        origin.file,
        line,
        column,
        source,
        pou,
        stop.construct,
    )
