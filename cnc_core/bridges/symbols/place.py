"""Where a symbol stands, and the way to it from its path."""

from __future__ import annotations

from dataclasses import dataclass

from hli import layout
from hli.symbol import SymbolError, tokens

from .kinds import Array, Kind, Record

HLI_SPACE = -1
"""The space of the HLI; the symbols of the PLC have numbers from 0."""
CONSTANT_SPACE = -2
"""The space of ``HLI_Global_Constants``."""


@dataclass(frozen=True)
class Place:
    """A symbol: path in its canonical spelling, type, bytes in its space."""

    path: str
    kind: Kind
    space: int
    offset: int
    bit: int = -1

    @property
    def size(self) -> int:
        return self.kind.size

    @property
    def of_plc(self) -> bool:
        """A variable of the PLC's programs: its process has the value."""
        return self.space >= 0


def index_numbers(path: str, token: str) -> list[int]:
    """The numbers of ``[3]``, ``[1,2]`` or ``[HLI_SYS_CH_MAXIDX]``."""
    found = []
    for part in token[1:-1].split(","):
        text = part.strip().rpartition(".")[2]
        try:
            found.append(int(text))
        except ValueError:
            number = _CONSTANTS.get(text.upper())
            if number is None:
                raise SymbolError(
                    f"symbol {path!r}: index {token} is no number"
                ) from None
            found.append(number)
    return found


_CONSTANTS = {name.upper(): n for name, n in layout.CONSTANTS.items()}


def walk(place: Place, parts: list[str], path: str) -> Place:
    """Down from a place by names and indices.  SymbolError: it ends."""
    waiting: list[int] = []  # indices of an array of several dimensions
    for part in parts:
        if part.startswith("["):
            waiting += index_numbers(path, part)
            place, waiting = _element(place, waiting, path)
        else:
            if waiting:
                raise SymbolError(f"symbol {path!r}: indices are missing")
            place = _member(place, part, path)
    if waiting:
        raise SymbolError(f"symbol {path!r}: indices are missing")
    return place


def _element(
    place: Place, indices: list[int], path: str
) -> tuple[Place, list[int]]:
    kind = place.kind
    if not isinstance(kind, Array):
        raise SymbolError(f"symbol {path!r}: {place.path} is no array")
    dims = len(kind.dims)
    if len(indices) < dims:
        return place, indices
    at = 0
    for index, (low, count) in zip(indices, kind.dims, strict=False):
        if not low <= index < low + count:
            raise SymbolError(
                f"symbol {path!r}: the index of {place.path} runs"
                f" {low}..{low + count - 1}"
            )
        at = at * count + index - low
    text = ",".join(map(str, indices[:dims]))
    found = Place(
        f"{place.path}[{text}]",
        kind.element,
        place.space,
        place.offset + at * kind.element.size,
    )
    rest = indices[dims:]
    return _element(found, rest, path) if rest else (found, [])


def _member(place: Place, name: str, path: str) -> Place:
    kind = place.kind
    part = kind.member(name) if isinstance(kind, Record) else None
    if part is None:
        raise SymbolError(f"symbol {path!r}: {place.path} has no {name}")
    return Place(
        f"{place.path}.{part.name}",
        part.kind,
        place.space,
        place.offset + part.offset,
        part.bit,
    )


def parts_of(path: str) -> list[str]:
    """Names and indices of a path.  SymbolError: it is none."""
    if len(path) > 1000:
        raise SymbolError("a symbol's path has at most 1000 characters")
    return tokens(path)
