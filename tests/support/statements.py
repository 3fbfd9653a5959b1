"""Statements of a dialect: what each program of ``tests/statements`` has to give.

An expectation is one of: ``fine`` (no error); ``error`` or ``error NUMBER``;
``warning NUMBER``; ``length MM`` of all motions; ``time S`` at least, and less
than 1.5 times it with 0.2 s; pairs of an axis and its last position, or of a
variable and its value.
"""

from __future__ import annotations

import re
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


def words(dialect: str) -> list[tuple[str, str]]:
    """(kind, word) of every statement of the guide."""
    text = (STATEMENTS / "words.toml").read_text(encoding="utf-8")
    kinds = tomllib.loads(text)[dialect]
    return [
        (kind, word) for kind, all_ in kinds.items() for word in all_.split()
    ]


def stands(word: str, text: str) -> bool:
    """The word stands in the text by itself; an index or a value may follow it."""
    before = r"(?<![A-Za-z_$])" if word[0].isalnum() else ""
    behind = r"(?![A-Z])(?!_(?![A-Z0-9]{1,2}\"))"  # VMAX_X is VMAX of an axis
    if word[-1].isdigit():
        behind = r"(?![0-9])"
    elif not word[-1].isalnum():
        behind = ""
    return re.search(before + re.escape(word) + behind, text) is not None


def given_fields(rows: list[Statement]) -> set[tuple[str, int]]:
    """(code, place from 1) of the fields of setup lines that a row gives."""
    lines = [line for row in rows for line in row.setup.split(";")]
    found = set()
    for line in lines:
        _, _, record = line.partition("=")
        code, *fields = record.strip("()").split(",")
        found |= {(code, i + 1) for i, field in enumerate(fields) if field}
    return found
