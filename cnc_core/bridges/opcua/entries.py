"""Variables of the address space, and where their values come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from asyncua import ua

from ..symbols.cell import GoneError, ServedCell
from ..symbols.kinds import Array, Kind, Number, Text, decode, encode
from ..symbols.place import Place

VARIANTS = {
    "BOOL": ua.VariantType.Boolean,
    "BIT": ua.VariantType.Boolean,
    "SINT": ua.VariantType.SByte,
    "USINT": ua.VariantType.Byte,
    "BYTE": ua.VariantType.Byte,
    "INT": ua.VariantType.Int16,
    "UINT": ua.VariantType.UInt16,
    "WORD": ua.VariantType.UInt16,
    "DINT": ua.VariantType.Int32,
    "UDINT": ua.VariantType.UInt32,
    "DWORD": ua.VariantType.UInt32,
    "TIME": ua.VariantType.UInt32,
    "DATE": ua.VariantType.UInt32,
    "TIME_OF_DAY": ua.VariantType.UInt32,
    "DATE_AND_TIME": ua.VariantType.UInt32,
    "LINT": ua.VariantType.Int64,
    "ULINT": ua.VariantType.UInt64,
    "LWORD": ua.VariantType.UInt64,
    "LTIME": ua.VariantType.UInt64,
    "LDATE": ua.VariantType.UInt64,
    "LTIME_OF_DAY": ua.VariantType.UInt64,
    "LDATE_AND_TIME": ua.VariantType.UInt64,
    "REAL": ua.VariantType.Float,
    "LREAL": ua.VariantType.Double,
}


def single(kind: Kind) -> bool:
    """One value, or an array of such: a variable, not an object."""
    element = kind.element if isinstance(kind, Array) else kind
    return isinstance(element, (Number, Text))


def variant_type(kind: Kind) -> ua.VariantType:
    """The type of a variable's value, or of its elements."""
    element = kind.element if isinstance(kind, Array) else kind
    if isinstance(element, Number):
        return VARIANTS[element.name]
    return ua.VariantType.String


def now() -> datetime:
    """The time stamp of a value."""
    return datetime.now(UTC)


def bad(code: int) -> ua.DataValue:
    """No value, and why."""
    stamp = now()
    return ua.DataValue(
        Value=ua.Variant(None, ua.VariantType.Null),
        StatusCode=ua.StatusCode(code),
        SourceTimestamp=stamp,
        ServerTimestamp=stamp,
    )


class Fresh(ua.DataValue):  # type: ignore[misc]
    """A value that nobody changes any longer, so copies of it are itself.

    asyncua copies what it tells subscriptions, which took half of the time.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> Fresh:
        return self


def good(variant: ua.Variant) -> ua.DataValue:
    """A value of now."""
    stamp = now()
    return Fresh(Value=variant, SourceTimestamp=stamp, ServerTimestamp=stamp)


@dataclass
class SymbolEntry:
    """A variable that shows a symbol."""

    place: Place
    asked: bytes | None = None  # what the PLC said of its symbol

    def sample(self, cell: ServedCell) -> bytes | None:
        """The bytes now; None: there are none."""
        if self.place.of_plc:
            return self.asked
        try:
            return cell.read_now(self.place)
        except GoneError:
            return None

    def value(self, data: bytes | None) -> ua.DataValue:
        """The bytes as a value."""
        if data is None:
            return bad(ua.StatusCodes.BadNoCommunication)
        kind = self.place.kind
        return good(ua.Variant(decode(kind, data), variant_type(kind)))

    def bytes_of(self, variant: ua.Variant) -> bytes | None:
        """What a client wrote; None: of another type or length."""
        kind = self.place.kind
        value = variant.Value
        if variant.VariantType != variant_type(kind):
            return None
        if isinstance(kind, Array) != isinstance(value, list):
            return None
        if isinstance(kind, Array) and len(value) != kind.count:
            return None
        if isinstance(kind, Text) and len(value or "") > kind.length:
            return None
        return encode(kind, value)


@dataclass
class ModelEntry:
    """A variable of the model for CNC systems."""

    get: Callable[[Any], Any]
    make: Callable[[Any], ua.Variant]

    def sample(self, cell: ServedCell) -> Any:
        """The plain value now; None: the CNC is not there."""
        areas = cell.observer.areas
        if areas is None:
            return None
        try:
            return self.get(areas.segment.root)
        except IndexError:  # a CNC with fewer axes came back
            return None

    def value(self, plain: Any) -> ua.DataValue:
        """The plain value as a value."""
        if plain is None:
            return bad(ua.StatusCodes.BadNoCommunication)
        return good(self.make(plain))


Entry = SymbolEntry | ModelEntry
