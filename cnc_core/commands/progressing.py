"""How far a command is: on a terminal a bar by bytes of the program, with N,
cell time, speed and estimate; elsewhere nothing.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
    TransferSpeedColumn,
)

from .console import err, out

LOOK_S = 0.2  # between two looks, wall time
BAR = 16  # columns
CHUNK = 1 << 20


class Bar:
    """The bar of one program file; it never goes back."""

    def __init__(self, shown: Progress, title: str, size: int) -> None:
        self._shown, self._size = shown, max(size, 1)
        self._task = shown.add_task(title, total=self._size, place="")
        self._read, self._next = 0, 0.0

    @property
    def due(self) -> bool:
        """It is time for another look, and somebody sees it."""
        return not self._shown.disable and time.monotonic() >= self._next

    def show(
        self, read: float, n: int = 0, cell_s: float | None = None
    ) -> None:
        """``read``: bytes of the program that are done."""
        self._next = time.monotonic() + LOOK_S
        self._read = max(self._read, min(int(read), self._size))
        place = f"N{n}" if n else ""
        if cell_s is not None:
            place += f" {cell_s:.1f} s"
        self._shown.update(
            self._task, completed=self._read, place=place.strip()
        )

    def share(self, done: float, n: int) -> None:
        """The share of the work that is done, and N."""
        if self.due or done >= 1.0:
            self.show(done * self._size, n)

    def program(
        self, program: Any, n: int, cell_s: float | None = None
    ) -> None:
        """A program that is being read."""
        if self.due:
            self.show(program.bytes_read, n, cell_s)


@contextmanager
def program_bar(
    title: str, file: Path, *, printing: bool = False
) -> Iterator[Bar]:
    """A bar for ``file``.

    ``printing``: the command prints meanwhile, so that a terminal on standard
    output belongs to it.
    """
    hidden = not err.is_terminal or (printing and out.is_terminal)
    size = file.stat().st_size if file.is_file() else 0
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(BAR),
        TaskProgressColumn(),
        TextColumn("{task.fields[place]}"),
        TransferSpeedColumn(),
        TimeRemainingColumn(),
        console=err,
        transient=True,
        disable=hidden,
    ) as shown:
        yield Bar(shown, title, size)


@contextmanager
def run_bar(title: str, file: Path) -> Iterator[Callable[[str], None]]:
    """A bar for a run; call the result with its segment's name.

    Lines that were executed stand for bytes.
    """
    from hli.errors import HliError  # noqa: PLC0415
    from hli.segment import Segment, attach  # noqa: PLC0415

    seen: list[Segment] = []

    with program_bar(title, file) as bar:
        lines = _lines(file) if bar.due else 1
        size = file.stat().st_size if file.is_file() else 0

        def look(name: str) -> None:
            if not bar.due:
                return
            with contextlib.suppress(HliError):
                if not seen:
                    seen.append(attach(name))
                root = seen[0].root
                state = root.channel[0].bahn_state
                bar.show(
                    state.block_count_r / lines * size,
                    state.block_number_r,
                    root.sidecar.cnc.cell_time_ns * 1e-9,
                )

        try:
            yield look
        finally:
            for segment in seen:
                segment.close()


def _lines(file: Path) -> int:
    """Lines of a file, at least 1."""
    with contextlib.suppress(OSError), file.open("rb") as text:
        count = sum(
            part.count(b"\n") for part in iter(lambda: text.read(CHUNK), b"")
        )
        return max(count, 1)
    return 1
