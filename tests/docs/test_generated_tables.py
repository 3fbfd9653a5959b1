"""The tables of the reference are those of the code.

``python docs/generate.py --write`` writes them.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

from cnc_core.catalogue import catalogue
from cnc_core.frontend.isg.cycles.registry import CYCLES

pytestmark = pytest.mark.source

DOCS = Path(__file__).resolve().parents[2] / "docs"


sys.path.insert(0, str(DOCS))  # a folder of scripts, no package
GENERATE = importlib.import_module("generate")
DIALECTS = importlib.import_module("tables.dialects")
TEXTS = importlib.import_module("tables.texts")
PAGES = [p for p in GENERATE.pages() if "<!-- generated" in p.read_text()]


def regions(page: Path) -> list[tuple[str, str]]:
    """(table, argument) of the page's regions."""
    return [
        (m[2], m[3] or "") for m in GENERATE.REGION.finditer(page.read_text())
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_committed_page_is_what_the_code_gives(page: Path) -> None:
    """No table of the page differs from the generator's."""
    text = page.read_text()
    assert GENERATE.generated(text) == text, "python docs/generate.py --write"


def test_every_table_has_its_place() -> None:
    """Each table of the generator stands in a page."""
    placed = {name for page in PAGES for name, _ in regions(page)}
    assert placed == set(GENERATE.TABLES)


def test_every_error_stands_in_one_table() -> None:
    """The ranges of the error reference hold each number exactly once."""
    page = DOCS / "reference" / "errors.md"
    ranges = [
        tuple(map(int, argument.split("-"))) for _, argument in regions(page)
    ]
    for number in catalogue():
        held = [low for low, high in ranges if low <= number <= high]
        assert len(held) == 1, number


def test_every_cycle_has_its_table() -> None:
    """By its name."""
    page = DOCS / "reference" / "cycles.md"
    shown = [argument for name, argument in regions(page) if name == "cycle"]
    assert shown == [cycle.name for cycle in CYCLES]


@pytest.mark.parametrize(
    "text",
    ["0\n    rapid\n", "0 1\n    motion\n1\n    line\n"],
    ids=["left out", "twice"],
)
def test_a_gap_in_the_texts_is_an_error(
    text: str,
) -> None:
    """A function without a text, or with two, has no table."""
    states = dict.fromkeys((0, 1), "works")
    with pytest.raises(TEXTS.DescriptionError, match="1"):
        DIALECTS.functions(text, states, "G")


def test_a_row_with_two_states_is_an_error() -> None:
    """Functions of one row are all executed, or all stored, or all refused."""
    states = {0: "works", 1: "refused"}
    with pytest.raises(TEXTS.DescriptionError, match="refused"):
        DIALECTS.functions("0 1\n    motion\n", states, "G")
