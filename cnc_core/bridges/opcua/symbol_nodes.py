"""The symbols of HLI and PLC as nodes, by their paths."""

from __future__ import annotations

from collections.abc import Iterator

from asyncua import ua

from ..symbols.cell import ServedCell
from ..symbols.kinds import Array, Record
from ..symbols.listing import ELEMENTS_MAX
from ..symbols.ownership import writable
from ..symbols.place import Place
from .entries import SymbolEntry, single, variant_type
from .space import Space, std

URI = "urn:hli-cosim:symbols"
SYMBOLS = "Symbols"
NODES_MAX = 50_000


class SymbolNodes:
    """A tree of nodes that follows the symbols of a cell."""

    def __init__(self, space: Space, cell: ServedCell, namespace: int) -> None:
        self._space, self._cell, self._ns = space, cell, namespace
        self._edition = -1
        self._nodes: dict[str, ua.NodeId] = {}
        self._kinds: dict[str, object] = {}

    def node(self, path: str) -> ua.NodeId:
        """The node of a symbol, in its canonical spelling."""
        return ua.NodeId(path, self._ns)

    def add_folder(self) -> None:
        """The folder of all symbols."""
        parent = std(ua.ObjectIds.ObjectsFolder)
        name = ua.QualifiedName(SYMBOLS, self._ns)
        self._space.folder(self.node(SYMBOLS), name, parent)

    def follow(self) -> None:
        """Add what is new and take away what is gone, if anything changed."""
        if self._edition == self._cell.edition:
            return
        self._edition = self._cell.edition
        wanted = dict(self._wanted())
        for path in [*self._nodes]:
            found = wanted.get(path)
            if found is None or self._shape(found[1]) != self._kinds[path]:
                self._space.delete([self._nodes.pop(path)])
                del self._kinds[path]
        for path, (parent, place) in wanted.items():
            known = self._nodes.get(path)
            if known is None:
                self._add(path, parent, place)
            elif known in self._space.entries:
                self._space.entries[known] = SymbolEntry(place)

    @staticmethod
    def _shape(place: Place) -> object:
        kind = place.kind
        return (kind.name, writable(place)) if single(kind) else "object"

    def _wanted(self) -> Iterator[tuple[str, tuple[str, Place]]]:
        """Path -> path of the parent, and the symbol."""
        count = 0
        waiting = [(SYMBOLS, place) for place in self._cell.roots()]
        while waiting and count < NODES_MAX:
            parent, place = waiting.pop()
            count += 1
            yield place.path, (parent, place)
            if not single(place.kind):
                waiting += [(place.path, p) for p in _parts(place)]

    def _add(self, path: str, parent: str, place: Place) -> None:
        name = ua.QualifiedName(_last(path, parent), self._ns)
        node, above = self.node(path), self.node(parent)
        if single(place.kind):
            self._space.variable(
                node,
                name,
                above,
                SymbolEntry(place),
                std(variant_type(place.kind).value),
                array=isinstance(place.kind, Array),
                writable=writable(place),
            )
        else:
            self._space.object(node, name, above)
        self._nodes[path] = node
        self._kinds[path] = self._shape(place)


def _parts(place: Place) -> list[Place]:
    """Members, or elements of an array that is not too long."""
    kind = place.kind
    if isinstance(kind, Record):
        return [
            Place(
                f"{place.path}.{part.name}",
                part.kind,
                place.space,
                place.offset + part.offset,
                part.bit,
            )
            for part in kind.members.values()
            if not part.name.startswith("fill_")
        ]
    if not isinstance(kind, Array) or len(kind.dims) > 1:
        return []
    low, count = kind.dims[0]
    if count > ELEMENTS_MAX:
        return []
    size = kind.element.size
    return [
        Place(
            f"{place.path}[{low + k}]",
            kind.element,
            place.space,
            place.offset + k * size,
        )
        for k in range(count)
    ]


def _last(path: str, parent: str) -> str:
    """The name below its parent."""
    return path.removeprefix(parent).lstrip(".") or path
