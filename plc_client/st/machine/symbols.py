"""Variables of a running program by their TwinCAT paths, in its own memory."""

from __future__ import annotations

import ctypes
import difflib
import struct
from collections.abc import Iterator
from typing import Any

from hli.symbol import SymbolError

from ..model.elementary import ELEMENTARY, Elementary

_FORMATS = {
    ("bool", 8, False): "B",
    ("real", 32, True): "f",
    ("real", 64, True): "d",
}
_WHOLE = {8: "b", 16: "h", 32: "i", 64: "q"}


def _format(type_: Elementary) -> str:
    found = _FORMATS.get((type_.family, type_.bits, type_.signed))
    if found is None:
        found = _WHOLE[type_.bits]
        found = found if type_.signed else found.upper()
    return f"<{found}"


class Memory:
    """The program's bytes and its types."""

    def __init__(
        self, address: int, size: int, rows: list[Any], statics: Any = None
    ) -> None:
        self.bytes: Any = (ctypes.c_char * max(size, 1)).from_address(address)
        self.rows = rows
        self.statics: dict[str, Any] = statics or {}

    def view(self, number: int, at: int, bit: int = -1, path: str = "") -> Any:
        """The value at an offset: a number, text, or a view of a whole."""
        row = self.rows[number]
        kind = row[0]
        if kind == "t":
            return StructView(self, row, at, path)
        if kind == "a":
            return ArrayView(self, row, at, path)
        if kind == "s":
            return self._text(row, at)
        if kind == "p":
            return self._unpack("<Q", at)
        if bit >= 0:
            return bool(self._unpack("<B", at) >> bit & 1)
        return self._number(ELEMENTARY[row[1]], at)

    def _unpack(self, pattern: str, at: int) -> Any:
        return struct.unpack_from(pattern, self.bytes, at)[0]

    def _number(self, type_: Elementary, at: int) -> Any:
        value = self._unpack(_format(type_), at)
        return bool(value) if type_.family == "bool" else value

    def _text(self, row: Any, at: int) -> str:
        _, length, wide = row
        size = (length + 1) * (2 if wide else 1)
        data = bytes(self.bytes[at : at + size])
        if wide:
            units = [data[i : i + 2] for i in range(0, size, 2)]
            end = units.index(b"\0\0") if b"\0\0" in units else length
            return data[: 2 * end].decode("utf-16-le", errors="replace")
        return data.partition(b"\0")[0].decode("cp1252", errors="replace")

    def write(
        self, number: int, at: int, value: Any, bit: int = -1, path: str = ""
    ) -> None:
        """Store a value.  TypeError, OverflowError: it does not fit."""
        row = self.rows[number]
        kind = row[0]
        if kind == "s":
            self._write_text(row, at, value, path)
        elif kind == "n" and isinstance(value, str):
            self._write_enum(row, at, value, path)
        elif kind in ("e", "n"):
            self._write_number(ELEMENTARY[row[1]], at, value, bit, path)
        elif kind == "a":
            self.view(number, at, path=path)[:] = value
        else:
            raise TypeError(f"{path} cannot be written as a whole")

    def _write_text(self, row: Any, at: int, value: Any, path: str) -> None:
        _, length, wide = row
        if not isinstance(value, str):
            raise TypeError(f"{path} is a text")
        data = value.encode("utf-16-le" if wide else "cp1252")
        unit = 2 if wide else 1
        if len(data) > length * unit:
            raise OverflowError(f"{path} holds {length} characters")
        data += b"\0" * unit
        self.bytes[at : at + len(data)] = data

    def _write_enum(self, row: Any, at: int, value: str, path: str) -> None:
        names = {name.upper(): number for name, number in row[3].items()}
        key = value.rpartition(".")[2].upper()
        if key not in names:
            raise ValueError(
                f"{path} has no {value}; it has {', '.join(row[3])}"
            )
        self._write_number(ELEMENTARY[row[1]], at, names[key], -1, path)

    def _write_number(
        self, type_: Elementary, at: int, value: Any, bit: int, path: str
    ) -> None:
        if isinstance(value, str):
            raise TypeError(f"{path} is a number")
        if type_.family == "bool":
            if value not in (0, 1):
                raise OverflowError(f"{path} is a BOOL")
            if bit >= 0:
                byte = self._unpack("<B", at) & ~(1 << bit)
                value = byte | int(value) << bit
        elif type_.family != "real":
            if value != int(value):
                raise TypeError(f"{path} holds whole numbers")
            if not type_.low <= value <= type_.high:
                raise OverflowError(f"{path} is {type_.low}..{type_.high}")
            value = int(value)
        struct.pack_into(_format(type_), self.bytes, at, value)


