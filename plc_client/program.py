"""One task of the user while it runs: its instance, its schedule, its statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from .guard import Guard, TaskOverrun
from .stats import Reservoir
from .task import PlcError, TaskSpec, describe, spec_of

SETUP_WATCHDOG = 6.0  # setup(), finished() and result() may take so many times a scan's watchdog


@dataclass
class Program:
    """One task of the user with its statistics, which outlive re-attachments and restarts."""

    instance: Any
    name: str
    spec: TaskSpec
    times: Reservoir = field(default_factory=Reservoir)
    overruns: int = 0
    jitter_ns: int = 0
    restarts: int = 0
    due: int = 0
    interval_ticks: int = 1
    scans_after_end: int = 0
    factory: Any = None
    arguments: tuple[Any, ...] = ()
    guard: Guard | None = None
    started_ns: int = -1

    @classmethod
    def of(cls, task_class: type, *args: Any, name: str = "") -> Program:
        """Instance of a user's class; PlcError names the place if the constructor fails."""
        program = cls(None, name or task_class.__qualname__, spec_of(task_class), factory=task_class, arguments=args)
        program.instance = program._made()
        return program

    def _made(self) -> Any:
        try:
            return self.factory(*self.arguments)
        except (Exception, SystemExit) as error:
            raise PlcError(describe(error)) from error

    def restart(self) -> None:
        """A new instance of the class; the statistics go on."""
        if self.factory is not None:
            self.instance = self._made()
        self.restarts += 1
        self.started_ns = -1

    def call(self, method: str, *args: Any) -> Any:
        """Call one of the user's methods; PlcError names the place if it fails or does not return in time."""
        limit = self.spec.watchdog * (1.0 if method == "cyclic" else SETUP_WATCHDOG)
        try:
            if self.guard is not None:
                self.guard.begin(limit)
            return getattr(self.instance, method)(*args)
        except (Exception, SystemExit) as error:
            raise PlcError(describe(error)) from error
        except TaskOverrun as error:
            text = f"task watchdog: {method}() of {self.name} did not return within {limit:g} s"
            raise PlcError(describe(TaskOverrun(text).with_traceback(error.__traceback__))) from error
        finally:
            if self.guard is not None:
                self.guard.end()

    def has(self, method: str) -> bool:
        """Whether the user gave this optional method."""
        return callable(getattr(self.instance, method, None))

    def begins(self, at_ns: int, interval_ns: int) -> None:
        """A scan begins at this time of the pacer's clock: how far is its period from the interval?"""
        if self.started_ns >= 0:
            off = abs(at_ns - self.started_ns - interval_ns)
            self.jitter_ns = max(self.jitter_ns, off)
        self.started_ns = at_ns

    def schedule(self, now: int) -> None:
        """Set the next due tick behind `now`; intervals that passed entirely without a scan are overruns."""
        missed = max(now - self.due, 0) // self.interval_ticks
        self.overruns += missed
        self.due += (missed + 1) * self.interval_ticks

    def report(self) -> dict[str, Any]:
        """Statistics: times of ``cyclic()`` in us; jitter: largest deviation of a period from the interval."""
        return {
            "interval_s": self.spec.interval,
            "priority": self.spec.priority,
            "scans": self.times.n,
            "overruns": self.overruns,
            **self.times.summary_us(),
            "jitter_us": self.jitter_ns / 1e3,
            "restarts": self.restarts,
        }


def task_statistics(programs: Sequence[Program]) -> dict[str, dict[str, Any]]:
    """Statistics of all tasks by name; classes of one name are numbered."""
    found: dict[str, dict[str, Any]] = {}
    for program in programs:
        name, n = program.name, 2
        while name in found:
            name, n = f"{program.name}#{n}", n + 1
        found[name] = program.report()
    return found
