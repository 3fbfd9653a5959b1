"""Units of the members of the HLI, from its reference."""

from __future__ import annotations

import functools

from .reference import MEMBERS

Said = dict[str, dict[str, tuple[str, str, str]]]


@functools.cache
def members_told() -> Said:
    """Structure -> member -> (unit, writer, meaning), as the reference has them."""
    found: Said = {}
    structures: list[str] = []
    member = ""
    for line in MEMBERS.splitlines():
        if line.startswith(" ") and member:
            for structure in structures:
                unit, writer, said = found[structure][member]
                said += " " + line.strip()
                found[structure][member] = unit, writer, said
        elif line and not line.startswith(" ") and "|" not in line:
            # names go on in the next line until the first member comes
            structures = line.split() + ([] if member else structures)
            member = ""
        elif "|" in line:
            member, *told = (part.strip() for part in line.split("|", 3))
            for structure in structures:
                unit, writer, said = told
                found.setdefault(structure, {})[member] = unit, writer, said
    return found


def units_and_writers() -> dict[str, dict[str, tuple[str, str]]]:
    """Structure -> member -> (unit, writer)."""
    return {
        structure: {
            member: (unit, writer)
            for member, (unit, writer, _) in members.items()
        }
        for structure, members in members_told().items()
    }


def unit_of(structure: str, member: str) -> str:
    """The unit of a member, empty if it has none."""
    return members_told().get(structure, {}).get(member, ("", "", ""))[0]
