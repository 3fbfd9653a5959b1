"""Units of the members of the HLI, from its reference."""

from __future__ import annotations

import functools

from .reference import MEMBERS


@functools.cache
def units() -> dict[str, dict[str, str]]:
    """Structure -> member -> unit; members without a unit are left out."""
    found: dict[str, dict[str, str]] = {}
    structures: list[str] = []
    for line in MEMBERS.splitlines():
        if not line or line.startswith(" "):
            continue
        if "|" not in line:
            structures = line.replace(",", " ").split()
            continue
        member, unit, _ = (part.strip() for part in line.split("|", 2))
        for structure in structures:
            if unit:
                found.setdefault(structure, {})[member] = unit
    return found


def unit_of(structure: str, member: str) -> str:
    """The unit of a member, empty if it has none."""
    return units().get(structure, {}).get(member, "")
