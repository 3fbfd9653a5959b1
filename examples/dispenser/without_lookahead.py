"""The valve is told when the tool is in the bead.

The channel's status shows the block number.
"""

from plc_client import Hli, task

BEADS = ((50, 50), (100, 120), (160, 160))  # first and last block of each bead


@task(interval=0.002)
class Valve:
    def setup(self, hli: Hli):
        self.state = hli.gpCh[0].bahn_state
        self.open = False

    def cyclic(self):
        n = self.state.block_number_r
        self.open = any(first <= n <= last for first, last in BEADS)
