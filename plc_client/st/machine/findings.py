"""Blocks of a program that were given what they refuse, or what was hardly meant."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

from .symbols import Memory, size_of

_REFUSAL = "HliRefusal"
_PERCENT = {"path_active": "path", "override_active": "override"}
"""An output of the blocks with an override -> their input."""


def findings(memory: Memory, number: int, at: int, path: str) -> list[str]:
    """Warnings of the blocks inside of a variable."""
    found = []
    for name, block, view in _blocks(memory, number, at, path):
        refusal = view.refusal
        if refusal.count:
            found.append(
                f"{name} ({block}) got {refusal.input} := {refusal.value:g} and"
                f" sent nothing in {refusal.count} scans; {refusal.allowed}"
            )
        percent = _commanded(view)
        if 0.0 < percent < 1.0:
            found.append(
                f"{name} commands an override of {percent:g} %; overrides are"
                f" in percent: {100.0 * percent:g} for {percent:g}"
            )
    return found


def _commanded(block: Any) -> float:
    """The percentage that a block with an override commands; else 0."""
    names = dir(block)
    held = "held" not in names or block.held[0]
    for output, given in _PERCENT.items():
        if output in names and held:
            return float(getattr(block, given))
    return 0.0


def _blocks(
    memory: Memory, number: int, at: int, path: str
) -> Iterator[tuple[str, str, Any]]:
    """(path, type, view) of each block that notes what it refuses."""
    row = memory.rows[number]
    if row[0] == "a" and _holds(memory.rows, row[1]):
        size = size_of(memory.rows, row[1])
        bounds = [range(low, high + 1) for low, high in row[2]]
        for k, indices in enumerate(product(*bounds)):
            element = f"{path}[{', '.join(map(str, indices))}]"
            yield from _blocks(memory, row[1], at + k * size, element)
    if row[0] != "t":
        return
    if any(memory.rows[inner][1] == _REFUSAL for inner, *_ in row[3].values()):
        yield path, row[1], memory.view(number, at, path=path)
    for name, (inner, offset, _) in row[3].items():
        if _holds(memory.rows, inner):
            yield from _blocks(memory, inner, at + offset, f"{path}.{name}")


def _holds(rows: list[Any], number: int) -> bool:
    """Whether there is such a block inside of a type."""
    row = rows[number]
    if row[0] == "a":
        return _holds(rows, row[1])
    if row[0] != "t":
        return False
    return any(
        rows[inner][1] == _REFUSAL or _holds(rows, inner)
        for inner, *_ in row[3].values()
    )
