"""What TwinCAT's online view does: symbols of HLI and tasks, watch list, force
and unforce.

A symbol is ``HLI_Global_Variables.gpCh[0]^.bahn_state.dist_prog_start``
(hli.symbol) or a variable of a task, by the class's name: ``LaserPower.power``,
``LaserPower.trigger.q``, ``LaserPower.table[2]``.

A forced value is written behind the inputs and again behind the logic of every
scan, so neither the CNC nor the program changes what the program, and the CNC,
see.  Watched values are recorded at the end of every scan.
"""

from __future__ import annotations

import difflib
import dis
from array import array
from collections.abc import Iterable, Sequence
from types import CodeType
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from hli.owners import cnc_writes
from hli.symbol import (
    Symbol,
    SymbolError,
    getattr_or_item,
    index_of,
    resolve,
    tokens,
)
from hli.view import ArrayView, Pointers, View, ViewArray

from .scan_record import ScanRecord

ROWS = 1_000_000
"""Rows of the watch list.

When the list is full, every second row goes and half as many are taken.
"""
UNFIT = (
    AttributeError,
    IndexError,
    KeyError,
    OverflowError,
    TypeError,
    ValueError,
)
"""What writing a symbol raises if the value does not fit, or the symbol cannot be written."""


Key = str | int | tuple[int, ...]
"""A member's name, an index, or the indices of several dimensions."""


class TaskSymbol(Symbol):
    """A variable of a task; reading one that is not there (yet) gives None."""

    __slots__ = ("_task",)

    def __init__(self, path: str, task: Any, keys: list[Key]) -> None:
        last: Any = keys[-1]
        super().__init__(path, keys[:-1], last)
        self._task = task

    @property
    def value(self) -> Any:
        """The value now."""
        holder = _walk(self._task.instance, self._holder)
        return None if holder is None else _peek(holder, self._key)

    @value.setter
    def value(self, value: Any) -> None:
        holder = _walk(self._task.instance, self._holder)
        if holder is None:
            return
        if isinstance(self._key, str):
            setattr(holder, self._key, value)
        else:
            holder[self._key] = value

    def check(self) -> None:
        """SymbolError: after ``setup()`` there is no such variable, and no
        method of its class ever stores one.
        """
        value, spelled = self._task.instance, self._task.name
        for key in [*self._holder, self._key]:
            if value is None:
                return  # comes later
            problem = (
                _no_variable(value, key)
                if isinstance(key, str)
                else _no_item(value, key)
            )
            if problem:
                raise SymbolError(f"symbol {self.path!r}: {spelled}{problem}")
            value = _peek(value, key)
            spelled += _spelled(key)


def _no_item(value: Any, index: int | tuple[int, ...]) -> str:
    """What is wrong with an index; a list may still grow."""
    if not hasattr(type(value), "__getitem__"):
        return " is no array"
    fixed = isinstance(value, (tuple, ArrayView)) or (
        isinstance(value, np.ndarray) and value.ndim > 0
    )
    return (
        f"[{index}]: the index runs 0..{len(value) - 1}"
        if fixed and isinstance(index, int) and index >= len(value)
        else ""
    )


def _no_variable(value: Any, name: str) -> str:
    """What is wrong with a name: neither there nor stored by a method of the class."""
    known = set(dir(value))
    if name in known or hasattr(value, name):
        return ""
    known |= stored_names(type(value))
    if name in known:
        return ""
    near = difflib.get_close_matches(
        name,
        [n for n in sorted(known) if not n.startswith("_")],
        n=1,
        cutoff=0.5,
    )
    return f" has no variable {name!r}" + (
        f"; did you mean {near[0]}?" if near else ""
    )


def stored_names(cls: type) -> set[str]:
    """Every name that the methods of a class assign as an attribute, of
    whatever object.
    """
    members = [member for base in cls.__mro__ for member in vars(base).values()]
    codes = [
        m.__code__
        for m in (getattr(member, "__func__", member) for member in members)
        if hasattr(m, "__code__")
    ]
    found: set[str] = set()
    while codes:
        code = codes.pop()
        found |= {
            step.argval
            for step in dis.get_instructions(code)
            if step.opname == "STORE_ATTR"
        }
        codes += [
            inner for inner in code.co_consts if isinstance(inner, CodeType)
        ]
    return found


def check(symbol: Symbol) -> None:
    """SymbolError for a variable of a task that cannot come to be; call it
    after ``setup()``.
    """
    if isinstance(symbol, TaskSymbol):
        symbol.check()


