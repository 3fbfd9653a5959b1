"""Reading a whole program without a channel: every wait comes true at once."""

from __future__ import annotations

from collections.abc import Iterator

from ..blocks import BlockBatch
from .front_end import FrontEnd
from .port import Wait


def read_all(
    front_end: FrontEnd, rows: int = 4096
) -> Iterator[BlockBatch | Wait]:
    """Batches of up to ``rows`` rows and the waits between them, up to the
    program's end.
    """
    while (item := front_end.read(rows)) is not None:
        yield item
