"""What clients upload: all symbols, all types; made once for each edition."""

from __future__ import annotations

import struct

from ..symbols.cell import ServedCell
from ..symbols.kinds import Kind
from ..symbols.listing import everything, kinds_of
from .codes import AdsError, Code
from .entries import symbol_entry, type_entry


class Uploads:
    """Symbols and types of a cell, as blocks of bytes."""

    def __init__(self, cell: ServedCell) -> None:
        self._cell = cell
        self._edition = -1
        self._kinds: dict[str, Kind] = {}
        self._counts = 0, 0
        self.symbols = b""
        self.types = b""

    def refresh(self) -> None:
        """Make them anew if a CNC or PLC came or went."""
        cell = self._cell
        if self._edition == cell.edition:
            return
        symbols = [symbol_entry(p) for p in everything(cell.roots())]
        kinds = kinds_of(cell.roots())
        types = [type_entry(kind) for kind in kinds.values()]
        self._kinds = {name.upper(): kind for name, kind in kinds.items()}
        self._counts = len(symbols), len(types)
        self.symbols, self.types = b"".join(symbols), b"".join(types)
        self._edition = cell.edition

    def info(self, length: int) -> bytes:
        """Counts and sizes: 8 bytes, or 24."""
        self.refresh()
        symbols, types = self._counts
        found = struct.pack(
            "<IIIIII",
            symbols,
            len(self.symbols),
            types,
            len(self.types),
            0,
            0,
        )
        return found[:length]

    def type_of(self, name: str) -> bytes:
        """The entry of a type.  AdsError."""
        self.refresh()
        kind = self._kinds.get(name.strip().upper().replace(" ", " "))
        if kind is None:
            raise AdsError(Code.SYMBOL_NOT_FOUND, name)
        return type_entry(kind)
