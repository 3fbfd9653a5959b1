"""The stage protocol: batches in, batches out, in program order.

A stage may hold rows back (a compensation needs the next motion) as long as it holds the rows behind them too;
``drain`` gives out what it still holds.  ``resync`` tells it that the machine stands elsewhere than the rows say
(probing, stop, restart, LOG CLEAR).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ..blocks import POLYNOMIAL, BlockBatch


class Stage(Protocol):
    """One step of path preparation."""

    def push(self, batch: BlockBatch) -> BlockBatch:
        """Rows that are final now."""
        ...

    def drain(self) -> BlockBatch:
        """Everything still held back (program end or flush)."""
        ...

    def resync(self, position: npt.NDArray[np.float64]) -> None:
        """The path goes on from ``position`` (axes,), mm or degrees."""
        ...


class DropZeroLength:
    """Motions of no length give no row: no element, no log entry (look-ahead specification, section 2)."""

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        keep = (rows["type"] > POLYNOMIAL) | (rows["length"] > 0.0)
        return batch if keep.all() else BlockBatch(rows[keep], batch.pool)

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: npt.NDArray[np.float64]) -> None:
        pass


class Pipeline:
    """Stages in a row; itself a stage."""

    def __init__(self, stages: Sequence[Stage]) -> None:
        self.stages = list(stages)

    def push(self, batch: BlockBatch) -> BlockBatch:
        for stage in self.stages:
            batch = stage.push(batch)
        return batch

    def drain(self) -> BlockBatch:
        """What the stages hold, each one's rest pushed through those behind it."""
        parts = []
        for i, stage in enumerate(self.stages):
            held = stage.drain()
            parts.append(Pipeline(self.stages[i + 1 :]).push(held))
        rows = [p.rows for p in parts if len(p)]
        return BlockBatch(np.concatenate(rows)) if rows else BlockBatch.empty()

    def resync(self, position: npt.NDArray[np.float64]) -> None:
        for stage in self.stages:
            stage.resync(position)
