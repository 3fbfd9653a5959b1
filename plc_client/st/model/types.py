"""ST types and their layout in memory: natural alignment up to 8 bytes, little-endian."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

POINTER_SIZE = 8
STRING_LENGTH = 80
"""Characters of a STRING without a length."""


class Type:
    """Base of all types: ``size`` and ``align`` in bytes, ``name`` as ST writes it."""

    if TYPE_CHECKING:
        size: int
        align: int
        name: str

    def __str__(self) -> str:
        return self.name

    @property
    def scalar(self) -> bool:
        """Whether a C variable holds it; all else is handled by address."""
        return False


@dataclass(frozen=True, eq=False)
class Elementary(Type):
    """Numbers, bit strings, times and dates.

    ``family``: bool, bit, int, real, time (durations), date.  ``unit_ns``
    is what one counts of times and dates.
    """

    name: str
    family: str
    bits: int
    signed: bool = False
    unit_ns: int = 0

    @property
    def size(self) -> int:  # type: ignore[override]
        return max(self.bits // 8, 1)

    @property
    def align(self) -> int:  # type: ignore[override]
        return self.size

    @property
    def scalar(self) -> bool:
        return True

    @property
    def c(self) -> str:
        """Name of the C type in the run time's header."""
        if self.family == "real":
            return f"st_f{self.bits}"
        if self.family == "bool":
            return "st_bool"
        return f"st_{'i' if self.signed else 'u'}{self.bits}"

    @property
    def whole(self) -> bool:
        """Integers and bit strings, BOOL left out."""
        return self.family in ("int", "bit")

    @property
    def low(self) -> int:
        """Smallest value of an integer type."""
        return -(1 << (self.bits - 1)) if self.signed else 0

    @property
    def high(self) -> int:
        """Largest value of an integer type."""
        return (1 << (self.bits - self.signed)) - 1

    def wrap(self, value: int) -> int:
        """The value modulo 2**bits."""
        value &= (1 << self.bits) - 1
        negative = self.signed and value >> (self.bits - 1)
        return value - (1 << self.bits) if negative else value


def _elementary() -> dict[str, Elementary]:
    rows = [
        ("BOOL", "bool", 8, False, 0),
        ("BIT", "bool", 8, False, 0),
        ("BYTE", "bit", 8, False, 0),
        ("WORD", "bit", 16, False, 0),
        ("DWORD", "bit", 32, False, 0),
        ("LWORD", "bit", 64, False, 0),
        ("SINT", "int", 8, True, 0),
        ("INT", "int", 16, True, 0),
        ("DINT", "int", 32, True, 0),
        ("LINT", "int", 64, True, 0),
        ("USINT", "int", 8, False, 0),
        ("UINT", "int", 16, False, 0),
        ("UDINT", "int", 32, False, 0),
        ("ULINT", "int", 64, False, 0),
        ("REAL", "real", 32, True, 0),
        ("LREAL", "real", 64, True, 0),
        ("TIME", "time", 32, False, 1_000_000),
        ("LTIME", "time", 64, False, 1),
        ("DATE", "date", 32, False, 1_000_000_000),
        ("TIME_OF_DAY", "date", 32, False, 1_000_000),
        ("DATE_AND_TIME", "date", 32, False, 1_000_000_000),
        ("LDATE", "date", 64, False, 1),
        ("LTIME_OF_DAY", "date", 64, False, 1),
        ("LDATE_AND_TIME", "date", 64, False, 1),
    ]
    return {row[0]: Elementary(*row) for row in rows}


ELEMENTARY = _elementary()
ALIASES = {
    "TOD": "TIME_OF_DAY",
    "DT": "DATE_AND_TIME",
    "LTOD": "LTIME_OF_DAY",
    "LDT": "LDATE_AND_TIME",
    "UXINT": "ULINT",
    "XINT": "LINT",
    "XWORD": "LWORD",
    "PVOID": "LWORD",
    "__UXINT": "ULINT",
    "__XINT": "LINT",
    "__XWORD": "LWORD",
}
ELEMENTARY |= {alias: ELEMENTARY[name] for alias, name in ALIASES.items()}
BOOL, BYTE, WORD = ELEMENTARY["BOOL"], ELEMENTARY["BYTE"], ELEMENTARY["WORD"]
DWORD, LWORD = ELEMENTARY["DWORD"], ELEMENTARY["LWORD"]
SINT, INT, DINT, LINT = (ELEMENTARY[n] for n in ("SINT", "INT", "DINT", "LINT"))
USINT, UINT, UDINT, ULINT = (
    ELEMENTARY[n] for n in ("USINT", "UINT", "UDINT", "ULINT")
)
REAL, LREAL = ELEMENTARY["REAL"], ELEMENTARY["LREAL"]
TIME, LTIME = ELEMENTARY["TIME"], ELEMENTARY["LTIME"]
DATE, TOD, DT = ELEMENTARY["DATE"], ELEMENTARY["TOD"], ELEMENTARY["DT"]


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
