"""The cell's PLC: the speed that the robot allows."""

from plc_client import AcknowledgeAll, task
from plc_client.blocks import FeedControl


@task(interval=0.001)
class Logic:
    limit: float = 100.0  # %, from the robot

    def setup(self, hli):
        self.functions = AcknowledgeAll(hli)
        self.feed = FeedControl(hli.gpCh[0])

    def cyclic(self):
        self.functions()
        self.feed(self.limit)
