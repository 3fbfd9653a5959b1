"""Laser power from the speed that the tool has now.

That is right for a laser that answers at once, and none does.
"""

from plc_client import Hli, task

ENERGY_J_PER_MM = 20.0


@task(interval=0.001)
class LaserPower:
    def setup(self, hli: Hli):
        self.state = hli.gpCh[0].bahn_state
        self.power_w = 0.0

    def cyclic(self):
        self.power_w = (
            ENERGY_J_PER_MM * self.state.active_feed_r / 1000.0
        )  # 1 um/s
