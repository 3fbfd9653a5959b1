"""PLC program of ``e2e/test_modes.py``: starts, holds, aborts, restarts and
selects programs; tells what it saw.
"""

from __future__ import annotations

from typing import Any

from plc_client import task

AUTOMATIC, MDI = 2, 3
SELECTED, READY, ACTIVE, HOLD, RESET = 2, 3, 4, 5, 15


@task(interval=0.001)
class Modes:
    """A list of steps: send a command when the state before it is reached, wait
    until the distance given.
    """

    def setup(self, hli: Any) -> None:
        self.ch = hli.gpCh[0]
        self.unit = self.ch.channel_mc_control.mode_and_state
        self.unit.enable_w = True
        self.log: list[tuple[int, float]] = []
        self.steps = iter(
            [
                ((READY, 0.0), (AUTOMATIC, ACTIVE, "")),
                ((ACTIVE, 100_000.0), (AUTOMATIC, HOLD, "")),
                ((HOLD, 0.0), (AUTOMATIC, ACTIVE, "")),
                ((ACTIVE, 200_000.0), (AUTOMATIC, SELECTED, "")),
                ((SELECTED, 0.0), (AUTOMATIC, ACTIVE, "second.nc")),
                ((SELECTED, 0.0), (MDI, ACTIVE, "G1 X7 F6000")),
                ((SELECTED, 0.0), (AUTOMATIC, READY, "missing.nc")),
                ((SELECTED, 0.0), (AUTOMATIC, RESET, "")),
            ]
        )
        self.step: Any = next(self.steps)
        self.errors: list[int] = []
        self.ch.mc_error.enable_w = True

    def cyclic(self) -> None:
        state = int(self.unit.state_r.state)
        if not self.log or self.log[-1][0] != state:
            self.log.append((state, float(self.ch.bahn_state.dist_prog_start)))
        if self.ch.mc_error.semaphor_rw:
            self.errors.append(int(self.ch.mc_error.satz_r.kopf.error_id))
            self.ch.mc_error.semaphor_rw = False
        if self.step is None or self.unit.command_semaphor_rw:
            return
        (wanted, distance), (mode, target, parameter) = self.step
        if state != wanted or self.ch.bahn_state.dist_prog_start < distance:
            return
        command = self.unit.command_w
        command.to_mode, command.to_state, command.parameter = (
            mode,
            target,
            parameter,
        )
        self.unit.command_semaphor_rw = True
        self.step = next(self.steps, None)

    def finished(self) -> bool:
        return self.step is None and not self.unit.command_semaphor_rw

    def result(self) -> dict[str, Any]:
        return {
            "log": self.log,
            "errors": self.errors,
            "position": self.ch.bahn_state.coord_r[0].act_position_r,
        }
