"""PLC of ``test_isons_run.py``: notes every G100 with the distance at which it was seen."""

from __future__ import annotations

from typing import Any

from plc_client import task

WORDS = 6  # of four bytes, a block
GENERIC, COUNT, SLOTS = 512, 532, 16


@task(interval=0.001)
class Events:
    """Generic variables 2n and 2n + 1: number and distance (um) of event n."""

    def setup(self, hli: Any) -> None:
        self.channel, self.area, self.seen = hli.gpCh[0], hli.gpVEGlobal, 0

    def cyclic(self) -> None:
        while self.seen < self.area[COUNT * WORDS]:
            slot = COUNT + 1 + self.seen % SLOTS
            self.area[(GENERIC + 2 * self.seen) * WORDS] = self.area[
                slot * WORDS
            ]
            distance = int(self.channel.bahn_state.dist_prog_start // 10)
            self.area[(GENERIC + 2 * self.seen + 1) * WORDS] = distance
            self.seen += 1
