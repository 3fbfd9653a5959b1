"""The page that the shim and the slave share; ``shim/wire.h`` says the same in C.

The shim writes a request, then ``asked`` goes up.  Behind the answer
``answered`` goes up to the same count.  The importer's end of a socket, the
line, closes when the importer is gone.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import select
from typing import Any

from hli._sync import ffi, lib

from hli import layout

SETUP, STEP, END, HLI = 1, 2, 3, 4
REFUSED, ENDED = 1, 2  # as before, or the cell is no more
TEXT = 4096
HLI_SIZE = ctypes.sizeof(layout.HLI_CHANNEL)
SPIN_NS = 200_000  # before a wait goes to sleep
SLICE_NS = 100_000_000  # of a sleep; then the importer is looked at


def page_type(values: int) -> type[ctypes.Structure]:
    """The page of an FMU with so many values."""

    class Page(ctypes.Structure):
        _fields_ = [
            ("asked", layout.HLI_SIDE_WORD),
            ("answered", layout.HLI_SIDE_WORD),
            ("size", ctypes.c_uint32),
            ("kind", ctypes.c_uint32),
            ("failed", ctypes.c_uint32),
            ("fill", ctypes.c_uint32),
            ("cycles", ctypes.c_uint64),
            ("text", ctypes.c_char * TEXT),
            ("program", ctypes.c_char * TEXT),
            ("values", ctypes.c_double * values),
            ("hli", ctypes.c_uint8 * HLI_SIZE),
        ]

    return Page


class Wire:
    """The slave's end: ``next`` answers, and waits for the next request."""

    def __init__(self, line: int, memory: int, values: int) -> None:
        self._line = line
        size = ctypes.sizeof(page_type(values))
        self.fits = os.fstat(memory).st_size == size
        kind = page_type(values if self.fits else 0)
        self._memory = mmap.mmap(memory, ctypes.sizeof(kind))
        self.page: Any = kind.from_buffer(self._memory)
        self._asked = self._pointer(kind, "asked")
        self._answered = self._pointer(kind, "answered")
        self._count = 0

    def _pointer(self, kind: type[ctypes.Structure], name: str) -> Any:
        place = ctypes.addressof(self.page) + getattr(kind, name).offset
        return ffi.cast("void *", place)

    @property
    def values(self) -> Any:
        """cffi ``double *`` to the row of values."""
        kind = type(self.page)
        return ffi.cast("double *", self._pointer(kind, "values"))

    def fail(self, text: str, how: int) -> None:
        """The next answer is an error with this text; ``how``: REFUSED or
        ENDED.
        """
        raw = text.encode()[: TEXT - 1]
        self.page.text = raw.decode(errors="ignore").encode()
        self.page.failed = how

    def next(self) -> int:
        """Answers the request before, if there was one, and waits: the kind of
        the next one; END: the importer is gone.
        """
        before, self._count = self._count, (self._count + 1) & 0xFFFFFFFF
        lib.hs_word_post(self._answered, before)
        while lib.hs_word_wait(self._asked, self._count, SPIN_NS, SLICE_NS):
            if self._is_gone():
                return END
        return int(self.page.kind)

    def _is_gone(self) -> bool:
        """Nothing is ever written to the line: it is readable once it is closed."""
        return bool(select.select([self._line], [], [], 0.0)[0])
