"""The symbols of a running PLC, for programs that are to know all of them.

Three orders of other processes (``hli.orders``): ``symbols`` tells
names and types, ``fetch`` gives values and arrays, ``assign`` sets values
once, without forcing them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from hli.symbol import Symbol, SymbolError
from hli.view import ArrayView, Pointers, View, ViewArray

TEXT_LENGTH = 255
"""Characters that a text of a task's class has room for."""
LEVELS_MAX = 4
_NUMPY = {
    "b1": "BOOL",
    "i1": "SINT",
    "u1": "USINT",
    "i2": "INT",
    "u2": "UINT",
    "i4": "DINT",
    "u4": "UDINT",
    "i8": "LINT",
    "u8": "ULINT",
    "f4": "REAL",
    "f8": "LREAL",
}
_WHOLES = (View, ViewArray, ArrayView, Pointers)
_SIMPLE = (bool, int, float, str)
# of numpy's numbers, float64 alone is a float
_SINGLE: list[tuple[Any, list[Any], int]] = [
    ((bool, np.bool_), ["e", "BOOL"], 1),
    (int, ["e", "LINT"], 8),
    (float, ["e", "LREAL"], 8),
    (str, ["s", TEXT_LENGTH, False, "utf-8"], TEXT_LENGTH + 1),
]


@runtime_checkable
class HasListing(Protocol):
    """A task that knows the types of its symbols: a program of ST."""

    def st_listing(self) -> dict[str, Any]:
        """``types``: rows; ``roots``: pairs of a name and a row's number."""


class _Rows:
    """Types by number, as a description of Structured Text has them."""

    def __init__(self) -> None:
        self.rows: list[list[Any]] = []

    def add(self, row: list[Any]) -> int:
        self.rows.append(row)
        return len(self.rows) - 1

    def extend(self, rows: list[list[Any]]) -> int:
        """The rows of another description; what their numbers grow by."""
        base = len(self.rows)
        for row in rows:
            self.rows.append(_moved(row, base))
        return base

    def of(self, value: Any, level: int = 0) -> tuple[int, int] | None:
        """Number and size of the type of a value; None: it has none."""
        for kinds, row, size in _SINGLE:
            if isinstance(value, kinds):
                return self.add([*row]), size
        if isinstance(value, np.generic):
            return self._numpy(value.dtype)
        if isinstance(value, (np.ndarray, list, tuple)):
            return self._array(value)
        return self._object(value, level)

    def _numpy(self, dtype: Any) -> tuple[int, int] | None:
        name = _NUMPY.get(dtype.str[1:])
        return (self.add(["e", name]), dtype.itemsize) if name else None

    def _array(self, value: Any) -> tuple[int, int] | None:
        """Arrays of numpy, and lists of one kind of number."""
        if not isinstance(value, np.ndarray):
            if not value or not all(
                isinstance(item, (bool, int, float)) for item in value
            ):
                return None
            try:
                value = np.asarray(value)
            except (ValueError, OverflowError):
                return None
        element = self._numpy(value.dtype)
        if element is None or not value.size or not value.ndim:
            return None
        dims = [[0, n - 1] for n in value.shape]
        return self.add(["a", element[0], dims]), element[1] * value.size

    def _object(self, value: Any, level: int) -> tuple[int, int] | None:
        """What a class of the program holds; nothing of libraries' classes."""
        if level >= LEVELS_MAX or isinstance(value, _WHOLES):
            return None
        members: dict[str, list[int]] = {}
        at = 0
        for name in _names(value):
            found = self.of(getattr(value, name, None), level + 1)
            if found is not None:
                members[name] = [found[0], at, -1]
                at += -(-found[1] // 8) * 8
        if not members and level:
            return None
        return self.add(["t", type(value).__name__, at, members]), at


def _names(value: Any) -> list[str]:
    """Variables of an object; those with an underscore are its own matter."""
    found = [*getattr(value, "__dict__", {})]
    for base in type(value).__mro__:
        slots = vars(base).get("__slots__", ())
        found += [slots] if isinstance(slots, str) else slots
    return [name for name in dict.fromkeys(found) if not name.startswith("_")]


def _moved(row: list[Any], base: int) -> list[Any]:
    if row[0] == "a":
        return ["a", row[1] + base, row[2]]
    if row[0] == "t":
        members = {n: [m[0] + base, *m[1:]] for n, m in row[3].items()}
        return ["t", row[1], row[2], members]
    return row


def described(programs: Sequence[Any]) -> dict[str, Any]:
    """Types and roots of all tasks (``programs``: with name and instance)."""
    rows = _Rows()
    roots: dict[str, list[Any]] = {}
    for program in programs:
        instance = program.instance
        if isinstance(instance, HasListing):
            told = instance.st_listing()
            base = rows.extend(told["types"])
            for name, number in told["roots"]:
                roots.setdefault(name, [name, number + base])
            continue
        found = rows.of(instance)
        if found is not None:
            name = program.name.rpartition(".")[2]
            roots[name] = [name, found[0]]
    return {"types": rows.rows, "roots": [*roots.values()]}


def plain(path: str, value: Any) -> Any:
    """A value, or an array as a flat list.  SymbolError: a structure."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if value is None or isinstance(value, _SIMPLE):
        return value
    if isinstance(value, (View, ViewArray, Pointers)):
        raise SymbolError(f"symbol {path!r}: name a member")
    if hasattr(type(value), "__len__") and hasattr(type(value), "__iter__"):
        return [plain(path, item) for item in value]
    raise SymbolError(f"symbol {path!r}: name a member")


def assign(symbol: Symbol, value: Any) -> None:
    """Set a value, or all elements of an array."""
    if not isinstance(value, list):
        symbol.value = value
        return
    now = symbol.value
    if isinstance(now, np.ndarray):
        now[...] = np.reshape(value, now.shape)
    elif isinstance(now, list):
        now[:] = value
    elif isinstance(now, ArrayView):
        for k, item in enumerate(value):
            now[k] = item
    else:
        symbol.value = value
