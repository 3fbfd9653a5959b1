"""The page on recordings names every column with its unit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cnc_core.recording.schema import AXES, COLUMNS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "recording.md"


@pytest.mark.parametrize("table", COLUMNS)
def test_the_table_is_described(table: str) -> None:
    """A section a table, a row a column: name, unit, type, text, wall clock."""
    section = PAGE.read_text().split(f"### `{table}`\n")[1].split("\n### ")[0]
    rows = re.findall(
        r"^\| (.+?) \| (.+?) \| (.+?) \| (.+?) \|$", section, re.M
    )
    described = [
        (name.strip("`"), unit, kind, text)
        for name, unit, kind, text in rows[1:]
    ]
    assert described[0:] == [
        (
            "X, Y, .." if name == AXES else name,
            column.unit or "-",
            column.type,
            column.text + (" (wall clock)" if column.wall else ""),
        )
        for name, column in COLUMNS[table].items()
    ]
