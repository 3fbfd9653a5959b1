"""Stages that most programs never switch on: batches go around them until then.

A macro that waits behind every motion makes batches of one row.  A dozen
stages that only look at each of them would then be most of the work.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cnc_core.blocks import ELEMENT, POLYNOMIAL, BlockBatch
from cnc_core.units import AnyArray, FloatArray

from .stage import Pipeline, Stage


class Asleep:
    """A stage around ``stages``, which change nothing before a row of type
    ``kind`` comes.

    ``start``: (axes,) position before the first row, mm or degrees.  The stages
    inside may depend on the last motions before they wake, and on nothing else.
    """

    def __init__(
        self, stages: Sequence[Stage], kind: int, start: FloatArray
    ) -> None:
        self._inside = Pipeline(stages)
        self._kind = kind
        self._awake = False
        self._start = start.copy()
        # the last two batches with motions
        self._before: BlockBatch | None = None
        self._last: BlockBatch | None = None

    @property
    def idle(self) -> bool:
        return not self._awake or self._inside.idle

    def push(self, batch: BlockBatch) -> BlockBatch:
        if not self._awake:
            types = batch.rows["type"]
            if not (types == self._kind).any():
                if (types <= POLYNOMIAL).any():
                    self._before, self._last = self._last, batch
                return batch
            self._wake()
        return self._inside.push(batch)

    def drain(self) -> BlockBatch:
        return self._inside.drain() if self._awake else BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        if self._awake:
            self._inside.resync(position)
        else:
            self._rest_from(position)

    def _rest_from(self, position: FloatArray) -> None:
        self._start = position.copy()
        self._before = self._last = None

    def _wake(self) -> None:
        """The stages get to know where the path comes from."""
        self._awake = True
        before, last = self._before, self._last
        self._inside.resync(
            self._start if before is None else _end(before.rows, self._start)
        )
        if last is not None:
            self._inside.push(last)  # comes out unchanged, as it has already
        self._before = self._last = None


def _end(rows: AnyArray, start: FloatArray) -> FloatArray:
    """(axes,) where the last driven motion ends, ``start`` without one."""
    driven = np.flatnonzero(
        (rows["type"] <= POLYNOMIAL) & (rows["flags"] & ELEMENT == 0)
    )
    if not len(driven):
        return start
    return np.asarray(rows["end"][driven[-1], : len(start)]).copy()
