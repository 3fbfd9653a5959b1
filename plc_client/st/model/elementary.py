"""Elementary types: numbers, bit strings, times and dates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING


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
