"""PLC of ``test_isons_run.py``: drives 10 mm back behind 25 mm, then forward;
tells where output 3 comes.
"""

from __future__ import annotations

from typing import Any

from plc_client import task

OUTPUT, WORDS = 256, 6  # first block of 24 bytes, words of four bytes
TENTH_UM = 10_000.0


@task(interval=0.001)
class Retraces:
    """``back``: where the path turned; ``at``: where the output came;
    ``scans``: since it is driven forward again.
    """

    def setup(self, hli: Any) -> None:
        self.channel, self.area = hli.gpCh[0], hli.gpVEGlobal
        self.unit = self.channel.bahn_mc_control.backward_motion
        self.unit.enable_w = True
        self.gone = False
        self.back = self.at = -1.0
        self.scans = 0

    def cyclic(self) -> None:
        state = self.channel.bahn_state
        place = float(state.dist_prog_start) / TENTH_UM
        if not self.gone and place > 25.0:
            self.unit.command_w, self.gone = True, True
        elif self.gone and self.unit.command_w and place < 15.0:
            self.unit.command_w = False
        if not self.gone or self.unit.command_w:
            return
        if state.backward_active_r:
            self.back = place
        elif self.at < 0.0:
            self.scans += 1
            self.at = place if self.area[(OUTPUT + 3) * WORDS] else -1.0

    def result(self) -> dict[str, Any]:
        return {"back": self.back, "at": self.at, "scans": self.scans}
