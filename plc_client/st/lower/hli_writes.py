"""Writing to the HLI: warnings where the CNC overwrites it or does not look at it."""

from __future__ import annotations

import re
from collections.abc import Iterable

from hli.owners import cnc_writes, members_of

from ..errors import OWNER, UNHEARD, Position, Problem
from .context import Context
from .value import Value

_WITH_A_FLAG = ("override", "rapid_override")
"""Units that the CNC looks at while another unit is TRUE, too."""


def note(context: Context, place: Value, pos: Position) -> None:
    """Warn of an assignment to ``gpCh[0]^...`` and its like."""
    path = place.spelled
    if path[:2].upper() != "GP" or context.origin.file.startswith("<"):
        return
    spelled = path.replace("[]", "[i]")
    if cnc_writes(path):
        text = f"{spelled} is written by the CNC in each cycle; write"
        context.warn(f"{text} command_w or another _w member", pos, OWNER)
        return
    names = [member for _, member in members_of(path)]
    if "command_w" not in names:
        return
    unit = names[names.index("command_w") - 1]
    needed = [("enable_w", "a unit")]
    if unit in _WITH_A_FLAG:
        needed.append((f"{unit}_valid", unit))
    for name, what in needed:
        text = f"{spelled} is written, and {name} nowhere; the CNC looks at"
        text += f" {what} while {name} is TRUE"
        context.warn(text, pos, UNHEARD, name)


def unheard(warnings: Iterable[Problem], texts: Iterable[str]) -> list[Problem]:
    """The warnings that hold for a program of these texts; each name that is
    missing is told once.
    """
    whole = "\n".join(texts)
    found, told = [], set()
    for warning in warnings:
        name = warning.construct
        if warning.code == UNHEARD:
            if name in told or re.search(rf"\b{name}\b", whole, re.I):
                continue
            told.add(name)
        found.append(warning)
    return found
