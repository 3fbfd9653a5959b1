"""PLC program of a test: two tasks ask for the contour through the queue, in every
scan.
"""

from typing import Any

from plc_client import task
from plc_client.blocks import ContourQueue


@task(interval=0.001, priority=0)
class Near:
    """Asks for the next 20 mm in every scan."""

    beyond = 0.0

    def setup(self, hli: Any) -> None:
        self.ch = hli.gpCh[0]
        self.fb = ContourQueue(self.ch)
        self.seen: list[Any] = []

    def cyclic(self) -> None:
        at = self.ch.bahn_state.dist_prog_start
        if self.fb(at + self.beyond, 200_000.0, details=True, events=True):
            self.seen.append(
                [
                    self.fb.tag,
                    self.fb.blocks["block_number"].tolist(),
                    self.fb.details["time_start"].tolist(),
                ]
            )

    def result(self) -> Any:
        return self.seen


@task(interval=0.001, priority=1)
class Far(Near):
    """Another task, 20 mm further on."""

    beyond = 200_000.0
