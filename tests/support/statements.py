"""Statements of a dialect: what each program of ``tests/statements`` has to give.

An expectation is one of: ``fine`` (no error); ``error`` or ``error NUMBER``;
``warning NUMBER``; ``length MM`` of all motions; ``time S`` at least, and less
than 1.5 times it with 0.2 s; pairs of an axis and its last position, or of a
variable and its value.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

STATEMENTS = Path(__file__).resolve().parent.parent / "statements"
KEYWORDS = ("fine", "error", "warning", "length", "time")


@dataclass(frozen=True)
class Statement:
    """One row of the table; ``setup``: lines that replace those of the sample."""

    section: str
    name: str
    setup: str
    program: str
    expected: str
    oracle: str

    @property
    def title(self) -> str:
        return f"{self.section.split()[0]} {self.name}".replace("`", "")

    @property
    def pairs(self) -> dict[str, float]:
        """Axes or variables and their values; empty for a keyword."""
        words = self.expected.split()
        if words[0] in KEYWORDS:
            return {}
        return dict(
            zip(words[::2], (float(w) for w in words[1::2]), strict=True)
        )


def statements(dialect: str) -> list[Statement]:
    """The rows of a dialect in the order of its sections."""
    text = (STATEMENTS / f"{dialect}.toml").read_text(encoding="utf-8")
    return [
        Statement(section, row[0], *([""] if len(row) == 4 else []), *row[1:])
        for section, table in tomllib.loads(text).items()
        for row in table["rows"]
    ]
