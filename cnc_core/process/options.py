"""Options of one run: from the command line through the cell to the CNC process."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Any, TypedDict, TypeVar

from ..errors import CncError

Method = TypeVar("Method", bound=Callable[..., Any])
OUT_FOLDER = Path("hli-cosim-out")
STANDS_CELL_S, STANDS_WALL_S = 1.0, 3.0
CLOCKS = ("lockstep", "freerun", "realtime")
SERVICES = ("cyclic", "immediate")


@dataclass(frozen=True)
class RunOptions:
    """Choices of a user for one run of a program.

    ``clock``: ``lockstep``, ``freerun`` or ``realtime``.
    ``service``: ``cyclic`` or ``immediate``; None: the cell's.
    ``dialect``: None finds it by content and name.
    ``lenient``: unknown commands of ISG are warnings.
    ``out``: folder of the files that the program writes.
    ``record``: file of the recording.
    ``record_only``: tables and columns that are recorded; none: all.
    ``autostart`` False: the PLC starts the program by ``mode_and_state``.
    ``hold_start``: the program is prepared, nothing moves.
    ``watch``: symbols that are recorded at every scan.
    ``force``: symbols that are held at a value.
    ``inputs``: simulated inputs by symbol, beside those of the cell.
    ``answers``: file with answers to the program's dialogs.
    ``start_line``, ``start_pass``, ``start_marker``: see ``Restart``.
    ``tolerance``: path deviation, mm, that is allowed where the program commands
    none; None: the cell's.
    ``name``: of the segment; None: one of its own.
    ``strict``: a run with a warning ends with an error.
    ``max_time``: cell time, s, after which the run ends with an error.
    ``max_wall``: the same for wall time, s.  0: no limit.
    ``report_wait``: cell time and wall time, s, after which a wait is told.
    ``st``: options of a PLC in Structured Text (docs/st.md).
    """

    clock: str = "lockstep"
    dialect: str | None = None
    out: Path | None = None
    record: Path | None = None
    hold_start: bool = False
    lenient: bool = False
    autostart: bool = True
    watch: tuple[str, ...] = ()
    force: dict[str, Any] = field(default_factory=dict)
    inputs: dict[str, Any] = field(default_factory=dict)
    answers: Path | None = None
    start_line: int | None = None
    start_pass: int = 1
    start_marker: str | None = None
    service: str | None = None
    record_only: tuple[str, ...] = ()
    tolerance: float | None = None
    name: str | None = None
    strict: bool = False
    max_time: float = 0.0
    max_wall: float = 0.0
    report_wait: tuple[float, float] = (STANDS_CELL_S, STANDS_WALL_S)
    st: tuple[str, ...] = ()

    @property
    def place(self) -> tuple[int | None, int, str | None]:
        """Line, pass and marker where the program is taken up (``Restart.of``)."""
        return self.start_line, self.start_pass, self.start_marker

    def checked(self) -> RunOptions:
        """These options; CncError 902001 names the first that is wrong."""
        _one_of("clock", self.clock, CLOCKS)
        for name in ("max_time", "max_wall"):
            _not_negative(name, getattr(self, name))
        if self.tolerance is not None:
            _not_negative("tolerance", self.tolerance, "mm")
        for seconds in self.report_wait:
            _not_negative("report_wait", seconds)
        if self.service is not None:
            _one_of("service", self.service, SERVICES)
        return self


class RunKeywords(TypedDict, total=False):
    """The members of ``RunOptions`` as ``Cell.run`` takes them by keyword."""

    clock: str | None
    service: str | None
    dialect: str | None
    lenient: bool
    out: str | Path | None
    record: str | Path | bool | None
    autostart: bool
    hold_start: bool
    watch: Any
    force: dict[str, Any] | None
    inputs: dict[str, Any] | None
    answers: str | Path | None
    start_line: int | None
    start_pass: int
    start_marker: str | None
    record_only: Any
    tolerance: float | None
    name: str | None
    strict: bool
    max_time: float
    max_wall: float
    report_wait: tuple[float, float]
    st: Any


# as a caller leaves them open; the cell and ``RunOptions`` fill them in
OPEN: dict[str, Any] = {
    "clock": None,
    "watch": (),
    "force": None,
    "inputs": None,
    "record_only": (),
}


def takes_run_options(method: Method) -> Method:
    """Show the members of ``RunOptions`` in the signature of a method.

    The method takes them as ``**chosen``; help and editors see each by name.
    """
    signature = inspect.signature(method)
    own = list(signature.parameters.values())[:-1]
    shown = [
        inspect.Parameter(
            member.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=OPEN.get(member.name, member.default),
            annotation=RunKeywords.__annotations__[member.name],
        )
        for member in fields(RunOptions)
    ]
    vars(method)["__signature__"] = signature.replace(parameters=own + shown)
    return method


@dataclass(frozen=True)
class CncOptions:
    """Work of one CNC process: the user's choices and the launcher's own.

    ``file``: program of the first channel; ``more``: of the others.  None: the
    channel has no program until the PLC selects one.
    ``report``: file of the report; ``samples``: file of the CNC's part of the
    recording.  ``once``: one program, then the end.  ``terminal``:
    an operator sits there, if standard input is a terminal.  ``attended``: a
    monitor is started beside it, whose page answers dialogs.
    """

    file: Path | None
    name: str
    run: RunOptions = field(default_factory=RunOptions)
    config: Path | None = None
    report: Path | None = None
    samples: Path | None = None
    once: bool = False
    wait_plc: bool = True
    lookahead: int | None = None
    core: int = -1
    terminal: bool = True
    attended: bool = False
    more: tuple[Path | None, ...] = ()

    @property
    def programs(self) -> tuple[Path | None, ...]:
        """The channels' programs in their order."""
        return self.file, *self.more

    def as_json(self) -> str:
        """The options as the process takes them on its command line."""
        text: bytes = options_adapter().dump_json(self)
        return text.decode()

    @classmethod
    def from_json(cls, text: str) -> CncOptions:
        """The options of ``as_json``; ValueError if they are none."""
        options: CncOptions = options_adapter().validate_json(text)
        return options


@cache
def options_adapter() -> Any:
    """pydantic's reader and writer; imported by the processes that need it."""
    from pydantic import TypeAdapter  # noqa: PLC0415

    return TypeAdapter(CncOptions)


def names_of(given: Any) -> tuple[str, ...]:
    """One name, or several."""
    return (given,) if isinstance(given, str) else tuple(given)


def _not_negative(name: str, value: float, unit: str = "s") -> None:
    number = isinstance(value, int | float)
    if not (number and math.isfinite(value) and value >= 0.0):
        raise CncError(
            902001, f"{name} {value!r}: a number of {unit}, 0 or more"
        )


def _one_of(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise CncError(902001, f"{name} {value!r}: {', '.join(choices)}")
