"""One task of the user while it runs: its instance, its schedule, its statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from time import monotonic_ns
from typing import Any

from .guard import Guard, TaskOverrun
from .stats import Totals
from .task import PlcError, TaskSpec, describe, spec_of

# setup(), finished() and result() may take so many times a scan's watchdog
SETUP_WATCHDOG = 6.0


@dataclass(eq=False)
class Program:
    """One task of the user with its statistics, which outlive re-attachments
    and restarts.
    """

    instance: Any
    name: str
    spec: TaskSpec
    times: Totals = field(default_factory=Totals)
    overruns: int = 0
    jitter_ns: int = 0
    restarts: int = 0
    due: int = 0
    interval_ticks: int = 1
    interval_s: float = 0.0  # in which it runs; 0: as specified
    scans_after_end: int = 0
    factory: Any = None
    arguments: tuple[Any, ...] = ()
    guard: Guard = field(
        default_factory=Guard
    )  # the scanner's, from its start on
    started_ns: int = -1
    warnings: list[str] = field(default_factory=list)
    ready: bool = False  # setup() has returned, once at least
    _interval_ns: int = 0

    @classmethod
    def of(cls, task_class: type, *args: Any, name: str = "") -> Program:
        """Instance of a user's class; PlcError names the place if the
        constructor fails.
        """
        program = cls(
            None,
            name or task_class.__qualname__,
            spec_of(task_class),
            factory=task_class,
            arguments=args,
        )
        program.instance = program._made()
        return program

    def _made(self) -> Any:
        try:
            return self.factory(*self.arguments)
        except (Exception, SystemExit) as error:
            raise PlcError(describe(error)) from error

    def become(self, task_class: type) -> Program:
        """The same task from the next restart on, of a class that was read anew."""
        self.factory, self.spec = task_class, spec_of(task_class)
        return self

    def restart(self) -> None:
        """A new instance of the class; the statistics go on."""
        if self.factory is not None:
            self.instance = self._made()
        self.restarts += 1
        self.started_ns = -1

    def call(self, method: str, *args: Any) -> Any:
        """Call ``setup()``, ``finished()`` or ``result()``; PlcError: it fails
        or does not return in time.
        """
        limit = self.spec.watchdog * SETUP_WATCHDOG
        try:
            self.guard.begin(limit)
            return getattr(self.instance, method)(*args)
        except (Exception, SystemExit, TaskOverrun) as error:
            raise self._failure(method, limit, error) from error
        finally:
            self.guard.end()

    def scan(self, now: int, at_ns: int | None, ended: bool) -> None:
        """One ``cyclic()`` at tick `now`; ``at_ns``: when, on the cell's clock
        (None: the wall's clock counts).

        Raises PlcError as ``call`` does.  Most of what a PLC's scan costs
        beside the user's code is here.
        """
        begin = monotonic_ns()
        self._note_period(begin if at_ns is None else at_ns)
        self.call_cyclic()
        self.times.add(monotonic_ns() - begin)
        self.scans_after_end += ended
        self.schedule(now)

    def call_cyclic(self) -> None:
        """``cyclic()`` under the watchdog.  Raises PlcError as ``call`` does."""
        guard = self.guard
        try:
            guard.begin(self.spec.watchdog)
            self.instance.cyclic()
        except (Exception, SystemExit, TaskOverrun) as error:
            raise self._failure("cyclic", self.spec.watchdog, error) from error
        finally:
            guard.end()

    def _failure(
        self, method: str, limit: float, error: BaseException
    ) -> PlcError:
        if isinstance(error, TaskOverrun):
            text = f"task watchdog: {method}() of {self.name} did not return within {limit:g} s"
            error = TaskOverrun(text).with_traceback(error.__traceback__)
        return PlcError(describe(error))

    def has(self, method: str) -> bool:
        """Whether the user gave this optional method."""
        return callable(getattr(self.instance, method, None))

    def start(self, interval_ticks: int, guard: Guard) -> None:
        """The first scan comes next: no period was measured yet."""
        self.interval_ticks, self.guard = interval_ticks, guard
        self._interval_ns = round(self.spec.interval * 1e9)
        self.scans_after_end = 0
        self.started_ns = -1

    def _note_period(self, at_ns: int) -> None:
        """A scan begins at this time: how far is its period from the interval?"""
        if self.started_ns >= 0:
            off = abs(at_ns - self.started_ns - self._interval_ns)
            if off > self.jitter_ns:  # noqa: PLR1730 (quicker than max())
                self.jitter_ns = off
        self.started_ns = at_ns

    def schedule(self, now: int) -> None:
        """Set the next due tick behind `now`; intervals that passed entirely
        without a scan are overruns.
        """
        self.due += self.interval_ticks
        if self.due <= now:
            missed = (now - self.due) // self.interval_ticks + 1
            self.overruns += missed
            self.due += missed * self.interval_ticks

    def report(self) -> dict[str, Any]:
        """Statistics: times of ``cyclic()`` in us; jitter: largest deviation of
        a period from the interval.
        """
        return {
            "interval_s": self.interval_s or self.spec.interval,
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
