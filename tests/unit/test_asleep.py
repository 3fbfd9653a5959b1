"""Stages that sleep until a row of theirs comes."""

from __future__ import annotations

import numpy as np

from cnc_core.blocks import FILTER, LINEAR, NC_BLOCK, BlockBatch
from cnc_core.geometry.stages.asleep import Asleep
from support.limits import FloatArray


class Follower:
    """Notes what it is told."""

    def __init__(self) -> None:
        self.at: FloatArray | None = None
        self.seen: list[float] = []

    def push(self, batch: BlockBatch) -> BlockBatch:
        self.seen += list(batch.rows["end"][:, 0])
        return batch

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self.at = position


def _rows(*ends: float, kind: int = LINEAR) -> BlockBatch:
    rows = np.zeros(len(ends), NC_BLOCK)
    rows["type"], rows["end"][:, 0] = kind, ends
    return BlockBatch(rows)


def test_it_wakes_where_the_path_has_come_to() -> None:
    """The last motions are told again, from where they began."""
    inner = Follower()
    stage = Asleep([inner], FILTER, np.zeros(2))
    for batch in (_rows(1.0, 2.0), _rows(3.0), _rows(4.0)):
        assert stage.push(batch) is batch
    assert not len(stage.drain())
    assert inner.seen == []
    stage.push(_rows(0.0, kind=FILTER))
    assert inner.at is not None
    assert inner.at[0] == 3.0
    assert inner.seen == [4.0, 0.0]


def test_a_new_position_is_where_it_wakes() -> None:
    """Probing, a stop, a restart."""
    inner = Follower()
    stage = Asleep([inner], FILTER, np.zeros(2))
    stage.push(_rows(1.0, 2.0))
    stage.resync(np.array([7.0, 8.0]))
    stage.push(_rows(0.0, kind=FILTER))
    assert inner.at is not None
    assert list(inner.at) == [7.0, 8.0]
    assert inner.seen == [0.0]
