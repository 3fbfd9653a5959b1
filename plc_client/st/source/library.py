"""The library in Structured Text; a program takes the units whose names it holds."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources

from ..errors import Log, StError
from . import files
from .units import Unit

_WORD = re.compile(r"[A-Za-z_]\w*")
_GLOBAL = re.compile(r"([A-Za-z_]\w*)\s*:")


@dataclass(frozen=True)
class _Entry:
    unit: Unit
    names: frozenset[str]
    spelled: frozenset[str]
    words: frozenset[str]


def words_of(text: str) -> frozenset[str]:
    """Every word of a text, in capitals."""
    return frozenset(map(str.upper, _WORD.findall(text)))


def _names_of(text: str) -> frozenset[str]:
    """What a unit declares."""
    if text.lstrip().startswith("VAR_GLOBAL"):
        return frozenset(_GLOBAL.findall(text))
    return frozenset(files.declared(text))


@functools.cache
def _entries() -> tuple[_Entry, ...]:
    folder = resources.files(__package__.rpartition(".")[0]) / "library"
    log, found = Log(), []
    for file in sorted(folder.iterdir(), key=lambda e: e.name):
        if file.name.endswith(".st"):
            name = f"<library>/{file.name}"
            for unit in files.units_of(name, file.read_text(), log):
                words = words_of(unit.text)
                spelled = _names_of(unit.text)
                names = frozenset(map(str.upper, spelled))
                found.append(_Entry(unit, names, spelled, words))
    if log.errors:
        raise StError(log.errors)
    return tuple(found)


def names() -> frozenset[str]:
    """What the library declares, in capitals."""
    return frozenset().union(*(entry.names for entry in _entries()))


def spelled() -> frozenset[str]:
    """The same as it is written there."""
    return frozenset().union(*(entry.spelled for entry in _entries()))


def units_for(texts: Iterable[str]) -> list[Unit]:
    """The units that texts name, and those that these units name."""
    wanted: set[str] = set()
    for text in texts:
        wanted |= words_of(text)
    found: dict[int, Unit] = {}
    size = -1
    while size < len(found):
        size = len(found)
        for number, entry in enumerate(_entries()):
            if number not in found and not entry.names.isdisjoint(wanted):
                found[number] = entry.unit
                wanted |= entry.words
    return [found[number] for number in sorted(found)]
