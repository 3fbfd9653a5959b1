"""The program file as a stream of lines, in bounded memory."""

from __future__ import annotations

import codecs
import io
import re
from pathlib import Path
from typing import BinaryIO

from cnc_core.errors import CncError, Place
from cnc_core.files import Folders, open_regular, unreadable

CHUNK_BYTES = 1 << 20
# the longest line kept: a block's characters in UTF-8, and a line break
LINE_BYTES = 4 * 4096 + 16
HEAD_BYTES = 65536
# no text has them; DC1 to DC4, DEL and the end of a file of DOS come with
# programs from punched tape and serial lines
BINARY = re.compile(rb"[\x00-\x06\x0e-\x10\x15-\x19\x1b-\x1f]")
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def _utf_16(head: bytes) -> bool:
    """By its mark, or by every second byte of plain text being 0."""
    marked = head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    halves = any(head[::2]), any(head[1::2])
    return marked or (len(head) > 1 and halves[0] != halves[1])


class Source:
    """A program file: chunks for the scanner, lines for the parser, places for
    jumps.

    ``buffer[offset:]`` has been read from the file and not been consumed.
    ``final``: the file ends with the buffer.
    ``folders``: where a called file may lie.  None: the user has named it.
    Consumed bytes stay in the buffer until the next chunk is read. Short jumps
    back therefore cost nothing.
    """

    def __init__(
        self,
        path: Path,
        chunk_bytes: int = CHUNK_BYTES,
        folders: Folders | None = None,
    ) -> None:
        self.path = path
        self._folders = folders
        self.buffer = b""
        self.offset = 0
        self.final = False
        self._base = 0  # place of buffer[0] in the file
        self._chunk_bytes = chunk_bytes
        self._file = self._open()
        while not self.final and len(self.buffer) < len(BYTE_ORDER_MARK):
            self.refill()
        if self.buffer.startswith(BYTE_ORDER_MARK):
            self.offset = len(BYTE_ORDER_MARK)
        self._begin = self.offset
        self._refuse_binary()

    def _open(self) -> BinaryIO:
        if self._folders is None:
            return open_regular(self.path)
        return self._folders.open(self.path)

    def _unreadable(self, error: OSError) -> CncError:
        return unreadable(self.path, error)

    def _refuse_binary(self) -> None:
        """CncError for a file that is no text, before each byte is an error."""
        head = self.buffer[:HEAD_BYTES]
        found = BINARY.search(head)
        if found is None:
            return
        self.close()
        text = f"no text: byte 0x{found[0][0]:02x} at offset {found.start()}"
        if _utf_16(head):
            text = "the file is UTF-16: save it as UTF-8"
        line = head.count(b"\n", 0, found.start()) + 1
        column = found.start() - head.rfind(b"\n", 0, found.start())
        raise CncError(901009, text, Place(str(self.path), line, column))

    def close(self) -> None:
        self._file.close()

    @property
    def exhausted(self) -> bool:
        return self.final and self.offset >= len(self.buffer)

    @property
    def position(self) -> int:
        """Bytes of the file in front of the next text."""
        return self._base + self.offset

    def seek(self, position: int) -> None:
        """Go on at a place that ``position`` returned before."""
        position = max(position, self._begin)
        offset = position - self._base
        if 0 <= offset <= len(self.buffer):
            self.offset = offset
            return
        try:
            self._file.seek(position)
        except OSError as error:
            raise self._unreadable(error) from None
        self.buffer, self.offset, self._base, self.final = (
            b"",
            0,
            position,
            False,
        )

    def hop(self, pattern: re.Pattern[bytes]) -> int:
        """Consume whole lines up to the first one with a match of ``pattern``.

        Returns their number. The pattern must not match across line breaks.
        """
        lines = 0
        while True:
            found = pattern.search(self.buffer, self.offset)
            end = found.start() if found else len(self.buffer)
            begin = (
                self.buffer.rfind(b"\n", self.offset, end) + 1 or self.offset
            )
            lines += self.buffer.count(b"\n", self.offset, begin)
            self.offset = begin
            if found or self.final or len(self.buffer) - begin > LINE_BYTES:
                break
            self.refill()
        # a last line without a line break
        if not found and self.final and not self.exhausted:
            lines += 1
            self.offset = len(self.buffer)
        return lines

    def refill(self) -> None:
        """Drop what is consumed and read one chunk more."""
        try:
            chunk = self._file.read(self._chunk_bytes)
        except OSError as error:
            raise self._unreadable(error) from None
        self.final = not chunk
        if self.final:
            return  # short jumps back stay in the buffer
        self.buffer = self.buffer[self.offset :] + chunk
        self._base += self.offset
        self.offset = 0

    def line(self) -> str | None:
        """The next physical line without its line break and trailing blanks.

        None: the end of the file. A line longer than any block returns its
        beginning only, which is still longer than a block.
        """
        if self.exhausted:
            return None
        end = self._line_end()
        if self.exhausted:
            return (
                None  # the file ended with a line break, which shows only now
            )
        raw = self.buffer[self.offset : end if end >= 0 else len(self.buffer)]
        self.offset += len(raw) + (1 if end >= 0 else 0)
        if end < 0 and not self.final:
            raw = raw[:LINE_BYTES] + self._discard_line(raw)
        return decode(raw).rstrip(" \t\r")

    def _line_end(self) -> int:
        """Place of the line break.

        -1: the file ends first, or the line is too long.
        """
        end = self.buffer.find(b"\n", self.offset)
        while (
            end < 0
            and not self.final
            and len(self.buffer) - self.offset <= LINE_BYTES
        ):
            self.refill()
            end = self.buffer.find(b"\n", self.offset)
        return end

    def _discard_line(self, tail: bytes) -> bytes:
        r"""Skip the rest of a line that is too long; a ``\`` if it ends with one."""
        while not self.final:
            end = self.buffer.find(b"\n", self.offset)
            rest = self.buffer[
                self.offset : end if end >= 0 else len(self.buffer)
            ]
            self.offset += len(rest) + (1 if end >= 0 else 0)
            tail = rest.rstrip(b" \t\r")[-1:] or tail[-1:]
            if end >= 0:
                break
            self.refill()
        return b"\\" if tail.endswith(b"\\") else b""


class TextSource(Source):
    """A program that stands in no file."""

    def __init__(self, path: Path, text: str) -> None:
        self._text = text.encode()
        super().__init__(path)

    def _open(self) -> BinaryIO:
        return io.BytesIO(self._text)


def decode(raw: bytes) -> str:
    """UTF-8, or Latin-1 where it is not."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")
