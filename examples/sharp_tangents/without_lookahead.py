"""Full feed everywhere: the CNC brakes for the corners as hard as the drives can."""

from plc_client import Hli, Override, task


@task(interval=0.001)
class Feed:
    def setup(self, hli: Hli):
        self.override = Override(hli.gpCh[0])
        self.percent = 100.0

    def cyclic(self):
        self.override(path=self.percent)
