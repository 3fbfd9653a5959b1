"""Who writes a member of the HLI, from its reference."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from typing import Any

from . import layout
from .units import unit_of, units_and_writers

CNC = "CNC"
ENDINGS = (("_rw", "both"), ("_r", CNC), ("_w", "PLC"))
ROOTS: dict[str, Any] = {
    "GPPFORM": layout.HLI_PLATFORM,
    "GPCH": layout.HLI_CHANNEL,
    "GPAX": layout.HLI_AXIS,
    "GPAHEAD": layout.HLI_AHEAD,
}
NAME = re.compile(r"[A-Za-z_]\w*")


@functools.cache
def writers() -> dict[str, dict[str, str]]:
    """Structure -> member -> ``CNC``, ``PLC``, ``both`` or a text."""
    return {
        structure: {
            member: writer or _by_ending(member)
            for member, (_, writer) in members.items()
        }
        for structure, members in units_and_writers().items()
    }


def _by_ending(member: str) -> str:
    return next((who for end, who in ENDINGS if member.endswith(end)), "")


def members_of(path: str) -> Iterator[tuple[str, str]]:
    """(structure, member) of each step of a symbol path, as far as it leads."""
    names = NAME.findall(re.sub(r"\[[^]]*\]", "", path))
    names = (
        names[1:] if names and names[0].upper().startswith("HLI_") else names
    )
    structure = ROOTS.get(names[0].upper()) if names else None
    for name in names[1:]:
        if structure is None:
            return
        fields = {field.upper(): field for field, _ in structure._fields_}
        known = layout.ALIASES.get(name, name).rpartition(".")[2]
        member = fields.get(known.upper())
        if member is None:
            return
        yield structure.__name__, member
        base, _ = layout.element_type(dict(structure._fields_)[member])
        structure = base if hasattr(base, "_fields_") else None


def cnc_writes(path: str) -> bool:
    """A symbol path leads to a member that the CNC alone writes, or below one."""
    return any(
        writers()[structure].get(member) == CNC
        for structure, member in members_of(path)
    )


def unit_of_path(path: str) -> str:
    """The unit of what a symbol path names; that of a control unit for its
    command and state.
    """
    units = [unit_of(*step) for step in members_of(path)]
    return next((unit for unit in reversed(units) if unit), "")


@functools.cache
def status_names() -> frozenset[str]:
    """Names of members that the CNC alone writes and that nothing else is called
    like: ``_r``, those of status structures, and status structures themselves.
    """
    found = set()
    for structure, members in writers().items():
        status = structure.endswith("_STATE")
        area = structure in ("HLI_CHANNEL", "HLI_AXIS")
        found |= {
            name
            for name, who in members.items()
            if who == CNC
            and (name.endswith("_r") or ((status or area) and "_" in name))
        }
    return frozenset(found)
