"""From bytes back to symbols, for clients that name bytes."""

from __future__ import annotations

from collections.abc import Iterable

from .kinds import Array, Record, Text
from .listing import index_text, leaves
from .place import Place


def inside(roots: Iterable[Place], offset: int, length: int) -> Place | None:
    """The smallest symbol that holds these bytes; None: none does."""
    for root in roots:
        if _holds(root, offset, length):
            return _smallest(root, offset, length)
    return None


def _holds(place: Place, offset: int, length: int) -> bool:
    end = place.offset + place.size
    return place.offset <= offset and offset + length <= end


def _smallest(place: Place, offset: int, length: int) -> Place:
    while True:
        part = _part(place, offset)
        if part is None or not _holds(part, offset, length):
            return place
        place = part


def _part(place: Place, offset: int) -> Place | None:
    """The member or element that holds a byte."""
    kind = place.kind
    if isinstance(kind, Array):
        size = kind.element.size
        text = index_text(kind, (offset - place.offset) // size)
        begin = offset - (offset - place.offset) % size
        return Place(f"{place.path}[{text}]", kind.element, place.space, begin)
    if isinstance(kind, Record):
        for part in kind.members.values():
            begin = place.offset + part.offset
            if begin <= offset < begin + part.kind.size:
                path = f"{place.path}.{part.name}"
                return Place(path, part.kind, place.space, begin, part.bit)
    return None


def singles(place: Place, offset: int, length: int) -> list[Place] | None:
    """The single values in these bytes of a symbol; None: one is cut.

    A text may end early.
    """
    end = offset + length
    found = []
    for leaf in leaves(place):
        last = leaf.offset + leaf.size
        if last <= offset or leaf.offset >= end:
            continue
        cut = leaf.offset < offset or last > end
        if cut and not (isinstance(leaf.kind, Text) and leaf.offset >= offset):
            return None
        found.append(leaf)
    return found
