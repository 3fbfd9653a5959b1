"""The table of docs/st.md tells what the compiler does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from plc_client.st.build import check
from plc_client.st.errors import REFUSED
from plc_client.st.source import library

PAGE = Path(__file__).parents[3] / "docs" / "st.md"
ROW = re.compile(r"^\| ([^|]+) \| `(.+)` \| (works|refused) \|$", re.M)
ROWS = ROW.findall(PAGE.read_text())
UNITS = (
    "FUNCTION",
    "{attribute 'call",
    "TYPE",
    "INTERFACE",
    "VAR_GLOBAL",
    "PROGRAM",
)
FUNCTION = "TYPE TechnoFunction : STRUCT"
HELP = "FUNCTION FEXT : INT END_FUNCTION\n"


def source_of(example: str) -> str:
    """Statements become a program; whole units stay what they are."""
    if example.startswith(UNITS):
        return example + "\n"
    return f"{HELP}PROGRAM MAIN\n{example}\nEND_PROGRAM\n"


@pytest.mark.parametrize(
    ("construct", "example", "state"), ROWS, ids=[row[0] for row in ROWS]
)
def test_table_tells_what_the_compiler_does(
    construct: str, example: str, state: str
) -> None:
    """An example that works has no error; one that is refused names it."""
    found = check({"example.st": source_of(example)}).log.errors
    if state == "works":
        assert not found, construct
    else:
        assert [problem.code for problem in found] == [REFUSED], construct
        assert found[0].construct


def test_the_table_is_there() -> None:
    """The rows are found by their form."""
    assert len(ROWS) > 30


def test_programs_of_the_page_are_right() -> None:
    """Each compiles without an error and without a warning."""
    found = re.findall(
        r"^```\n((?:PROGRAM|FUNC).*?)^```$", PAGE.read_text(), re.M | re.S
    )
    assert len(found) > 2
    for source in found:
        log = check({"page.st": source}).log
        assert [*log.errors, *log.warnings] == []


def test_members_of_a_technology_function_are_told() -> None:
    """Those of ``TechnoFunction``, each with its type."""
    (text,) = (
        u.text
        for u in library.units_for(["TechnoFunction"])
        if FUNCTION in u.text
    )
    members = re.findall(r"^  (\w+) : ([\w()]+);", text, re.M)
    assert len(members) == 7
    for name, type_ in members:
        assert f"| `{name}` | {type_} |" in PAGE.read_text()
