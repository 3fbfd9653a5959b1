"""The parser's own loop and lark's give the same trees and refuse the same texts."""

from __future__ import annotations

from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import pytest
from lark.exceptions import UnexpectedInput, VisitError

from plc_client.st.errors import Log, StopHere
from plc_client.st.source import files
from plc_client.st.source.units import Unit
from plc_client.st.syntax.parser import _parser
from plc_client.st.syntax.quick import NotAcceptedError, quick_parser
from support.seeds import few
from support.st_mutations import TEXTS, mutated

WRONG = (NotAcceptedError, UnexpectedInput, VisitError, StopHere)


def tree_of(unit: Unit, parse: Any) -> str:
    """The tree as text; empty: the text is refused."""
    _, builder, keywords, _ = _parser()
    keywords.text = unit.text
    builder.shift(unit.line, unit.column)
    with suppress(*WRONG):
        return repr(parse(unit.text, start=unit.kind))
    return ""


def agree(text: str) -> int:
    """Both loops on every unit of a text; how many were refused."""
    lark, _, _, quick = _parser()
    refused = 0
    for unit in files.units_of("m.st", text, Log()):
        found = tree_of(unit, quick.parse)
        assert found == tree_of(unit, lark.parse)
        refused += not found
    return refused


@pytest.mark.parametrize("number", range(0, len(TEXTS), 4))
def test_right_sources(number: int) -> None:
    """Right sources are accepted by both, with the same places."""
    assert agree(TEXTS[number]) == 0


@pytest.mark.parametrize("seed", few(range(500), 6))
def test_wrong_sources(seed: int) -> None:
    """A source that lark refuses is refused."""
    agree(mutated(seed))


def test_a_lark_that_is_built_otherwise_parses_itself() -> None:
    """Its tables are its own matter; a version without them is no error."""
    foreign: Any = SimpleNamespace(parser=SimpleNamespace(), options=None)
    assert quick_parser(foreign) is None
