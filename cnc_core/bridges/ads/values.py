"""Values by name, handle, index group and offset; reading and writing them."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass

from hli.symbol import SymbolError

from ...observing.plc import RefusedError
from ..symbols import constants
from ..symbols.cell import GoneError, OwnedError, ServedCell
from ..symbols.kinds import Number, Text
from ..symbols.listing import everything
from ..symbols.ownership import writable
from ..symbols.place import HLI_SPACE, Place
from ..symbols.ranges import inside, singles
from .codes import AdsError, Code, Group

HANDLES_MAX = 16_384
UINT = struct.Struct("<I")


@dataclass(frozen=True)
class Span:
    """Bytes of a symbol; ``begin`` counts from the symbol's first byte."""

    place: Place
    begin: int
    length: int


@dataclass
class Handle:
    """A symbol that a client named, and where it stands in this edition."""

    path: str
    place: Place
    edition: int


class Values:
    """The symbols of a cell for one client."""

    def __init__(self, cell: ServedCell) -> None:
        self.cell = cell
        self._handles: dict[int, Handle] = {}
        self._last = 0

    # -- places
    def by_name(self, name: bytes) -> Place:
        """AdsError: there is no such symbol."""
        path = name.partition(b"\0")[0].decode("cp1252", "replace")
        return self._find(path)

    def _find(self, path: str) -> Place:
        if not self.cell.there:
            raise AdsError(Code.NOT_READY, self.cell.observer.problem)
        try:
            return self.cell.find(path)
        except SymbolError as error:
            raise AdsError(Code.SYMBOL_NOT_FOUND, str(error)) from None

    def new_handle(self, name: bytes) -> int:
        """A handle for a symbol.  AdsError."""
        if len(self._handles) >= HANDLES_MAX:
            raise AdsError(Code.NO_MORE_HANDLES)
        place = self.by_name(name)
        self._last = self._last % 0xFFFF_FFF0 + 1
        found = Handle(place.path, place, self.cell.edition)
        self._handles[self._last] = found
        return self._last

    def release(self, number: int) -> None:
        """AdsError: there is no such handle."""
        if self._handles.pop(number, None) is None:
            raise AdsError(Code.SYMBOL_NOT_FOUND, f"handle {number}")

    def _by_handle(self, number: int) -> Place:
        handle = self._handles.get(number)
        if handle is None:
            raise AdsError(Code.SYMBOL_NOT_FOUND, f"handle {number}")
        if handle.edition != self.cell.edition:  # CNC or PLC came or went
            handle.place = self._find(handle.path)
            handle.edition = self.cell.edition
        return handle.place

    def span(self, group: int, offset: int, length: int) -> Span:
        """What a client means.  AdsError."""
        if group == Group.VALUE_BY_HANDLE:
            place = self._by_handle(offset)
            return Span(place, 0, min(length, place.size))
        if group == Group.HLI:
            return self._in(self.cell.hli.roots(), offset, length)
        if group == Group.CONSTANTS:
            return self._in(constants.roots(), offset, length)
        spaces = self.cell.plc.spaces
        if Group.PLC <= group < Group.PLC + len(spaces):
            return self._in([spaces[group - Group.PLC]], offset, length)
        if Group.PLC_BITS <= group < Group.PLC_BITS + len(spaces):
            return self._bit(spaces[group - Group.PLC_BITS], offset)
        raise AdsError(Code.INVALID_GROUP, f"{group:#x}")

    def _in(self, roots: Iterable[Place], offset: int, length: int) -> Span:
        if not self.cell.there:
            raise AdsError(Code.NOT_READY, self.cell.observer.problem)
        place = inside(roots, offset, length)
        if place is None:
            raise AdsError(Code.INVALID_OFFSET, f"{offset} .. +{length}")
        return Span(place, offset - place.offset, length)

    def _bit(self, root: Place, offset: int) -> Span:
        at, bit = divmod(offset, 8)
        for part in everything([root]):
            if part.bit == bit and part.offset == at:
                return Span(part, 0, 1)
        raise AdsError(Code.INVALID_OFFSET, f"bit {offset}")

    # -- bytes
    def read_now(self, span: Span) -> bytes | None:
        """The bytes; None: the PLC has to be asked.  AdsError."""
        place = span.place
        if place.of_plc:
            return None
        try:
            return self.cell.read_part(place, span.begin, span.length)
        except GoneError as error:
            raise AdsError(Code.NOT_READY, str(error)) from None

    def read_bytes(self, offset: int, length: int) -> bytes:
        """Bytes of the segment.  AdsError."""
        try:
            return self.cell.read_hli(offset, length)
        except GoneError as error:
            raise AdsError(Code.NOT_READY, str(error)) from None
        except SymbolError as error:
            raise AdsError(Code.INVALID_OFFSET, str(error)) from None

    async def read(self, spans: list[Span]) -> list[bytes]:
        """The bytes of symbols of HLI and PLC.  AdsError."""
        try:
            found = await self.cell.read([span.place for span in spans])
        except GoneError as error:
            raise AdsError(Code.NOT_READY, str(error)) from None
        except RefusedError as error:
            raise AdsError(Code.INVALID_STATE, str(error)) from None
        return [
            data[span.begin : span.begin + span.length]
            for data, span in zip(found, spans, strict=True)
        ]

    async def write(self, group: int, offset: int, data: bytes) -> None:
        """Set what a client means.  AdsError."""
        span = self.span(group, offset, len(data))
        if span.length < len(data) or not data:
            raise AdsError(Code.INVALID_SIZE, span.place.path)
        try:
            await self._write(span, data)
        except OwnedError as error:
            raise AdsError(Code.INVALID_ACCESS, str(error)) from None
        except GoneError as error:
            raise AdsError(Code.NOT_READY, str(error)) from None
        except RefusedError as error:
            raise AdsError(Code.INVALID_DATA, str(error)) from None

    async def _write(self, span: Span, data: bytes) -> None:
        place = span.place
        if span.begin == 0 and span.length == place.size:
            await self.cell.write(place, data)
            return
        if isinstance(place.kind, Text) and span.begin == 0:
            await self.cell.write(place, data.ljust(place.size, b"\0"))
            return
        if isinstance(place.kind, Number) and span.begin == 0:
            # as a controller does it: the low bytes, the others stay
            (whole,) = await self.cell.read([place])
            await self.cell.write(place, data + whole[len(data) :])
            return
        parts = singles(place, place.offset + span.begin, span.length)
        if parts is None:
            raise AdsError(Code.INVALID_SIZE, place.path)
        if place.space == HLI_SPACE:
            await self._write_parts(span, parts, data)
            return
        (whole,) = await self.cell.read([place])
        end = span.begin + len(data)
        data = whole[: span.begin] + data + whole[end:]
        await self.cell.write(place, data)

    async def _write_parts(
        self, span: Span, parts: list[Place], data: bytes
    ) -> None:
        begin = span.place.offset + span.begin
        own = [part for part in parts if writable(part)]
        if not own:
            raise OwnedError(f"the CNC owns {span.place.path}")
        for part in own:
            at = part.offset - begin
            value = data[at : at + part.size].ljust(part.size, b"\0")
            await self.cell.write(part, value)
