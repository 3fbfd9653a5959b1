"""PLC of ``test_isons_run.py``: input 0 comes when the path has driven 40 mm."""

from __future__ import annotations

from typing import Any

from plc_client import task

TENTH_UM = 10_000.0


@task(interval=0.001)
class Trip:
    """Sets the first input."""

    def setup(self, hli: Any) -> None:
        self.channel, self.area = hli.gpCh[0], hli.gpVEGlobal

    def cyclic(self) -> None:
        if self.channel.bahn_state.dist_prog_start >= 40.0 * TENTH_UM:
            self.area[0] = 1
