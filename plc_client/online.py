"""What TwinCAT's online view does: symbols of HLI and tasks, watch list, force and unforce.

A symbol is ``HLI_Global_Variables.gpCh[0]^.bahn_state.dist_prog_start`` (hli.symbol) or a variable of a task, by the
class's name: ``LaserPower.power``, ``LaserPower.trigger.q``, ``LaserPower.table[2]``.

A forced value is written behind the inputs and again behind the logic of every scan, so neither the CNC nor the program
changes what the program, and the CNC, see.  Watched values are recorded at the end of every scan.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from hli.symbol import Symbol, SymbolError, getattr_or_item, index_of, resolve, tokens

ROWS = 1_000_000
"""Rows of the watch list; when they are full every second one is dropped and half as many are taken."""
UNFIT = (AttributeError, IndexError, KeyError, OverflowError, TypeError, ValueError)
"""What writing a symbol raises if the value does not fit, or the symbol cannot be written."""


class TaskSymbol(Symbol):
    """A variable of a task; reading one that is not there (yet) gives None."""

    __slots__ = ()

    @property
    def value(self) -> Any:
        """The value now."""
        holder = self._holder()
        return None if holder is None else _peek(holder, self._key)

    @value.setter
    def value(self, value: Any) -> None:
        holder = self._holder()
        if holder is None:
            return
        if isinstance(self._key, int):
            holder[self._key] = value
        else:
            setattr(holder, self._key, value)


def _peek(holder: Any, key: str | int) -> Any:
    try:
        return getattr_or_item(holder, key)
    except (AttributeError, IndexError, KeyError):
        return None


class SymbolTable:
    """Symbols of one connection and its tasks (``programs``: with ``name`` and ``instance``)."""

    def __init__(self, hli: Any, programs: Sequence[Any]) -> None:
        self._hli = hli
        self._programs = {p.name.upper(): p for p in programs}

    def __getitem__(self, path: str) -> Symbol:
        """Raises SymbolError."""
        parts = tokens(path)
        program = self._programs.get(parts[0].upper())
        if program is None:
            try:
                return resolve(self._hli, path)
            except SymbolError as error:
                tasks = ", ".join(p.name for p in self._programs.values())
                raise SymbolError(f"{error}; tasks: {tasks}") from None
        if len(parts) < 2:
            raise SymbolError(f"symbol {path!r}: a variable of task {program.name} is needed")
        keys = [index_of(path, part) if part.startswith("[") else part for part in parts[1:]]
        return TaskSymbol(path, lambda: _walk(program.instance, keys[:-1]), keys[-1])


def _walk(value: Any, keys: list[str | int]) -> Any:
    for key in keys:
        value = _peek(value, key)
        if value is None:
            return None
    return value


class Watch:
    """The watch list: ``columns()`` gives one array per symbol and ``t`` (cell time in s), a row per recorded scan."""

    def __init__(self, rows: int = ROWS) -> None:
        self._symbols: dict[str, Symbol] = {}
        self._values: dict[str, array[float]] = {}
        self._time: array[float] = array("d")
        self._rows = rows
        self._every = 1
        self.any = False  # whether something is watched
        self._scan = 0

    def add(self, path: str, symbol: Symbol) -> None:
        """Record this symbol from now on; earlier rows are NaN.  SymbolError: a structure, an array or a text."""
        if not isinstance(symbol, TaskSymbol) and not _is_number(symbol.value):
            raise SymbolError(f"symbol {path!r}: only single numbers and BOOLs can be watched; name a member")
        self._symbols[path] = symbol
        self.any = True
        self._values.setdefault(path, array("d", [float("nan")] * len(self._time)))

    def rebind(self, table: SymbolTable) -> None:
        """After a restart: the same paths in the new instances."""
        self._symbols = {path: table[path] for path in self._symbols}

    def record(self, time_s: float) -> None:
        """One row."""
        self._scan += 1
        if not self._symbols or self._scan % self._every:
            return
        self._time.append(time_s)
        for path, symbol in self._symbols.items():
            self._values[path].append(_number(symbol.value))
        if len(self._time) >= self._rows:
            self._thin()

    def _thin(self) -> None:
        self._every *= 2
        self._time = self._time[1::2]
        self._values = {path: values[1::2] for path, values in self._values.items()}

    def columns(self) -> dict[str, np.ndarray[Any, Any]]:
        """Copies of what was recorded."""
        return {name: np.array(values) for name, values in {"t": self._time, **self._values}.items()}

    def report(self) -> dict[str, list[float | None]]:
        """For JSON: NaN is None."""
        return {
            name: [None if v != v else v for v in values]  # noqa: PLR0124 (NaN differs from itself)
            for name, values in {"t": self._time, **self._values}.items()
        }

    def __len__(self) -> int:
        return len(self._time)

    def __bool__(self) -> bool:
        return bool(self._symbols)


def _number(value: Any) -> float:
    """Numbers and BOOLs as float; anything else (and what is not there) as NaN."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return float("nan")


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True


class Forces:
    """Forced symbols, written twice a scan."""

    def __init__(self) -> None:
        self._forced: dict[str, tuple[Symbol, Any]] = {}
        self.any = False  # whether something is forced

    def force(self, path: str, symbol: Symbol, value: Any) -> None:
        """Hold a symbol at a value; a value that does not fit raises at once (TypeError, OverflowError)."""
        symbol.value = value
        self._forced[path] = (symbol, value)
        self.any = True

    def unforce(self, path: str | None = None) -> None:
        """Let one symbol go (all without a path); it keeps its value until somebody writes it."""
        if path is None:
            self._forced.clear()
        else:
            del self._forced[path]
        self.any = bool(self._forced)

    def rebind(self, table: SymbolTable) -> None:
        """After a restart."""
        self._forced = {path: (table[path], value) for path, (_, value) in self._forced.items()}

    def apply(self) -> None:
        """Write all forced values.  SymbolError: a variable of a task that does not take its value."""
        for path, (symbol, value) in self._forced.items():
            try:
                symbol.value = value
            except UNFIT as error:
                raise SymbolError(f"force {path}={value!r}: {error}") from None

    def __bool__(self) -> bool:
        return bool(self._forced)

    def items(self) -> Iterable[tuple[str, Any]]:
        """Path and value of every force."""
        return [(path, value) for path, (_, value) in self._forced.items()]


def parse_force(text: str) -> tuple[str, Any]:
    """``SYMBOL=VALUE`` of a command line: TRUE, FALSE, a number, or text.  ValueError without ``=``."""
    path, equals, value = text.partition("=")
    if not equals:
        raise ValueError(f"force {text!r}: SYMBOL=VALUE is needed")
    return path.strip(), _value(value.strip())


def _value(text: str) -> Any:
    if text.upper() in ("TRUE", "FALSE"):
        return text.upper() == "TRUE"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
