"""Each channel of a cell has its look-ahead extension, ``gpAhead[i]``."""

from __future__ import annotations

from pathlib import Path

import pytest

from hli import layout
from hli.queue import Ask, Queue, Told
from support.channels import Channels

pytestmark = pytest.mark.sanitize("engine", "hli")

TWO = "[channels.mill.axes.X]\n[channels.saw.axes.X]\n"


def test_each_queue_answers_with_its_own_channel(tmp_path: Path) -> None:
    """Both ask at once; the lengths are those of the two texts."""
    texts = ["G1 X10 F60\nX30\nM30\n", "G1 X7 F60\nX8\nM30\n"]
    lengths = [[100_000.0, 200_000.0], [70_000.0, 10_000.0]]
    with Channels(tmp_path, texts, TWO) as cnc:
        cnc.run(3)
        queues = [Queue(cnc.hli.gpAhead[i]) for i in range(2)]
        ask = Ask(0.0, 1e6, mode=layout.HLI_AHEAD_MODE_CONTOUR)
        slots = [queue.ask(ask) for queue in queues]
        cnc.run(3)
        for queue, slot, expected in zip(queues, slots, lengths, strict=True):
            answer = queue.take(slot)
            assert isinstance(answer, Told)
            assert answer.blocks["length"].tolist() == expected
