"""ST programs as tasks of the scan runtime: one class for every program of every task."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ... import clock
from ...task import PlcError, task
from ..build import build, sources_of
from ..errors import OWNER, UNHEARD
from ..options import Built, Options
from .findings import findings
from .listing import listing_of
from .loader import StProgram, StTrap
from .retain import Retained

LOOP_S = 5.0
"""Wall time a scan may spend in loops; the task watchdog waits longer."""
ON_TRAP = ("stop", "halt")


class Shared:
    """One program behind all its tasks."""

    def __init__(self, path: str, built: Built, tell_on: int) -> None:
        self.path = path
        self.built = built
        self.program = StProgram(built)
        self.program.allow(LOOP_S)
        self.program.tell_on(tell_on)
        self.retained = Retained(path, self.program)
        self._ready: set[int] = set()
        self.fresh = True

    def begin(self, who: int, hli: Any) -> None:
        """``setup()`` of one task; the first of a round starts the program."""
        if self.fresh or who in self._ready:
            self._ready.clear()
            self.fresh = False
            self.retained.save()
            self.program.connect(hli)
            self.program.start(clock.now_ns())
            self.retained.load()
        self._ready.add(who)


class StTask:
    """A program in a task; its variables are attributes."""

    _st_shared: Shared
    _st_name: str

    def __init__(self) -> None:
        shared = self._st_shared
        shared.fresh = True
        put = object.__setattr__
        put(self, "_st_entry", shared.program.entry(self._st_name))
        put(self, "_st_view", shared.program[self._st_name])
        put(self, "_st_run", shared.program.run)
        put(self, "_st_halted", "")

    def setup(self, hli: Any) -> None:
        """Initial values, the HLI's pointers, what was retained."""
        self._st_shared.begin(id(self), hli)
        object.__setattr__(self, "_st_halted", "")

    def cyclic(self) -> None:
        """One scan.  StTrap: the program did what it must not."""
        if self._st_halted:
            return
        try:
            self._st_run(self._st_entry, clock.now_ns())
        except StTrap as trap:
            self._trapped(trap)

    def native_scan(self) -> tuple[int, int] | None:
        """Addresses of the guarded call and of the program's entry; None: the
        task has halted.
        """
        if self._st_halted:
            return None
        return self._st_shared.program.guarded_entry, self._st_entry

    def trapped(self) -> None:
        """C has stopped at a trap.  StTrap, unless the task halts."""
        self._trapped(self._st_shared.program.trap())

    def _trapped(self, trap: StTrap) -> None:
        if os.environ.get("HLI_COSIM_ON_TRAP", "stop") == "halt":
            object.__setattr__(self, "_st_halted", str(trap))
            print(f"task halted: {trap}", flush=True)
            return
        raise trap

    def st_warnings(self) -> list[str]:
        """What the compiler has to say of the program's use of the HLI; the
        first task tells it.
        """
        built = self._st_shared.built
        if not self._is_first():
            return []
        return [
            str(warning).splitlines()[0]
            for warning in built.warnings
            if warning.code in (OWNER, UNHEARD)
        ]

    def st_findings(self) -> list[str]:
        """What the run has shown of the task's blocks; those of lists of
        globals are told by the first task.
        """
        program, name = self._st_shared.program, self._st_name
        root = program.description["roots"][name]
        found = findings(program.memory, root["type"], root["at"], "")
        for label, rows in program.description["lists"].items():
            for variable, row in rows.items() if self._is_first() else ():
                if "type" in row:
                    path = f"{label}.{variable}"
                    place = (row["type"], row["at"])
                    found += findings(program.memory, *place, path)
        return [text.removeprefix(".") for text in found]

    def _is_first(self) -> bool:
        first: str = self._st_shared.built.description["tasks"][0]["programs"][
            0
        ]
        return first.upper() == self._st_name.upper()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_st_") or name in ("finished", "result"):
            raise AttributeError(name)
        return getattr(self._st_view, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._st_view, name, value)

    def __dir__(self) -> list[str]:
        return dir(self._st_view)

    def st_views(self) -> dict[str, Any]:
        """Programs and lists of globals by their names, the user's alone."""
        program = self._st_shared.program
        places = program.description["places"]
        return {
            name: program[name]
            for name in program.names()
            if "HLI_" not in name
            and not places.get(name.upper(), [""])[0].startswith("<library>")
        }

    def st_listing(self) -> dict[str, Any]:
        """The same with their types, as ``plc_client.listing`` tells them."""
        return listing_of(self._st_shared.program.description)

    @property
    def st_program(self) -> StProgram:
        """The whole program: ``st_program["GVL"].x``."""
        return self._st_shared.program


_WORDS = ("define", "interval", "short-circuit", "task")
_TASK = re.compile(r"\w+(:(?P<ms>\d+(\.\d+)?))?(:\d{1,5})?=\s*\w+(\s*,\s*\w+)*")
LONGEST_S = 3600.0
"""Interval of a task, s."""


def options_of(words: Sequence[str] = ()) -> Options:
    """Options from words; those of the variable ``HLI_COSIM_ST`` come first.

    PlcError: a word is unknown or its value is wrong.
    """
    found: dict[str, list[str]] = {name: [] for name in _WORDS}
    for word in (*os.environ.get("HLI_COSIM_ST", "").split(), *words):
        name, _, value = word.partition("=")
        if name not in found:
            known = ", ".join(_WORDS)
            raise PlcError(f"option {word!r} of Structured Text: {known}")
        found[name].append(value)
    for text in found["task"]:
        _check_task(text)
    return Options(
        short_circuit=bool(found["short-circuit"]),
        defines=tuple(found["define"]),
        tasks=tuple(found["task"]),
        interval=_seconds(found["interval"][-1:]),
    )


def _check_task(text: str) -> None:
    match = _TASK.fullmatch(text)
    if match is None:
        raise PlcError(f"task {text!r}: NAME:MS:PRIORITY=PROGRAM,PROGRAM")
    if not 0.0 < float(match["ms"] or 1.0) <= LONGEST_S * 1e3:
        raise PlcError(f"task {text!r}: an interval above 0 is needed")


def _seconds(given: list[str]) -> float:
    try:
        seconds = float(given[0]) if given else 0.001
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds <= LONGEST_S:
        raise PlcError(f"interval={given[0]}: seconds above 0 are needed")
    return seconds


def load_st(
    path: str | Path, options: Options | None = None, tell_on: int = 2
) -> list[type]:
    """The task classes of an ST program.  PlcError: it is wrong or has no PROGRAM.

    ``tell_on``: descriptor for lines of the running program.
    """
    chosen = options or options_of()
    built = build(sources_of([path]), chosen)
    shared = Shared(str(Path(path).resolve()), built, tell_on)
    found = []
    for row in built.description["tasks"]:
        for name in row["programs"]:
            found.append(_class(shared, row, name))  # noqa: PERF401
    if not found:
        raise PlcError(f"{path}: no PROGRAM found; a task runs programs")
    return found


def _class(shared: Shared, row: dict[str, Any], name: str) -> type:
    known = {n.upper(): n for n in shared.built.description["roots"]}
    if name.upper() not in known:
        names = ", ".join(known.values()) or "none"
        text = f"task {row['name']}: no PROGRAM {name}; there are {names}"
        raise PlcError(f"{shared.path}: {text}")
    spelled = known[name.upper()]
    members = {"_st_shared": shared, "_st_name": spelled}
    cls = type(spelled, (StTask,), members)
    cls.__qualname__ = spelled
    cls.__module__ = "plc_program_st"
    marked: type = task(row["interval"], row["priority"])(cls)
    return marked
