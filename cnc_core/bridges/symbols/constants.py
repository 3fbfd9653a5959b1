"""``HLI_Global_Constants``: highest indices and the like, as PLC programs have
them.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from hli import export

from .kinds import Number
from .place import CONSTANT_SPACE, Place, walk

UDINT = Number("UDINT")
NUMBERS = export.st_constants()
VALUES = struct.pack(f"<{len(NUMBERS)}I", *NUMBERS.values())
_PLACES = {
    name.upper(): Place(
        f"{export.GVL_CONSTANTS}.{name}", UDINT, CONSTANT_SPACE, 4 * k
    )
    for k, name in enumerate(NUMBERS)
}


def named(parts: list[str]) -> bool:
    """The path names a constant; the list in front may be left out."""
    listed = parts[0].upper() == export.GVL_CONSTANTS.upper()
    return parts[1 if listed and len(parts) > 1 else 0].upper() in _PLACES


def find(parts: list[str], path: str) -> Place:
    """The constant of a path that names one.  SymbolError: it has no parts."""
    at = 0 if parts[0].upper() in _PLACES else 1
    return walk(_PLACES[parts[at].upper()], parts[at + 1 :], path)


def roots() -> Iterator[Place]:
    """All of them."""
    yield from _PLACES.values()