class StructView:
    """A structure or instance: its members are attributes, in any case of letters."""

    __slots__ = ("_at", "_memory", "_names", "_path", "_row")

    def __init__(self, memory: Memory, row: Any, at: int, path: str) -> None:
        for name, value in (
            ("_memory", memory),
            ("_row", row),
            ("_at", at),
            ("_path", path or row[1]),
        ):
            object.__setattr__(self, name, value)

    def _member(self, name: str) -> tuple[str, list[Any]]:
        rows = self._row[3]
        if name in rows:
            return name, [
                rows[name][0],
                self._at + rows[name][1],
                rows[name][2],
            ]
        upper = name.upper()
        for known, row in rows.items():
            if known.upper() == upper:
                return known, [row[0], self._at + row[1], row[2]]
        for known, row in self._memory.statics.get(self._row[1], {}).items():
            if known.upper() == upper and "type" in row:
                return known, [row["type"], row["at"], row["bit"]]
        near = difflib.get_close_matches(name, list(rows), n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]}?" if near else ""
        text = f"{self._path} has no variable {name!r}{hint}"
        raise AttributeError(text)

    def __getattr__(self, name: str) -> Any:
        known, (number, at, bit) = self._member(name)
        path = f"{self._path}.{known}"
        return self._memory.view(number, at, bit, path)

    def __setattr__(self, name: str, value: Any) -> None:
        known, (number, at, bit) = self._member(name)
        path = f"{self._path}.{known}"
        self._memory.write(number, at, value, bit, path)

    def __dir__(self) -> list[str]:
        return list(self._row[3])

    def __repr__(self) -> str:
        return f"<{self._path} : {self._row[1]}>"


class ArrayView:
    """An array; indices count as in the declaration."""

    __slots__ = ("_at", "_memory", "_path", "_row")

    def __init__(self, memory: Memory, row: Any, at: int, path: str) -> None:
        self._memory, self._row, self._at = memory, row, at
        self._path = path

    def _size(self) -> int:
        return size_of(self._memory.rows, self._row[1])

    def _offset(self, key: Any) -> int:
        indices = key if isinstance(key, tuple) else (key,)
        dims = self._row[2]
        if len(indices) != len(dims):
            raise IndexError(f"{self._path} has {len(dims)} dimensions")
        offset = 0
        for index, (low, high) in zip(indices, dims, strict=True):
            if not low <= index <= high:
                raise IndexError(f"{self._path}: the index runs {low}..{high}")
            offset = offset * (high - low + 1) + index - low
        return self._at + offset * self._size()

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, slice):
            return list(self)[key]
        path = f"{self._path}[{key}]"
        return self._memory.view(self._row[1], self._offset(key), path=path)

    def __setitem__(self, key: Any, value: Any) -> None:
        if isinstance(key, slice):
            self._fill(list(value))
            return
        at, path = self._offset(key), f"{self._path}[{key}]"
        self._memory.write(self._row[1], at, value, path=path)

    def _fill(self, values: list[Any]) -> None:
        if len(values) != len(self):
            raise ValueError(f"{self._path} has {len(self)} elements")
        size = self._size()
        for k, value in enumerate(values):
            self._memory.write(self._row[1], self._at + k * size, value)

    def __len__(self) -> int:
        count = 1
        for low, high in self._row[2]:
            count *= high - low + 1
        return count

    def __iter__(self) -> Iterator[Any]:
        size = self._size()
        for k in range(len(self)):
            yield self._memory.view(self._row[1], self._at + k * size)

    def __repr__(self) -> str:
        return f"<{self._path} : {len(self)} elements>"


def size_of(rows: list[Any], number: int) -> int:
    """Bytes of a type."""
    row = rows[number]
    kind = row[0]
    if kind == "t":
        return int(row[2])
    if kind == "a":
        count = 1
        for low, high in row[2]:
            count *= high - low + 1
        return count * size_of(rows, row[1])
    if kind == "s":
        return int((row[1] + 1) * (2 if row[2] else 1))
    return 8 if kind == "p" else ELEMENTARY[row[1]].size


class ListView:
    """A list of global variables."""

    def __init__(self, memory: Memory, name: str, rows: Any) -> None:
        object.__setattr__(self, "_memory", memory)
        object.__setattr__(self, "_name", name)
        object.__setattr__(
            self, "_rows", {k.upper(): (k, v) for k, v in rows.items()}
        )

    def _row(self, name: str) -> tuple[str, Any]:
        found = self._rows.get(name.upper())
        if found is None:
            raise AttributeError(f"{self._name} has no variable {name!r}")
        return found  # type: ignore[no-any-return]

    def __getattr__(self, name: str) -> Any:
        known, row = self._row(name)
        if "value" in row:
            return row["value"]
        path = f"{self._name}.{known}"
        return self._memory.view(row["type"], row["at"], row["bit"], path)

    def __setattr__(self, name: str, value: Any) -> None:
        known, row = self._row(name)
        path = f"{self._name}.{known}"
        if "value" in row:
            raise AttributeError(f"{path} is a constant")
        self._memory.write(row["type"], row["at"], value, row["bit"], path)

    def __dir__(self) -> list[str]:
        return [known for known, _ in self._rows.values()]


def unknown_symbol(path: str, name: str, known: list[str]) -> SymbolError:
    """The error for a path that begins with nothing known."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    hint = (
        f"; did you mean {near[0]}?" if near else f"; known: {', '.join(known)}"
    )
    return SymbolError(f"symbol {path!r}: {name} is unknown{hint}")
