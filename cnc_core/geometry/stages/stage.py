"""The stage protocol: batches in, batches out, in program order.

A stage may hold rows back (a compensation needs the next motion) as long as it
holds the rows behind them too; ``drain`` gives out what it still holds.
``resync`` tells it that the machine stands elsewhere than the rows say
(probing, stop, restart, LOG CLEAR).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

from cnc_core.blocks import POLYNOMIAL, BlockBatch
from cnc_core.blocks.pool import joined
from cnc_core.errors import CncError
from cnc_core.units import FloatArray


class RefusedRow(Exception):  # noqa: N818 - it is the row that is refused, the error is inside
    """A stage refuses a row: the error, the final rows ahead of that row, and
    its ``count`` (0 if not known).

    A line comes again in a loop, its ``count`` does not.
    """

    def __init__(
        self, error: CncError, ahead: BlockBatch, count: int = 0
    ) -> None:
        super().__init__(str(error))
        self.error, self.ahead, self.count = error, ahead, count


class Stage(Protocol):
    """One step of path preparation."""

    @property
    def idle(self) -> bool:
        """Nothing is held, and rows without a word for the stage pass as they are.

        The stage then remembers where the last motion ended, and nothing else.
        """
        ...

    def push(self, batch: BlockBatch) -> BlockBatch:
        """Rows that are final now. RefusedRow for the first wrong one."""
        ...

    def drain(self) -> BlockBatch:
        """Everything still held back (program end or flush)."""
        ...

    def resync(self, position: FloatArray) -> None:
        """The path goes on from ``position`` (axes,), mm or degrees."""
        ...


class DropZeroLength:
    """Motions of no length give no row: no element, no log entry (look-ahead
    specification, section 2).
    """

    idle = True

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        keep = (rows["type"] > POLYNOMIAL) | (rows["length"] > 0.0)
        return batch if keep.all() else BlockBatch(rows[keep], batch.pool)

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        pass


def _tried(
    step: Callable[[], BlockBatch],
) -> tuple[BlockBatch, RefusedRow | None]:
    """The rows of one step, and why there are no more of them."""
    try:
        return step(), None
    except RefusedRow as refused:
        return refused.ahead, refused


class Pipeline:
    """Stages in a row; itself a stage."""

    def __init__(self, stages: Sequence[Stage]) -> None:
        self.stages = list(stages)
        self._drained = False  # nothing has come since

    @property
    def idle(self) -> bool:
        return all(stage.idle for stage in self.stages)

    def push(self, batch: BlockBatch) -> BlockBatch:
        self._drained = False
        return self._from(0, batch, None)

    def drain(self) -> BlockBatch:
        """What the stages hold, each one's rest pushed through those behind it."""
        if self._drained:
            return BlockBatch.empty()
        parts = []
        for i, stage in enumerate(self.stages):
            held, refusal = _tried(stage.drain)
            if refusal is None and not len(held) and held.profile is None:
                continue
            try:
                parts.append(self._from(i + 1, held, refusal))
            except RefusedRow as refused:
                raise RefusedRow(
                    refused.error,
                    joined([*parts, refused.ahead]),
                    refused.count,
                ) from None
        self._drained = True
        return joined(parts)

    def _from(
        self, first: int, batch: BlockBatch, refusal: RefusedRow | None
    ) -> BlockBatch:
        """Rows through the stages from ``first`` on, and why there are no more.

        Of several refused rows the one ahead of the others counts.  Stages see
        no empty batches.
        """
        for stage in self.stages[first:]:
            if not len(batch) and batch.profile is None:
                break
            batch, later = _tried(partial(stage.push, batch))
            refusal = later or refusal
        if refusal:
            raise RefusedRow(refusal.error, batch, refusal.count)
        return batch

    def resync(self, position: FloatArray) -> None:
        for stage in self.stages:
            stage.resync(position)
