"""Simulated inputs: contacts, sensors and actuators for the PLC's image.

An ``Input`` describes how a variable of a task changes: with the time, the
distance, an M function, or behind another symbol.  It is written behind the
latch of every scan and ahead of the forces, on the cell's clock.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

from hli.symbol import Symbol, SymbolError

from .blocks.program_flow import TechnoFunction, techno_areas
from .online import UNFIT, SymbolTable, TaskSymbol, check
from .program import Program

_TENTH_UM = 10_000.0  # in a millimetre
_PLACES = ("time_s", "distance_mm", "m")


@dataclass(frozen=True, kw_only=True)
class Step:
    """An input takes ``value`` at one of three places, ``delay_s`` later.

    ``time_s``: at this cell time.
    ``distance_mm``: whenever the path passes this distance forward.
    ``m``: whenever the CNC hands over this M function.
    """

    value: float
    time_s: float | None = None
    distance_mm: float | None = None
    m: int | None = None
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        given = [name for name in _PLACES if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"step: one of time_s, distance_mm, m is needed, not {given}"
            )
        for name in ("value", given[0]):
            _check_number(name, getattr(self, name))
        _check_not_negative("delay_s", self.delay_s)
        if given != ["distance_mm"]:
            _check_not_negative(given[0], getattr(self, given[0]))


@dataclass(frozen=True)
class Input:
    """A simulated input: a variable of a task that the machine writes.

    ``start``: its first value, a BOOL or a number.
    ``steps``: what it becomes, and when.
    ``follows``: a symbol that it repeats instead; without a dot one of its own
    task.  ``above``, ``below``: a BOOL, TRUE while that number is above or
    below.  ``inverted``: the opposite.
    ``on_delay_s``, ``off_delay_s``: how long it takes a BOOL to follow.
    ``lag_s``: time constant of a number that follows.

    In a class its place is the variable's: ``closed = Input(follows="valve")``.
    """

    start: float = False
    steps: tuple[Step, ...] = ()
    follows: str = ""
    above: float | None = None
    below: float | None = None
    inverted: bool = False
    on_delay_s: float = 0.0
    off_delay_s: float = 0.0
    lag_s: float = 0.0

    def __post_init__(self) -> None:
        _check_number("start", self.start)
        steps = tuple(map(_step, self.steps))
        object.__setattr__(self, "steps", steps)
        for name in ("on_delay_s", "off_delay_s", "lag_s"):
            _check_not_negative(name, getattr(self, name))
        for name in ("above", "below"):
            if getattr(self, name) is not None:
                _check_number(name, getattr(self, name))
        self._check_together()

    def _check_together(self) -> None:
        if self.follows and self.steps:
            raise ValueError("an input has steps or follows a symbol, not both")
        alone = (
            "above below inverted on_delay_s off_delay_s lag_s"
            if not self.follows
            else "on_delay_s off_delay_s inverted"
            if not self.is_bool
            else "lag_s"
        )
        for name in alone.split():
            if getattr(self, name) not in (None, False, 0.0):
                need = "follows" if not self.follows else "start"
                raise ValueError(
                    f"{name} does not fit {need}={getattr(self, need)!r}"
                )

    @property
    def is_bool(self) -> bool:
        """Whether it is a contact; otherwise a number."""
        return (
            isinstance(self.start, bool)
            or self.above is not None
            or self.below is not None
        )

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        """Of an instance: the first value, until the simulation writes."""
        return self if instance is None else self.start


def _step(value: Step | Mapping[str, Any]) -> Step:
    return value if isinstance(value, Step) else _made(Step, value)


def input_of(value: Input | Mapping[str, Any]) -> Input:
    """An input from the keys of a cell file.  TypeError, ValueError: they are
    wrong.
    """
    return value if isinstance(value, Input) else _made(Input, value)


def inputs_of(given: Mapping[str, Any] | None) -> dict[str, Input]:
    """Inputs by symbol; ValueError names the one that is wrong."""
    found = {}
    for path, value in (given or {}).items():
        try:
            found[path] = input_of(value)
        except (TypeError, ValueError) as error:
            raise ValueError(f"input {path}: {error}") from None
    return found


def _made(kind: Any, values: Any) -> Any:
    if not isinstance(values, Mapping):
        raise TypeError(f"a table is needed, not {values!r}")
    known = [field.name for field in fields(kind)]
    for name in values:
        if name not in known:
            raise ValueError(f"unknown key {name!r}; known: {', '.join(known)}")
    if kind is Step and "value" not in values:
        raise ValueError("step: value is needed")
    return kind(**values)


def _check_number(name: str, value: Any) -> None:
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        raise TypeError(f"{name}={value!r}: a BOOL or a number is needed")


def _check_not_negative(name: str, value: Any) -> None:
    _check_number(name, value)
    if value < 0:
        raise ValueError(f"{name}={value!r}: 0 or more is needed")


@dataclass
class _Now:
    """What a scan begins with."""

    time_s: float
    passed_s: float  # since the scan before; the first one: 0
    functions: tuple[int, ...]  # M functions that are offered anew
    distance: float  # 0.1 um
    before_s: float
    before: float


class _Simulated:
    """One input while it runs."""

    def __init__(self, path: str, described: Input) -> None:
        self.path, self.described = path, described
        self.value: float = described.start
        self._coming: deque[tuple[float, float]] = deque()
        self._changed_s: float | None = None
        self.follows = described.follows
        if self.follows and "." not in self.follows:
            self.follows = f"{path.rpartition('.')[0]}.{self.follows}"
        self.bind_to: Symbol | None = None
        self.source: Symbol | None = None

    @property
    def needs_functions(self) -> bool:
        """Whether an M function changes it."""
        return any(step.m is not None for step in self.described.steps)

    def bind(self, table: SymbolTable) -> None:
        """Find its symbols.  SymbolError: there are none of these names."""
        try:
            symbol = table[self.path]
            if not isinstance(symbol, TaskSymbol):
                raise SymbolError("the CNC's memory; name a variable of a task")
            check(symbol)
            self.bind_to = symbol
            self.source = table[self.follows] if self.follows else None
            if self.source is not None:
                check(self.source)
        except SymbolError as error:
            raise SymbolError(
                f"input {self.path}: {error} (an input of the cell file, or of inputs=)"
            ) from None

    def set(self, value: float) -> None:
        """This value from now on; steps to come still come."""
        _check_number("value", value)
        self.value = value
        self._coming.clear()

    def write(self, now: _Now) -> None:
        """Its value at this scan into its variable."""
        if self.source is not None:
            self._follow(self.source.value, now)
        else:
            self._take_steps(now)
        assert self.bind_to is not None
        try:
            self.bind_to.value = self.value
        except UNFIT as error:
            raise SymbolError(
                f"input {self.path}={self.value!r}: {error}"
            ) from None

    def _take_steps(self, now: _Now) -> None:
        for step in self.described.steps:
            if _reached(step, now):
                self._coming.append((now.time_s + step.delay_s, step.value))
        if not self._coming:
            return
        due = [one for one in self._coming if one[0] <= now.time_s + 1e-9]
        for one in sorted(due, key=lambda one: one[0]):
            self.value = one[1]
            self._coming.remove(one)

    def _follow(self, value: Any, now: _Now) -> None:
        if value is None:  # not stored yet
            return
        if not isinstance(value, (int, float)) and not hasattr(value, "dtype"):
            raise SymbolError(
                f"input {self.path}: {self.follows} is no single value"
            )
        if self.described.is_bool:
            self._follow_bool(self._condition(value), now)
        elif self.described.lag_s > 0.0:
            part = -math.expm1(-now.passed_s / self.described.lag_s)
            self.value += (float(value) - self.value) * part
        else:
            self.value = value

    def _condition(self, value: Any) -> bool:
        above, below = self.described.above, self.described.below
        true = bool(value) if above is None and below is None else True
        if above is not None:
            true = true and value > above
        if below is not None:
            true = true and value < below
        return bool(true) != self.described.inverted

    def _follow_bool(self, wanted: bool, now: _Now) -> None:
        if wanted == self.value:
            self._changed_s = None
            return
        if self._changed_s is None:
            self._changed_s = now.time_s
        one = self.described
        delay = one.on_delay_s if wanted else one.off_delay_s
        if now.time_s - self._changed_s >= delay - 1e-9:
            self.value, self._changed_s = wanted, None


def _reached(step: Step, now: _Now) -> bool:
    if step.time_s is not None:
        return now.before_s < step.time_s - 1e-9 <= now.time_s
    if step.distance_mm is not None:
        place = step.distance_mm * _TENTH_UM - 1e-3
        return now.before < place <= now.distance
    return step.m in now.functions


class _Functions:
    """M functions that the CNC hands over, each told once."""

    def __init__(self, hli: Any) -> None:
        self._areas = techno_areas(hli)
        self._seen: list[Any] = []
        self._left: list[Any] = []

    def look(self) -> tuple[int, ...]:
        """The numbers that were not offered when the scan before ended."""
        self._seen = self._offered()
        left = list(self._left)
        new = []
        for one in self._seen:
            if one in left:
                left.remove(one)
            elif one[1] == "M":
                new.append(one[2])
        return tuple(new)

    def scanned(self) -> None:
        """The scan has ended: what is still there is no news."""
        seen = self._seen
        self._left = (
            [one for one in self._offered() if one in seen] if seen else []
        )

    def _offered(self) -> list[Any]:
        return [
            (place, function.kind, function.number, _place_of(function))
            for area in self._areas
            for place, function in area.offered()
        ]


def _place_of(function: TechnoFunction) -> tuple[int, int]:
    """Block number and line: two functions of one number differ in it."""
    payload = function.payload
    return (
        int(getattr(payload, "satz_nr", 0)),
        int(getattr(payload, "zeilen_nr", 0)),
    )


class Inputs:
    """The inputs of one connection: ``inputs["Clamp.closed"] = True`` sets one
    as a hand does; the symbol need not be described before.
    """

    def __init__(
        self,
        hli: Any,
        table: SymbolTable,
        given: Mapping[str, Any] | None = None,
    ) -> None:
        self._hli, self._table = hli, table
        self._given = inputs_of(given)
        self._all: dict[str, _Simulated] = {}
        self._before_s = self._before = -math.inf
        self._functions: _Functions | None = None
        self.any = False

    def rebind(self, programs: Iterable[Program]) -> None:
        """After ``setup()`` of these tasks: the machine itself goes on.

        SymbolError: a name is wrong.
        """
        of_tasks = [one for p in programs for one in _of_task(p)]
        for path, described in [*of_tasks, *self._given.items()]:
            old = self._find(path)
            if old is None or old.described != described:
                self._all[path.upper()] = _Simulated(path, described)
        for one in self._all.values():
            one.bind(self._table)
        self.any = bool(self._all)
        if self._functions is None and any(
            one.needs_functions for one in self._all.values()
        ):
            self._functions = _Functions(self._hli)

    def apply(self, time_s: float) -> None:
        """Write all at the beginning of a scan."""
        passed = time_s - self._before_s
        distance = _distance(self._hli)
        now = _Now(
            time_s,
            passed if math.isfinite(passed) else 0.0,
            self._functions.look() if self._functions else (),
            distance,
            self._before_s,
            self._before,
        )
        for one in self._all.values():
            one.write(now)
        self._before_s, self._before = time_s, distance

    def scanned(self) -> None:
        """The end of a scan."""
        if self._functions:
            self._functions.scanned()

    def _find(self, path: str) -> _Simulated | None:
        return self._all.get(path.upper())

    def __contains__(self, path: str) -> bool:
        return self._find(path) is not None

    def __iter__(self) -> Iterator[str]:
        return iter([one.path for one in self._all.values()])

    def __getitem__(self, path: str) -> float:
        """The value now.  KeyError: no such input."""
        one = self._find(path)
        if one is None:
            known = ", ".join(self) or "none"
            raise KeyError(f"no input {path}; inputs: {known}")
        return one.value

    def __setitem__(self, path: str, value: float) -> None:
        """From the next scan on.  SymbolError: no such variable."""
        one = self._find(path)
        if one is None:
            one = _Simulated(path, Input(value))
            one.bind(self._table)
            self._all[path.upper()] = one
            self.any = True
        elif one.follows:
            raise SymbolError(
                f"input {path} follows {one.follows}: force it instead"
            )
        one.set(value)


def _of_task(program: Program) -> Iterator[tuple[str, Input]]:
    """What a class declares in its body."""
    names: dict[str, Any] = {}
    for base in reversed(type(program.instance).__mro__):
        names |= vars(base)
    for name, value in names.items():
        if isinstance(value, Input):
            yield f"{program.name.rpartition('.')[2]}.{name}", value


def _distance(hli: Any) -> float:
    return float(hli.gpCh[0].bahn_state.dist_prog_start)
