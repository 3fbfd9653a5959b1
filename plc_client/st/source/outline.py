"""What other units see of a unit: its declarations without its statements.

A unit whose statements alone have changed leaves the C of all others as it is.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from .text import blanked
from .units import Unit

_TEXTS = r"'(?:\$.|[^'$])*'|\"(?:\$.|[^\"$])*\""
_WORDS = (
    "VAR(?:_[A-Z_]+)?|METHOD|PROPERTY|ACTION"
    "|END_(?:VAR|METHOD|PROPERTY|ACTION|PROGRAM|FUNCTION|FUNCTION_BLOCK)"
)
_PART = re.compile(rf"{_TEXTS}|\b(?:{_WORDS})\b", re.I | re.S)
_PART_OF_PROPERTY = re.compile(
    rf"{_TEXTS}|\b(?:{_WORDS}|GET|SET|END_GET|END_SET)\b", re.I | re.S
)
_POU = re.compile(r"\s*(?:PROGRAM|FUNCTION|FUNCTION_BLOCK)\b", re.I)


def outline(unit: Unit) -> Unit | None:
    """The unit without statements, at the same places; None: it is no POU."""
    if unit.kind == "head":
        return _without_bodies(unit)
    if unit.kind != "unit" or _POU.match(unit.text) is None:
        return None
    return replace(unit, text=_declarations(unit.text, blanked))


def _without_bodies(unit: Unit) -> Unit:
    children = [_without_bodies(child) for child in unit.children]
    return replace(unit, body=None, children=children)


def declared(unit: Unit) -> list[str]:
    """What the C of other units depends on."""
    seen = outline(unit)
    if seen is None or seen.kind == "head":
        return texts_of(seen or unit)
    return texts_of(replace(unit, text=_declarations(unit.text, _nothing)))


def _nothing(_: str) -> str:
    return ""


def _declarations(text: str, instead: Callable[[str], str]) -> str:
    """Something else instead of the statements between END_VAR and the next part.

    Those of a part without variables stay: nothing tells where they begin.
    """
    has_property = re.search(r"\bPROPERTY\b", text, re.I)
    words = _PART_OF_PROPERTY if has_property else _PART
    parts, kept, behind = [], 0, -1
    for match in words.finditer(text):
        word = match[0].upper()
        if word[0] in "'\"":
            continue
        if behind >= 0:
            parts += [text[kept:behind], instead(text[behind : match.start()])]
            kept, behind = match.start(), -1
        if word == "END_VAR":
            behind = match.end()
    return "".join([*parts, text[kept:]])


def texts_of(unit: Unit) -> list[str]:
    """Every text of a unit with its parts, and what stands beside them."""
    found = [unit.kind, unit.role, unit.namespace, unit.text]
    found += [f"{a.name}={a.value}" for a in unit.attributes]
    for part in (unit.body, *unit.children):
        if part is not None:
            found += texts_of(part)
    return found
