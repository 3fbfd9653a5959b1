"""What a halt of the path has left out: by rows, as preparation knows them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cnc_core._engine import ffi, lib

DONE_MAX = 1024  # functions that go out early, and rows of a block


@dataclass(frozen=True)
class LeftOut:
    """Rows that a halt has left out.

    ``row``: those below it have been executed, and of the others ``done``.
    ``path``: the row in which the path stands, behind ``driven`` of its
    ``whole`` length, mm; motions ahead of it have been driven.
    """

    row: int
    path: int
    driven: float
    whole: float
    done: frozenset[int]


def left_out_of(handle: Any) -> LeftOut:
    """Of the engine of this handle; ahead of ``engine_resync``."""
    out, done = ffi.new("engine_left *"), ffi.new("uint64_t[]", DONE_MAX)
    count = lib.engine_left_out(handle, out, done, DONE_MAX)
    return LeftOut(
        int(out.row),
        int(out.path),
        float(out.driven),
        float(out.whole),
        frozenset(int(done[i]) for i in range(count)),
    )
