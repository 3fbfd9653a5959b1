"""Who writes a member of the HLI, from its reference."""

from __future__ import annotations

import functools
import re
from typing import Any

from . import layout
from .units import units_and_writers

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


def cnc_writes(path: str) -> bool:
    """A symbol path leads to a member that the CNC alone writes, or below one."""
    names = NAME.findall(re.sub(r"\[[^]]*\]", "", path))
    names = (
        names[1:] if names and names[0].upper().startswith("HLI_") else names
    )
    structure = ROOTS.get(names[0].upper()) if names else None
    for name in names[1:]:
        if structure is None:
            return False
        fields = {field.upper(): field for field, _ in structure._fields_}
        known = layout.ALIASES.get(name, name)
        member = fields.get(known.rpartition(".")[2].upper())
        if member is None:
            return False
        if writers()[structure.__name__].get(member) == CNC:
            return True
        base, _ = layout.element_type(dict(structure._fields_)[member])
        structure = base if hasattr(base, "_fields_") else None
    return False


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
