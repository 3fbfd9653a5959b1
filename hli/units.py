"""Units of the members of the HLI, from its reference."""

from __future__ import annotations

import functools

from .reference import MEMBERS


@functools.cache
def units_and_writers() -> dict[str, dict[str, tuple[str, str]]]:
    """Structure -> member -> (unit, writer), as the reference has them."""
    found: dict[str, dict[str, tuple[str, str]]] = {}
    structures: list[str] = []
    within = False
    for line in MEMBERS.splitlines():
        if not line or line.startswith(" "):
            continue
        if "|" not in line:
            # names go on in the next line until the first member comes
            structures = line.split() + ([] if within else structures)
            within = False
            continue
        within = True
        member, unit, writer, _ = (part.strip() for part in line.split("|", 3))
        for structure in structures:
            found.setdefault(structure, {})[member] = unit, writer
    return found


def unit_of(structure: str, member: str) -> str:
    """The unit of a member, empty if it has none."""
    return units_and_writers().get(structure, {}).get(member, ("", ""))[0]
