"""PLC of ``test_isons_run.py``: pauses the program when the path has driven 10
mm, goes on 50 scans later.
"""

from __future__ import annotations

from typing import Any

from plc_client import task

AUTOMATIC, ACTIVE, HOLD = 2, 4, 5
TENTH_UM = 10_000.0


@task(interval=0.001)
class Pauses:
    """Two mode commands; tells the states that it has seen."""

    def setup(self, hli: Any) -> None:
        self.channel = hli.gpCh[0]
        self.unit = self.channel.channel_mc_control.mode_and_state
        self.unit.enable_w = True
        self.channel.mc_error.enable_w = True
        self.steps = [(ACTIVE, HOLD, 0), (HOLD, ACTIVE, 50)]
        self.states: list[int] = []
        self.waited = 0
        self.held: float | None = None
        self.errors: list[int] = []

    def cyclic(self) -> None:
        state = int(self.unit.state_r.state)
        if not self.states or self.states[-1] != state:
            self.states.append(state)
        if self.channel.mc_error.semaphor_rw:
            self.errors.append(int(self.channel.mc_error.satz_r.kopf.error_id))
            self.channel.mc_error.semaphor_rw = False
        if not self.steps or self.unit.command_semaphor_rw:
            return
        wanted, target, wait = self.steps[0]
        far = self.channel.bahn_state.dist_prog_start >= 10.0 * TENTH_UM
        self.waited = self.waited + 1 if state == wanted and far else 0
        if self.waited > wait:
            self.unit.command_w.to_mode, self.unit.command_w.to_state = (
                AUTOMATIC,
                target,
            )
            self.unit.command_semaphor_rw = True
            self.held = (
                float(self.channel.bahn_state.dist_prog_start) / TENTH_UM
            )
            self.steps.pop(0)

    def result(self) -> dict[str, Any]:
        return {"states": self.states, "held": self.held, "errors": self.errors}
