"""The C of units that have not changed since the program was built before.

A unit's C depends on its own text and on the declarations of all units.
Both are in the key.  Only units without errors are kept.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import Problem
from ..source.outline import declared, outline, texts_of
from ..source.units import Unit
from .compiler import cache_folder, digest

Row = list[Any]
"""C functions, prototypes by name, warnings; lines count from the unit's first."""


class LoweredUnits:
    """What one set of declarations has kept; filled while a program is built."""

    def __init__(self, units: Sequence[Unit], about: str) -> None:
        self._outlines = {id(unit): outline(unit) for unit in units}
        self._keys = {id(unit): _key(unit) for unit in units}
        texts = [about]
        for unit in units:
            texts += declared(unit)
        name = digest("\0".join(texts))
        self._file = cache_folder() / f"{name}.units.json"
        self._before = _read(self._file)
        self._now: dict[str, Row] = {}
        self._changed = False

    def outline(self, unit: Unit) -> Unit | None:
        """The declarations of a unit whose C is kept; None: it is not."""
        known = self._keys[id(unit)] in self._before
        return self._outlines[id(unit)] if known else None

    def of(self, unit: Unit) -> tuple[list[str], dict[str, str], list[Problem]]:
        """Functions, prototypes and warnings of a unit that has an outline."""
        key = self._keys[id(unit)]
        self._now[key] = self._before[key]
        functions, prototypes, rows = self._before[key]
        warnings = [Problem(**row) for row in rows]
        file = unit.origin.file
        return (
            functions,
            prototypes,
            [replace(w, line=w.line + unit.line, file=file) for w in warnings],
        )

    def keep(
        self,
        unit: Unit,
        functions: list[str],
        prototypes: dict[str, str],
        warnings: list[Problem],
    ) -> None:
        """Remember the C of a unit that has an outline."""
        if self._outlines.get(id(unit)) is None:
            return
        rows = [vars(replace(w, line=w.line - unit.line)) for w in warnings]
        self._now[self._keys[id(unit)]] = [functions, prototypes, rows]
        self._changed = True

    def save(self) -> None:
        """Write the file, which holds the units of the last build."""
        if self._changed:
            part = self._file.with_suffix(f".{id(self)}.part")
            part.write_text(json.dumps(self._now))
            part.replace(self._file)


def _key(unit: Unit) -> str:
    return digest("\0".join(texts_of(unit)))


def _read(file: Path) -> dict[str, Row]:
    try:
        found = json.loads(file.read_text())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