def _peek(holder: Any, key: Key) -> Any:
    try:
        return getattr_or_item(holder, key)
    except (AttributeError, IndexError, KeyError, TypeError):
        return None


@runtime_checkable
class HasViews(Protocol):
    """A task with further parts that have names: a program of ST."""

    def st_views(self) -> dict[str, Any]:
        """The parts by name."""


def views_of(instance: Any) -> dict[str, Any]:
    """The named parts of a task's instance, none for a class of Python."""
    return instance.st_views() if isinstance(instance, HasViews) else {}


class Namespace(NamedTuple):
    """What symbols begin with beside tasks: a list of an ST program."""

    name: str
    instance: Any


class SymbolTable:
    """Symbols of one connection and its tasks (``programs``: with ``name`` and
    ``instance``).
    """

    def __init__(self, hli: Any, programs: Sequence[Any]) -> None:
        self._hli = hli
        self.update(programs)

    def update(self, programs: Sequence[Any]) -> None:
        """These tasks from now on."""
        self.programs = programs
        found: dict[str, Any] = {}
        for program in programs:  # lists of globals and programs of ST
            for name, view in views_of(program.instance).items():
                found[name.upper()] = Namespace(name, view)
        # the last part: a class may stand in a function or another class
        self._programs = found | {
            p.name.rpartition(".")[2].upper(): p for p in programs
        }

    def __getitem__(self, path: str) -> Symbol:
        """Raises SymbolError."""
        parts = tokens(path)
        program = self._programs.get(parts[0].upper())
        if program is None:
            try:
                return resolve(self._hli, path)
            except SymbolError as error:
                raise self._unknown(error, path, parts[0]) from None
        if len(parts) < 2:
            raise SymbolError(
                f"symbol {path!r}: a variable of task {program.name} is needed"
            )
        keys = [_key(path, part) for part in parts[1:]]
        spelled = program.name + "".join(map(_spelled, keys))
        return TaskSymbol(spelled, program, keys)

    def _unknown(
        self, error: SymbolError, path: str, first: str
    ) -> SymbolError:
        """The error with the tasks, or those that have a variable of the name."""
        programs = self._programs.values()
        having = [
            f"{program.name}.{path}"
            for program in programs
            if _peek(program.instance, first) is not None
        ]
        if having:
            meant = " or ".join(having)
            text = f"symbol {path!r}: {first} is unknown; did you mean {meant}?"
            return SymbolError(text)
        if "did you mean" in str(error):
            return error
        tasks = ", ".join(program.name for program in programs)
        return SymbolError(f"{error}; tasks: {tasks}")


def _key(path: str, part: str) -> Key:
    """A name, an index, or the indices of ``[1,2]``."""
    if not part.startswith("["):
        return part
    if "," not in part:
        return index_of(path, part)
    numbers = part[1:-1].split(",")
    return tuple(index_of(path, f"[{number}]") for number in numbers)


def _spelled(key: Key) -> str:
    if isinstance(key, tuple):
        return f"[{','.join(map(str, key))}]"
    return f"[{key}]" if isinstance(key, int) else f".{key}"


def _walk(value: Any, keys: Any) -> Any:
    for key in keys:
        value = _peek(value, key)
        if value is None:
            return None
    return value


class Watch:
    """The watch list: ``columns()`` gives one array per symbol and ``t`` (cell
    time in s), a row per recorded scan.
    """

    def __init__(self, rows: int = ROWS) -> None:
        self._symbols: dict[str, Symbol] = {}
        self._values: dict[str, array[float]] = {}
        self._time: array[float] = array("d")
        self._rows = rows
        self._every = 1
        self.any = False  # whether something is watched or recorded
        self.to: ScanRecord | None = None  # every scan goes there, too
        self._scan = 0

    def add(self, path: str, symbol: Symbol) -> None:
        """Record this symbol from now on; earlier rows are NaN.  SymbolError: a
        structure, an array or a text.
        """
        if not isinstance(symbol, TaskSymbol):
            _check_number(path, symbol)
        self._symbols[path] = symbol
        self.any = True
        self._values.setdefault(
            path, array("d", [float("nan")] * len(self._time))
        )

    def rebind(self, table: SymbolTable) -> None:
        """After ``setup()``: the same paths in the (new) instances.
        SymbolError: a task has no such number.
        """
        self._symbols = {path: table[path] for path in self._symbols}
        for path, symbol in self._symbols.items():
            check(symbol)
            if symbol.value is not None:
                _check_number(path, symbol)

    def record(self, time_s: float, cycle: int = 0) -> None:
        """One row."""
        self._scan += 1
        if self.to is not None:
            values = [number_of(s.value) for s in self._symbols.values()]
            self.to.add(cycle, time_s, values)
        if not self._symbols or self._scan % self._every:
            return
        self._time.append(time_s)
        for path, symbol in self._symbols.items():
            self._values[path].append(number_of(symbol.value))
        if len(self._time) >= self._rows:
            self._thin()

    def _thin(self) -> None:
        self._every *= 2
        self._time = self._time[1::2]
        self._values = {
            path: values[1::2] for path, values in self._values.items()
        }

    @property
    def paths(self) -> tuple[str, ...]:
        """The symbols as they were named."""
        return tuple(self._symbols)

    def record_to(self, target: ScanRecord) -> None:
        """Hand every scan to a recording, with the symbols of now."""
        self.to = target
        self.any = True

    def columns(self) -> dict[str, np.ndarray[Any, Any]]:
        """Copies of what was recorded."""
        return {
            name: np.array(values)
            for name, values in {"t": self._time, **self._values}.items()
        }

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


