"""ST types and their layout in memory: natural alignment up to 8 bytes, little-endian."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .elementary import (
    ALIASES,
    BOOL,
    BYTE,
    DATE,
    DINT,
    DT,
    DWORD,
    ELEMENTARY,
    INT,
    LINT,
    LREAL,
    LTIME,
    LWORD,
    REAL,
    SINT,
    TIME,
    TOD,
    UDINT,
    UINT,
    ULINT,
    USINT,
    WORD,
    Elementary,
    Type,
)

__all__ = [
    "ALIASES",
    "ANY",
    "ANY_NAMES",
    "ANY_TYPE",
    "BOOL",
    "BYTE",
    "DATE",
    "DINT",
    "DT",
    "DWORD",
    "ELEMENTARY",
    "INT",
    "LINT",
    "LREAL",
    "LTIME",
    "LWORD",
    "POINTER_SIZE",
    "REAL",
    "SINT",
    "STRING_LENGTH",
    "TIME",
    "TOD",
    "UDINT",
    "UINT",
    "ULINT",
    "USINT",
    "VOID",
    "WORD",
    "ArrayType",
    "Elementary",
    "EnumType",
    "Member",
    "ObjectType",
    "OpenArray",
    "PointerType",
    "StringType",
    "StructType",
    "Subrange",
    "Type",
    "Void",
    "c_type",
    "plain",
    "same",
]
POINTER_SIZE = 8
STRING_LENGTH = 80
"""Characters of a STRING without a length."""


@dataclass(frozen=True, eq=False)
class StringType(Type):
    """STRING(length) or WSTRING(length), closed by a zero character."""

    length: int
    wide: bool = False

    @property
    def name(self) -> str:  # type: ignore[override]
        return f"{'W' if self.wide else ''}STRING({self.length})"

    @property
    def size(self) -> int:  # type: ignore[override]
        return (self.length + 1) * (2 if self.wide else 1)

    @property
    def align(self) -> int:  # type: ignore[override]
        return 2 if self.wide else 1


@dataclass(frozen=True, eq=False)
class ArrayType(Type):
    """Elements in row-major order; ``dims`` are (low, high)."""

    element: Type
    dims: tuple[tuple[int, int], ...]

    @property
    def name(self) -> str:  # type: ignore[override]
        ranges = ", ".join(f"{low}..{high}" for low, high in self.dims)
        return f"ARRAY [{ranges}] OF {self.element}"

    @property
    def count(self) -> int:
        """Number of elements."""
        n = 1
        for low, high in self.dims:
            n *= high - low + 1
        return n

    @property
    def size(self) -> int:  # type: ignore[override]
        return self.count * self.element.size

    @property
    def align(self) -> int:  # type: ignore[override]
        return self.element.align


@dataclass(frozen=True, eq=False)
class OpenArray(Type):
    """``ARRAY [*] OF element``: an address with its bounds."""

    element: Type
    rank: int
    align: int = POINTER_SIZE

    @property
    def size(self) -> int:  # type: ignore[override]
        return POINTER_SIZE * (1 + 2 * self.rank)

    @property
    def name(self) -> str:  # type: ignore[override]
        return f"ARRAY [{', '.join('*' * self.rank)}] OF {self.element}"


@dataclass(eq=False)
class Member:
    """One member of a structure, instance or area."""

    name: str
    type: Type
    offset: int = 0
    bit: int = -1
    section: str = "VAR"
    access: str = ""


@dataclass(eq=False)
class StructType(Type):
    """Structure or union; ``members`` by name in capitals."""

    name: str
    members: dict[str, Member] = field(default_factory=dict)
    union: bool = False
    pack: int = 8
    size: int = 0
    align: int = 1
    initial: Any = None
    foreign: bool = False
    base: StructType | None = None

    def add(self, member: Member) -> None:
        """Place the next member."""
        align = min(member.type.align, self.pack)
        start = 0 if self.union else -(-self.size // align) * align
        member.offset = start
        self.size = max(self.size, start + member.type.size)
        self.align = max(self.align, align)
        self.members[member.name.upper()] = member

    def close(self) -> None:
        """Pad to the alignment."""
        self.size = max(-(-self.size // self.align) * self.align, 1)


@dataclass(eq=False)
class EnumType(Type):
    """Named numbers."""

    name: str
    base: Elementary
    values: dict[str, int] = field(default_factory=dict)
    qualified: bool = False
    strict: bool = False
    named: bool = False
    """Its text is the name (attribute ``to_string``)."""
    default: int = 0
    spelled: dict[str, str] = field(default_factory=dict)

    @property
    def size(self) -> int:  # type: ignore[override]
        return self.base.size

    @property
    def align(self) -> int:  # type: ignore[override]
        return self.base.size

    @property
    def scalar(self) -> bool:
        return True


@dataclass(frozen=True, eq=False)
class Subrange(Type):
    """``base (low..high)``."""

    base: Elementary
    low: int
    high: int

    @property
    def name(self) -> str:  # type: ignore[override]
        return f"{self.base} ({self.low}..{self.high})"

    @property
    def size(self) -> int:  # type: ignore[override]
        return self.base.size

    @property
    def align(self) -> int:  # type: ignore[override]
        return self.base.size

    @property
    def scalar(self) -> bool:
        return True


@dataclass(frozen=True, eq=False)
class PointerType(Type):
    """``POINTER TO`` or, with ``reference``, ``REFERENCE TO``; None: any target."""

    target: Type | None
    reference: bool = False
    size: int = POINTER_SIZE
    align: int = POINTER_SIZE

    @property
    def name(self) -> str:  # type: ignore[override]
        word = "REFERENCE TO" if self.reference else "POINTER TO"
        return f"{word} {self.target or 'anything'}"

    @property
    def scalar(self) -> bool:
        return True


@dataclass(eq=False)
class ObjectType(Type):
    """A type of a class; types of the same kind and class are the same."""

    cls: Any


class Void(Type):
    """The result of what has none."""

    name = "nothing"
    size, align = 0, 1


VOID = Void()


def plain(type_: Type) -> Type:
    """The elementary type behind a subrange or an enumeration."""
    if isinstance(type_, (Subrange, EnumType)):
        return type_.base
    return type_


def c_type(type_: Type) -> str:
    """The C type of a scalar."""
    base = plain(type_)
    return base.c if isinstance(base, Elementary) else "st_ptr"


def same(left: Type, right: Type) -> bool:  # noqa: PLR0911
    """Whether two types hold the same in the same way."""
    if left is right:
        return True
    if isinstance(left, ArrayType) and isinstance(right, ArrayType):
        return left.dims == right.dims and same(left.element, right.element)
    if isinstance(left, StringType) and isinstance(right, StringType):
        return left.wide == right.wide and left.length == right.length
    if isinstance(left, PointerType) and isinstance(right, PointerType):
        if left.target is None or right.target is None:
            return True
        return same(left.target, right.target)
    if isinstance(left, ObjectType):
        return type(left) is type(right) and left.cls is right.cls
    if isinstance(left, Subrange) and isinstance(right, Subrange):
        return (left.base, left.low, left.high) == (
            right.base,
            right.low,
            right.high,
        )
    return False


def _any(name: str) -> StructType:
    found = StructType(name)
    found.add(Member("pValue", PointerType(BYTE)))
    found.add(Member("diSize", DINT))
    found.add(Member("TypeClass", DINT))
    return found


ANY = _any("ANY")
"""An input of any type, as the routine sees it: where the value is, its size and class."""
ANY_TYPE = _any("AnyType")
"""The same as a variable; an ANY converts to it."""
ANY_NAMES = frozenset(
    f"ANY{name}"
    for name in ("", "_BIT", "_DATE", "_INT", "_NUM", "_REAL", "_STRING")
)
