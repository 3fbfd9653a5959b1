"""Rows that the stages would pass on as they come, put through together.

A macro behind every motion waits until everything before it has been executed.
The front end then hands out batches of one row.  Where nobody drives, the wait
is true at once, and all it asks of the stages is to give out what they hold.
While they are idle that changes nothing.  So rows are gathered here across the
waits, and the stages see them in one batch.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np

from ..blocks import (
    CIRCULAR,
    DWELL,
    EVENT,
    LINEAR,
    POLYNOMIAL,
    BlockBatch,
    H,
    M,
    S,
    T,
)
from ..blocks.pool import joined, rows_of
from ..geometry.stages.stage import RefusedRow, Stage
from ..units import FloatArray

# makes a step of the stages; what comes in place of a refused one
Staged = Callable[[Callable[[], BlockBatch], BlockBatch], BlockBatch]
# types of rows that switch no stage
PASSING = np.zeros(256, np.bool_)
PASSING[[LINEAR, CIRCULAR, DWELL, M, H, S, T, EVENT]] = True
# rows of a batch that are worth it; rows that are gathered
SMALL, MOST = 64, 4096
REFUSED_MAX = 64  # rows that stages hold and refuse, one a drain


class Gathered:
    """``stages``: where the rows go.

    ``drained``: a wait stands behind the last batch.
    """

    def __init__(self, stages: Stage) -> None:
        self._stages = stages
        self._parts: list[bytes] = []
        self._rows = 0
        self._end: FloatArray | None = None
        self.drained = False

    def __bool__(self) -> bool:
        """Something is kept."""
        return bool(self._parts)

    def takes(self, batch: BlockBatch) -> bool:
        """Keep a batch; False if the stages have to see it, behind what is kept."""
        rows = batch.rows
        if batch.profile is not None or len(rows) > SMALL:
            return False
        kinds = rows["type"]
        if not PASSING[kinds].all() or len(batch.pool):
            return False
        if not self._parts and not self._stages.idle:
            return False
        self._parts.append(rows.tobytes())
        self._rows += len(rows)
        moving = (kinds <= POLYNOMIAL).nonzero()[0]
        if len(moving):
            self._end = rows["end"][moving[-1]].copy()
        self.drained = False
        return True

    @property
    def full(self) -> bool:
        return self._rows >= MOST

    def end(self, before: FloatArray) -> FloatArray:
        """(axes,) where the last motion ends; ``before``: without one."""
        return before if self._end is None else self._end[: len(before)]

    def put_through(
        self, start: FloatArray, staged: Staged, ended: Callable[[], bool]
    ) -> BlockBatch:
        """What is kept, through the stages, from ``start`` (axes,) on.

        If one refuses a row, batch by batch, as if nothing had been gathered:
        ``staged`` makes a step and reports what is refused; ``ended``: nothing
        may follow.
        """
        kept, self._parts, self._rows, self._end = self._parts, [], 0, None
        parts = [BlockBatch(rows_of(part)) for part in kept]
        try:
            out = self._stages.push(joined(parts))
            if self.drained:
                out = joined([out, self._stages.drain()])
            return out
        except RefusedRow:
            self._empty()
            self._stages.resync(start)
        done = []
        for part in parts:
            done.append(staged(partial(self._stages.push, part), part))
            if not ended():
                done.append(staged(self._stages.drain, BlockBatch.empty()))
            if ended():
                break
        return joined(done)

    def _empty(self) -> None:
        """What the stages hold is given up, refused rows too."""
        for _ in range(REFUSED_MAX):
            with suppress(RefusedRow):
                self._stages.drain()
                return
