"""The program as instructions and searches see it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from cnc_core.frontend.base.flow import Flow, Mark
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.port import ChannelPort, Wait

from .parameters import Parameters
from .store import Store


class ProgramHost(Protocol):
    """What instructions and searches may ask of the program.

    ``steps``: blocks executed so far.  ``waits``: when a WAIT_INPUT has begun,
    s, by its place.  ``tool_place``: level, block and open loops of the last T.
    """

    steps: int
    waits: dict[int, float]
    tool_place: tuple[int, Mark, list[Any]] | None

    @property
    def flow(self) -> Flow: ...

    @property
    def modal(self) -> Modal: ...

    @property
    def mark(self) -> Mark:
        """Where the block begins that is being prepared."""
        ...

    @property
    def store(self) -> Store: ...

    @property
    def parameters(self) -> Parameters: ...

    @property
    def port(self) -> ChannelPort: ...

    # how the program runs

    @property
    def answers(self) -> bool:
        """A machine that moves answers the waits."""
        ...

    @property
    def asks(self) -> bool:
        """An operator may change what the program sees."""
        ...

    @property
    def collecting(self) -> bool:
        """The program is only checked: its errors are collected."""
        ...

    @property
    def waits_passed(self) -> int: ...

    @property
    def compensated(self) -> bool:
        """Tool radius compensation holds rows back."""
        ...

    @property
    def place_found(self) -> bool:
        """No place is searched for, or it has been reached."""
        ...

    # what the program is asked to do

    def warn(self, code: int, text: str, offset: int) -> None:
        """A warning at a column of the block that is executed."""
        ...

    def held_rows(self) -> list[Row | Wait]:
        """Rows that the corners still hold; they hold none behind it."""
        ...

    def put_out(self, items: Sequence[Row | Wait]) -> None:
        """Rows and waits in front of the next block."""
        ...

    def scan_plain_lines(self, on: bool) -> None:
        """Whether the scanner reads plain lines, or the parser every line."""
        ...

    def visit(self, begin: Mark, end: Mark) -> None:
        """Check blocks that are left out."""
        ...

    def end_program(self) -> None:
        """Nothing follows but the rows held back and the macro M_END."""
        ...

    def revive(self) -> None:
        """The program goes on although its end has begun."""
        ...

    # macros and files

    def call_event(self, name: str) -> bool:
        """Call the macro of an event now; False if there is none."""
        ...

    def pause_macro(self, event: str) -> Path | None:
        """File of an event's macro, None if there is none."""
        ...

    def text_of(self, name: str, offset: int) -> str | None:
        """Text of a file that the program reads, None if there is none."""
        ...

    def write_file(self, name: str, text: str) -> None:
        """Write a file in the folder of the run."""
        ...
