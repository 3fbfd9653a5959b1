"""Plain lines of a profile read many at a time: letters and numbers as columns,
no object per line.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cnc_core.frontend.base.source import Source
from cnc_core.units import FloatArray

TAKEN_BYTES = 1 << 18  # read at a time
_BLANK = b"0123456789.+- \t\r"
_SPACES = bytes.maketrans(
    bytes(range(65, 91)) + bytes(range(97, 123)), b" " * 52
)


@dataclass
class Columns:
    """``values`` (lines, letters): NaN where a line has no such word.
    ``number``: N of each line, -1 without.
    """

    values: FloatArray
    number: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.values)


class ColumnReader:
    """Reads runs of lines made of N, G1 (if ``straight``) and words of
    ``letters`` alone.
    """

    def __init__(self, letters: str, *, straight: bool = True) -> None:
        self._letters = letters
        motion = rb"(?>G0?1(?![0-9.])[ \t]*)?" if straight else b""
        word = (
            rb"(?>["
            + letters.encode()
            + rb"][ \t]*[+-]?(?>[0-9]++\.?[0-9]*+|\.[0-9]++)[ \t]*)"
        )
        line = (
            rb"[ \t]*(?>N[0-9]{1,9}(?![0-9.])[ \t]*)?"
            + motion
            + word
            + rb"*+\r?\n"
        )
        self._run = re.compile(rb"(?>" + line + rb")*+")
        self._column = np.full(128, -1, np.int64)
        for i, letter in enumerate(letters):
            self._column[ord(letter)] = i

    def take(self, source: Source, lines_max: int) -> Columns | None:
        """The lines that stand next; None if the next line is none of them (or
        the file ends without a line break).
        """
        begin = source.offset
        found = self._run.match(source.buffer, begin, begin + TAKEN_BYTES)
        end = found.end() if found else begin
        if end == begin:
            return None
        text = source.buffer[begin:end]
        if text.count(b"\n") > lines_max:
            text = text[: _line_end(text, lines_max)]
        columns, used = self._columns(text)
        if not len(columns):
            return None
        source.offset = begin + (
            len(text) if used == len(columns) else _line_end(text, len(columns))
        )
        return columns

    def _columns(self, text: bytes) -> tuple[Columns, int]:
        letters = np.frombuffer(text.translate(None, _BLANK), np.uint8)
        breaks = letters == 10
        line = np.cumsum(breaks)[~breaks]
        words, lines = letters[~breaks], int(breaks.sum())
        numbers = np.fromstring(text.translate(_SPACES), np.float64, sep=" ")
        number = np.full(lines, -1, np.int64)
        is_n = words == ord("N")
        number[line[is_n]] = numbers[is_n].astype(np.int64)
        wanted = ~is_n & (words != ord("G"))
        line = line[wanted]
        column = self._column[words[wanted]]
        numbers = numbers[wanted]
        whole = _before_doubles(line * 128 + column, line, lines)
        values = np.full((lines, len(self._letters)), np.nan)
        values[line, column] = numbers
        return Columns(values[:whole], number[:whole]), lines


def _line_end(text: bytes, lines: int) -> int:
    """Bytes of the first ``lines`` lines."""
    ends = np.flatnonzero(np.frombuffer(text, np.uint8) == 10)
    return int(ends[lines - 1]) + 1


def _before_doubles(
    key: npt.NDArray[np.int64], line: npt.NDArray[np.int64], lines: int
) -> int:
    """Lines ahead of the first one with a letter twice (the parser says what is
    wrong with it).
    """
    order = np.argsort(key, kind="stable")
    double = np.flatnonzero(np.diff(key[order]) == 0)
    return int(line[order][double].min()) if len(double) else lines
