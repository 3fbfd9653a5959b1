"""Stages in a row."""

import numpy as np

from cnc_core.blocks import NC_BLOCK, BlockBatch
from cnc_core.blocks.profile_columns import ProfileChunk
from cnc_core.geometry.stages.stage import Pipeline


class Seen:
    """Counts what it is given."""

    def __init__(self):
        self.count = 0

    def push(self, batch):
        self.count += 1
        return batch

    def drain(self):
        return BlockBatch.empty()

    def resync(self, position):
        pass


def test_stages_see_no_empty_batches():
    """A wait drains every stage through all behind it: most hold nothing."""
    stages = [Seen() for _ in range(5)]
    pipeline = Pipeline(stages)
    assert len(pipeline.drain()) == 0
    assert len(pipeline.push(BlockBatch.empty())) == 0
    assert [stage.count for stage in stages] == [0] * 5
    pipeline.push(BlockBatch(np.zeros(1, NC_BLOCK)))
    chunk = object.__new__(ProfileChunk)  # columns of a profile, no rows
    pipeline.push(BlockBatch.of_profile(chunk))
    assert [stage.count for stage in stages] == [2] * 5
