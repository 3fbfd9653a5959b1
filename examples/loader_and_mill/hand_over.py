"""The PLC of a mill and a loader: vice, gripper, and a lock between both.

The programs agree by signals where they move.  The PLC moves vice and gripper as
their M functions ask for it, each in its time.  It opens the gripper at the vice
alone, when the vice holds the part.
"""

from __future__ import annotations

from plc_client import AutoContinue, TechnoServer, task

VICE_SCANS, GRIPPER_SCANS = 30, 20  # how long they move
AT_VICE = 1_000_000  # 0.1 um: the loader is at the vice below this X


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


@task(interval=0.004)
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
        loader_x = self.hli.gpCh[1].bahn_state.coord_r[0].act_position_r
        at_vice = loader_x < AT_VICE
        was_shut = self.vice.closed
        self.vice(may_open=not (at_vice and self.gripper.closed))
        self.gripper(may_open=at_vice and self.vice.closed)
        self.parts += was_shut and not self.vice.closed
        self.vice_shut, self.gripper_shut = (
            self.vice.closed,
            self.gripper.closed,
        )

    def finished(self):
        states = [self.hli.gpCh[i] for i in range(self.hli.gNrCh)]
        return all(state.decoder_state.program_end_r for state in states)

    def result(self):
        return {"parts": self.parts}
