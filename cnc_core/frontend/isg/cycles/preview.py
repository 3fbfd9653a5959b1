"""A dry run ahead of a program: wrong cycle calls are refused before axes move.

The program is executed without a machine, as ``check`` does it, within bounds.
Only errors of cycles count. Nothing counts behind the first other error, nor in
a program that has read a value of the machine.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Protocol

from cnc_core.blocks import BlockBatch
from cnc_core.errors import CncError
from cnc_core.files import Folders, open_regular
from cnc_core.frontend.machine import External
from cnc_core.frontend.port import ExternalValue, OfflinePort, Wait
from cnc_core.units import FloatArray

SEARCHED_BYTES = 64 << 20
CHUNK_BYTES = 1 << 20
ROWS_MAX = 100_000
BLOCKS_MAX = 200_000
CALL = re.compile(rb"\bcycle\s*\[", re.I)
SUBPROGRAM = re.compile(rb"(?<![A-Za-z])L[ \t]+([^\s();\"\],#$]+)", re.I)
FILES_MAX = 100
CODES = frozenset({13320, 21381, 22178, *range(907101, 907109), 907110})


class Reader(Protocol):
    """The part of a front end that the dry run needs."""

    errors: list[CncError]
    idle_blocks_max: int

    def read(self, rows: int) -> BlockBatch | Wait | None: ...

    def close(self) -> None: ...


class DryPort(OfflinePort):
    """A machine that is not there.

    ``asked``: the program has read a value of the machine.
    """

    def __init__(self, position: FloatArray, skip_levels: int) -> None:
        super().__init__(position, skip_levels)
        self.asked = False

    def now_s(self) -> float:
        self.asked = True
        return 0.0

    def position(self) -> FloatArray:
        self.asked = True
        return super().position()

    def read_external(self, variable: External, element: int) -> ExternalValue:
        self.asked = True
        return super().read_external(variable, element)

    def read_file(self, name: str) -> str | None:
        self.asked = True
        return super().read_file(name)


def calls_cycles(path: Path, folders: Folders) -> bool:
    """The program, or a file that it calls, calls a cycle.

    Very long texts are searched in their beginning only.
    """
    waiting, seen = [path], {path}
    while waiting and len(seen) <= FILES_MAX:
        file = waiting.pop()
        found, called = _look_through(file, folders if file != path else None)
        if found:
            return True
        for name in called:
            try:
                file = folders.place(name, path.parent)
            except CncError:
                continue  # the call will say why
            if file not in seen:
                seen.add(file)
                waiting.append(file)
    return False


def _look_through(path: Path, folders: Folders | None) -> tuple[bool, set[str]]:
    """Whether a cycle is called, and the names of the subprogram files that are."""
    tail, called = b"", set[str]()
    try:
        opened = open_regular(path) if folders is None else folders.open(path)
    except CncError:
        return False, called
    with opened as file:
        for _ in range(SEARCHED_BYTES // CHUNK_BYTES):
            chunk = file.read(CHUNK_BYTES)
            text = (tail + chunk).lower()
            if b"cycle" in text and CALL.search(text):
                return True, called
            if not chunk:
                break
            if b"l " in text or b"l\t" in text:
                called |= {
                    name.decode("latin-1")
                    for name in SUBPROGRAM.findall(tail + chunk)
                }
            tail = chunk[-128:]
    return False, called


def wrong_calls(reader: Reader, port: DryPort) -> list[CncError]:
    """Errors of cycle calls that the dry run finds; ``reader`` collects its errors."""
    rows, reader.idle_blocks_max = 0, BLOCKS_MAX
    try:
        while (
            rows < ROWS_MAX
            and not port.asked
            and (item := reader.read(4096)) is not None
        ):
            rows += len(item) if isinstance(item, BlockBatch) else 1
    except CncError:
        pass
    finally:
        reader.close()
    found = []
    for error in reader.errors:
        if error.code not in CODES:
            break
        found.append(error)
    return [] if port.asked else found
