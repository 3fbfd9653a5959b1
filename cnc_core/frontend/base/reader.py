"""The resumable reader under the front ends: plain lines through the C scanner, other blocks through the dialect."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cnc_core.blocks import NC_BLOCK, BlockBatch
from cnc_core.errors import CncError, Place
from cnc_core.frontend.base import scanner
from cnc_core.frontend.base.block_text import BlockText
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.base.source import Source
from cnc_core.port import ChannelPort, Wait

Item = Row | Wait | CncError


class BlockReader(ABC):
    """Reads one program; a dialect says how a block is taken from the text and what it does.

    ``collect``: an erroneous block is put into ``errors`` and skipped; otherwise ``read`` raises its error, after the
    rows of all blocks before it.  ``scan=False`` sends every line through the parser (tests).
    """

    def __init__(self, path: Path, modal: Modal, port: ChannelPort, *, collect: bool, scan: bool) -> None:
        self.errors: list[CncError] = []
        self.warnings: list[CncError] = []
        self.files: list[Path] = [path]
        self.modal = modal
        self._port = port
        self._collect = collect
        self._scan = scan
        self._source = Source(path)
        self._queue: deque[Item] = deque()
        self._ended = False

    @abstractmethod
    def _take_block(self) -> BlockText | None:
        """The next block's text; None at the end of the file."""

    @abstractmethod
    def _execute(self, block: BlockText) -> Sequence[Row | Wait]:
        """Rows and waits of one block; sets ``_ended`` behind the program's end."""

    def _plain(self) -> bool:
        """Plain lines mean what the scanner takes them for."""
        return True

    @property
    def block_count(self) -> int:
        """Physical lines read so far."""
        return self.modal.count

    def read(self, rows: int) -> BlockBatch | Wait | None:
        """Up to ``rows`` rows, a reason to wait, or None at the program's end."""
        if rows < 1:
            raise ValueError("rows must be positive")
        out = np.empty(rows, NC_BLOCK)
        filled = self._fill(out)
        if filled:
            return BlockBatch(out[:filled])
        if not self._queue:
            return None
        if isinstance(self._queue[0], CncError):
            raise self._queue[0]
        wait = self._queue.popleft()
        assert isinstance(wait, Wait)
        return wait

    def close(self) -> None:
        self._source.close()

    def _fill(self, out: Row) -> int:
        """Rows into ``out`` until it is full, or a wait, an error or the end is next."""
        filled = 0
        while filled < len(out):
            if self._queue:
                item = self._queue[0]
                if not isinstance(item, np.ndarray):
                    break
                out[filled] = item[0]
                filled += 1
                self._queue.popleft()
            elif self._ended:
                break
            else:
                filled += self._advance(out[filled:])
        return filled

    def _advance(self, out: Row) -> int:
        """Plain lines into ``out``, then one block of another kind into the queue; rows written to ``out``."""
        stop, rows = scanner.OTHER, 0
        if self._scan and self._plain():
            rows, stop = self.modal.scan(self._source, out)
        if stop in (scanner.OTHER, scanner.ERROR):
            self._block()
        elif stop == scanner.MORE:
            self._ended = self._source.exhausted
            if not self._ended:
                self._source.refill()
        if self._ended:
            self._source.close()
        return rows

    def _block(self) -> None:
        """One block through the parser: its rows, waits or error into the queue."""
        block = self._take_block()
        if block is None:
            self._ended = True
            return
        self.modal.count_lines(1)
        try:
            self._queue.extend(self._execute(block))
        except CncError as error:
            self._error(error, block)
        self.modal.count_lines(block.lines_read - 1)

    def _error(self, error: CncError, block: BlockText) -> None:
        error = located(error, block)
        self.errors.append(error)
        if error.code == 900006:
            self.modal.assume_feed()  # one error for one missing feed
        if not self._collect:
            self._queue.append(error)
            self._ended = True

    def _warn(self, code: int, text: str, place: Place) -> None:
        warning = CncError(code, text, place)
        self.warnings.append(warning)
        self._port.message(str(warning))


def located(error: CncError, block: BlockText) -> CncError:
    """The error with its place in the file; so far it may know only the offset in the block's text."""
    return error.at(block.place(error.place.column))
