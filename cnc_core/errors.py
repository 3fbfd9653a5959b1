"""One error base and one table of numbers.

Vendor numbers are used where they are public (companion specifications, "DG" pages); everything else lies in our own
range 900000..909999.  The table is printed into the docs by ``docs/errors.md`` and checked for completeness by a test.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

# number -> what it means (without the particulars of one occurrence)
ERRORS: dict[int, str] = {
    # vendor numbers
    20003: "G60 without motion",
    20013: "G04: a number and an axis word together",
    20014: "G04: only the first main axis may carry the time",
    20108: "two motion functions in one block",
    20116: "two zero offsets in one block",
    20118: "G70 and G71 in one block",
    20127: "G161 and G162 in one block",
    20131: "unknown G function",
    20301: "block too long",
    20752: "G04: time out of range",
    21024: "I, J, K and R together",
    # our own: program text
    900001: "unknown word",
    900002: "unknown command",
    900003: "not supported",
    900004: "malformed number or expression",
    900005: "word programmed twice in one block",
    900006: "feed missing or not positive",
    900007: "wrong circle",
    900008: "circle without centre and radius",
    900009: "M function not defined",
    900010: "malformed command",
    900011: "two functions of one group in a block",
    900012: "value out of range",
    900013: "unclosed bracket or comment",
    900014: "unknown tool",
    # our own: files, configuration, machine
    901001: "file not found",
    901002: "file cannot be read",
    901003: "dialect not available",
    902001: "configuration error",
    903001: "software limit exceeded",
    # our own: engine and co-simulation
    904001: "row not supported by the engine",
    904002: "row with numbers that are not finite",
    904003: "out of memory",
    905001: "a process died",
    905002: "segment in use",
}


@dataclass
class Place:
    """Where in the program: file, 1-based line and column, the text of the line."""

    file: str = ""
    line: int = 0
    column: int = 0
    source: str = ""


class CncError(Exception):
    """A numbered error with its place; ``str()`` gives ``FILE:LINE:COL: CODE: text`` and the source line."""

    def __init__(self, code: int, text: str = "", place: Place | None = None) -> None:
        self.code = code
        self.text = text or ERRORS.get(code, "error")
        self.place = place or Place()
        super().__init__(self.text)

    def at(self, place: Place) -> CncError:
        """The same error at ``place``, if it has none yet."""
        if not self.place.line:
            self.place = place
        return self

    def __str__(self) -> str:
        p = self.place
        head = f"{p.file}:{p.line}:{p.column}: " if p.line else (f"{p.file}: " if p.file else "")
        tail = f"\n    {p.source}" if p.source else ""
        return f"{head}{self.code}: {self.text}{tail}"

    def as_json(self) -> dict[str, Any]:
        """``{file, line, column, code, text}`` as the contract wants it."""
        p = self.place
        return {"file": p.file, "line": p.line, "column": p.column, "code": self.code, "text": self.text}


class ConfigError(CncError):
    """Wrong cell configuration."""

    def __init__(self, text: str, place: Place | None = None) -> None:
        super().__init__(902001, text, place)
