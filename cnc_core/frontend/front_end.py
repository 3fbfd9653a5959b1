"""The questions that a channel may ask a front end."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from ..blocks import BlockBatch
from ..errors import CncError, Place
from ..units import FloatArray
from .machine import ProgramMachine
from .port import Wait


class FrontEnd(Protocol):
    """The reader of one program.

    ``setups``: what ``check`` prints of each setup that the program activated.
    """

    errors: list[CncError]
    warnings: list[CncError]
    files: list[Path]
    setups: list[dict[str, object]]

    @property
    def block_count(self) -> int:
        """Physical lines read so far."""
        ...

    @property
    def bytes_read(self) -> int:
        """Bytes of the main program's file in front of the next block."""
        ...

    @property
    def place_now(self) -> Place:
        """Where the block stands that is being executed, with its text."""
        ...

    @property
    def restartable(self) -> Restartable | None:
        """This front end, if its dialect has macros for pauses and restarts."""
        ...

    def read(self, rows: int) -> BlockBatch | Wait | None:
        """Up to ``rows`` rows, a reason to wait, or None at the program's end."""
        ...

    def collect_once(self, error: CncError) -> None:
        """An error that a stage finds while errors are collected."""
        ...

    def close(self) -> None: ...


class PlaceSearch(Protocol):
    """Search of the place where a program is taken up again.

    ``found``: nothing is searched for, or the place has been reached.
    """

    found: bool

    @property
    def path_reaches_back(self) -> bool:
        """The path behind the place depends on the blocks before it."""
        ...

    @property
    def go_block_macro(self) -> Path | None:
        """The macro to execute at the place, None if there is none."""
        ...

    def search(self, line: int, passes: int, marker: str, value: float) -> None:
        """Begin.  The place is a line and its pass, or a variable's value."""
        ...

    def note(self, rows: BlockBatch) -> None:
        """Rows that the search passes."""
        ...

    def go_on(self) -> BlockBatch:
        """End the search where the path stays; the functions to repeat."""
        ...

    def take_up(self, start: FloatArray) -> None:
        """End the search; the axes stand at ``start`` (axes,)."""
        ...


class Restartable(FrontEnd, Protocol):
    """A front end with macros for a pause, a stop, a restart and a retrace.

    ``RETRACING``, ``SEARCHING``: values of ``run_type`` of ``macro_reader``.
    """

    @property
    def RETRACING(self) -> int: ...

    @property
    def SEARCHING(self) -> int: ...

    @property
    def search(self) -> PlaceSearch: ...

    @property
    def compensated(self) -> bool:
        """Tool radius compensation holds rows back."""
        ...

    @property
    def pauses(self) -> bool:
        """A pause is more than a standstill."""
        ...

    @property
    def pause_mode(self) -> int:
        """0: both macros, 1: the first, 2: the last, 4: no pause allowed."""
        ...

    @property
    def has_stop(self) -> bool:
        """The cell or the program has a macro for a stop."""
        ...

    @property
    def retrace_macro(self) -> Path | None:
        """The macro to execute behind a retrace, None if there is none."""
        ...

    def pause_macro(self, event: str) -> Path | None:
        """The macro of an event, None if there is none."""
        ...

    def macro_reader(
        self,
        path: Path,
        machine: ProgramMachine,
        place: FloatArray,
        *,
        run_type: int = 0,
    ) -> FrontEnd:
        """The reader of a macro; the path was left at ``place`` (axes,)."""
        ...

    def return_speed(self) -> float:
        """Speed of the way back to the path, mm/s."""
        ...

    def begin_stop(self, position: FloatArray) -> None:
        """The axes stand at ``position`` (axes,): execute the stop's macro."""
        ...
