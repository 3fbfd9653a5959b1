"""Walks over the symbols, for clients that want to see all of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .kinds import Array, Kind, Record
from .place import Place

ELEMENTS_MAX = 32
"""Structures of a longer array are listed as the array alone."""


def parts_of_place(place: Place) -> Iterator[Place]:
    """Members, or structures of an array; nothing below a single value."""
    kind = place.kind
    if isinstance(kind, Record):
        for part in kind.members.values():
            if part.name.startswith("fill_"):
                continue
            path = f"{place.path}.{part.name}"
            at = place.offset + part.offset
            yield Place(path, part.kind, place.space, at, part.bit)
    elif isinstance(kind, Array) and isinstance(kind.element, Record):
        if kind.count > ELEMENTS_MAX or len(kind.dims) > 1:
            return
        low, count = kind.dims[0]
        for k in range(count):
            at = place.offset + k * kind.element.size
            path = f"{place.path}[{low + k}]"
            yield Place(path, kind.element, place.space, at)


def everything(roots: Iterable[Place]) -> Iterator[Place]:
    """The roots, and all below them."""
    for place in roots:
        yield place
        yield from everything(parts_of_place(place))


def leaves(place: Place) -> Iterator[Place]:
    """The single values in a place, those of all arrays too."""
    kind = place.kind
    if isinstance(kind, Array):
        for k in range(kind.count):
            name = f"{place.path}[{index_text(kind, k)}]"
            at = place.offset + k * kind.element.size
            yield from leaves(Place(name, kind.element, place.space, at))
    elif isinstance(kind, Record):
        for part in parts_of_place(place):
            yield from leaves(part)
    else:
        yield place


def index_text(kind: Array, k: int) -> str:
    """The indices of the element that has this number."""
    found = []
    for first, count in reversed(kind.dims):
        k, rest = divmod(k, count)
        found.append(first + rest)
    return ",".join(map(str, reversed(found)))


def kinds_of(roots: Iterable[Place]) -> dict[str, Kind]:
    """The types of places and all that stands in them, by their names."""
    found: dict[str, Kind] = {}
    for place in roots:
        _collect(place.kind, found)
    return found


def _collect(kind: Kind, found: dict[str, Kind]) -> None:
    if kind.name in found:
        return
    if isinstance(kind, Array):
        _collect(kind.element, found)
    elif isinstance(kind, Record):
        for part in kind.members.values():
            _collect(part.kind, found)
    found[kind.name] = kind
