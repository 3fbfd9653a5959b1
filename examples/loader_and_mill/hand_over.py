"""The PLC of a mill and a loader: vice, gripper, and a lock between both.

The programs agree by signals where they move.  The PLC moves vice and gripper as
their M functions ask for it, each in its time.  It never opens one that alone
holds a part.
"""

from __future__ import annotations

from plc_client import AutoContinue, TechnoServer, task

VICE_SCANS, GRIPPER_SCANS = 120, 80  # how long they move


class Clamp:
    """A vice or a gripper: two M functions of one channel."""

    def __init__(self, functions, channel, shut, open_, scans):
        self.shut = functions.on("M", shut, channel=channel)
        self.open = functions.on("M", open_, channel=channel)
        self.scans, self.moving, self.closed = scans, 0, False

    def __call__(self, may_open):
        wants = self.shut.active or (self.open.active and may_open)
        self.moving = self.moving + 1 if wants else 0
        done = self.moving >= self.scans
        if done:
            self.closed = self.shut.active
        self.shut(done=done and self.shut.active)
        self.open(done=done and self.open.active)


@task(interval=0.001)
class HandOver:
    """Loops over the channels, as PLC programs do."""

    def setup(self, hli):
        self.hli = hli
        self.flows = [AutoContinue(hli.gpCh[i]) for i in range(hli.gNrCh)]
        self.functions = TechnoServer(hli)
        self.vice = Clamp(self.functions, 0, 10, 11, VICE_SCANS)
        self.gripper = Clamp(self.functions, 1, 20, 21, GRIPPER_SCANS)
        self.vice_shut = self.gripper_shut = False
        self.parts = 0

    def cyclic(self):
        for flow in self.flows:
            flow()
        self.functions()
        held_by_both = self.vice.closed and self.gripper.closed
        opens = self.vice.closed
        self.vice(may_open=not held_by_both)
        self.gripper(may_open=self.vice.closed)
        self.parts += opens and not self.vice.closed
        self.vice_shut, self.gripper_shut = (
            self.vice.closed,
            self.gripper.closed,
        )

    def finished(self):
        states = [self.hli.gpCh[i] for i in range(self.hli.gNrCh)]
        return all(state.decoder_state.program_end_r for state in states)

    def result(self):
        return {"parts": self.parts}
