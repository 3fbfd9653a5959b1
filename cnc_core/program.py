"""A program on its way from text to final rows: front end, geometry stages, kinematics.

``Program`` is what every command uses; it knows no dialect and no engine.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from . import frontend
from .blocks import BlockBatch
from .config import CellConfig
from .errors import CncError, Place
from .geometry.stage import DropZeroLength, Pipeline
from .kinematics.limits import AxisLimits
from .port import ChannelPort, OfflinePort, Wait

BATCH_ROWS = 4096


class FrontEnd(Protocol):
    """A dialect's reader; None at the program's end."""

    errors: list[CncError]
    warnings: list[CncError]

    def read(self, rows: int) -> BlockBatch | Wait | None: ...


def source_place(path: Path, line: int) -> Place:
    """Place of a line of a program file, with its text."""
    text = ""
    try:
        with path.open("rb") as file:
            for number, raw in enumerate(file, 1):
                if number == line:
                    text = raw.decode("latin-1").rstrip("\r\n")
                    break
    except OSError:
        pass
    return Place(str(path), line, 1, text)


class Program:
    """Rows of one program file, after all stages.

    ``collect``: go on behind errors and keep them in ``errors`` (the command ``check``).
    """

    def __init__(
        self,
        path: str | Path,
        cell: CellConfig,
        dialect: str | None = None,
        port: ChannelPort | None = None,
        *,
        collect: bool = False,
    ) -> None:
        self.path, self.cell, self.collect = Path(path), cell, collect
        machine = cell.program_machine()
        self.port = port or OfflinePort(machine.start)
        self.dialect = dialect or frontend.detect(self.path)
        self.reader: FrontEnd = frontend.create(self.dialect, self.path, machine, self.port, collect=collect)
        limits = AxisLimits(cell, lambda _file, line: source_place(self.path, line))
        self.pipeline = Pipeline([DropZeroLength(), limits])
        self._own_errors: list[CncError] = []

    @property
    def errors(self) -> list[CncError]:
        """All errors found so far, in order of their lines."""
        return sorted([*self.reader.errors, *self._own_errors], key=lambda e: e.place.line)

    def read(self, rows: int = BATCH_ROWS) -> BlockBatch | Wait | None:
        """The next final rows, a wait, or None at the end.

        CncError for the first wrong block, behind all rows before it.
        """
        item = self.reader.read(rows)
        if isinstance(item, BlockBatch):
            return self._staged(item)
        if item is Wait.DRAINED or item is None:
            held = self.pipeline.drain()
            if len(held):
                raise AssertionError("a stage held rows over a flush")  # stages that hold rows arrive with compensation
        return item

    def _staged(self, batch: BlockBatch) -> BlockBatch:
        try:
            return self.pipeline.push(batch)
        except CncError as error:
            if not self.collect:
                return self._before(batch, error)
            self._own_errors.append(error)
            return batch

    def _before(self, batch: BlockBatch, error: CncError) -> BlockBatch:
        """The rows ahead of the one a stage refused; the error comes with the next read."""
        rows = batch.rows[batch.rows["line"] < error.place.line]
        self.read = self._raiser(error)  # type: ignore[method-assign]
        return BlockBatch(rows, batch.pool)

    @staticmethod
    def _raiser(error: CncError):  # type: ignore[no-untyped-def]
        def read(rows: int = BATCH_ROWS) -> BlockBatch | Wait | None:
            raise error

        return read

    def batches(self) -> Iterator[BlockBatch]:
        """All rows of a program that nobody drives: stops, M functions and waits are acknowledged at once."""
        while (item := self.read()) is not None:
            if isinstance(item, BlockBatch):
                yield item
