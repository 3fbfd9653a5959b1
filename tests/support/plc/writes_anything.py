"""A hostile PLC: random bytes into its whole mapping of channel and axes in
each scan, sidecar and head excepted.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from hli import layout
from plc_client import task
from support.every_byte import bytes_of

QUIET = (".enable_w", ".plc_present_w")
MODES = os.environ.get("HOSTILE_MODES") == "1"


@task(interval=0.002)
class Hostile:
    """Path-neutral unless HOSTILE_MODES is 1: then mode commands with random
    states and names for a while.
    """

    def setup(self, hli: Any) -> None:
        self.hli, self.rng, self.scans = hli, np.random.default_rng(1), 0
        self.memory = np.frombuffer(hli.segment.memory, np.uint8)
        self.where = bytes_of(QUIET)

    def cyclic(self) -> None:
        self.scans += 1
        if MODES:
            self._command()
        else:
            self.memory[self.where] = self.rng.integers(
                0, 256, len(self.where), np.uint8
            )

    def _command(self) -> None:
        unit = self.hli.gpCh[0].channel_mc_control.mode_and_state
        if self.scans > 400 or unit.command_semaphor_rw:
            return
        unit.enable_w = True
        unit.command_w.to_mode = int(self.rng.integers(0, 7))
        unit.command_w.to_state = int(self.rng.integers(0, 18))
        name = "".join(map(chr, self.rng.integers(1, 128, 290)))
        unit.command_w.parameter = name[: int(self.rng.choice([0, 5, 290]))]
        unit.command_semaphor_rw = True

    def finished(self) -> bool:
        return not MODES or self.scans > 400

    def result(self) -> dict[str, int]:
        return {
            "scans": self.scans,
            "bytes": self.scans * len(self.where),
            "states": layout.HLI_PHASE_ENDED,
        }
