"""The parameter set is chosen by the block that the machine is in.

That is too late by the time that the generator needs to change.
"""

from plc_client import Hli, task

# found by hand, for this part only
DETAIL_BLOCKS = {30, 40, 50, 70, 80, 90, 110, 120}


@task(interval=0.004)
class Generator:
    def setup(self, hli: Hli):
        self.state = hli.gpCh[0].bahn_state
        self.fine = False

    def cyclic(self):
        self.fine = self.state.block_number_r in DETAIL_BLOCKS
