"""PLC of ``test_isons_run.py``: stops the program when the path has driven 10
mm, from HOLD if it is told so.
"""

from __future__ import annotations

import os
from typing import Any

from plc_client import task

AUTOMATIC, SELECTED, ACTIVE, HOLD = 2, 2, 4, 5
TENTH_UM = 10_000.0


@task(interval=0.001)
class Stops:
    """One or two mode commands."""

    def setup(self, hli: Any) -> None:
        self.channel = hli.gpCh[0]
        self.unit = self.channel.channel_mc_control.mode_and_state
        self.unit.enable_w = True
        self.steps = [(ACTIVE, SELECTED)]
        if os.environ.get("HLI_COSIM_STOP_FROM_HOLD"):
            self.steps = [(ACTIVE, HOLD), (HOLD, SELECTED)]

    def cyclic(self) -> None:
        if not self.steps or self.unit.command_semaphor_rw:
            return
        wanted, target = self.steps[0]
        far = self.channel.bahn_state.dist_prog_start >= 10.0 * TENTH_UM
        if int(self.unit.state_r.state) == wanted and far:
            self.unit.command_w.to_mode, self.unit.command_w.to_state = (
                AUTOMATIC,
                target,
            )
            self.unit.command_semaphor_rw = True
            self.steps.pop(0)
