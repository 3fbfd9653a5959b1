"""The scans of a recorded PLC: what CNC and PLC changed in the memory, in batches
as C takes them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from hli._sync import ffi

from cnc_core.units import AnyArray

from .reading import Recording

Values = npt.NDArray[np.uint64]
Rows = AnyArray
SCANS = 4096  # of a batch
KEYS = ("scan", "cycle", "t")  # of the table ``plc``, beside the symbols
Words = tuple[Any, Any, int]
"""Words that changed: C pointers to their numbers and values, and how many."""


class Scan(NamedTuple):
    """One scan of the recorded PLC: what the CNC changed ahead of it, and what
    the PLC changed in it.
    """

    number: int
    cycle: int
    time_s: float
    cell_ns: int
    came: Words
    wrote: Words


@dataclass
class Batch:
    """Consecutive scans: arrays (n,), ``ends`` (2 n,) of the words that came and
    that were written; ``at`` and ``values`` are C pointers to all words.
    ``watched``: symbols at the scans' ends (n, symbols).
    """

    numbers: Values
    cycles: Values
    times: npt.NDArray[np.float64]
    watched: npt.NDArray[np.float64]
    ends: npt.NDArray[np.uint32]
    words: npt.NDArray[np.uint32]
    contents: Values

    def __post_init__(self) -> None:
        self.cell_ns = np.rint(self.times * 1e9).astype(np.int64)
        self.at = pointer("uint32_t *", self.words)
        self.values = pointer("uint64_t *", self.contents)

    def __len__(self) -> int:
        return len(self.numbers)

    def scan(self, i: int) -> Scan:
        """One of them."""
        first = int(self.ends[2 * i - 1]) if i else 0
        middle, last = int(self.ends[2 * i]), int(self.ends[2 * i + 1])
        return Scan(
            int(self.numbers[i]),
            int(self.cycles[i]),
            float(self.times[i]),
            int(self.cell_ns[i]),
            self._words(first, middle),
            self._words(middle, last),
        )

    def _words(self, first: int, end: int) -> Words:
        return self.at + first, self.values + first, end - first


def symbols_of(recording: Recording) -> tuple[str, ...]:
    """The watched symbols."""
    return tuple(n for n in recording.plc.columns if n not in KEYS)


def batches_of(recording: Recording) -> Iterator[Batch]:
    """All scans in order, ``setup()`` as scan 0 first; memory for a chunk of the
    tables.

    Of a recording that was cut, the scans whose changes are whole.
    """
    changes = _Changes(recording)
    for numbers, cycles, times, *watched in _times(recording):
        scan, by_plc, words, contents = changes.up_to(int(numbers[-1]))
        count = len(numbers)
        if changes.ended and not recording.complete:
            count = int(np.searchsorted(numbers, changes.last))
        if count == 0:
            return
        row = np.searchsorted(numbers[:count], scan)
        key = 2 * row.astype(np.int64) + by_plc
        order = np.argsort(key, kind="stable")
        key = key[order]
        ends = np.searchsorted(key, np.arange(1, 2 * count + 1))
        yield Batch(
            numbers[:count],
            cycles[:count],
            times[:count],
            _table(watched, count),
            ends.astype(np.uint32),
            np.ascontiguousarray(words[order], np.uint32),
            np.ascontiguousarray(contents[order], np.uint64),
        )
        if count < len(numbers):
            return


def _table(columns: list[Rows], count: int) -> npt.NDArray[np.float64]:
    """The first rows of columns, side by side."""
    found = np.empty((count, len(columns)))
    for i, column in enumerate(columns):
        found[:, i] = column[:count]
    return found


def _times(recording: Recording) -> Iterator[list[Rows]]:
    """Scan, cycle, time and symbols, at most ``SCANS`` of them; ahead of the
    first scan ``setup()``.
    """
    columns = [*KEYS, *symbols_of(recording)]
    first = True
    for chunk in recording.plc.chunks(columns):
        arrays = [column.to_numpy() for column in chunk.columns]
        if first and len(chunk):
            arrays = [np.concatenate([a[:1], a]) for a in arrays]
            arrays[0][0] = 0
            first = False
        for begin in range(0, len(arrays[0]), SCANS):
            yield [a[begin : begin + SCANS] for a in arrays]


class _Changes:
    """The table ``exchange``, taken scan by scan.

    ``ended``: there are no more; ``last``: scan of the last one.
    """

    def __init__(self, recording: Recording) -> None:
        self._chunks = recording.exchange.chunks(
            ["scan", "by_plc", "word", "value"]
        )
        self._held: list[Rows] = []
        self.ended, self.last = False, 0

    def up_to(self, scan: int) -> list[Rows]:
        """Scan, by_plc, word and value of all changes up to this scan."""
        while not self.ended and (not self._held or self.last <= scan):
            self._read()
        if not self._held:
            return [np.empty(0, np.int64)] * 4
        end = int(np.searchsorted(self._held[0], scan, side="right"))
        found = [column[:end] for column in self._held]
        self._held = [column[end:] for column in self._held]
        return found

    def _read(self) -> None:
        chunk = next(self._chunks, None)
        if chunk is None:
            self.ended = True
            return
        if not len(chunk):
            return
        fresh = [chunk.column(i).to_numpy() for i in range(4)]
        self.last = int(fresh[0][-1])
        self._held = (
            [
                np.concatenate(pair)
                for pair in zip(self._held, fresh, strict=True)
            ]
            if self._held
            else fresh
        )


def pointer(kind: str, array: AnyArray) -> Any:
    """A C pointer to an array; the caller keeps the array."""
    return ffi.cast(kind, array.ctypes.data)
