"""A dry run ahead of a program that calls cycles: wrong calls are refused before any axis moves.

The program is executed without a machine, as ``check`` does it, within bounds.  Only what concerns cycles counts, and
nothing counts behind the first other error or in a program that has read what only the machine knows.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import BlockBatch
from cnc_core.errors import CncError
from cnc_core.frontend.machine import External
from cnc_core.port import ExternalValue, OfflinePort, Wait

SEARCHED_BYTES = 64 << 20
CHUNK_BYTES = 1 << 20
ROWS_MAX = 100_000
BLOCKS_MAX = 200_000
CALL = re.compile(rb"\bcycle\s*\[", re.I)
CODES = frozenset({13320, 21381, 22178, *range(907101, 907109)})


class Reader(Protocol):
    """The front end, as far as the dry run needs it."""

    errors: list[CncError]
    idle_blocks_max: int

    def read(self, rows: int) -> BlockBatch | Wait | None: ...

    def close(self) -> None: ...


class DryPort(OfflinePort):
    """A machine that is not there; ``asked``: the program wanted to know something of it."""

    def __init__(self, position: npt.NDArray[np.float64], skip_levels: int) -> None:
        super().__init__(position, skip_levels)
        self.asked = False

    def now_s(self) -> float:
        self.asked = True
        return 0.0

    def position(self) -> npt.NDArray[np.float64]:
        self.asked = True
        return super().position()

    def read_external(self, variable: External, element: int) -> ExternalValue:
        self.asked = True
        return super().read_external(variable, element)

    def read_file(self, name: str) -> str | None:
        self.asked = True
        return super().read_file(name)


def calls_cycles(path: Path) -> bool:
    """The text of the program, its beginning if it is very long, calls a cycle."""
    if not path.is_file():
        return False
    tail = b""
    with path.open("rb") as file:
        for _ in range(SEARCHED_BYTES // CHUNK_BYTES):
            chunk = file.read(CHUNK_BYTES)
            if CALL.search(tail + chunk):
                return True
            if not chunk:
                break
            tail = chunk[-64:]
    return False


def wrong_calls(reader: Reader, port: DryPort) -> list[CncError]:
    """Errors of cycle calls that the dry run finds; ``reader`` collects its errors."""
    rows, reader.idle_blocks_max = 0, BLOCKS_MAX
    try:
        while rows < ROWS_MAX and not port.asked and (item := reader.read(4096)) is not None:
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
