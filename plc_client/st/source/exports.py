"""Exports of CODESYS 2: POUs among lists of libraries and settings."""

from __future__ import annotations

import re

from ..errors import Log, refuse
from .text import CleanText
from .units import Unit

SUFFIX = ".exp"
_LIST = re.compile(r"^LIBRARY$.*?^END_LIBRARY$", re.S | re.M)
_FOREIGN = re.compile(r"\b_(FBD|LD|CFC|SFC|IL)_BODY\b|\b(INITIAL_STEP)\b")
_NOT_NEWLINE = re.compile(r"[^\n]")


def without_lists(clean: CleanText) -> CleanText:
    """The text without the names of the libraries a project takes."""
    text = _LIST.sub(lambda m: _NOT_NEWLINE.sub(" ", m[0]), clean.text)
    return CleanText(text, clean.attributes)


def refuse_foreign(units: list[Unit], log: Log) -> list[Unit]:
    """Units in Structured Text; bodies in another language are refused by name."""
    kept = []
    for unit in units:
        found = _FOREIGN.search(unit.text)
        if found is None:
            kept.append(unit)
            continue
        ahead = unit.text[: found.start()]
        place = (unit.line + ahead.count("\n"), 1)
        name = found[1] or "SFC"
        log.error(unit.origin, refuse(f"a body in {name}", place))
    return kept