def _check_number(path: str, symbol: Symbol) -> None:
    value = symbol.value
    if not _is_number(value):
        members = getattr(getattr(value, "_c", None), "_fields_", ())
        names = ", ".join(name for name, *_ in members)
        raise SymbolError(
            f"symbol {path!r}: only single numbers and BOOLs can be watched;"
            f" name a member{': ' + names if names else ''}"
        )


def number_of(value: Any) -> float:
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


def check_kind(path: str, symbol: Symbol, value: Any) -> None:
    """SymbolError: a text for a number or a BOOL, or anything for a structure."""
    now = symbol.value
    if isinstance(now, (View, ViewArray, ArrayView, Pointers)):
        raise SymbolError(
            f"force {path}={value}: {path} is no single value; name a member"
        )
    if not isinstance(value, str) or not isinstance(
        now, (int, float, np.number, np.bool_)
    ):
        return
    if isinstance(now, (bool, np.bool_)):
        raise SymbolError(
            f"force {path}={value}: {path} is a BOOL; write TRUE or FALSE"
        )
    raise SymbolError(
        f"force {path}={value}: {path} is a number, {now!r} now; write a number"
    )


def force_warnings(path: str) -> list[str]:
    """What a force of this symbol does not do, if the CNC writes it."""
    if not cnc_writes(path):
        return []
    return [
        f"force {path}: the CNC writes it in each cycle; the force changes what"
        " the PLC reads, not what the CNC does"
    ]


class Forces:
    """Forced symbols, written twice a scan."""

    def __init__(self) -> None:
        self._forced: dict[str, tuple[Symbol, Any]] = {}
        self.any = False  # whether something is forced

    def force(self, path: str, symbol: Symbol, value: Any) -> None:
        """Hold a symbol at a value; a value that does not fit raises at once
        (SymbolError, TypeError, OverflowError).
        """
        check_kind(path, symbol, value)
        symbol.value = value
        self.hold(path, symbol, value)

    def hold(self, path: str, symbol: Symbol, value: Any) -> None:
        """The same, from the next scan on."""
        self._forced[path] = (symbol, value)
        self.any = True

    def unforce(self) -> None:
        """Let all symbols go; they keep their values until somebody writes them."""
        self._forced.clear()
        self.any = False

    def let_go(self, named: Sequence[tuple[str, str]]) -> None:
        """``unforce`` of these (as they were spelled, their paths), all or none.

        SymbolError: one is not forced.
        """
        for spelled, path in named:
            if path not in self._forced:
                forced = ", ".join(self._forced) or "nothing"
                raise SymbolError(
                    f"symbol {spelled!r} is not forced; forced: {forced}"
                )
        for _, path in named:
            self._forced.pop(path, None)
        self.any = bool(self._forced)

    def rebind(self, table: SymbolTable) -> None:
        """After ``setup()``.  SymbolError: a task has no such variable."""
        self._forced = {
            path: (table[path], value)
            for path, (_, value) in self._forced.items()
        }
        for path, (symbol, value) in self._forced.items():
            try:
                check(symbol)
            except SymbolError as error:
                raise SymbolError(f"force {path}={value!r}: {error}") from None
            check_kind(path, symbol, value)

    def apply(self) -> None:
        """Write all forced values.

        SymbolError: a variable of a task that does not take its value.
        """
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
    """``SYMBOL=VALUE`` of a command line: TRUE, FALSE, a number, or text.
    ValueError without ``=``.
    """
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
